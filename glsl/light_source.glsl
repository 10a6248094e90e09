// Small bright sources of the environment as the GPU holds them: lamps, each divided into parts. Twin of the layout: SourceRecords in
// src/environment/sources.rs.

struct Source {
    vec4 direction; // of its centroid, in the environment's coordinates; w: standard deviation along its longer axis, in radians
    vec4 axis[2];   // across that, as long as its standard deviation along each; w: of a lamp, the index of its first part, and their number
    vec4 power;     // radiance integrated over its solid angle, over the scale of the pyramid's texels
};

layout(set = 0, binding = 14, std430) readonly buffer Sources {
    uint lamp_count;
    Source sources[]; // the lamps as wholes, then the parts of the first, of the second, ...
};
