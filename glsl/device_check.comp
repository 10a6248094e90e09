#version 450
// Does once what shading relies on, so that what the device answers can be compared with what Vulkan promises.
// Twin: src/device_check.rs.

layout(local_size_x = 64) in;

layout(set = 0, binding = 0) uniform samplerCube cube;
layout(set = 0, binding = 1) uniform samplerCube wide_cube;
layout(set = 0, binding = 2) uniform sampler3D volume;

layout(set = 0, binding = 3, std430) readonly buffer Questions {
    vec4 questions[]; // xyz: direction or coordinates, w: level; xy: the bits of two half floats each
};
layout(set = 0, binding = 4, std430) writeonly buffer Answers {
    vec4 answers[];
};
// Of the question with index i, i + 1 is counted.
layout(set = 0, binding = 5, std430) buffer Counts {
    uint total;
    uint largest;
    uint taken;
    uint order[]; // each index once, as they come
} counts;

layout(push_constant) uniform Push {
    // Where the questions of each kind end.
    uint cube_end;
    uint wide_cube_end;
    uint volume_end;
    uint half_end;
} push;

shared uint group_total;

void main() {
    uint i = gl_GlobalInvocationID.x;
    bool is_asked = i < push.half_end;
    if (gl_LocalInvocationIndex == 0) {
        group_total = 0;
    }
    barrier();
    if (is_asked) {
        vec4 question = questions[i];
        if (i < push.cube_end) {
            answers[i] = textureLod(cube, question.xyz, question.w);
        } else if (i < push.wide_cube_end) {
            answers[i] = textureLod(wide_cube, question.xyz, question.w);
        } else if (i < push.volume_end) {
            answers[i] = textureLod(volume, question.xyz, 0.0);
        } else {
            uvec2 bits = floatBitsToUint(question.xy);
            answers[i] = vec4(unpackHalf2x16(bits.x), unpackHalf2x16(bits.y));
        }
        atomicAdd(group_total, i + 1);
        atomicMax(counts.largest, i + 1);
        counts.order[atomicAdd(counts.taken, 1)] = i;
    }
    barrier();
    if (gl_LocalInvocationIndex == 0) {
        atomicAdd(counts.total, group_total);
    }
}
