// The environment as it is: the lat-long map, bilinear between its pixel centres, wrapped in u and clamped in v.
// Twin: src/environment/light_map.rs.
#include "lat_long.glsl"

// rgb: radiance; a: what the method wants to know of it besides. For light_sampling.glsl the density over the unit square (u, v)
// with which it draws, for vmf_pyramid.glsl whether the pixel is of a small source.
layout(set = 0, binding = 10) uniform texture2D environment_map;

// Solid angle per area of the unit square: dw = sin(theta) dtheta dphi = 2 pi^2 sin(theta) du dv.
float square_to_sr(vec3 d) {
    return 19.7392088 * length(d.xz);
}

// The four pixels around a direction, and its place between them.
struct Corners {
    int left;
    int right;
    int top;
    int bottom;
    vec2 t;
};

Corners environment_corners(vec3 d) {
    ivec2 size = textureSize(environment_map, 0);
    vec2 position = lat_long(d) * vec2(size) - 0.5;
    vec2 corner = floor(position);
    // phi starts at -180 degrees: columns count from minus half a turn, at most one turn below 0.
    int left = (int(corner.x) + size.x) % size.x;
    int right = (left + 1) % size.x;
    int top = clamp(int(corner.y), 0, size.y - 1);
    int bottom = clamp(int(corner.y) + 1, 0, size.y - 1);
    return Corners(left, right, top, bottom, position - corner);
}

// Radiance and alpha from the unit direction `d`. Bilinear by hand: samplers may round the position between texels to 1/256,
// and this needs no format that can be filtered.
vec4 environment_texel(vec3 d) {
    Corners c = environment_corners(d);
    vec4 above = mix(texelFetch(environment_map, ivec2(c.left, c.top), 0), texelFetch(environment_map, ivec2(c.right, c.top), 0), c.t.x);
    vec4 below = mix(texelFetch(environment_map, ivec2(c.left, c.bottom), 0), texelFetch(environment_map, ivec2(c.right, c.bottom), 0), c.t.x);
    return mix(above, below, c.t.y);
}

// The radiance alone; the method's one way to look the environment up without its density.
vec3 environment_radiance(vec3 d) {
    ++lookups;
    return environment_texel(d).rgb;
}
