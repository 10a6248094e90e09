// Plastic: a rough dielectric coat on a diffuse base. Twin of src/brdf/models/plastic.rs, which says why this base.
// a.rgb: diffuse / (1 - mean F); b.x: ior, b.y: distribution (0 GGX, 1 Beckmann);
// c.x, c.y: roughness_alpha along x, the tangent, and along y.
#include "parameters.glsl"
#include "microfacet.glsl"
#include "pi.glsl"

vec3 plastic(BrdfParameters parameters, vec3 w_i, vec3 w_o) {
    float ior = parameters.b.x;
    vec3 h = normalize(w_i + w_o);
    float coat = fresnel_dielectric(dot(w_o, h), ior) * torrance_sparrow(parameters.b.y, w_i, w_o, h, parameters.c.xy);
    float transmitted = (1.0 - fresnel_dielectric(w_i.z, ior)) * (1.0 - fresnel_dielectric(w_o.z, ior));
    return vec3(coat) + parameters.a.rgb * (transmitted * INVERSE_PI);
}
