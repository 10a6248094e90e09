// Random numbers by counting: the same seed, sub-pixel and index give the same numbers on every device.
// Twin: src/shading/random.rs.

// PCG4D (Jarzynski and Olano 2020, Hash Functions for GPU Rendering): four words of hash from four of input.
uvec4 pcg4d(uvec4 v) {
    v = v * 1664525u + 1013904223u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    v ^= v >> 16u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return v;
}

// Four random words for this sub-pixel; images have fewer than 2^16 sub-pixels a side.
uvec4 random_bits(uint index) {
    return pcg4d(uvec4(subpixel.x | subpixel.y << 16, index, push.seed));
}

// Multiples of 2^-24 in [0, 1): all that single precision holds evenly.
vec4 to_unit(uvec4 bits) {
    return vec4(bits >> 8u) * (1.0 / 16777216.0);
}
