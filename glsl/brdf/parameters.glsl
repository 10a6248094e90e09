// Parameters of one material's BRDF, packed as `gpu_parameters` of its model in src/brdf/ says.
#ifndef BRDF_PARAMETERS_GLSL
#define BRDF_PARAMETERS_GLSL

struct BrdfParameters {
    vec4 a;
    vec4 b;
    vec4 c;
};

#endif
