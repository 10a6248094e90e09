#version 450
// Sorts pixels into interior, edge and background, and by the shader of their material. Lists those that have to be shaded.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "camera.glsl"
#include "geometry_texel.glsl"
#include "normal_variance.glsl"
#include "tiles.glsl"

layout(local_size_x = TILE_SIDE, local_size_y = TILE_SIDE) in;

layout(constant_id = 0) const uint SUBPIXELS = 2; // per axis
layout(constant_id = 1) const uint HAS_TANGENTS = 0; // 0: no material of the scene needs them
layout(constant_id = 2) const uint CLASSES = 2; // two for each shader of a material; at most as many as a tile has pixels
layout(constant_id = 3) const uint HAS_GRAZING = 1; // 0: no material has another shader at grazing views

layout(set = 0, binding = 0) uniform utexture2D geometry;
layout(set = 0, binding = 1, std430) buffer Counters {
    Counted counted;
    TileClass classes[];
} counters;
// For each class of pixels the parts of tiles that hold them.
layout(set = 0, binding = 2, std430) writeonly buffer PartList {
    uint parts[];
} part_list;
// For each tile of the image the places of its pixels in it, class by class.
layout(set = 0, binding = 3, std430) writeonly buffer PixelList {
    uint pixels[];
} pixel_list;
// For each tile of the image what its pixels see.
layout(set = 0, binding = 5, std430) writeonly buffer Coverage {
    uvec4 coverage[];
};
// Which shader a material is shaded by. Twin: src/passes/classify.rs.
struct ShaderOfMaterial {
    uint shader;
    float cos_grazing; // where cos theta_o is less, it is the one of mixed pixels: that has what only grazing views need
};
layout(set = 0, binding = 4, std430) readonly buffer Shaders {
    ShaderOfMaterial shaders[];
};

layout(push_constant) uniform Push {
    Camera camera;
    uvec2 size_px;
    uvec2 first_tile; // the tile of the first workgroup
    // Of normals along each of two axes, and of tangents around the normal, in rad^2: below both, sub-pixels are one smooth surface,
    vec2 smooth_variance;
    float cos_smooth; // if all their normals are also within this angle of the first one's
    uint shader_of_mixed; // the shader of pixels of materials that have different ones
} push;

shared uint listed[CLASSES];
shared uint tile_coverage[4];
shared uint covered_total;
shared uint covered_edge_total;

// The first slot of a class among the pixels of this tile. Where there is one shader, interior pixels are listed from the front and edge pixels from
// the back. So they are listed before all are counted: the pass takes 5 ms then, and 8.5 if they have to wait.
uint first_slot(uint pixel_class) {
    if (CLASSES == 2) {
        return pixel_class == INTERIOR ? 0 : TILE_PIXELS - listed[EDGE];
    }
    uint slot = 0;
    for (uint before = 0; before < pixel_class; ++before) {
        slot += listed[before];
    }
    return slot;
}

// Columns and rows of tiles of the image.
uvec2 tile_counts() {
    return (push.size_px + TILE_SIDE - 1) / TILE_SIDE;
}

uint this_tile() {
    uvec2 tile = push.first_tile + gl_WorkGroupID.xy;
    return tile.y * tile_counts().x + tile.x;
}

void list_pixel(uint slot) {
    pixel_list.pixels[this_tile() * TILE_PIXELS + slot] = gl_LocalInvocationIndex;
}

// The shader of a sub-pixel that sees this normal of a material.
uint shader_of(uvec2 place, vec3 normal, uint material) {
    ShaderOfMaterial of_material = shaders[material];
    if (HAS_GRAZING == 0) {
        return of_material.shader;
    }
    vec3 w_o = -normalize(camera_ray(push.camera, (vec2(place) + 0.5) / vec2(push.size_px * SUBPIXELS)));
    return dot(normal, w_o) < of_material.cos_grazing ? push.shader_of_mixed : of_material.shader;
}

