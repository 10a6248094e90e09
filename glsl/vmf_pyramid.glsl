// The environment blurred by von Mises-Fisher kernels, as the GPU holds it: without its small sources, and these alone.
// Twin: src/environment/vmf_pyramid.rs; of what looks it up, src/shading/fitted.rs.
#include "environment_map.glsl"

layout(set = 0, binding = 4) uniform samplerCube environment_pyramid;
layout(set = 0, binding = 13) uniform samplerCubeArray irradiance_maps;
layout(set = 0, binding = 15) uniform samplerCube source_pyramid;

// Width of the kernel of level 0, in radians: FINEST_WIDTH_RAD in src/threads/fitted/kernel.rs.
const float FINEST_WIDTH_RAD = 1.0 / 256.0;

// Exactly, for -63 <= n <= 63.
float power_of_4(int n) {
    return intBitsToFloat((127 + 2 * n) << 23);
}

// Variance along each axis of a kernel of `level`, over that of level 0: of whole levels 4^level, of level -1, the environment as it
// is, none; between them kernels blend, and so do their variances (F16).
float variance_of_level(float level) {
    float whole = floor(level);
    return level < 0.0 ? level + 1.0 : power_of_4(int(whole)) * (1.0 + 3.0 * (level - whole));
}

float level_of_variance(float variance) {
    if (variance < 1.0) {
        return variance - 1.0;
    }
    // Half the exponent of the number.
    int whole = ((floatBitsToInt(variance) >> 23) - 127) >> 1;
    return float(whole) + (variance * power_of_4(-whole) - 1.0) / 3.0;
}

// What normals of this variance along each axis, in rad^2, add to the variance of a kernel, over that of level 0: mirrored directions
// turn twice as far.
float variance_of_pixel(float normal_variance) {
    return 4.0 * normal_variance / (FINEST_WIDTH_RAD * FINEST_WIDTH_RAD);
}

// The level of a kernel with so much more variance (F27).
float level_within_pixel(float level, float added_variance) {
    return level_of_variance(variance_of_level(level) + added_variance);
}

// The environment as it is, with so much of its sources. `d` need not be a unit vector, as for cube maps.
vec3 sharp_radiance(vec3 d, float sources) {
    ++lookups;
    Corners c = environment_corners(d);
    vec3 sum = vec3(0.0);
    for (int i = 0; i < 4; ++i) {
        bool right = (i & 1) != 0;
        bool bottom = i > 1;
        vec4 texel = texelFetch(environment_map, ivec2(right ? c.right : c.left, bottom ? c.bottom : c.top), 0);
        float weight = (right ? c.t.x : 1.0 - c.t.x) * (bottom ? c.t.y : 1.0 - c.t.y);
        sum += weight * (texel.a > 0.0 ? sources : 1.0) * texel.rgb;
    }
    return sum;
}

// Kernels of at least this part of the variance of the finest level are looked up in that level alone. They are one to two pixels of the
// environment wide, so little is lost; and nearly all lobes but mirrors then need no lookup of the environment as it is, which costs several.
const float AS_SHARP = 0.625;

// How much of a kernel of `level` is the environment as it is, the rest being the finest level (F16).
float sharp_part(float level) {
    return max(1.0 - variance_of_level(level) / (AS_SHARP * variance_of_level(push.finest_level)), 0.0);
}

// The environment without its sources, and these alone, blurred by the kernel of `level` or the finest that there is.
vec3 blurred_radiance(vec3 d, float level) {
    ++lookups;
    return textureLod(environment_pyramid, d, max(level - push.finest_level, 0.0)).rgb;
}

vec3 blurred_sources(vec3 d, float level) {
    ++lookups;
    return textureLod(source_pyramid, d, max(level - push.finest_level, 0.0)).rgb;
}
