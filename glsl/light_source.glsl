// Small bright sources of the environment as the GPU holds them: lamps, each a tree of halves of halves. Twin of the layout: SourceRecord
// in src/environment/sources.rs.

struct Source {
    vec4 direction; // of its centroid, in the environment's coordinates; w: standard deviation along its longer axis, in radians
    vec4 axis[2];   // across that, as long as its standard deviation along each; w of the first: how many nodes it and all its parts are
    vec4 power;     // radiance integrated over its solid angle, over the scale of the pyramid's texels
};

const uint MAX_SOURCE_NODES = 96u; // of all trees

// Uniform, which some drivers read faster than storage. Depth first.
layout(set = 0, binding = 14, std140) uniform Sources {
    uint source_count;
    Source sources[MAX_SOURCE_NODES];
};
