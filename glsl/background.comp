#version 450
// Puts the environment behind what the surface does not cover.
#extension GL_GOOGLE_include_directive : require
#include "bounded.glsl"
#include "camera.glsl"
#include "lat_long.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 0, binding = 0, rgba32f) uniform image2D radiance;
layout(set = 0, binding = 1) uniform sampler2D environment_map;

layout(push_constant) uniform Push {
    Camera camera;
    uvec2 size_px;
    vec2 rotation;        // cosine and sine of the environment's rotation about +Y
    float radiance_scale; // radiance of a texel of value 1
} push;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(uvec2(pixel), push.size_px))) {
        return;
    }
    vec4 surface = imageLoad(radiance, pixel);
    if (surface.a >= 1.0) {
        return;
    }
    vec3 d = normalize(camera_ray(push.camera, (vec2(pixel) + 0.5) / vec2(push.size_px)));
    vec2 place = lat_long(turned_back(push.rotation, d));
    vec3 behind = bounded(textureLod(environment_map, place, 0.0).rgb * push.radiance_scale);
    imageStore(radiance, pixel, vec4(bounded(surface.rgb + (1.0 - surface.a) * behind), 1.0));
}
