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

// The surface that is seen at a place in the picture, from 0 to 1.
Surface surface_at(vec2 position, vec3 normal) {
    vec3 w_o = -normalize(camera_ray(push.camera, position));
    return make_surface(to_environment(normal), to_environment(w_o));
}

// A method defines what a surface's `estimate` is, and includes partition.glsl or shared_sum.glsl, which say what that is to a pixel:
// `vec4 shade_pixel(uvec2 pixel, bool interior)` is its radiance times coverage, over radiance_scale, and its coverage. It includes what
// it looks up; nothing else of the scene is made or uploaded.
#include "method.glsl"

shared uint group_lookups;

void main() {
    if (gl_LocalInvocationIndex == 0) {
        group_lookups = 0;
    }
    uvec2 tiles = (push.size_px + TILE_SIDE - 1) / TILE_SIDE;
    bool interior = push.kind == INTERIOR;
    // Only as many workgroups as tiles are dispatched. So the first needs no test, and with the test at the end of a loop no driver that
    // masks lanes out runs the body once more for none.
    uint t = gl_WorkGroupID.x;
    do {
        uint packed = tile_list.tiles[push.kind * tiles.x * tiles.y + t];
        if (gl_LocalInvocationIndex < tile_pixel_count(packed)) {
            uint tile = tile_index(packed);
            uint slot = interior ? gl_LocalInvocationIndex : TILE_PIXELS - 1 - gl_LocalInvocationIndex;
            uint place = pixel_list.pixels[tile * TILE_PIXELS + slot];
            uvec2 pixel = uvec2(tile % tiles.x, tile / tiles.x) * TILE_SIDE + uvec2(place % TILE_SIDE, place / TILE_SIDE);
            vec4 shaded = shade_pixel(pixel, interior);
            imageStore(radiance, ivec2(pixel), vec4(shaded.rgb * push.radiance_scale, shaded.a));
        }
        t += gl_NumWorkGroups.x;
    } while (t < counters.classes[push.kind].tile_count);
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
