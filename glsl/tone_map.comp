#version 450
// Linear radiance to display values: clamp(exposure L, 0, 1)^(1/gamma). Twin: display_value in src/shading/mod.rs.

#extension GL_GOOGLE_include_directive : require
#include "bounded.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

layout(set = 0, binding = 0, rgba32f) uniform readonly image2D radiance;
layout(set = 0, binding = 1, rgba8) uniform writeonly image2D display;

layout(push_constant) uniform Push {
    uvec2 size_px;
    float exposure;
    float inverse_gamma;
} push;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(uvec2(pixel), push.size_px))) {
        return;
    }
    vec4 linear = imageLoad(radiance, pixel);
    // Radiance comes multiplied by coverage; display files hold colour and coverage apart.
    vec3 color = linear.a > 0.0 ? bounded(linear.rgb / linear.a) : vec3(0.0);
    imageStore(display, pixel, vec4(pow(clamp(push.exposure * color, 0.0, 1.0), vec3(push.inverse_gamma)), linear.a));
}
