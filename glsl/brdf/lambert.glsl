// Lambert: f = reflectance / pi. Twin of src/brdf/models/lambert.rs. a.rgb: reflectance.
#include "parameters.glsl"
#include "pi.glsl"

vec3 lambert(BrdfParameters parameters, vec3 w_i, vec3 w_o) {
    return parameters.a.rgb * INVERSE_PI;
}
