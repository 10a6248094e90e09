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
//! sample looks up an environment that was filtered to the sample's share of the hemisphere. By default threads are *fitted*: each
//! has a direction, the width of a blur and a colour, found such that their sum answers any light as the BRDF does.
//!
//! ```text
//! scene ──> prepare ──> threads, environment pyramid, meshes                               once, beforehand
//!                          │
//!                          v
//!            geometry_cache ─> classify ─> shade ─> background ─> tone_map ─> PNG          each frame, on the GPU
//!                                                      │              └─────> present ─> ui ─> window
//!                                                      └──────────────────────> EXR
//! ```
//!
//! A program renders in a few lines:
//!
//! ```no_run
//! use threadlight::{Renderer, Scene};
//!
//! let scene = Scene::default().with_material("silver").with_environment("sun");
//! let picture = Renderer::new()?.render(&scene)?;
//! picture.save("silver.png")?;
//! # Ok::<(), threadlight::Error>(())
//! ```
//!
//! Custom BRDFs are types that implement [`CustomBrdf`]; [`CustomEnvironment`] and [`CustomMesh`] are light and meshes from memory. The
//! [`guide`] has all of it at length: usage, every equation with the function that holds it, architecture, results, limits. [`low_level`] is
//! the rest of the program, part by part.
//!
//! The frame on one screen is `declare` in `src/pipeline.rs`.

mod error;
mod facade;
#[cfg(test)]
mod farthest;
pub mod guide;
pub mod low_level;

pub use brdf::{Brdf, Custom, CustomBrdf};
pub use environment::{CustomEnvironment, Environment};
pub use error::{Error, Result};
pub use facade::{Picture, Renderer};
pub use method::{Method, Pattern};
pub use progress::Observer;
pub use scene::{
    Background, Camera, CustomMesh, EnvironmentSettings, EnvironmentSource, ImageSettings, MaterialSettings,
    MaterialSource, MeshSource, ObjectSettings, Scene, ShadingSettings, Source, TangentRule,
};
pub use threads::Threads;

/// The crate of vectors in what is public, in the version that it is of.
pub use glam;
/// The crate of TOML in what is public, in the version that it is of.
pub use toml;

use low_level::*;
