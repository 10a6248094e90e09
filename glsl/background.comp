#version 450
// Puts the environment behind what the surface does not cover.
#extension GL_GOOGLE_include_directive : require
#include "bounded.glsl"
#include "camera.glsl"
#include "coverage.glsl"
#include "lat_long.glsl"

layout(local_size_x = TILE_SIDE, local_size_y = TILE_SIDE) in;

// Of pixels that see no surface at all, this pass writes the first value.
layout(set = 0, binding = 0, rgba32f) uniform image2D radiance;
layout(set = 0, binding = 2) uniform sampler2D environment_map;

layout(push_constant) uniform Push {
    Camera camera;
    uvec2 size_px;
    vec2 rotation;        // cosine and sine of the environment's rotation about +Y
    Region region;
    float radiance_scale; // radiance of a texel of value 1
} push;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(uvec2(pixel), push.size_px))) {
        return;
    }
    uvec4 of_tile = coverage_of_tile(push.region);
    if (sees_only_surface(of_tile, gl_LocalInvocationIndex)) {
        return;
    }
    vec4 surface = vec4(0.0);
    if (sees_surface(of_tile, gl_LocalInvocationIndex)) {
        surface = imageLoad(radiance, pixel);
    }
    vec3 d = normalize(camera_ray(push.camera, (vec2(pixel) + 0.5) / vec2(push.size_px)));
    vec2 place = lat_long(turned_back(push.rotation, d));
    vec3 behind = bounded(textureLod(environment_map, place, 0.0).rgb * push.radiance_scale);
    imageStore(radiance, pixel, vec4(bounded(surface.rgb + (1.0 - surface.a) * behind), 1.0));
}
