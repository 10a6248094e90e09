// Fitted threads: sum over k of w_k (environment blurred by kernel k)(d_k), plus the cosine part's irradiance. Directions, widths and
// weights were fitted to f(w_i, w_o) (n . w_i), so no BRDF is left to evaluate.
//
// Few threads fit tails of lobes worst, and under small bright sources tails matter most. For these the fit's own answer is
// replaced by the BRDF's.
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

struct Source {
    vec3 direction; // of its centroid, in the environment's coordinates
    float width;    // standard deviation along an axis, in radians
    vec3 power;     // radiance integrated over its solid angle, over the scale of the pyramid's texels
    float padding;
};

layout(set = 0, binding = 14, std430) readonly buffer Sources {
    uint source_count;
    Source sources[];
};

const uint MAX_SOURCES = 8;

// vMF, by half the squared distance between unit vectors, which is 1 - cos.
float vmf(float away, float kappa) {
    return kappa / (radians(360.0) * (1.0 - exp(-2.0 * kappa))) * exp(-kappa * away);
}

// kappa of the kernel of a whole level, blurred by a source.
float blurred_kappa(float level, float source_width) {
    float width = FINEST_WIDTH_RAD * exp2(level);
    return 1.0 / (width * width + source_width * source_width);
}

// What a lookup of `level` at `direction` weighs a source at `to_source` by.
float kernel_at(vec3 direction, float level, vec3 to_source, float source_width) {
    vec3 difference = direction - to_source;
    float away = 0.5 * dot(difference, difference);
    float whole = floor(level);
    float finer = vmf(away, blurred_kappa(whole, source_width));
    float coarser = vmf(away, blurred_kappa(whole + 1.0, source_width));
    return mix(finer, coarser, level - whole);
}

// What is to be integrated over a source: the mean of four points with its variance.
struct AtSource {
    vec3 f_cos;
    float cosine;
};

AtSource at_source(Material material, vec3 to_source, float source_width, vec3 w_o) {
    vec3 x = any_tangent(to_source);
    vec3 y = cross(to_source, x);
    AtSource mean = AtSource(vec3(0.0), 0.0);
    for (int i = 0; i < 4; ++i) {
        float sign = i < 2 ? 1.0 : -1.0;
        vec3 w_i = normalize(to_source + sign * sqrt(2.0) * source_width * ((i & 1) == 0 ? x : y));
        if (w_i.z > 0.0) {
            mean.f_cos += 0.25 * brdf(material, w_i, w_o) * w_i.z;
            mean.cosine += 0.25 * w_i.z;
        }
    }
    return mean;
}

// How much of a source's answer is replaced. Where it is mirrored towards the eye, four points are too few to tell what a lobe makes
// of it that is narrower; but there the fit is best. Within a half vector of lobe_width f loses a quarter, as a Gaussian does at
// 0.76 of its width; reflection doubles that.
float replaced(Material material, vec3 to_source, float source_width, vec3 w_o) {
    vec3 mirror = vec3(-w_o.x, -w_o.y, w_o.z);
    float lobe = 2.6 * material.lobe_width;
    return smoothstep(1.5, 3.0, (length(to_source - mirror) + 4.0 * lobe) / (2.0 * source_width));
}

vec3 estimate(Surface surface, Material material, uint first, uint stride) {
    // Rows stand at multiples of 90 degrees / row_count; beyond the last one it holds.
    float row = min(surface.theta_o * (float(material.row_count) / radians(90.0)), float(material.row_count - 1));
    uint words_a_row = 3 * (material.thread_count + 1);
    uint below = material.first_thread + uint(row) * words_a_row;
    uint above = below + (uint(row) + 1 < material.row_count ? words_a_row : 0);
    float t = fract(row);
    vec3 cosine_part = mix(unpack_cosine_part(below), unpack_cosine_part(above), t);
    vec3 w_o = view_direction(surface);
    vec3 sum = vec3(0.0);
    vec3 to_source[MAX_SOURCES];
    float part[MAX_SOURCES];
    for (uint s = 0; s < source_count; ++s) {
        to_source[s] = sources[s].direction * surface.frame;
        part[s] = replaced(material, to_source[s], sources[s].width, w_o);
        AtSource mean = at_source(material, to_source[s], sources[s].width, w_o);
        // The irradiance map has no sources.
        vec3 of_cosine = cosine_part * (mean.cosine / radians(180.0));
        sum += sources[s].power * mix(of_cosine, mean.f_cos, part[s]);
    }
    for (uint k = first; k < material.thread_count; k += stride) {
        Kernel a = unpack_kernel(below + 3 * (k + 1));
        Kernel b = unpack_kernel(above + 3 * (k + 1));
        vec3 direction = normalize(mix(a.direction, b.direction, t));
        float level = level_within_pixel(mix(a.level, b.level, t), surface.normal_variance);
        level = max(level, finest_level(push.face_size));
        ++lookups;
        vec3 radiance =
            textureLod(environment_pyramid, surface.frame * direction, level - finest_level(push.face_size)).rgb;
        for (uint s = 0; s < source_count; ++s) {
            radiance -= part[s] * kernel_at(direction, level, to_source[s], sources[s].width) * sources[s].power;
        }
        sum += mix(a.weight, b.weight, t) * radiance;
    }
    ++lookups;
    sum += cosine_part * textureLod(irradiance_map, surface.frame[2], 0.0).rgb;
    return max(sum, vec3(0.0));
}
