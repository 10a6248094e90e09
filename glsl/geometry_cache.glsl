// What both stages of the geometry cache know of the object being drawn.

layout(push_constant) uniform Object {
    // Rows of what takes positions from the mesh's middle to world axes with the eye at the origin, in units of the scene's extent: far from
    // either origin, coordinates would not keep the precision.
    vec4 to_eye[3];
    // Unit vectors of the camera and what its image plane spans (right and up divided by the half-extents); w: the tangent at the mesh's middle
    // around the axis, its x, y and z.
    vec4 right_over_extent;
    vec4 up_over_extent;
    vec4 forward;
    // The axis that tangents go by, in object space; w: how, as below.
    vec4 tangent_axis;
    // Cosine and sine of the material's rotation, by which tangents are turned.
    vec2 tangent_turn;
    uint material;
    float near_plane;
} object;

// How tangents go by the axis of an object: not at all, since its material needs none; around it; along it; not by
// it but by the mesh's texture coordinates.
const float NO_TANGENT = 0.0;
const float TANGENT_AROUND = 1.0;
const float TANGENT_ALONG = 2.0;
const float TANGENT_OF_MESH = 3.0;

// Reversed, infinite projection: depth 1 at the near plane, 0 at infinity, so float precision is where it is needed.
vec4 project(vec3 from_eye) {
    return vec4(dot(object.right_over_extent.xyz, from_eye), -dot(object.up_over_extent.xyz, from_eye),
                object.near_plane, dot(object.forward.xyz, from_eye));
}
