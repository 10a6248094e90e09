#version 450
// Makes pixels that see no surface black and transparent, where nothing is put behind the objects.
#extension GL_GOOGLE_include_directive : require
#include "tiles.glsl"

layout(local_size_x = TILE_SIDE, local_size_y = TILE_SIDE) in;

layout(set = 0, binding = 0, rgba32f) uniform writeonly image2D radiance;
layout(set = 0, binding = 1, std430) readonly buffer Coverage {
    uvec4 coverage[];
};

layout(push_constant) uniform Push {
    uvec2 size_px;
    Region region;
} push;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(uvec2(pixel), push.size_px))) {
        return;
    }
    uvec4 of_tile = uvec4(0);
    if (is_in_region(push.region, gl_WorkGroupID.xy)) {
        of_tile = coverage[gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x];
    }
    if (!sees_surface(of_tile, gl_LocalInvocationIndex)) {
        imageStore(radiance, pixel, vec4(0.0));
    }
}
