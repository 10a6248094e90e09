// MERL: a measured table over half and difference angles. Twin of src/brdf/merl.rs.
// a.x, a.y: y and z offset of this table in the atlas of all tables, in texels; a.z: what a texel of 1 stands for.
//
// The including shader defines `vec4 brdf_table_texel(vec3 texel_coordinate)`: a trilinear fetch from the atlas at a position
// in texels (centres at i + 0.5) whose x repeats every 60.
#include "parameters.glsl"

const float HALF_PI = 1.57079633;

// The angle in [0, 90 degrees] of tangent y / x, neither negative, in a triangle of this hypotenuse; 0 if all are 0. Twin of that name in
// src/brdf/merl.rs. An arc tangent, since cosines have no digits left near the pole, just where bins are smallest; and not GLSL's, which
// may err by 4096 units in the last place (Vulkan 1.3, "Precision and Operation of SPIR-V Instructions") and handles cases that do not occur.
float acute_angle(float y, float x, float hypotenuse) {
    // tan(a / 2) = sin a / (1 + cos a): at most tan(22.5 degrees). The smallest normal number stands in for 0, to divide by.
    float tangent = min(y, x) / max(max(y, x) + hypotenuse, 1.2e-38);
    float square = tangent * tangent;
    // atan(t) / t to 2e-8 of it.
    float series = 0.0799375;
    series = series * square - 0.13854501;
    series = series * square + 0.1997473;
    series = series * square - 0.33332808;
    series = series * square + 0.99999998;
    float angle = 2.0 * tangent * series;
    return y > x ? HALF_PI - angle : angle;
}

vec3 merl(BrdfParameters parameters, vec3 w_i, vec3 w_o) {
    if (!(w_i.z > 0.0 && w_o.z > 0.0)) return vec3(0.0);
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
    float x = 60.0 * phi_d / (2.0 * HALF_PI);
    float y = clamp(90.0 * theta_d / HALF_PI, 0.5, 89.5) + parameters.a.x;
    float z = clamp(90.0 * sqrt(theta_h / HALF_PI), 0.5, 89.5) + parameters.a.y;
    vec4 texel = brdf_table_texel(vec3(x, y, z));
    return texel.a > 0.0 ? parameters.a.z / texel.a * texel.rgb : vec3(0.0);
}
