// Materials as the GPU holds them. Twin of the layout: src/brdf/record.rs.
#include "brdf/parameters.glsl"

struct ThreadTable {
    uint first;       // where its threads start in the thread buffer
    uint count;
    uint row_count;
    uint sharp_count;   // only threads before this one are sharper than the environment's pyramid in some row
    uint set_count;     // sets of its threads, each of which does alone: thread k is of set k % set_count
    uint azimuth_count; // of the view, that there are rows or CDFs for; 1 of an isotropic BRDF
};

struct Material {
    BrdfParameters parameters;
    uint model;        // position in src/brdf/models/table.rs
    uint first_slice;  // where its CDFs or its split sum start in the buffer of these
    float lobe_width;  // half_vector_width in src/brdf/lobe/mod.rs, in radians
    float narrowness;  // the lobe's width across its long axis over the one along it: 1 of an isotropic BRDF
    vec2 long_axis;    // of the lobe, from the tangent; across it the lobe has lobe_width
    ThreadTable threads;          // of a pixel whose sub-pixels share one sum
    ThreadTable subpixel_threads; // of each sub-pixel of another pixel
    float shared_deviation; // of normals, up to which sub-pixels share one sum where the view is along them: src/threads/fitted/sets.rs
    float flank;       // flank_rad in src/brdf/lobe/mod.rs
    vec2 clear;        // that of its threads: src/threads/fitted/giving_way.rs
    float lobe_radius; // lobe_radius_rad there
    float dark_from;   // that of the lobe: src/brdf/lobe/mod.rs
    vec4 narrowing;    // narrowing there
    float rim_power;   // that of its threads or its split sum: src/threads/rim.rs
    uint base_map;     // which irradiance map its threads look up
    float base[6];     // the profile of that: src/brdf/base.rs
};

layout(set = 0, binding = 5, std430) readonly buffer Materials {
    Material materials[];
};

layout(set = 0, binding = 6) uniform sampler3D brdf_tables;

// Texel (phi_d, theta_d, theta_h) of the atlas of BRDF tables, between texel centres trilinearly.
vec4 brdf_table_texel(vec3 texel_coordinate) {
    return textureLod(brdf_tables, texel_coordinate / vec3(textureSize(brdf_tables, 0)), 0.0);
}

layout(set = 0, binding = 16) uniform sampler3D made_brdf_tables;

// A texel of the atlas of tables that were made, between texel centres trilinearly: its axes are those of brdf/tabulated.glsl, or of
// brdf/tabulated_anisotropic.glsl.
vec4 made_table_texel(vec3 texel_coordinate) {
    return textureLod(made_brdf_tables, texel_coordinate / vec3(textureSize(made_brdf_tables, 0)), 0.0);
}
