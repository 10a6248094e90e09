#version 450
// Pass 2 of the paper (section 4.2): each sub-pixel evaluates its partition of the threads, the pixel is their sum.
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "camera.glsl"
#include "geometry_texel.glsl"
#include "surface.glsl"
#include "tiles.glsl"

layout(local_size_x = TILE_PIXELS) in;

layout(constant_id = 0) const uint SUBPIXELS = 2; // per axis

// Between these view angles the threads start to follow the view; why, says methods/paper.glsl.
const float FACING_DEG = 3.0;
const float TURNING_DEG = 15.0;

// Pixels within which normals vary more, along each axis in rad^2, are a sum for each sub-pixel where methods share surfaces: normals
// 0.6 degrees from their mean, as at the rim of a sphere, where the view angle changes by more than a row of threads.
const float SHARED_VARIANCE = 1e-4;

layout(set = 0, binding = 0) uniform utexture2D geometry;
layout(set = 0, binding = 1, std430) readonly buffer Counters {
    TileClass classes[2];
} counters;
layout(set = 0, binding = 2, std430) readonly buffer TileList {
    uint tiles[];
} tile_list;
layout(set = 0, binding = 9, std430) readonly buffer PixelList {
    uint pixels[];
} pixel_list;
layout(set = 0, binding = 3, rgba32f) uniform writeonly image2D radiance;

// How many lookups in the environment were made, as a number of 64 bits.
layout(set = 0, binding = 8, std430) buffer Lookups {
    uint low;
    uint high;
} all_lookups;

layout(push_constant) uniform Push {
    Camera camera;
    uvec2 size_px;
    uint kind;              // which class of pixels
    float face_size;        // of level 0 of the environment pyramid
    vec2 rotation;          // cosine and sine of the environment's rotation about +Y
    float radiance_scale;   // radiance of a texel of value 1
    uint sample_count;      // threads, or samples, of a pixel
    uvec2 seed;             // low and high half
} push;

#include "material.glsl"
#include "brdf_models.glsl"

// World to environment coordinates: the environment is turned by the rotation, so directions are turned back.
vec3 to_environment(vec3 d) {
    return vec3(push.rotation.x * d.x - push.rotation.y * d.z, d.y, push.rotation.y * d.x + push.rotation.x * d.z);
}

// Lookups in the environment that this invocation has made: methods count them.
uint lookups = 0;

// The sub-pixel that is being shaded: methods draw random numbers by its place.
uvec2 subpixel = uvec2(0);

// A method defines `vec3 estimate(Surface surface, Material material, uint first, uint stride)`: the sum over its threads or
// samples first, first + stride, ... of weight times environment, a partition of the radiance that leaves `surface` towards
// the eye, and `const bool SHARES_SURFACE`: whether a pixel that lies on one smooth surface is one sum at its mean normal,
// not a partition among its sub-pixels, but for where `bool needs_subpixels(Surface surface, Material material)` has each sum over
// all of them. It includes what it looks up; nothing else of the scene is made or uploaded.
#include "method.glsl"

shared uint group_lookups;

// The sum of the normals of a pixel that lies on one smooth surface.
vec3 normal_sum(uvec2 pixel) {
    vec3 sum = vec3(0.0);
    for (uint j = 0; j < SUBPIXELS * SUBPIXELS; ++j) {
        uvec2 subpixel = pixel * SUBPIXELS + uvec2(j % SUBPIXELS, j / SUBPIXELS);
        sum += geometry_normal(texelFetch(geometry, ivec2(subpixel), 0).xy);
    }
    return sum;
}

// The surface that is seen at a place in the picture, from 0 to 1.
Surface surface_at(vec2 position, vec3 normal) {
    vec3 w_o = -normalize(camera_ray(push.camera, position));
    return make_surface(to_environment(normal), to_environment(w_o));
}

void main() {
    if (gl_LocalInvocationIndex == 0) {
        group_lookups = 0;
    }
    const uint subpixel_count = SUBPIXELS * SUBPIXELS;
    uvec2 tiles = (push.size_px + TILE_SIDE - 1) / TILE_SIDE;
    bool interior = push.kind == INTERIOR;
    for (uint t = gl_WorkGroupID.x; t < counters.classes[push.kind].tile_count; t += gl_NumWorkGroups.x) {
        uint packed = tile_list.tiles[push.kind * tiles.x * tiles.y + t];
        if (gl_LocalInvocationIndex >= tile_pixel_count(packed)) {
            continue;
        }
        uint tile = tile_index(packed);
        uint slot = interior ? gl_LocalInvocationIndex : TILE_PIXELS - 1 - gl_LocalInvocationIndex;
        uint place = pixel_list.pixels[tile * TILE_PIXELS + slot];
        uvec2 pixel = uvec2(tile % tiles.x, tile / tiles.x) * TILE_SIDE + uvec2(place % TILE_SIDE, place / TILE_SIDE);
        // With R the length of the mean normal, 1 - R is the variance along each of two axes.
        vec3 normals = interior ? normal_sum(pixel) : vec3(0.0);
        float normal_variance = interior ? max(1.0 - length(normals) / float(subpixel_count), 0.0) : 0.0;
        bool shares_surface = interior && SHARES_SURFACE && normal_variance < SHARED_VARIANCE;
        Surface middle;
        if (shares_surface) {
            middle = surface_at((vec2(pixel) + 0.5) / vec2(push.size_px), normalize(normals));
            middle.normal_variance = normal_variance;
            uvec2 texel = texelFetch(geometry, ivec2(pixel * SUBPIXELS), 0).xy;
            shares_surface = !needs_subpixels(middle, materials[geometry_material(texel)]);
        }
        uint stride = interior && !SHARES_SURFACE ? subpixel_count : 1;
        vec3 sum = vec3(0.0);
        uint covered = 0;
        for (uint j = 0; j < (shares_surface ? 1 : subpixel_count); ++j) {
            subpixel = pixel * SUBPIXELS + uvec2(j % SUBPIXELS, j / SUBPIXELS);
            uvec2 texel = texelFetch(geometry, ivec2(subpixel), 0).xy;
            if (is_covered(texel)) {
                ++covered;
                Surface surface = middle;
                if (!shares_surface) {
                    surface = surface_at((vec2(subpixel) + 0.5) / vec2(push.size_px * SUBPIXELS), geometry_normal(texel));
                    surface.normal_variance = stride > 1 ? normal_variance : 0.0;
                }
                sum += estimate(surface, materials[geometry_material(texel)], stride > 1 ? j : 0, stride);
            }
        }
        covered = interior ? subpixel_count : covered;
        if (!shares_surface && stride == 1) {
            sum /= float(subpixel_count);
        }
        float coverage = float(covered) / float(subpixel_count);
        imageStore(radiance, ivec2(pixel), vec4(sum * push.radiance_scale, coverage));
    }
    barrier();
    atomicAdd(group_lookups, lookups);
    barrier();
    if (gl_LocalInvocationIndex == 0) {
        uint before = atomicAdd(all_lookups.low, group_lookups);
        if (before + group_lookups < before) {
            atomicAdd(all_lookups.high, 1);
        }
    }
}
