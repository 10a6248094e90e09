// The pinhole camera: from a position on the image to the direction through it.
// Twin: CameraRays::ray in src/passes/view.rs.

// Right and up are scaled by the half-extent of the image plane at distance 1 along forward.
struct Camera {
    vec4 right;
    vec4 up;
    vec4 forward;
};

// Direction from the eye through `position`, in [0, 1] from the top left corner; not normalised.
vec3 camera_ray(Camera camera, vec2 position) {
    vec2 offset = vec2(2.0, -2.0) * position + vec2(-1.0, 1.0);
    return camera.forward.xyz + offset.x * camera.right.xyz + offset.y * camera.up.xyz;
}
