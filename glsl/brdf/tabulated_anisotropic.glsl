// A table over half and difference vectors. Twin of src/brdf/models/tabulated_anisotropic.rs, which says why these.
// a.xy: long axis of the lobe, from the tangent; a.z, a.w: nodes per doubling of h_x and h_y; b.x, b.y: reciprocals of their knees;
// b.z, b.w: y and z offset of the table in the atlas, in texels;
// c.x: 0, or if f is not reciprocal, how far behind the table that for negative d_y lies, in texels;
// c.y: the node of h_x = 0 and of h_y = 0; c.z: nodes per doubling of 1 - tan(theta_d / 2); c.w: twice what a texel of 1 stands for.
//
// The including shader defines `vec4 made_table_texel(vec3 texel_coordinate)`: a trilinear fetch from the atlas at a position in
// texels (centres at i + 0.5).
#include "parameters.glsl"

const float LAST_COLUMN = 16.0;     // of 17 along phi_d
const float ROWS = 25.0;            // along tan(theta_d / 2)
const float SLABS = 3.0;            // side by side along y
const float RECIPROCAL_KNEE = 5.0;  // of 1 - tan(theta_d / 2)

// The texel of node h_y, a whole number, at this position in phi_d, theta_d and h_x.
vec3 slab_texel(BrdfParameters parameters, vec3 position, float h_y, float side) {
    float group = floor((h_y + 0.5) / SLABS);
    float tangents = 2.0 * parameters.c.y + 1.0;
    vec2 offset = vec2(ROWS * (h_y - SLABS * group), tangents * group + side) + parameters.b.zw;
    return made_table_texel(position + vec3(0.0, offset) + 0.5).rgb;
}

vec3 tabulated_anisotropic(BrdfParameters parameters, vec3 w_i, vec3 w_o) {
    mat2 to_own = mat2(parameters.a.x, -parameters.a.y, parameters.a.y, parameters.a.x);
    vec3 own_i = vec3(to_own * w_i.xy, w_i.z);
    vec3 h = normalize(own_i + vec3(to_own * w_o.xy, w_o.z));
    float cos_theta_d = dot(own_i, h);
    vec2 tangent = h.xy / (1.0 + h.z);
    vec2 d = own_i.xy - (own_i.z + cos_theta_d) * tangent;
    bool is_turned = d.y < 0.0;
    if (is_turned) d = -d;
    float sum = abs(d.x) + d.y;
    float phi_d = sum > 0.0 ? 0.5 - 0.5 * d.x / sum : 0.5;
    float from_grazing = clamp(1.0 - length(d) / (1.0 + cos_theta_d), 0.0, 1.0);
    vec2 nodes = parameters.a.zw * log2(1.0 + min(abs(tangent), 1.0) * parameters.b.xy);
    vec2 at = parameters.c.y + min(nodes, parameters.c.y) * sign(tangent);
    vec3 position = vec3(LAST_COLUMN * phi_d, min(parameters.c.z * log2(1.0 + from_grazing * RECIPROCAL_KNEE), ROWS - 1.0), at.x);
    bool is_reciprocal = parameters.c.x == 0.0;
    float side = is_turned ? parameters.c.x : 0.0;
    float first = min(floor(at.y), 2.0 * parameters.c.y - 1.0);
    vec3 low = slab_texel(parameters, position, first, side);
    vec3 high = slab_texel(parameters, position, first + 1.0, side);
    return mix(low, high, at.y - first) * (parameters.c.w / (is_reciprocal ? w_i.z + w_o.z : 2.0 * w_i.z));
}
