#version 450
// Puts the environment behind what the surface does not cover.
#extension GL_GOOGLE_include_directive : require
#include "bounded.glsl"
#include "camera.glsl"

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
    d = vec3(push.rotation.x * d.x - push.rotation.y * d.z, d.y, push.rotation.y * d.x + push.rotation.x * d.z);
    // Lat-long: phi from -z towards +x, theta from +y. At the poles any phi will do, but atan(0, 0) is undefined.
    float phi = abs(d.x) + abs(d.z) > 0.0 ? atan(d.x, -d.z) : 0.0;
    vec2 uv = vec2(phi / radians(360.0), acos(clamp(d.y, -1.0, 1.0)) / radians(180.0));
    vec3 behind = bounded(textureLod(environment_map, uv, 0.0).rgb * push.radiance_scale);
    imageStore(radiance, pixel, vec4(bounded(surface.rgb + (1.0 - surface.a) * behind), 1.0));
}
