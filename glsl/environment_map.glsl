// The environment as it is: the lat-long map, bilinear between its pixel centres, wrapped in u and clamped in v.
// Twin: src/environment/light_map.rs.

// rgb: radiance; a: density over the unit square (u, v) with which light_sampling.glsl draws.
layout(set = 0, binding = 10) uniform texture2D environment_map;

// Solid angle per area of the unit square: dw = sin(theta) dtheta dphi = 2 pi^2 sin(theta) du dv.
float square_to_sr(vec3 d) {
    return 19.7392088 * length(d.xz);
}

// Radiance and density from the unit direction `d`. Bilinear by hand: samplers may round the position between texels to 1/256,
// and this needs no format that can be filtered.
vec4 environment_texel(vec3 d) {
    ivec2 size = textureSize(environment_map, 0);
    // From -z towards +x, and from +y. At the poles any phi will do, but atan(0, 0) is undefined.
    float sin_theta = length(d.xz);
    float phi = sin_theta > 0.0 ? atan(d.x, -d.z) : 0.0;
    float theta = atan(sin_theta, d.y);
    vec2 position = vec2(phi / radians(360.0), theta / radians(180.0)) * vec2(size) - 0.5;
    vec2 corner = floor(position);
    vec2 t = position - corner;
    // phi starts at -180 degrees: columns count from minus half a turn, at most one turn below 0.
    int left = (int(corner.x) + size.x) % size.x;
    int right = (left + 1) % size.x;
    int top = clamp(int(corner.y), 0, size.y - 1);
    int bottom = clamp(int(corner.y) + 1, 0, size.y - 1);
    vec4 above = mix(texelFetch(environment_map, ivec2(left, top), 0), texelFetch(environment_map, ivec2(right, top), 0), t.x);
    vec4 below = mix(texelFetch(environment_map, ivec2(left, bottom), 0), texelFetch(environment_map, ivec2(right, bottom), 0), t.x);
    return mix(above, below, t.y);
}

// The radiance alone; the method's one way to look the environment up without its density.
vec3 environment_radiance(vec3 d) {
    ++lookups;
    return environment_texel(d).rgb;
}
