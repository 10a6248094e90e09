// The environment's pyramid as the GPU holds it. Twin: src/environment/pyramid.rs.

#include "cube.glsl"

layout(set = 0, binding = 4) uniform samplerCube environment_pyramid;

// Level of the pyramid whose texels around `d` have this solid angle (Colbert and Krivanek 2007).
float level_of(float solid_angle_sr, float face_size, vec3 d) {
    return 0.5 * log2(solid_angle_sr / texel_solid_angle(face_size, d));
}
