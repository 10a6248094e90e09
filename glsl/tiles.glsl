// The tiles to shade, shared by the pass that lists them and those that go by that.
// Twin of the layout: src/passes/classify.rs.
//
// Pixels are packed tile by tile rather than over the whole image, and listed in parts of a tile: then on a CPU device the pixels of a part are
// the same, in the same order, in every run. There the last bit of a lookup depends on the lookups of its neighbours.

// Pixels on the side of a tile, which is a workgroup of the pass that lists them.
const uint TILE_SIDE = 8u;
const uint TILE_PIXELS = TILE_SIDE * TILE_SIDE;

// Pixels of one class in a part of a tile, at most: the lanes of lavapipe. Of larger parts more lanes are idle, since most tiles of a mesh have pixels
// of several classes; smaller ones are longer lists.
const uint PART_PIXELS = 8u;

// Parts of a tile that is of one class, and of a workgroup that shades.
const uint PARTS = TILE_PIXELS / PART_PIXELS;

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

// The tiles that hold pixels of one class: the arguments of an indirect dispatch, and how many parts of them are listed.
struct TileClass {
    uint groups_x;
    uint groups_y;
    uint groups_z;
    uint part_count;
};

// What is counted of all classes, by kind of pixels where there are two.
struct Counted {
    uint pixels[2];
    uint covered_subpixels;
    uint covered_edge_subpixels;
};

// The limit on workgroups that every device has; beyond it a workgroup takes more than PARTS.
const uint MAX_GROUPS = 65535u;

// Where the parts of a class start in the list of a picture of so many columns and rows of tiles.
uint first_part(uint pixel_class, uvec2 tiles) {
    return pixel_class * PARTS * tiles.x * tiles.y;
}

// A listed part of a tile: the tile's index, row by row (a picture of 16384 x 16384 pixels has 2^22), the part's first slot among the pixels of the
// tile, and how many it has (1 to PART_PIXELS).
uint pack_part(uint tile, uint first_slot, uint pixel_count) {
    return tile << 9 | first_slot << 3 | pixel_count - 1;
}

uint part_tile(uint part) {
    return part >> 9;
}

uint part_first_slot(uint part) {
    return part >> 3 & 63;
}

uint part_pixel_count(uint part) {
    return (part & 7) + 1;
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
