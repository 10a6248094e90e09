// A texel of the geometry cache: what shading needs of a sub-pixel, in 8 bytes.
// The view vector follows from the sub-pixel's place on the image, so it is not stored.
// Twin: src/geometry_texel.rs.
#include "arc_tangent.glsl"
#include "packing.glsl"
#include "tangent.glsl"

// The low half of the second word: material indices are stored plus one, zero is the background.
const uint MATERIAL_BITS = 0xffffu;

// Steps of the tangent's angle around the normal as it is stored, in the high half: 1 to 65535, from -180 to 180 degrees. 0 stands for none.
const float TANGENT_STEPS = 65534.0;

uvec2 pack_geometry(vec3 normal, uint material) {
    return uvec2(packSnorm2x16(octahedral_encode(normal)), material + 1u);
}

bool is_covered(uvec2 texel) {
    return (texel.y & MATERIAL_BITS) != 0u;
}

uint geometry_material(uvec2 texel) {
    return (texel.y & MATERIAL_BITS) - 1u;
}

vec3 geometry_normal(uvec2 texel) {
    return octahedral_decode(unpackSnorm2x16(texel.x));
}

// The texel with a unit tangent; steps are 1e-4 rad.
uvec2 with_tangent(uvec2 texel, vec3 tangent) {
    vec3 n = geometry_normal(texel);
    vec3 x = any_tangent(n);
    vec2 along = vec2(dot(tangent, x), dot(tangent, cross(n, x)));
    float angle = azimuth_of(along.y, along.x, length(along));
    uint steps = uint(round((angle / radians(360.0) + 0.5) * TANGENT_STEPS)) + 1u;
    return uvec2(texel.x, texel.y | steps << 16);
}

bool has_tangent(uvec2 texel) {
    return texel.y >> 16 != 0u;
}

// The tangent of a texel of this normal, if it has one.
vec3 geometry_tangent(uvec2 texel, vec3 normal) {
    uint steps = texel.y >> 16;
    vec3 x = any_tangent(normal);
    float angle = (float(steps - 1u) / TANGENT_STEPS - 0.5) * radians(360.0);
    return cos(angle) * x + sin(angle) * cross(normal, x);
}
