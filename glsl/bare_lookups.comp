#version 450
// The floor of shading: as many trilinear lookups in the environment's pyramid as a method makes, and nothing else.

layout(local_size_x = 64) in;

layout(set = 0, binding = 0) uniform samplerCube environment_pyramid;
// Written, so that no compiler finds the lookups to be of no use.
layout(set = 0, binding = 1, std430) writeonly buffer Sums {
    vec4 sums[];
};

layout(push_constant) uniform Push {
    uint pixel_count;
    uint lookup_count; // of each pixel
    float level; // lookups are of this level and up to LEVELS beside it
} push;

// As far as levels of threads are apart: those of a glossy material go over four.
const float LEVELS = 2.0;

void main() {
    uint pixel = (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * gl_WorkGroupSize.x + gl_LocalInvocationID.x;
    if (pixel >= push.pixel_count) {
        return;
    }
    // As with threads, neighbouring pixels look in neighbouring directions, one pixel all around: by the golden angle about
    // an axis, which is another one for the next lookup.
    const float golden_angle = radians(137.50776);
    float turn = radians(360.0) * float(pixel) / float(push.pixel_count);
    vec3 direction = vec3(0.8 * cos(turn), 0.8 * sin(turn), 0.6);
    vec3 sum = vec3(0.0);
    uint k = 0;
    do {
        // From thread to thread in no order, from pixel to pixel gradually.
        float place = fract(0.618034 * float(k) + float(pixel) / float(push.pixel_count));
        float level = push.level + LEVELS * (abs(4.0 * place - 2.0) - 1.0);
        sum += textureLod(environment_pyramid, direction, level).rgb;
        vec2 turned = cos(golden_angle) * direction.xy + sin(golden_angle) * vec2(-direction.y, direction.x);
        direction = vec3(turned, direction.z).yzx;
    } while (++k < push.lookup_count);
    sums[pixel] = vec4(sum, 1.0);
}
