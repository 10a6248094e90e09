//! Threadlight renders measured and analytic BRDFs under HDR environment light, in real time and without noise, on Vulkan.
//!
//! It implements Kim, Kyung and Lee, "Sample thread based real-time BRDF rendering" (2010). Outgoing radiance under distant
//! light, without occlusion or interreflection, is the integral over the hemisphere
//!
//! ```text
//! L_o(w_o) = integral f(w_i, w_o) L_i(w_i) (n . w_i) dw_i                                        (1)
//! ```
//!
//! For each BRDF a few *sample threads* are made beforehand: incident directions that move continuously with the view angle
//! theta_o, each with its pdf. Neighbouring pixels then have neighbouring samples, so there is no noise to be seen, and each
//! sample looks up an environment that was filtered to the sample's share of the hemisphere.
//!
//! ```text
//! scene ──> prepare ──> threads, environment pyramid, meshes                               once, on the CPU
//!                          │
//!                          v
//!            geometry_cache ─> classify ─> shade ─> background ─> tone_map ─> PNG          each frame, on the GPU
//!                                                      │              └─────> present ─> ui ─> window
//!                                                      └──────────────────────> EXR
//! ```
//!
//! | the paper | here |
//! |---|---|
//! | 3.1, equation (2): the estimate | `glsl/methods/paper.glsl`, twin in [`shading`] |
//! | 3.2, equations (4) to (6): pdf and cones | [`threads::slice`], [`threads::cones`] |
//! | 3.2.1, equations (8) to (10): forces | [`threads::forces`] |
//! | 3.2.2, 3.2.3: smoothing and peaks | [`threads::smoothing`], [`threads::peaks`] |
//! | 4.1: geometry cache at sub-pixel resolution | [`passes::geometry_cache`] |
//! | 4.2: each sub-pixel evaluates its partition of the threads | [`passes::shade`], `glsl/shade.comp` |
//! | beyond it: fitted threads | [`threads::fitted`], `glsl/methods/fitted.glsl` |
//! | tables 1 to 4, figures 10 to 13: how fast, how wrong | [`evaluate`] |
//!
//! Dependencies run downwards: `view` (the interactive viewer), then `pipeline` and [`prepare`], then [`passes`], then [`graph`]
//! (which passes run, in which order, with which barriers, in which memory, and what is kept between frames) and [`vulkan`] (the
//! only `unsafe` code) on one side, [`scene`], [`environment`], [`threads`] and [`brdf`] on the other. The method on one screen
//! is `declare` in `pipeline.rs`.
//!
//! The [`guide`] has all of it at length: usage, every equation, architecture, results, limits.

pub mod brdf;
pub mod environment;
pub mod error;
pub mod evaluate;
pub mod file_format;
pub mod geometry_texel;
pub mod graph;
pub mod guide;
pub mod light;
pub mod memo;
pub mod method;
pub mod output;
pub mod packing;
pub mod passes;
pub mod pipeline;
pub mod prepare;
pub mod progress;
pub mod scene;
pub mod shading;
pub mod steps;
pub mod threads;
#[cfg(feature = "viewer")]
pub mod viewer;
#[allow(unsafe_code)]
pub mod vulkan;

pub use error::{Error, Result};
