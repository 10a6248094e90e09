// Blinn-Phong, f = diffuse / pi + specular c_n (n . h)^n. Twin of src/brdf/models/blinn_phong.rs.
// a.rgb: diffuse, a.w: exponent n; b.rgb: specular, b.w: normalisation c_n.
#include "log_one_minus.glsl"
#include "parameters.glsl"
#include "pi.glsl"

vec3 blinn_phong(BrdfParameters parameters, vec3 w_i, vec3 w_o) {
    vec3 h = normalize(w_i + w_o);
    float log_cos2 = log_one_minus(dot(h.xy, h.xy), 2.0 * log(h.z));
    float lobe = parameters.b.w * exp(0.5 * parameters.a.w * log_cos2);
    return parameters.a.rgb * INVERSE_PI + parameters.b.rgb * lobe;
}
