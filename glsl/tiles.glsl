// The list of pixels to shade, shared by the pass that makes it and the one that consumes it.
// Twin of the layout: src/passes/classify.rs.

// One class of pixels: the arguments of an indirect dispatch, and how many pixels are listed.
struct PixelClass {
    uint groups_x;
    uint groups_y;
    uint groups_z;
    uint count;
};

// Interior pixels see one smooth surface in all their sub-pixels and share one sum over the threads;
// edge pixels do not, and sum over all threads in each covered sub-pixel.
const uint INTERIOR = 0u;
const uint EDGE = 1u;

// Pixels per workgroup of the shade pass.
const uint SHADE_GROUP_SIZE = 64u;

// The limit on workgroups that every device has; beyond it a workgroup takes several blocks of pixels.
const uint MAX_GROUPS = 65535u;
