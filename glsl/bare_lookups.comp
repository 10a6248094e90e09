#version 450
// The floor of shading: as many trilinear lookups in the environment's pyramid as a method makes, and nothing else.
#extension GL_GOOGLE_include_directive : require
#include "circle.glsl"

layout(local_size_x = 64) in;

layout(set = 0, binding = 0) uniform samplerCube environment_pyramid;
// Written, so that no compiler finds the lookups to be of no use.
layout(set = 0, binding = 1, std430) writeonly buffer Sums {
    vec4 sums[];
};
// Rows of `lookup_count` lookups: direction, z up, and level.
layout(set = 0, binding = 2, std430) readonly buffer Lookups {
    vec4 lookups[];
};

layout(push_constant) uniform Push {
    uint pixel_count;
    uint lookup_count; // of each pixel
    uint row_count;
    uint sum_mask; // all ones, or one less than how many sums there is room for
} push;

void main() {
    uint group = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    uint pixel = group * gl_WorkGroupSize.x + gl_LocalInvocationID.x;
    if (pixel >= push.pixel_count) {
        return;
    }
    // Pixels that are near each other see a surface from about the same angle, in one row. Rows follow each other from the first to the last.
    uint group_count = (push.pixel_count - 1) / gl_WorkGroupSize.x + 1;
    uint row = uint(float(group) / float(group_count) * float(push.row_count));
    // With rows they are points of a spiral over the hemisphere, which are as far from each other along it as across it.
    float turns = sqrt(float(push.pixel_count) / radians(360.0));
    vec2 turn = on_circle(fract(turns * (float(pixel) / float(push.pixel_count))));
    mat2 turned = mat2(turn.x, turn.y, -turn.y, turn.x);
    vec3 sum = vec3(0.0);
    uint k = 0;
    do {
        vec4 lookup = lookups[row * push.lookup_count + k];
        sum += textureLod(environment_pyramid, vec3(turned * lookup.xy, lookup.z), lookup.w).rgb;
    } while (++k < push.lookup_count);
    sums[pixel & push.sum_mask] = vec4(sum, 1.0);
}
