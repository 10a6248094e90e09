// MERL: a measured table over half and difference angles. Twin of src/brdf/models/merl.rs.
// a.x, a.y: y and z offset of this table in the atlas of all tables, in texels; a.z: what a texel of 1 stands for.
//
// The including shader defines `vec4 brdf_table_texel(vec3 texel_coordinate)`: a trilinear fetch from the atlas at a position
// in texels (centres at i + 0.5) whose x repeats every PHI_D_TEXELS.
#include "../arc_tangent.glsl"
#include "parameters.glsl"

// Texels of a table along phi_d, 0 to 180 degrees, and along theta_d and theta_h, 0 to 90.
const float PHI_D_TEXELS = 60.0;
const float THETA_TEXELS = 90.0;

vec3 merl(BrdfParameters parameters, vec3 w_i, vec3 w_o) {
    vec3 h = normalize(w_i + w_o);
    float sin_theta_h = length(h.xy);
    // The azimuth of a half vector at the pole is arbitrary.
    vec2 phi_h = sin_theta_h > 0.0 ? h.xy / sin_theta_h : vec2(1.0, 0.0);
    // d: w_i seen from a frame with h as its pole.
    vec3 d = vec3(h.z * dot(w_i.xy, phi_h) - sin_theta_h * w_i.z, w_i.y * phi_h.x - w_i.x * phi_h.y, dot(w_i, h));
    float theta_h = acute_angle(sin_theta_h, h.z, 1.0);
    float sin_theta_d = length(d.xy);
    float theta_d = acute_angle(sin_theta_d, d.z, 1.0);
    // Reciprocity: phi_d and phi_d + 180 degrees are the same cell, so d may be turned to where y is positive.
    float phi_d = acute_angle(abs(d.y), abs(d.x), sin_theta_d);
    if (d.x * d.y < 0.0) phi_d = 2.0 * HALF_PI - phi_d;

    // Clamped by hand so that neighbours in the atlas never bleed in.
    float x = PHI_D_TEXELS * phi_d / (2.0 * HALF_PI);
    float y = clamp(THETA_TEXELS * theta_d / HALF_PI, 0.5, THETA_TEXELS - 0.5) + parameters.a.x;
    float z = clamp(THETA_TEXELS * sqrt(theta_h / HALF_PI), 0.5, THETA_TEXELS - 0.5) + parameters.a.y;
    vec4 texel = brdf_table_texel(vec3(x, y, z));
    return texel.a > 0.0 ? parameters.a.z / texel.a * texel.rgb : vec3(0.0);
}
