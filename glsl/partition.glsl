// For methods that divide their samples among the sub-pixels of a pixel that lies on one smooth surface: see shade.comp.

const bool SHARES_SURFACE = false;

bool needs_subpixels(Surface surface, Material material) {
    return false;
}
