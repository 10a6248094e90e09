#version 450
// Pass 2 of the paper (section 4.2): each sub-pixel evaluates its partition of the threads, the pixel is their sum.
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "bounded.glsl"
#include "camera.glsl"
#include "geometry_texel.glsl"
#include "lat_long.glsl"
#include "surface.glsl"
#include "tiles.glsl"

layout(local_size_x = TILE_PIXELS) in;

layout(constant_id = 0) const uint SUBPIXELS = 2; // per axis
layout(constant_id = 5) const uint HAS_TANGENTS = 0; // 0: no material that it shades needs them
// 0: pixels at edges, whose sub-pixels share nothing. A driver that masks lanes out would have each of them pay for what interior ones share.
layout(constant_id = 7) const uint IS_INTERIOR = 1;
layout(constant_id = 8) const uint HAS_ONE_MATERIAL = 0; // 1: the scene has no other

layout(set = 0, binding = 0) uniform utexture2D geometry;
layout(set = 0, binding = 1, std430) readonly buffer Counters {
    Counted counted;
    TileClass classes[];
} counters;
layout(set = 0, binding = 2, std430) readonly buffer PartList {
    uint parts[];
} part_list;
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
    uvec2 portion; // which portion of the listed parts, of how many
    uint pixel_class;
    float face_size;        // of level 0 of the environment pyramid
    vec2 rotation;          // cosine and sine of the environment's rotation about +Y
    float radiance_scale;   // radiance of a texel of value 1
    uint sample_count;      // threads, or samples, of a pixel
    uvec2 seed;             // low and high half
    float finest_level;     // the level of a kernel that is level 0 of the blurred environment
    float intensity;        // of the environment: apart from radiance_scale, since the product of the two may be infinite
} push;

#include "material.glsl"
#include "brdf_models.glsl"

// What is seen in a texel of the geometry cache is made of it.
Material material_of(uvec2 texel) {
    return materials[HAS_ONE_MATERIAL != 0 ? 0 : geometry_material(texel)];
}

vec3 to_environment(vec3 d) {
    return turned_back(push.rotation, d);
}

// Lookups in the environment that this invocation has made: methods count them.
uint lookups = 0;

// The sub-pixel that is being shaded: methods draw random numbers by its place.
uvec2 subpixel = uvec2(0);

// The surface that is seen at a place in the picture, from 0 to 1. Only materials that need it ask for the tangent.
Surface surface_at(vec2 position, vec3 normal, vec3 tangent) {
    vec3 w_o = -normalize(camera_ray(push.camera, position));
    Surface surface = make_surface(to_environment(normal), to_environment(w_o));
    if (HAS_TANGENTS != 0) {
        set_tangent(surface, to_environment(tangent));
    }
    return surface;
}

// The surface that a sub-pixel sees.
Surface surface_of_subpixel(uvec2 place, uvec2 texel) {
    vec3 normal = geometry_normal(texel);
    vec3 tangent = HAS_TANGENTS != 0 && has_tangent(texel) ? geometry_tangent(texel, normal) : vec3(0.0);
    return surface_at((vec2(place) + 0.5) / vec2(push.size_px * SUBPIXELS), normal, tangent);
}

// The BRDF of a surface for directions of its shading frame: an anisotropic one knows its own from the tangent.
vec3 brdf_at(Surface surface, Material material, vec3 w_i, vec3 w_o) {
    return HAS_TANGENTS != 0 ? brdf(material, turned(w_i, surface.phi_o), turned(w_o, surface.phi_o)) : brdf(material, w_i, w_o);
}

// A method defines what a surface's `estimate` is, and includes partition.glsl or shared_sum.glsl, which say what that is to a pixel:
// `vec4 shade_pixel(uvec2 pixel, bool interior)` is its radiance times coverage, over radiance_scale and intensity, and its coverage. It includes what
// it looks up; nothing else of the scene is made or uploaded.
#include "method.glsl"

shared uint group_lookups;

void main() {
    if (gl_LocalInvocationIndex == 0) {
        group_lookups = 0;
    }
    uvec2 tiles = (push.size_px + TILE_SIDE - 1) / TILE_SIDE;
    uint part_count = counters.classes[push.pixel_class].part_count;
    uint portion_size = (part_count + push.portion.y - 1) / push.portion.y;
    uint portion_start = min(push.portion.x * portion_size, part_count);
    uint portion_end = min(portion_start + portion_size, part_count);
    // The last workgroup may have fewer parts. With the test at the end of a loop no driver that masks lanes out runs the body once more for none.
    uint p = portion_start + PARTS * gl_WorkGroupID.x + gl_LocalInvocationIndex / PART_PIXELS;
    do {
        uint part = part_list.parts[first_part(push.pixel_class, tiles) + min(p, part_count - 1)];
        uint place_in_part = gl_LocalInvocationIndex % PART_PIXELS;
        if (p < portion_end && place_in_part < part_pixel_count(part)) {
            uint tile = part_tile(part);
            uint slot = part_first_slot(part) + place_in_part;
            uint place = pixel_list.pixels[tile * TILE_PIXELS + slot];
            uvec2 pixel = uvec2(tile % tiles.x, tile / tiles.x) * TILE_SIDE + uvec2(place % TILE_SIDE, place / TILE_SIDE);
            vec4 shaded = shade_pixel(pixel, IS_INTERIOR != 0);
            vec3 scaled = bounded(bounded(shaded.rgb * push.radiance_scale) * push.intensity);
            imageStore(radiance, ivec2(pixel), vec4(scaled, shaded.a));
        }
        p += PARTS * gl_NumWorkGroups.x;
    } while (p < portion_end);
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
