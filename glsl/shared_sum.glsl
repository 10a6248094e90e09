// For methods by which the sub-pixels of a pixel that lies on one smooth surface share one sum over all threads, at their mean normal. Of
// another pixel, each covered sub-pixel is a sum of its own, over one set of other threads: the partition of the paper's section 4.2, for
// threads that are made such that each set does alone. Twin: shade_shared in src/shading/mod.rs.
#include "normal_variance.glsl"

// The mean over threads first, first + stride, ... of the material of what each makes of the environment, as if there were no others.
vec3 estimate(Surface surface, Material material, uint first, uint stride);

// Whether one sum does not do for a pixel within one smooth surface, whose mean is this.
bool needs_subpixels(Surface surface, Material material);

// Variance along each axis, in rad^2, of the views of a pixel's sub-pixels. Twin: src/passes/view.rs.
float view_variance() {
    vec2 pixel = 2.0 * vec2(length(push.camera.right.xyz), length(push.camera.up.xyz)) / vec2(push.size_px);
    // That of SUBPIXELS equal steps of a pixel's side, in the mean of both sides.
    return dot(pixel, pixel) * (1.0 - 1.0 / float(SUBPIXELS * SUBPIXELS)) / 24.0;
}

// The mean of the surfaces that a pixel's sub-pixels see, all of them covered.
Surface mean_surface(uvec2 pixel) {
    NormalMoments normals = normal_moments(geometry_normal(texelFetch(geometry, ivec2(pixel * SUBPIXELS), 0).xy));
    vec3 tangents = vec3(0.0);
    for (uint j = 0; j < SUBPIXELS * SUBPIXELS; ++j) {
        uvec2 place = pixel * SUBPIXELS + uvec2(j % SUBPIXELS, j / SUBPIXELS);
        uvec2 texel = texelFetch(geometry, ivec2(place), 0).xy;
        vec3 normal = geometry_normal(texel);
        add_normal(normals, normal);
        if (HAS_TANGENTS != 0 && has_tangent(texel)) {
            tangents += geometry_tangent(texel, normal);
        }
    }
    Surface mean = surface_at((vec2(pixel) + 0.5) / vec2(push.size_px), normalize(mean_normal(normals, SUBPIXELS * SUBPIXELS)), tangents);
    // A mirrored direction turns once as far as the view does, twice as far as the normal.
    mean.normal_variance = normal_variance(normals, SUBPIXELS * SUBPIXELS) + 0.25 * view_variance();
    return mean;
}

// How many sub-pixels of a pixel within one surface are sums of their own: of more than 2 x 2 one in each row and column, so that these are no
// fewer threads each. Twin: sums_of_pixel in src/threads/fitted/sets.rs.
uint sums_of_pixel(uint subpixels) {
    return subpixels > 2 ? subpixels : subpixels * subpixels;
}

// Which sub-pixel sum j of these is. Twin: place_of_sum in src/threads/fitted/sets.rs.
uvec2 place_of_sum(uint j, uint subpixels) {
    // Of 4 x 4 they are in rows 1, 3, 0 and 2, of 3 x 3 in 1, 0 and 2.
    return subpixels > 2 ? uvec2(j, (2 * j + 1) % (subpixels | 1)) : uvec2(j % subpixels, j / subpixels);
}

vec4 shade_pixel(uvec2 pixel, bool interior) {
    uint parts = SUBPIXELS * SUBPIXELS;
    Surface surface;
    if (interior) {
        surface = mean_surface(pixel);
        uvec2 texel = texelFetch(geometry, ivec2(pixel * SUBPIXELS), 0).xy;
        parts = needs_subpixels(surface, material_of(texel)) ? sums_of_pixel(SUBPIXELS) : 1;
    }
    bool shares = interior && parts == 1;
    vec4 sum = vec4(0.0);
    uint j = 0;
    do {
        uvec2 place = pixel * SUBPIXELS + (interior ? place_of_sum(j, SUBPIXELS) : uvec2(j % SUBPIXELS, j / SUBPIXELS));
        uvec2 texel = texelFetch(geometry, ivec2(place), 0).xy;
        if (is_covered(texel)) {
            if (!shares) {
                surface = surface_of_subpixel(place, texel);
            }
            Material material = material_of(texel);
            uint set_count = 1;
            if (!shares) {
                material.threads = material.subpixel_threads;
                set_count = material.threads.set_count;
            }
            sum += vec4(estimate(surface, material, j % set_count, set_count), 1.0);
        }
    } while (++j < parts);
    return sum / float(parts);
}
