// log(1 - x) of 0 <= x < 1, by its series where 1 - x would round away what a large exponent multiplies; elsewhere it is `direct`.
#ifndef LOG_ONE_MINUS_GLSL
#define LOG_ONE_MINUS_GLSL
float log_one_minus(float x, float direct) {
    return x < 1e-2 ? -x * (1.0 + x * (0.5 + x * (1.0 / 3.0 + x * 0.25))) : direct;
}
#endif
