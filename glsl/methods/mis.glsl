// Multiple importance sampling (Veach and Guibas 1995, balance heuristic): each sample is a direction drawn by the BRDF and one by
// the light, so that neither a narrow lobe nor a small sun makes a large weight, at evenly distributed points. With
// thousands of samples it is the reference's form on the GPU. Twin: src/shading/mis.rs.
#include "low_discrepancy.glsl"
#include "light_sampling.glsl"
#include "importance_sampling.glsl"

#include "partition.glsl"

vec3 estimate(Surface surface, Material material, uint first, uint stride) {
    vec3 w_o = view_direction(surface);
    SliceRows rows = slice_rows(surface, material, w_o);
    uvec2 pixel = subpixel / SUBPIXELS;
    Stream streams[2] = Stream[](point_stream(pixel, 0), point_stream(pixel, 1));
    vec3 sum = vec3(0.0);
    for (uint k = first; k < push.sample_count; k += stride) {
        [[unroll]] for (int way = 0; way < 2; ++way) {
            uvec4 bits = point_bits(streams[way], k);
            // The two dimensions of the half vector are a pair.
            vec3 w_i = way == 0 ? sample_brdf(rows, w_o, bits.zxyw).w_i : sample_light(bits) * surface.frame;
            if (w_i.z > 0.0) {
                ++lookups;
                vec3 direction = surface.frame * w_i;
                vec4 texel = environment_texel(direction);
                // Never 0: brdf_pdf has a diffuse share.
                float p = brdf_pdf(rows, w_i, w_o, normalize(w_i + w_o)) + light_pdf(texel, direction);
                sum += brdf_at(surface, material, w_i, w_o) * texel.rgb * (w_i.z / p);
            }
        }
    }
    return sum / float(push.sample_count);
}
