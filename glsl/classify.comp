#version 450
// Sorts pixels into interior, edge and background, and lists those that have to be shaded.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "geometry_texel.glsl"
#include "tiles.glsl"

layout(local_size_x = TILE_SIDE, local_size_y = TILE_SIDE) in;

layout(constant_id = 0) const uint SUBPIXELS = 2; // per axis
layout(constant_id = 1) const uint HAS_TANGENTS = 0; // 0: no material of the scene needs them

layout(set = 0, binding = 0) uniform utexture2D geometry;
layout(set = 0, binding = 1, std430) buffer Counters {
    TileClass classes[2];
    uint pixels[2];
    uint covered_subpixels;
    uint covered_edge_subpixels;
} counters;
// The interior tiles, then, from the middle, the edge tiles.
layout(set = 0, binding = 2, std430) writeonly buffer TileList {
    uint tiles[];
} tile_list;
// For each tile of the image the places of its pixels in it: interior ones from the front, edge ones from the back.
layout(set = 0, binding = 3, std430) writeonly buffer PixelList {
    uint pixels[];
} pixel_list;

layout(push_constant) uniform Push {
    uvec2 size_px;
    // Sub-pixels count as one smooth surface whose normals' variance along each of two axes is below the first, and whose tangents' around the
    // normal below the second, in rad^2,
    vec2 smooth_variance;
    // if all normals lie within this angle of the first one's.
    float cos_smooth;
} push;

shared uint listed[2];
shared uint covered_total;
shared uint covered_edge_total;

void main() {
    if (gl_LocalInvocationIndex == 0) {
        listed[INTERIOR] = 0;
        listed[EDGE] = 0;
        covered_total = 0;
        covered_edge_total = 0;
    }
    barrier();

    uvec2 pixel = gl_GlobalInvocationID.xy;
    bool inside = all(lessThan(pixel, push.size_px));
    uint covered = 0;
    bool smooth_surface = true;
    if (inside) {
        uvec2 reference = uvec2(0);
        vec3 reference_normal = vec3(0.0);
        vec3 normals = vec3(0.0);
        vec3 tangents = vec3(0.0);
        for (uint j = 0; j < SUBPIXELS * SUBPIXELS; ++j) {
            uvec2 texel = texelFetch(geometry, ivec2(pixel * SUBPIXELS + uvec2(j % SUBPIXELS, j / SUBPIXELS)), 0).xy;
            if (!is_covered(texel)) {
                continue;
            }
            vec3 normal = geometry_normal(texel);
            normals += normal;
            if (HAS_TANGENTS != 0 && has_tangent(texel)) {
                tangents += geometry_tangent(texel, normal);
            }
            if (covered++ == 0) {
                reference = texel;
                reference_normal = normal;
            }
            smooth_surface = smooth_surface && geometry_material(texel) == geometry_material(reference)
                && dot(normal, reference_normal) >= push.cos_smooth;
        }
        // With R the length of the mean normal, 1 - R is the variance.
        smooth_surface = smooth_surface && 1.0 - length(normals) / float(covered) < push.smooth_variance.x;
        if (HAS_TANGENTS != 0 && has_tangent(reference)) {
            smooth_surface = smooth_surface && 1.0 - length(tangents) / float(covered) < push.smooth_variance.y;
        }
    }
    uint kind = smooth_surface && covered == SUBPIXELS * SUBPIXELS ? INTERIOR : EDGE;
    uint tile = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    if (covered > 0) {
        uint place = atomicAdd(listed[kind], 1);
        uint slot = kind == INTERIOR ? place : TILE_PIXELS - 1 - place;
        pixel_list.pixels[tile * TILE_PIXELS + slot] = gl_LocalInvocationIndex;
        atomicAdd(covered_total, covered);
        if (kind == EDGE) {
            atomicAdd(covered_edge_total, covered);
        }
    }
    barrier();

    if (gl_LocalInvocationIndex < 2 && listed[gl_LocalInvocationIndex] > 0) {
        uint k = gl_LocalInvocationIndex;
        uint place = atomicAdd(counters.classes[k].tile_count, 1);
        tile_list.tiles[k * gl_NumWorkGroups.x * gl_NumWorkGroups.y + place] = pack_tile(tile, listed[k]);
        atomicMax(counters.classes[k].groups_x, min(place + 1, MAX_GROUPS));
        atomicMax(counters.classes[k].groups_y, 1);
        atomicMax(counters.classes[k].groups_z, 1);
        atomicAdd(counters.pixels[k], listed[k]);
    }
    if (gl_LocalInvocationIndex == 0 && covered_total > 0) {
        atomicAdd(counters.covered_subpixels, covered_total);
        atomicAdd(counters.covered_edge_subpixels, covered_edge_total);
    }
}
