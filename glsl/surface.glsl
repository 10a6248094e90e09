// A point to shade: its shading frame and view angle. Twin: Surface in src/shading/mod.rs.
#include "arc_tangent.glsl"
#include "tangent.glsl"

struct Surface {
    // Columns: x, the part of w_o orthogonal to n; y = z cross x; z = n. In the environment's coordinates.
    mat3 frame;
    // Towards the eye, unit, in the environment's coordinates.
    vec3 w_o;
    // Angle between the normal and w_o; above 90 degrees where an interpolated normal faces away.
    float theta_o;
    // Variance of the normal within the pixel along each axis, in rad^2, and a quarter of that of the view, where sub-pixels share one sum; else 0.
    float normal_variance;
    // Cosine and sine of phi_o, the azimuth of w_o from the tangent; (1, 0) where no material that is shaded needs it.
    vec2 phi_o;
};

// Below this, the rounding error of what of w_o is orthogonal to n, its direction means nothing; the frame may then turn freely about n:
// what is seen along n has no azimuth, and phi_o follows the frame.
const float LEAST_SIN_THETA_O = 1e-6;

// Tangents of unit length whose sum is shorter cancel each other: any will do.
const float LEAST_TANGENT = 1e-3;

// n and w_o are unit vectors.
Surface make_surface(vec3 n, vec3 w_o) {
    float cos_theta_o = dot(n, w_o);
    vec3 across = w_o - cos_theta_o * n;
    float sin_theta_o = length(across);
    vec3 x = sin_theta_o > LEAST_SIN_THETA_O ? across / sin_theta_o : any_tangent(n);
    Surface surface;
    surface.frame = mat3(x, cross(n, x), n);
    surface.w_o = w_o;
    surface.theta_o = angle_of(sin_theta_o, cos_theta_o, 1.0);
    surface.normal_variance = 0.0;
    surface.phi_o = vec2(1.0, 0.0);
    return surface;
}

// Turns the tangent of a surface to what of `tangent`, of any length, is in the tangent plane.
void set_tangent(inout Surface surface, vec3 tangent) {
    // The tangent's azimuth in the shading frame is -phi_o.
    vec2 along = vec2(dot(surface.frame[0], tangent), -dot(surface.frame[1], tangent));
    float size = length(along);
    surface.phi_o = size > LEAST_TANGENT ? along / size : vec2(1.0, 0.0);
}

// `w` of the shading frame, turned about z by an angle of this cosine and sine.
vec3 turned(vec3 w, vec2 angle) {
    return vec3(angle.x * w.x - angle.y * w.y, angle.y * w.x + angle.x * w.y, w.z);
}

// A frame at n that does not turn with w_o: its x is what is left of `axis` in the tangent plane.
mat3 fixed_frame(vec3 n, vec3 axis) {
    vec3 x = tangent_along(axis, n);
    return mat3(x, cross(n, x), n);
}

// Towards the eye in the shading frame, (sin theta_o, 0, cos theta_o). Interpolated normals may face away; cos_theta_o is
// held at that of 89.99 degrees or more, so that BRDFs stay defined: MAX_THETA_O_DEG in src/brdf/mod.rs.
const float LEAST_COS_THETA_O = 1.7453e-4;

vec3 view_direction(Surface surface) {
    float cos_theta_o = max(dot(surface.frame[2], surface.w_o), LEAST_COS_THETA_O);
    return normalize(vec3(dot(surface.frame[0], surface.w_o), 0.0, cos_theta_o));
}
