// Sines and cosines as good as Vulkan lets them be.
#ifndef CIRCLE_GLSL
#define CIRCLE_GLSL

// The point of the unit circle at this part of a whole turn, 0 to 1. Vulkan bounds the error of sines and cosines only within half a turn of 0
// (Vulkan 1.3, "Precision and Operation of SPIR-V Instructions").
vec2 on_circle(float turn) {
    float from_opposite = radians(360.0) * (turn - 0.5);
    return -vec2(cos(from_opposite), sin(from_opposite));
}

// The sine of an angle from 0 to 45 degrees, to 1e-7 of it: GLSL's may err by 2^-11.
float acute_sine(float angle) {
    float square = angle * angle;
    return angle * (1.0 + square * (-1.0 / 6.0 + square * (1.0 / 120.0 + square * (-1.0 / 5040.0 + square / 362880.0))));
}

#endif
