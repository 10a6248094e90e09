// Directions in proportion to the environment's light (Agarwal et al. 2003 in spirit; as in pbrt, by pixels of the map): a pixel
// by luminance times solid angle, then a point under its bilinear weight. Summed over pixels the density is then itself
// bilinear: exactly the alpha channel of the map, which is zero only where the light is.
// Twin: src/shading/light_sampling.rs.
#include "circle.glsl"
#include "environment_map.glsl"

// Walker's alias table over the pixels, as built by Vose (1991).
struct Alias {
    uint threshold; // of 2^32: stay with the pixel below it
    uint other;
};

layout(set = 0, binding = 11, std430) readonly buffer LightAliases {
    Alias light_aliases[];
};

// A number in (-1, 1) with density 1 - |x|, from one in [0, 1).
float tent(float u) {
    return mix(1.0 - sqrt(2.0 - 2.0 * u), sqrt(2.0 * u) - 1.0, u < 0.5);
}

// A direction; its density is light_pdf of what the map holds there.
vec3 sample_light(uvec4 bits) {
    ivec2 size = textureSize(environment_map, 0);
    uint pixel, unused;
    umulExtended(bits.x, uint(size.x * size.y), pixel, unused);
    Alias alias = light_aliases[pixel];
    pixel = bits.y < alias.threshold ? pixel : alias.other;
    vec4 u = to_unit(bits);
    float x = (float(pixel % uint(size.x)) + 0.5 + tent(u.z)) / float(size.x);
    // Beyond the poles the pixel's row is clamped; folding the tent back there gives just that weight.
    float y = abs(float(pixel / uint(size.x)) + 0.5 + tent(u.w)) / float(size.y);
    y = y > 1.0 ? 2.0 - y : y;
    // Half a pixel beyond the seam is on the other side of it.
    vec2 around = on_circle(fract(x));
    float theta = radians(180.0) * y;
    return vec3(sin(theta) * around.y, cos(theta), -sin(theta) * around.x);
}

// Density in 1/sr of sample_light at `d`, where the map holds `texel`. Within 1e-7 rad of a pole it would have no bound.
float light_pdf(vec4 texel, vec3 d) {
    return texel.a / max(square_to_sr(d), 2e-6);
}
