// Monte Carlo with p = cos / pi, the projected disc (Malley). Twin: src/shading/cosine.rs.
#include "circle.glsl"
#include "random.glsl"
#include "environment_map.glsl"

#include "partition.glsl"

vec3 estimate(Surface surface, Material material, uint first, uint stride) {
    vec3 w_o = view_direction(surface);
    vec3 sum = vec3(0.0);
    for (uint k = first; k < push.sample_count; k += stride) {
        vec4 u = to_unit(random_bits(k));
        vec3 w_i = vec3(sqrt(u.x) * on_circle(u.y), sqrt(1.0 - u.x));
        sum += brdf_at(surface, material, w_i, w_o) * environment_radiance(surface.frame * w_i) * radians(180.0);
    }
    return sum / float(push.sample_count);
}