void main() {
    if (gl_LocalInvocationIndex < CLASSES) {
        listed[gl_LocalInvocationIndex] = 0;
    }
    if (gl_LocalInvocationIndex < 4) {
        tile_coverage[gl_LocalInvocationIndex] = 0;
    }
    if (gl_LocalInvocationIndex == 0) {
        covered_total = 0;
        covered_edge_total = 0;
    }
    barrier();

    uvec2 pixel = push.first_tile * TILE_SIDE + gl_GlobalInvocationID.xy;
    bool inside = all(lessThan(pixel, push.size_px));
    uint covered = 0;
    uint shader = 0;
    bool smooth_surface = true;
    if (inside) {
        uvec2 reference = uvec2(0);
        NormalMoments normals = normal_moments(vec3(0.0));
        vec3 tangents = vec3(0.0);
        for (uint j = 0; j < SUBPIXELS * SUBPIXELS; ++j) {
            uvec2 place = pixel * SUBPIXELS + uvec2(j % SUBPIXELS, j / SUBPIXELS);
            uvec2 texel = texelFetch(geometry, ivec2(place), 0).xy;
            if (!is_covered(texel)) {
                continue;
            }
            vec3 normal = geometry_normal(texel);
            if (HAS_TANGENTS != 0 && has_tangent(texel)) {
                tangents += geometry_tangent(texel, normal);
            }
            uint own_shader = CLASSES != 2 ? shader_of(place, normal, geometry_material(texel)) : 0;
            if (covered++ == 0) {
                reference = texel;
                normals = normal_moments(normal);
                shader = own_shader;
            }
            add_normal(normals, normal);
            shader = own_shader == shader ? shader : push.shader_of_mixed;
            smooth_surface = smooth_surface && geometry_material(texel) == geometry_material(reference)
                && dot(normal, normals.first) >= push.cos_smooth;
        }
        // Of a pixel that sees nothing it is no number, and no interior.
        smooth_surface = smooth_surface && normal_variance(normals, covered) < push.smooth_variance.x;
        if (HAS_TANGENTS != 0 && has_tangent(reference)) {
            smooth_surface = smooth_surface && 1.0 - length(tangents) / float(covered) < push.smooth_variance.y;
        }
    }
    uint kind = smooth_surface && covered == SUBPIXELS * SUBPIXELS ? INTERIOR : EDGE;
    uint pixel_class = class_of(shader, kind);
    uint place = 0;
    if (covered > 0) {
        place = atomicAdd(listed[pixel_class], 1);
        if (CLASSES == 2) {
            list_pixel(kind == INTERIOR ? place : TILE_PIXELS - 1 - place);
        }
        uvec2 bit = coverage_bit(gl_LocalInvocationIndex);
        atomicOr(tile_coverage[bit.x], bit.y);
        if (covered == SUBPIXELS * SUBPIXELS) {
            atomicOr(tile_coverage[2 + bit.x], bit.y);
        }
        atomicAdd(covered_total, covered);
        if (kind == EDGE) {
            atomicAdd(covered_edge_total, covered);
        }
    }
    barrier();

    if (CLASSES != 2 && covered > 0) {
        list_pixel(first_slot(pixel_class) + place);
    }
    if (gl_LocalInvocationIndex == 0) {
        coverage[this_tile()] = uvec4(tile_coverage[0], tile_coverage[1], tile_coverage[2], tile_coverage[3]);
    }
    uint k = gl_LocalInvocationIndex;
    if (k < CLASSES && listed[k] > 0) {
        uint parts = (listed[k] + PART_PIXELS - 1) / PART_PIXELS;
        uint others = atomicAdd(counters.classes[k].part_count, parts);
        uint first = first_part(k, tile_counts()) + others;
        uint slot = first_slot(k);
        for (uint part = 0; part < parts; ++part) {
            uint before = part * PART_PIXELS;
            part_list.parts[first + part] = pack_part(this_tile(), slot + before, min(listed[k] - before, PART_PIXELS));
        }
        atomicMax(counters.classes[k].groups_x, min((others + parts + PARTS - 1) / PARTS, MAX_GROUPS));
        atomicMax(counters.classes[k].groups_y, 1);
        atomicMax(counters.classes[k].groups_z, 1);
        atomicAdd(counters.counted.pixels[kind_of(k)], listed[k]);
    }
    if (gl_LocalInvocationIndex == 0 && covered_total > 0) {
        atomicAdd(counters.counted.covered_subpixels, covered_total);
        atomicAdd(counters.counted.covered_edge_subpixels, covered_edge_total);
    }
}
