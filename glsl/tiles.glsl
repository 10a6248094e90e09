// The tiles to shade, shared by the pass that lists them and those that go by that.
// Twin of the layout: src/passes/classify.rs.
//
// Pixels are packed tile by tile rather than over the whole image: then the pixels of one workgroup of the shade pass are
// the same, in the same order, in every run. On a CPU device the last bit of a lookup depends on the lookups of its neighbours.

// Pixels on the side of a tile; a tile is a workgroup of both passes.
const uint TILE_SIDE = 8u;
const uint TILE_PIXELS = TILE_SIDE * TILE_SIDE;

// Interior pixels see one smooth surface in all their sub-pixels, which share one sum or share its samples out;
// in edge pixels each covered sub-pixel is a sum of its own.
const uint INTERIOR = 0u;
const uint EDGE = 1u;

// Pixels are of one class if they are of one kind and have the same shader.
uint class_of(uint shader, uint kind) {
    return 2u * shader + kind;
}

uint kind_of(uint pixel_class) {
    return pixel_class & 1u;
}

// The tiles that hold pixels of one class: the arguments of an indirect dispatch, and how many tiles are listed.
struct TileClass {
    uint groups_x;
    uint groups_y;
    uint groups_z;
    uint tile_count;
};

// What is counted of all classes, by kind of pixels where there are two.
struct Counted {
    uint pixels[2];
    uint covered_subpixels;
    uint covered_edge_subpixels;
};

// The limit on workgroups that every device has; beyond it a workgroup takes several tiles.
const uint MAX_GROUPS = 65535u;

// A listed tile: its index, row by row, the first slot of the class among the tile's pixels, and how many of these are of the class (1 to 64).
uvec2 pack_tile(uint tile, uint first_slot, uint pixel_count) {
    return uvec2(tile, first_slot | pixel_count << 8);
}

uint tile_index(uvec2 packed) {
    return packed.x;
}

uint tile_first_slot(uvec2 packed) {
    return packed.y & 255u;
}

uint tile_pixel_count(uvec2 packed) {
    return packed.y >> 8;
}

// The tiles that may see a surface, those of columns and rows from the first to before the end; only these are drawn and sorted.
struct Region {
    uvec2 first_tile;
    uvec2 end_tile;
};

// What the pixels of a tile see, a bit each in four words: in two of any surface, in the other two of nothing else. Which of the two the bit of
// pixel `place` is in, and it.
uvec2 coverage_bit(uint place) {
    return uvec2(place / 32u, 1u << (place % 32u));
}
