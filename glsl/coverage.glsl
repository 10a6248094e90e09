// For passes over all pixels, of which each workgroup is a tile: what the pixels see of surfaces, as the pass that sorts them has written it.
#include "tiles.glsl"

layout(set = 0, binding = 1, std430) readonly buffer Coverage {
    uvec4 coverage[];
};

// That of this workgroup's tile.
uvec4 coverage_of_tile(Region region) {
    uvec2 tile = gl_WorkGroupID.xy;
    bool is_sorted = all(greaterThanEqual(tile, region.first_tile)) && all(lessThan(tile, region.end_tile));
    return is_sorted ? coverage[tile.y * gl_NumWorkGroups.x + tile.x] : uvec4(0);
}

bool sees_surface(uvec4 of_tile, uint place) {
    uvec2 bit = coverage_bit(place);
    return (of_tile[bit.x] & bit.y) != 0u;
}

bool sees_only_surface(uvec4 of_tile, uint place) {
    uvec2 bit = coverage_bit(place);
    return (of_tile[2u + bit.x] & bit.y) != 0u;
}
