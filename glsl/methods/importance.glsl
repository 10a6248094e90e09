// Monte Carlo with p in proportion to f cos. Twin: src/shading/importance.rs.
#include "pattern.glsl"
#include "environment_map.glsl"
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
            vec3 weight = brdf_at(surface, material, drawn.w_i, w_o) * (drawn.w_i.z / drawn.p);
            sum += weight * environment_radiance(surface.frame * drawn.w_i);
        }
    }
    return sum / float(push.sample_count);
}
