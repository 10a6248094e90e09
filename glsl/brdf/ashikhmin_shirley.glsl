// Ashikhmin and Shirley's anisotropic Phong. Twin of src/brdf/models/ashikhmin_shirley.rs.
// a.rgb: 28 / (23 pi) diffuse (1 - specular), a.w: exponent along x; b.rgb: specular, b.w: exponent along y;
// c.x: sqrt((n_x + 1) (n_y + 1)) / (8 pi).
#include "parameters.glsl"
#include "log_one_minus.glsl"
#include "microfacet.glsl"

// 1 - (1 - cos / 2)^5
float ashikhmin_shirley_room(float cos_theta) {
    float rest = 1.0 - 0.5 * cos_theta;
    float rest2 = rest * rest;
    return 1.0 - rest2 * rest2 * rest;
}

vec3 ashikhmin_shirley(BrdfParameters parameters, vec3 w_i, vec3 w_o) {
    vec3 h = normalize(w_i + w_o);
    float cos_theta_d = dot(w_o, h);
    vec2 h2 = h.xy * h.xy;
    float sin2 = min(h2.x + h2.y, 1.0);
    // The exponent at the azimuth of h, times sin^2.
    float exponent_sin2 = parameters.a.w * h2.x + parameters.b.w * h2.y;
    float log_cos2 = log_one_minus(sin2, 2.0 * log(h.z));
    // Where h is at the horizon 0 times infinity threatens, and where it is the normal 0 / 0.
    float lobe = min(exponent_sin2, sin2) > 0.0 ? exp(0.5 * exponent_sin2 * (log_cos2 / sin2)) : 1.0;
    float specular = parameters.c.x * lobe / (cos_theta_d * max(w_i.z, w_o.z));
    return fresnel_schlick(cos_theta_d, parameters.b.rgb) * specular + parameters.a.rgb * (ashikhmin_shirley_room(w_i.z) * ashikhmin_shirley_room(w_o.z));
}
