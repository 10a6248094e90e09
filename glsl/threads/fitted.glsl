// Fitted threads as the GPU holds them. Twin of the layout: src/threads/fitted/table.rs.
#include "azimuths.glsl"
#include "packing.glsl"

// Azimuth by azimuth of the view: the albedo of each row of theta_o as three floats, then thread by thread its rows, each three words: direction
// (its place on the stereographic map, 2 x 16 bits), level and red weight, green and blue weight (half floats). Neighbouring pixels look one thread up
// at the same time, each between two rows, and so find it in few cache lines. A fourth word is 0: GPUs load what is aligned to 16 bytes at once.
layout(set = 0, binding = 7, std430) readonly buffer Threads {
    uvec4 threads[];
};

struct Kernel {
    vec2 place; // of its direction on the stereographic map
    float level;
    vec3 weight;
};

uint elements_an_azimuth(ThreadTable table) {
    return table.row_count * (table.count + 1);
}

// Thread k of a row of which the albedo is this element, one of so many rows of an azimuth.
Kernel unpack_kernel(uint albedo, uint row_count, uint k) {
    uvec4 words = threads[albedo + (k + 1) * row_count];
    vec2 place = STEREOGRAPHIC_EXTENT * unpackSnorm2x16(words.x);
    vec2 level_red = unpackHalf2x16(words.y);
    vec2 green_blue = unpackHalf2x16(words.z);
    return Kernel(place, level_red.x, vec3(level_red.y, green_blue));
}

vec3 unpack_albedo(uint albedo) {
    return uintBitsToFloat(threads[albedo].xyz);
}
