// The split sum (Karis, "Real Shading in Unreal Engine 4", 2013): two albedos of the BRDF, each times light that was filtered by a lobe that
// does not depend on the view, Lambert's about the normal and GGX's about the mirror direction.
// Twin: src/shading/split_sum.rs.
layout(set = 0, binding = 4) uniform samplerCube environment_pyramid; // by GGX: src/environment/ggx_pyramid.rs
layout(set = 0, binding = 13) uniform samplerCube irradiance_map;
// For each material roughness_alpha, then for each view angle the two albedos: src/threads/split_sum.rs.
layout(set = 0, binding = 12, std430) readonly buffer SplitSums {
    float split_sums[];
};

#include "shared_sum.glsl"
#include "threads/rim.glsl"

const uint SPLIT_SUM_ROWS = 91u;
const float FINEST_ALPHA = 1.0 / 64.0;
const float COARSEST_LEVEL = 6.0;

bool needs_subpixels(Surface surface, Material material) {
    return false;
}

float level_of_alpha(float roughness_alpha) {
    return clamp(log2(roughness_alpha / FINEST_ALPHA), 0.0, COARSEST_LEVEL);
}

vec3 split_sum_albedo(uint first) {
    return vec3(split_sums[first], split_sums[first + 1], split_sums[first + 2]);
}

vec3 estimate(Surface surface, Material material, uint first, uint stride) {
    float row = min(surface.theta_o * (float(SPLIT_SUM_ROWS - 1) / radians(90.0)), float(SPLIT_SUM_ROWS - 1));
    uint below = material.first_slice + 1 + 6 * uint(row);
    uint above = material.first_slice + 1 + 6 * min(uint(row) + 1, SPLIT_SUM_ROWS - 1);
    float towards = towards_row_above(row, SPLIT_SUM_ROWS, material.rim_power);
    vec3 diffuse = mix(split_sum_albedo(below), split_sum_albedo(above), towards);
    vec3 specular = mix(split_sum_albedo(below + 3), split_sum_albedo(above + 3), towards);
    vec3 w_o = view_direction(surface);
    vec3 mirror = surface.frame * vec3(-w_o.x, -w_o.y, w_o.z);
    float level = level_of_alpha(split_sums[material.first_slice]);
    lookups += 2;
    return diffuse * textureLod(irradiance_map, surface.frame[2], 0.0).rgb
        + specular * textureLod(environment_pyramid, mirror, level).rgb;
}
