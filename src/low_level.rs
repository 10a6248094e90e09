//! All of Threadlight, for programs that want more than [`Renderer`](crate::Renderer): each method, pass and measurement by itself.
//!
//! What is here changes from version to version. The guide's [architecture](crate::guide::architecture) says what is where.
#[path = "brdf/mod.rs"]
pub mod brdf;
#[path = "environment/mod.rs"]
pub mod environment;
#[path = "evaluate/mod.rs"]
pub mod evaluate;
#[path = "file_format.rs"]
pub mod file_format;
#[path = "geometry_texel.rs"]
pub mod geometry_texel;
#[path = "graph/mod.rs"]
pub mod graph;
#[path = "light.rs"]
pub mod light;
#[path = "memo/mod.rs"]
pub mod memo;
#[path = "method.rs"]
pub mod method;
#[path = "output/mod.rs"]
pub mod output;
#[path = "packing.rs"]
pub mod packing;
#[path = "passes/mod.rs"]
pub mod passes;
#[path = "pipeline.rs"]
pub mod pipeline;
#[path = "prepare.rs"]
pub mod prepare;
#[path = "progress.rs"]
pub mod progress;
#[path = "scene/mod.rs"]
pub mod scene;
#[path = "shading/mod.rs"]
pub mod shading;
#[path = "steps/mod.rs"]
pub mod steps;
#[path = "threads/mod.rs"]
pub mod threads;
#[cfg(feature = "viewer")]
#[path = "viewer/mod.rs"]
pub mod viewer;
#[allow(unsafe_code)]
#[path = "vulkan/mod.rs"]
pub mod vulkan;
