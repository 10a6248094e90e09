// Blinn-Phong, f = diffuse / pi + specular c_n (n . h)^n. Twin of src/brdf/blinn_phong.rs.
// a.rgb: diffuse, a.w: exponent n; b.rgb: specular, b.w: normalisation c_n.
#include "parameters.glsl"

vec3 blinn_phong(BrdfParameters parameters, vec3 w_i, vec3 w_o) {
    if (!(w_i.z > 0.0 && w_o.z > 0.0)) return vec3(0.0);
    vec3 h = normalize(w_i + w_o);
    // log(cos^2) = log(1 - sin^2), by its series where 1 - sin^2 would round away what a large exponent multiplies.
    float sin2 = dot(h.xy, h.xy);
    float log_cos2 = sin2 < 1e-2 ? -sin2 * (1.0 + sin2 * (0.5 + sin2 * (1.0 / 3.0 + sin2 * 0.25))) : 2.0 * log(h.z);
    float lobe = parameters.b.w * exp(0.5 * parameters.a.w * log_cos2);
    return parameters.a.rgb * 0.318309886 + parameters.b.rgb * lobe;
}
