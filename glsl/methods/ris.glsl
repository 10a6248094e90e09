// Resampled importance sampling (Talbot et al. 2005): for each sample CANDIDATES directions, half drawn by the BRDF and half by the
// light, of which one is kept in proportion to q / p with q the luminance of f L cos, the whole integrand. Without
// occlusion q is the answer but for its colour, so this is multiple importance sampling (balance heuristic) of
// CANDIDATES lookups a sample, and those are counted. Twin: src/shading/ris.rs.
#include "random.glsl"
#include "light_sampling.glsl"
#include "importance_sampling.glsl"

#include "partition.glsl"

const uint CANDIDATES = 8; // even

vec3 estimate(Surface surface, Material material, uint first, uint stride) {
    vec3 w_o = view_direction(surface);
    SliceRows rows = slice_rows(surface, material, w_o);
    vec3 sum = vec3(0.0);
    for (uint k = first; k < push.sample_count; k += stride) {
        float weight_sum = 0.0;
        vec3 kept = vec3(0.0);
        // Not all unrolled: drivers take minutes to compile eight BRDFs.
        for (uint c = 0; c < CANDIDATES; c += 2) {
            [[unroll]] for (uint way = 0; way < 2; ++way) {
                uint index = k * CANDIDATES + c + way;
                uvec4 bits = random_bits(2 * index);
                vec3 w_i = way == 0 ? sample_brdf(rows, w_o, bits).w_i : sample_light(bits) * surface.frame;
                if (w_i.z > 0.0) {
                    vec3 direction = surface.frame * w_i;
                    ++lookups;
                    vec4 texel = environment_texel(direction);
                    vec3 value = brdf_at(surface, material, w_i, w_o) * texel.rgb * w_i.z;
                    float q = dot(value, vec3(0.2126, 0.7152, 0.0722));
                    float p = 0.5 * (brdf_pdf(rows, w_i, w_o, normalize(w_i + w_o)) + light_pdf(texel, direction));
                    float weight = q / p; // p > 0: brdf_pdf has a diffuse share
                    weight_sum += weight;
                    // Kept with probability weight / weight_sum: by the last candidate each in proportion.
                    if (weight > 0.0 && to_unit(random_bits(2 * index + 1)).x * weight_sum < weight) {
                        kept = value / q;
                    }
                }
            }
        }
        sum += kept * (weight_sum / float(CANDIDATES));
    }
    return sum / float(push.sample_count);
}
