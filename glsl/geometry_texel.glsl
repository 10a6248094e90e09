// A texel of the geometry cache: what shading needs of a sub-pixel, in 8 bytes.
// The view vector follows from the sub-pixel's place on the image, so it is not stored.
// Twin: src/geometry_texel.rs.
#include "packing.glsl"

// Material indices are stored plus one: zero is the background.
uvec2 pack_geometry(vec3 normal, uint material) {
    return uvec2(packSnorm2x16(octahedral_encode(normal)), material + 1u);
}

bool is_covered(uvec2 texel) {
    return texel.y != 0u;
}

uint geometry_material(uvec2 texel) {
    return texel.y - 1u;
}

vec3 geometry_normal(uvec2 texel) {
    return octahedral_decode(unpackSnorm2x16(texel.x));
}
