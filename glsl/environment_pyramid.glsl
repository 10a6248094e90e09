// The environment's pyramid as the GPU holds it. Twin: src/environment/pyramid.rs.

layout(set = 0, binding = 4) uniform samplerCube environment_pyramid;

// Solid angle of a texel of a cube map with faces of face_size^2 texels, in the unit direction `d`.
float texel_solid_angle(float face_size, vec3 d) {
    vec3 a = abs(d);
    float m = max(a.x, max(a.y, a.z));
    return 4.0 / (face_size * face_size) * m * m * m;
}

// Level of the pyramid whose texels around `d` have this solid angle (Colbert and Krivanek 2007).
float level_of(float solid_angle_sr, float face_size, vec3 d) {
    return 0.5 * log2(solid_angle_sr / texel_solid_angle(face_size, d));
}
