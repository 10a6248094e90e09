// The environment blurred by von Mises-Fisher kernels, as the GPU holds it. Twin: src/environment/vmf_pyramid.rs.

layout(set = 0, binding = 4) uniform samplerCube environment_pyramid;
layout(set = 0, binding = 13) uniform samplerCube irradiance_map;

// Width of the kernel of level 0, in radians, and its faces: FINEST_WIDTH_RAD in src/threads/fitted/kernel.rs.
const float FINEST_WIDTH_RAD = 1.0 / 256.0;
const float FINEST_FACE_SIZE = 1024.0;

// The level that is level 0 of a pyramid with faces of this size.
float finest_level(float face_size) {
    return log2(FINEST_FACE_SIZE / face_size);
}

// The level of a kernel that is blurred by normals of this variance along each axis, in rad^2: mirrored directions turn
// twice as far, and variances add up.
float level_within_pixel(float level, float normal_variance) {
    float width = FINEST_WIDTH_RAD * exp2(level);
    return level + 0.5 * log2(1.0 + 4.0 * normal_variance / (width * width));
}
