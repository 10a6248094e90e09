#version 450
// Pass 1 of the paper (section 4.1): the normal and material of every sub-pixel, and the tangent where the material needs one.
#extension GL_GOOGLE_include_directive : require
#include "geometry_cache.glsl"
#include "has_tangents.glsl" // whether a material of the scene needs them
#include "geometry_texel.glsl"

layout(location = 0) in vec3 world_position;
layout(location = 1) in vec3 world_normal;
#if HAS_TANGENTS
layout(location = 2) in vec3 world_tangent;
#endif

layout(location = 0) out uvec2 geometry;

// The triangle's own normal, of any length: towards the eye, whatever the winding, since x of the picture is to the right and y is down.
vec3 facet_normal_to_eye() {
    // What is linear on the picture goes on beyond the horizon of the triangle's plane, where a neighbouring pixel may be; positions do not.
    float over_w = gl_FragCoord.w;
    vec3 position_over_w = world_position * over_w;
    vec3 to_right = dFdx(position_over_w) - dFdx(over_w) * world_position;
    vec3 down = dFdy(position_over_w) - dFdy(over_w) * world_position;
    return cross(down, to_right);
}

void main() {
    vec3 facet_normal = facet_normal_to_eye();
    vec3 normal = world_normal;
    // Interpolated normals that cancel out leave nothing to normalise: the facet's normal stands in. 1e-20 is far
    // below any sum of unit vectors that is not a cancellation, and its square root is still a normal float.
    if (dot(normal, normal) < 1e-20) {
        // Divided by its largest component: through a narrow camera it is so short that a float would not hold its square.
        vec3 size = abs(facet_normal);
        normal = facet_normal / max(max(size.x, size.y), size.z);
    }
    // Both sides of a surface shade alike.
    if (dot(normal, facet_normal) < 0.0) {
        normal = -normal;
    }
    normal = normalize(normal);
    geometry = pack_geometry(normal, object.material);
#if HAS_TANGENTS
    if (tangent_rule() != NO_TANGENT) {
        vec3 tangent = tangent_along(world_tangent, normal);
        geometry = with_tangent(geometry, turned_tangent(tangent, normal, unpackSnorm2x16(object.tangent_turn)));
    }
#endif
}
