// Spherical Gaussians fitted to the BRDF itself (Green, Kautz and Durand 2007): looked up as fitted threads are, which are fitted to the
// BRDF's answers to lights. Twin: src/shading/gaussian.rs.
#include "methods/fitted.glsl"
