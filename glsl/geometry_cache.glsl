// What both stages of the geometry cache know of the object being drawn.

layout(push_constant) uniform Object {
    // Rows of what takes positions from the mesh's middle to world axes, in units of the scene's extent; w: the tangent at the mesh's middle
    // around the axis, its x, y and z.
    vec4 to_world[3];
    // Rows of what takes positions from the mesh's middle to clip space, in the same units: from far away or through a narrow camera,
    // coordinates from the eye would not keep the precision of what they differ by on the picture.
    vec4 clip_x;
    vec4 clip_y;
    vec4 clip_w;
    // The axis that tangents go by, in object space.
    vec3 tangent_axis;
    // Four half floats. The first three: the vector to the mesh's middle from the point of its bounding sphere that is nearest to the eye, in world
    // axes and the same units. Positions are interpolated from there, so that those near the eye are small numbers. The last: how tangents
    // go by the axis, as below.
    uint to_middle_xy;
    uint to_middle_z_and_rule;
    // Cosine and sine of the material's rotation, by which tangents are turned, in 2 x 16 bits.
    uint tangent_turn;
    uint material;
    // From the mesh's middle to the far plane, along the view.
    float far_plane;
} object;

// Distance of the near plane in units of the extent of what may be seen: with reversed depth it costs no precision to keep it nearer than any
// surface that a camera outside of the scene sees.
const float NEAR_PLANE = 1e-6;

vec3 to_middle() {
    return vec3(unpackHalf2x16(object.to_middle_xy), unpackHalf2x16(object.to_middle_z_and_rule).x);
}

float tangent_rule() {
    return unpackHalf2x16(object.to_middle_z_and_rule).y;
}

// How tangents go by the axis of an object: not at all, since its material needs none; around it; along it; not by
// it but by the mesh's texture coordinates.
const float NO_TANGENT = 0.0;
const float TANGENT_AROUND = 1.0;
const float TANGENT_ALONG = 2.0;
const float TANGENT_OF_MESH = 3.0;

// Reversed projection: depth 1 at the near plane, 0 at the far plane, so float precision is where it is needed. The far plane is just behind
// all that may be seen, and what is left to it is not taken from w: from far away, w would not keep it.
vec4 project(vec3 position) {
    vec4 at = vec4(position, 1.0);
    float along_view = dot(object.clip_w.xyz, position); // from the mesh's middle
    return vec4(dot(object.clip_x, at), dot(object.clip_y, at), NEAR_PLANE * (object.far_plane - along_view),
                object.clip_w.w + along_view);
}
