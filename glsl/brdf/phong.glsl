// Phong, f = diffuse / pi + specular (n + 2) / (2 pi) (r . w_o)^n. Twin of src/brdf/models/phong.rs.
// a.rgb: diffuse, a.w: exponent n; b.rgb: specular, b.w: (n + 2) / (2 pi).
#include "log_one_minus.glsl"
#include "parameters.glsl"
#include "pi.glsl"

vec3 phong(BrdfParameters parameters, vec3 w_i, vec3 w_o) {
    vec3 chord = vec3(-w_i.xy, w_i.z) - w_o;
    float x = 0.5 * dot(chord, chord); // 1 - cos
    if (x >= 1.0) return parameters.a.rgb * INVERSE_PI;
    float log_cos = log_one_minus(x, log(1.0 - x));
    float lobe = parameters.a.w > 0.0 ? exp(parameters.a.w * log_cos) : 1.0;
    return parameters.a.rgb * INVERSE_PI + parameters.b.rgb * (parameters.b.w * lobe);
}
