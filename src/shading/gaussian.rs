//! Spherical Gaussians fitted to the BRDF itself, looked up as fitted threads are. Twin of glsl/methods/gaussian.glsl.
pub(super) use super::fitted::estimate;
