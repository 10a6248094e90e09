// Unit vectors in 32 bits. Twin: src/packing.rs.
#ifndef PACKING_GLSL
#define PACKING_GLSL

// Octahedral map of a unit vector to [-1, 1]^2 (Meyer et al. 2010); two 16-bit numbers hold it to 7e-5 rad.
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

// How far from the middle a stereographic map goes: 13 degrees beyond the horizon.
const float STEREOGRAPHIC_EXTENT = 1.25;

// A direction, not of unit length, of a place on the stereographic map of directions about z: as places blend, so do directions.
vec3 stereographic_decode(vec2 place) {
    return vec3(2.0 * place, 1.0 - dot(place, place));
}

#endif
