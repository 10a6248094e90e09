// Angles in triangles. GLSL's arc tangent may err by 4096 units in the last place (Vulkan 1.3, "Precision and Operation of SPIR-V
// Instructions"), and handles cases that do not occur. `mix` and not `?:`, of which glslc makes branches: SwiftShader compiles those for
// minutes, where many are in line.
#ifndef ARC_TANGENT_GLSL
#define ARC_TANGENT_GLSL

const float HALF_PI = 1.57079633;

// atan(t) / t = A + B t^2 + C t^4 + ... to 2e-8 of it, up to tan(22.5 degrees).
const float ARC_TANGENT_A = 0.99999998;
const float ARC_TANGENT_B = -0.33332808;
const float ARC_TANGENT_C = 0.1997473;
const float ARC_TANGENT_D = -0.13854501;
const float ARC_TANGENT_E = 0.0799375;

// The angle in [0, 90 degrees] of tangent y / x, neither negative, in a triangle of this hypotenuse; 0 if all are 0. Twin of that name in
// src/brdf/models/merl.rs. An arc tangent, since cosines have no digits left near 0.
float acute_angle(float y, float x, float hypotenuse) {
    // tan(a / 2) = sin a / (1 + cos a): at most tan(22.5 degrees). The smallest normal number stands in for 0, to divide by.
    float tangent = min(y, x) / max(max(y, x) + hypotenuse, 1.2e-38);
    float square = tangent * tangent;
    float series = ARC_TANGENT_E;
    series = series * square + ARC_TANGENT_D;
    series = series * square + ARC_TANGENT_C;
    series = series * square + ARC_TANGENT_B;
    series = series * square + ARC_TANGENT_A;
    float angle = 2.0 * tangent * series;
    return mix(angle, HALF_PI - angle, y > x);
}

// The same in [0, 180 degrees], of x of either sign: atan2 in Rust, which errs by a unit in the last place.
float angle_of(float y, float x, float hypotenuse) {
    float angle = acute_angle(y, abs(x), hypotenuse);
    return mix(angle, 2.0 * HALF_PI - angle, x < 0.0);
}

// The same in [-180, 180 degrees], of y of either sign, too; 0 if all are 0.
float azimuth_of(float y, float x, float hypotenuse) {
    float angle = angle_of(abs(y), x, hypotenuse);
    return mix(angle, -angle, y < 0.0);
}

#endif
