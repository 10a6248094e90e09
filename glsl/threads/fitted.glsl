// Fitted threads as the GPU holds them. Twin of the layout: src/threads/fitted/table.rs.
#include "packing.glsl"

// Row by row of theta_o: the weight of the cosine kernel as three floats, then thread by thread three words: direction
// (octahedral, 2 x 16 bits), level and red weight, green and blue weight (half floats).
layout(set = 0, binding = 7, std430) readonly buffer Threads {
    uint threads[];
};

struct Kernel {
    vec3 direction;
    float level;
    vec3 weight;
};

uint words_a_row(ThreadSet set) {
    return 3 * (set.count + 1);
}

// Thread k of the row that starts at `row`.
Kernel unpack_kernel(uint row, uint k) {
    uint at = row + 3 * (k + 1);
    vec2 level_red = unpackHalf2x16(threads[at + 1]);
    vec2 green_blue = unpackHalf2x16(threads[at + 2]);
    return Kernel(octahedral_decode(unpackSnorm2x16(threads[at])), level_red.x, vec3(level_red.y, green_blue));
}

vec3 unpack_cosine_part(uint row) {
    return vec3(uintBitsToFloat(threads[row]), uintBitsToFloat(threads[row + 1]), uintBitsToFloat(threads[row + 2]));
}
