// Points that fill the unit hypercube evenly: Sobol's (0,2)-sequence, scrambled and shuffled (Burley 2020, Practical Hash-based
// Owen Scrambling). Another seed or pixel gives other, independent points. Twin: src/shading/low_discrepancy.rs.
#include "random.glsl"

// Owen's nested uniform scramble of numbers whose lowest bit is the most significant of the fraction, as a hash (Laine and
// Karras 2011, with Vegdahl's constants).
uvec2 owen_scramble(uvec2 x, uvec2 seed) {
    x ^= x * 0x3d20adeau;
    x += seed;
    x *= (seed >> 16u) | 1u;
    x ^= x * 0x05526c56u;
    return x ^ x * 0x53a22864u;
}

// The digits of Sobol's second dimension, the most significant lowest: Pascal's triangle modulo 2 times those of the first, in
// which entry (i, j) is 1 where the bits of i are among those of j (Lucas).
uvec2 pascal(uvec2 x) {
    x ^= x >> 1u & 0x55555555u;
    x ^= x >> 2u & 0x33333333u;
    x ^= x >> 4u & 0x0f0f0f0fu;
    x ^= x >> 8u & 0x00ff00ffu;
    return x ^ x >> 16u & 0x0000ffffu;
}

// The seeds of a stream of points: of two pairs of dimensions, each of which is a sequence by itself.
struct Stream {
    uvec2 shuffle;
    uvec4 scramble;
};

// A stream of points for a pixel, whose sub-pixels share it.
Stream point_stream(uvec2 pixel, uint index) {
    uint place = pixel.x | pixel.y << 16;
    return Stream(pcg4d(uvec4(place, 2 * index, push.seed)).xy, pcg4d(uvec4(place, 2 * index + 1, push.seed)));
}

// Point `index` of the stream, as multiples of 2^-32 in [0, 1): the first two dimensions belong together, and the last two.
uvec4 point_bits(Stream stream, uint index) {
    // Shuffled apart, the pairs have nothing to do with each other.
    uvec2 shuffled = bitfieldReverse(owen_scramble(uvec2(bitfieldReverse(index)), stream.shuffle));
    uvec2 second = pascal(shuffled);
    uvec2 x = owen_scramble(uvec2(shuffled.x, second.x), stream.scramble.xy);
    uvec2 y = owen_scramble(uvec2(shuffled.y, second.y), stream.scramble.zw);
    return bitfieldReverse(uvec4(x, y));
}
