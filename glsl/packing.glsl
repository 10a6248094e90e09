// A texel of the geometry cache: what shading needs of a sub-pixel, in 8 bytes.
// The view vector follows from the sub-pixel's place on the image, so it is not stored.
// Twin: src/shading/mod.rs.

// Octahedral map of a unit vector to [-1, 1]^2 (Meyer et al. 2010); two 16-bit numbers hold it to 4e-5 rad.
vec2 octahedral_encode(vec3 n) {
    n /= abs(n.x) + abs(n.y) + abs(n.z);
    vec2 folded = (1.0 - abs(n.yx)) * vec2(n.x >= 0.0 ? 1.0 : -1.0, n.y >= 0.0 ? 1.0 : -1.0);
    return n.z >= 0.0 ? n.xy : folded;
}

vec3 octahedral_decode(vec2 e) {
    vec3 n = vec3(e, 1.0 - abs(e.x) - abs(e.y));
    float fold = max(-n.z, 0.0);
    n.x -= n.x >= 0.0 ? fold : -fold;
    n.y -= n.y >= 0.0 ? fold : -fold;
    return normalize(n);
}

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
