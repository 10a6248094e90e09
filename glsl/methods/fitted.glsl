// Fitted threads: sum over k of w_k (environment blurred by kernel k)(d_k), plus the cosine part's irradiance. Directions, widths and
// weights were fitted to f(w_i, w_o) (n . w_i), so no BRDF is left to evaluate.
// Twin: src/shading/fitted.rs.
#include "vmf_pyramid.glsl"

// A pixel within one smooth surface is one sum over all threads, seen from its middle: see shade.comp.
const bool SHARES_SURFACE = true;

// Row by row of theta_o: the weight of the cosine kernel as three floats, then thread by thread three words: direction
// (octahedral, 2 x 16 bits), level and red weight, green and blue weight (half floats).
layout(set = 0, binding = 7, std430) readonly buffer Threads {
    uint threads[];
};

struct Kernel {
    vec3 direction;
    float level;
    vec3 weight;
};

Kernel unpack_kernel(uint at) {
    vec2 level_red = unpackHalf2x16(threads[at + 1]);
    vec2 green_blue = unpackHalf2x16(threads[at + 2]);
    return Kernel(octahedral_decode(unpackSnorm2x16(threads[at])), level_red.x, vec3(level_red.y, green_blue));
}

vec3 unpack_cosine_part(uint at) {
    return vec3(uintBitsToFloat(threads[at]), uintBitsToFloat(threads[at + 1]), uintBitsToFloat(threads[at + 2]));
}

vec3 estimate(Surface surface, Material material, uint first, uint stride) {
    // Rows stand at multiples of 90 degrees / row_count; beyond the last one it holds.
    float row = min(surface.theta_o * (float(material.row_count) / radians(90.0)), float(material.row_count - 1));
    uint words_a_row = 3 * (material.thread_count + 1);
    uint below = material.first_thread + uint(row) * words_a_row;
    uint above = below + (uint(row) + 1 < material.row_count ? words_a_row : 0);
    float t = fract(row);
    vec3 sum = vec3(0.0);
    for (uint k = first; k < material.thread_count; k += stride) {
        Kernel a = unpack_kernel(below + 3 * (k + 1));
        Kernel b = unpack_kernel(above + 3 * (k + 1));
        vec3 direction = surface.frame * normalize(mix(a.direction, b.direction, t));
        float level = level_within_pixel(mix(a.level, b.level, t), surface.normal_variance);
        ++lookups;
        sum += mix(a.weight, b.weight, t) * textureLod(environment_pyramid, direction, level - finest_level(push.face_size)).rgb;
    }
    if (first == 0) {
        ++lookups;
        vec3 cosine_part = mix(unpack_cosine_part(below), unpack_cosine_part(above), t);
        sum += cosine_part * textureLod(irradiance_map, surface.frame[2], 0.0).rgb;
    }
    return max(sum, vec3(0.0));
}
