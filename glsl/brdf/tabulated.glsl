// A table over tan(theta_h / 2), tan(theta_d / 2) and |cos phi_d|. Twin of src/brdf/models/tabulated.rs, which says why these.
// a.x: nodes along |cos phi_d|, less 1; a.y, a.z: nodes per doubling of 1 - tan(theta_d / 2) and of tan(theta_h / 2); a.w: twice what a texel of 1 stands for;
// b.x, b.y: reciprocals of the two knees; b.z, b.w: y and z offset of the table in the atlas, in texels;
// c.x: 0, or if f is not reciprocal, how far behind the table that for light nearer to the normal than the view lies, in texels.
//
// The including shader defines `vec4 made_table_texel(vec3 texel_coordinate)`: a trilinear fetch from the atlas at a position in
// texels (centres at i + 0.5).
#include "parameters.glsl"

vec3 tabulated(BrdfParameters parameters, vec3 w_i, vec3 w_o) {
    vec3 h = normalize(w_i + w_o);
    float sin_theta_h = length(h.xy);
    // The azimuth of a half vector at the pole is arbitrary.
    vec2 phi_h = sin_theta_h > 0.0 ? h.xy / sin_theta_h : vec2(1.0, 0.0);
    // w_i in a frame with h as its pole.
    float along = h.z * dot(w_i.xy, phi_h) - sin_theta_h * w_i.z;
    float across = w_i.y * phi_h.x - w_i.x * phi_h.y;
    float sin_theta_d = length(vec2(along, across));
    float x = sin_theta_d > 0.0 ? parameters.a.x * min(abs(along) / sin_theta_d, 1.0) : 0.0;
    float y = parameters.a.y * log2(1.0 + clamp(1.0 - sin_theta_d / (1.0 + dot(w_i, h)), 0.0, 1.0) * parameters.b.x);
    float z = parameters.a.z * log2(1.0 + min(sin_theta_h / (1.0 + h.z), 1.0) * parameters.b.y);
    bool is_reciprocal = parameters.c.x == 0.0;
    if (along < 0.0) z += parameters.c.x;
    vec3 texel = made_table_texel(vec3(x, y, z) + vec3(0.0, parameters.b.zw) + 0.5).rgb;
    return texel * (parameters.a.w / (is_reciprocal ? w_i.z + w_o.z : 2.0 * w_i.z));
}
