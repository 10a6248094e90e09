// The cube map: directions of its texels, after the table in the Vulkan specification. Twin: src/environment/cube.rs.

// The point (s, t), each 0 to 1, on the plane of `face` at distance 1 from the origin.
vec3 cube_point(uint face, vec2 st) {
    vec2 p = 2.0 * st - 1.0;
    switch (face) {
    case 0: return vec3(1.0, -p.y, -p.x);
    case 1: return vec3(-1.0, -p.y, p.x);
    case 2: return vec3(p.x, 1.0, p.y);
    case 3: return vec3(p.x, -1.0, -p.y);
    case 4: return vec3(p.x, -p.y, 1.0);
    default: return vec3(-p.x, -p.y, -1.0);
    }
}

// The coordinates of `d` along the axes of s and t and the face's own.
vec3 cube_coordinates(uint face, vec3 d) {
    switch (face) {
    case 0: return vec3(-d.z, -d.y, d.x);
    case 1: return vec3(d.z, -d.y, -d.x);
    case 2: return vec3(d.x, d.z, d.y);
    case 3: return vec3(d.x, -d.z, -d.y);
    case 4: return vec3(d.x, -d.y, d.z);
    default: return vec3(-d.x, -d.y, -d.z);
    }
}

// Solid angle of a texel of a cube map with faces of face_size^2 texels, in the unit direction `d`.
float texel_solid_angle(float face_size, vec3 d) {
    vec3 a = abs(d);
    float m = max(a.x, max(a.y, a.z));
    return 4.0 / (face_size * face_size) * m * m * m;
}
