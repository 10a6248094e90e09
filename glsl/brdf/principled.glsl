// glTF's metallic-roughness under a clear coat. Twin of src/brdf/models/principled.rs without sheen.
// a.rgb: base colour, a.w: metallic; b.x: f0 of dielectrics; b.y: weight of the coat, b.z: its roughness_alpha, b.w: its f0;
// c.x, c.y: roughness_alpha along x, the tangent, and along y.
#include "parameters.glsl"
#include "microfacet.glsl"
#include "pi.glsl"

vec3 principled(BrdfParameters parameters, vec3 w_i, vec3 w_o) {
    const float GGX = 0.0;
    vec3 h = normalize(w_i + w_o);
    float cos_theta_d = dot(w_o, h);
    vec3 base_colour = parameters.a.rgb;
    float metallic = parameters.a.w;
    float lobe = torrance_sparrow(GGX, w_i, w_o, h, parameters.c.xy);
    float dielectric = fresnel_schlick(cos_theta_d, vec3(parameters.b.x)).x;
    vec3 f = ((1.0 - dielectric) * INVERSE_PI * base_colour + dielectric * lobe) * (1.0 - metallic)
        + fresnel_schlick(cos_theta_d, base_colour) * (lobe * metallic);
    float coat = parameters.b.y;
    if (coat > 0.0) {
        vec3 f0 = vec3(parameters.b.w);
        float let_in = 1.0 - coat * fresnel_schlick(w_i.z, f0).x;
        float let_out = 1.0 - coat * fresnel_schlick(w_o.z, f0).x;
        float coat_lobe = torrance_sparrow(GGX, w_i, w_o, h, vec2(parameters.b.z));
        f = f * (let_in * let_out) + coat * fresnel_schlick(cos_theta_d, f0).x * coat_lobe;
    }
    return f;
}
