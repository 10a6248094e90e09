// Lambert: f = reflectance / pi. Twin of src/brdf/models/lambert.rs. a.rgb: reflectance.
#include "parameters.glsl"
#include "pi.glsl"

vec3 lambert(BrdfParameters parameters, vec3 w_i, vec3 w_o) {
    if (!(w_i.z > 0.0 && w_o.z > 0.0)) return vec3(0.0);
    return parameters.a.rgb * INVERSE_PI;
}
