// What both stages of the geometry cache know of the object being drawn.

layout(push_constant) uniform Object {
    // Object space to world axes with the eye at the origin (the eye's own coordinates keep the precision), in units of
    // the scene's extent.
    mat4x3 to_eye;
    // Unit vectors of the camera and what its image plane spans (right and up divided by the half-extents).
    vec4 right_over_extent; // w: unused
    vec4 up_over_extent;    // w: unused
    vec4 forward;           // w: near plane
    uint material;
} object;

// Reversed, infinite projection: depth 1 at the near plane, 0 at infinity, so float precision is where it is needed.
vec4 project(vec3 from_eye) {
    return vec4(dot(object.right_over_extent.xyz, from_eye), -dot(object.up_over_extent.xyz, from_eye),
                object.forward.w, dot(object.forward.xyz, from_eye));
}
