#version 450
// Makes pixels that see no surface black and transparent, where nothing is put behind the objects.
#extension GL_GOOGLE_include_directive : require
#include "coverage.glsl"

layout(local_size_x = TILE_SIDE, local_size_y = TILE_SIDE) in;

layout(set = 0, binding = 0, rgba32f) uniform writeonly image2D radiance;

layout(push_constant) uniform Push {
    uvec2 size_px;
    Region region;
} push;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(uvec2(pixel), push.size_px))) {
        return;
    }
    if (!sees_surface(coverage_of_tile(push.region), gl_LocalInvocationIndex)) {
        imageStore(radiance, pixel, vec4(0.0));
    }
}
