// Monte Carlo with p in proportion to the environment's light. Twin: src/shading/environment.rs.
#include "random.glsl"
#include "light_sampling.glsl"

#include "partition.glsl"

vec3 estimate(Surface surface, Material material, uint first, uint stride) {
    vec3 w_o = view_direction(surface);
    vec3 sum = vec3(0.0);
    for (uint k = first; k < push.sample_count; k += stride) {
        vec3 direction = sample_light(random_bits(k));
        vec3 w_i = direction * surface.frame;
        if (w_i.z > 0.0) {
            ++lookups;
            vec4 texel = environment_texel(direction);
            float p = light_pdf(texel, direction);
            // Black, it cannot have been drawn but by rounding.
            if (p > 0.0) {
                sum += brdf_at(surface, material, w_i, w_o) * texel.rgb * (w_i.z / p);
            }
        }
    }
    return sum / float(push.sample_count);
}
