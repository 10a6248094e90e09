// Rough metal: f = F D G / (4 cos_theta_i cos_theta_o). Twin of src/brdf/models/conductor.rs.
// a.rgb: eta; b.rgb: k, b.w: distribution (0 GGX, 1 Beckmann);
// c.x, c.y: roughness_alpha along x, the tangent, and along y.
#include "parameters.glsl"
#include "microfacet.glsl"

vec3 conductor(BrdfParameters parameters, vec3 w_i, vec3 w_o) {
    vec3 h = normalize(w_i + w_o);
    return fresnel_conductor(dot(w_o, h), parameters.a.rgb, parameters.b.rgb)
        * torrance_sparrow(parameters.b.w, w_i, w_o, h, parameters.c.xy);
}
