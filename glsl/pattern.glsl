// Where samples are drawn: at random numbers of each sub-pixel's own, which makes noise, or at one low-discrepancy set for all pixels,
// which makes none. Twin: `sample_bits` in src/shading/mod.rs.
#include "low_discrepancy.glsl"

layout(constant_id = 6) const uint FIXED_PATTERN = 0; // 1: one set for all pixels

// That set.
Stream fixed_stream() {
    return point_stream(uvec2(0), 0);
}

// The random words of sample k.
uvec4 sample_bits(Stream fixed_set, uint k) {
    // The two dimensions of the half vector are a pair.
    return FIXED_PATTERN != 0 ? point_bits(fixed_set, k).zxyw : random_bits(k);
}
