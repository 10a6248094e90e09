// For methods that divide their samples among the sub-pixels of a pixel that lies on one smooth surface, as the paper does with its
// threads (section 4.2). Of another pixel, each covered sub-pixel takes all samples. Twin: shade_partition in src/shading/mod.rs.
#include "normal_variance.glsl"

// The sum over samples first, first + stride, ... of weight times environment.
vec3 estimate(Surface surface, Material material, uint first, uint stride);

vec4 shade_pixel(uvec2 pixel, bool interior) {
    const uint subpixel_count = SUBPIXELS * SUBPIXELS;
    float variance = 0.0;
    if (interior) {
        NormalMoments normals = normal_moments(geometry_normal(texelFetch(geometry, ivec2(pixel * SUBPIXELS), 0).xy));
        for (uint j = 1; j < subpixel_count; ++j) {
            uvec2 place = pixel * SUBPIXELS + uvec2(j % SUBPIXELS, j / SUBPIXELS);
            add_normal(normals, geometry_normal(texelFetch(geometry, ivec2(place), 0).xy));
        }
        variance = normal_variance(normals, subpixel_count);
    }
    uint stride = interior ? subpixel_count : 1;
    vec3 sum = vec3(0.0);
    uint covered = 0;
    for (uint j = 0; j < subpixel_count; ++j) {
        subpixel = pixel * SUBPIXELS + uvec2(j % SUBPIXELS, j / SUBPIXELS);
        uvec2 texel = texelFetch(geometry, ivec2(subpixel), 0).xy;
        if (is_covered(texel)) {
            ++covered;
            Surface surface = surface_of_subpixel(subpixel, texel);
            surface.normal_variance = variance;
            sum += estimate(surface, material_of(texel), interior ? j : 0, stride);
        }
    }
    return vec4(interior ? sum : sum / float(subpixel_count), float(covered) / float(subpixel_count));
}
