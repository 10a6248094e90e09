#version 450
// Pass 1 of the paper (section 4.1): where the surface is.
#extension GL_GOOGLE_include_directive : require
#include "geometry_cache.glsl"
#include "has_tangents.glsl" // whether a material of the scene needs them

layout(location = 0) in vec3 position; // from the mesh's middle
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 tangent; // of texture coordinates; the normal of a mesh that has none

layout(location = 0) out vec3 world_position; // from near the eye
layout(location = 1) out vec3 world_normal;
#if HAS_TANGENTS
layout(location = 2) out vec3 world_tangent; // of any length
#endif

void main() {
    mat3 linear_part = transpose(mat3(object.to_world[0].xyz, object.to_world[1].xyz, object.to_world[2].xyz));
    world_position = linear_part * position + to_middle();
    // Cofactors of the linear part: the normal matrix up to scale, right for mirrored and sheared objects too.
    // Taken relative to the largest entry, since squares of any could leave the range of floats.
    vec3 largest = max(max(abs(linear_part[0]), abs(linear_part[1])), abs(linear_part[2]));
    linear_part /= max(max(largest.x, largest.y), largest.z);
    mat3 cofactors = mat3(cross(linear_part[1], linear_part[2]), cross(linear_part[2], linear_part[0]),
                          cross(linear_part[0], linear_part[1]));
    world_normal = cofactors * normal;
#if HAS_TANGENTS
    // Both are linear in the position, so what is interpolated is right within a triangle too.
    vec3 axis = object.tangent_axis;
    vec3 at_middle = vec3(object.to_world[0].w, object.to_world[1].w, object.to_world[2].w);
    vec3 along = tangent_rule() == TANGENT_AROUND ? at_middle + cross(axis, position) : axis;
    world_tangent = linear_part * (tangent_rule() == TANGENT_OF_MESH ? tangent : along);
#endif
    gl_Position = project(position);
}
