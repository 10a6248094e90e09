// For methods by which the sub-pixels of a pixel that lies on one smooth surface share one sum over all threads, at their mean normal. Of
// another pixel, each covered sub-pixel is a sum of its own, over one set of other threads: the partition of the paper's section 4.2, for
// threads that are made such that each set does alone. Twin: shade_shared in src/shading/mod.rs.

// Up to this deviation of their normals, in radians, sub-pixels are one surface to any lobe that is not narrower. Twin: src/passes/classify.rs.
const float NEARLY_FLAT_RAD = 0.01;

// What the small bright sources of the environment are to a surface, if kernels do not look them up.
struct SourceSum {
    vec3 radiance;    // what the BRDF makes of them
    vec3 irradiance;
    float of_kernels; // how much of the answer to them is that of kernels all the same, the rest being the BRDF's
};

// That of a sub-pixel, or of a pixel at its mean surface.
SourceSum at_sources(Surface surface, Material material);

// The mean over threads first, first + stride, ... of the material of what each makes of the environment, as if there were no others; with
// what is theirs of the sources.
vec3 estimate(Surface surface, Material material, uint first, uint stride, SourceSum of_sources);

// Whether one sum over threads does not do for a pixel within one smooth surface, whose mean is this.
bool needs_subpixels(Surface surface, Material material);

// Whether sources are not the same to sub-pixels that share that sum: it is theirs alone, then.
bool sources_vary(Surface surface);

// The mean of the surfaces that a pixel's sub-pixels see, all of them covered.
Surface mean_surface(uvec2 pixel) {
    vec3 normals = vec3(0.0);
    vec3 tangents = vec3(0.0);
    for (uint j = 0; j < SUBPIXELS * SUBPIXELS; ++j) {
        uvec2 place = pixel * SUBPIXELS + uvec2(j % SUBPIXELS, j / SUBPIXELS);
        uvec2 texel = texelFetch(geometry, ivec2(place), 0).xy;
        vec3 normal = geometry_normal(texel);
        normals += normal;
        if (HAS_TANGENTS != 0 && has_tangent(texel)) {
            tangents += geometry_tangent(texel, normal);
        }
    }
    Surface mean = surface_at((vec2(pixel) + 0.5) / vec2(push.size_px), normalize(normals), tangents);
    // With R the length of the mean normal, 1 - R is the variance along each of two axes.
    mean.normal_variance = max(1.0 - length(normals) / float(SUBPIXELS * SUBPIXELS), 0.0);
    return mean;
}

vec4 shade_pixel(uvec2 pixel, bool interior) {
    const uint subpixel_count = SUBPIXELS * SUBPIXELS;
    Surface mean;
    bool shares = false;
    uint parts = subpixel_count;
    if (interior) {
        mean = mean_surface(pixel);
        uvec2 texel = texelFetch(geometry, ivec2(pixel * SUBPIXELS), 0).xy;
        shares = !needs_subpixels(mean, materials[geometry_material(texel)]);
        parts = shares && !sources_vary(mean) ? 1 : subpixel_count;
    }
    vec3 sum = vec3(0.0);
    uint covered = 0;
    uint j = 0;
    do {
        uvec2 place = pixel * SUBPIXELS + uvec2(j % SUBPIXELS, j / SUBPIXELS);
        uvec2 texel = texelFetch(geometry, ivec2(place), 0).xy;
        if (is_covered(texel)) {
            ++covered;
            Material material = materials[geometry_material(texel)];
            Surface surface = mean;
            if (parts > 1) {
                surface = surface_of_subpixel(place, texel);
            }
            SourceSum of_sources = at_sources(surface, material);
            float weight = 1.0;
            uint set_count = 1;
            if (shares) {
                // None is mirrored near.
                of_sources.of_kernels = 0.0;
                surface = mean;
                weight = float(parts);
            } else {
                material.threads = material.subpixel_threads;
                set_count = material.threads.set_count;
            }
            if (!shares || j == 0) {
                sum += weight * estimate(surface, material, j % set_count, set_count, of_sources);
            }
            sum += (1.0 - of_sources.of_kernels) * of_sources.radiance;
        }
    } while (++j < parts);
    return vec4(max(sum, vec3(0.0)), float(covered)) / float(parts);
}
