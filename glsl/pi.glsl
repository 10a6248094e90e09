// What GLSL has no name for.
#ifndef PI_GLSL
#define PI_GLSL
const float INVERSE_PI = 0.318309886;
#endif
