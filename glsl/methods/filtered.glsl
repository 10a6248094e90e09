// Importance sampling with filtered lookups (Colbert and Krivanek 2007): the level of the pyramid whose texels are as large
// as the solid angle 1 / (n p) that a sample stands for. Less noise, but biased. Twin: src/shading/filtered.rs.
#include "pattern.glsl"
#include "environment_pyramid.glsl"
#include "importance_sampling.glsl"

#include "partition.glsl"

vec3 estimate(Surface surface, Material material, uint first, uint stride) {
    vec3 w_o = view_direction(surface);
    SliceRows rows = slice_rows(surface, material, w_o);
    Stream fixed_set = fixed_stream();
    vec3 sum = vec3(0.0);
    for (uint k = first; k < push.sample_count; k += stride) {
        DirectionSample drawn = sample_brdf(rows, w_o, sample_bits(fixed_set, k));
        if (drawn.p > 0.0) {
            ++lookups;
            vec3 direction = surface.frame * drawn.w_i;
            float level = level_of(1.0 / (float(push.sample_count) * drawn.p), push.face_size, direction);
            vec3 weight = brdf_at(surface, material, drawn.w_i, w_o) * (drawn.w_i.z / drawn.p);
            sum += weight * textureLod(environment_pyramid, direction, level).rgb;
        }
    }
    return sum / float(push.sample_count);
}
