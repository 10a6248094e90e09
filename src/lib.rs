//! Threadlight: measured and analytic BRDFs under HDR environment light, in real time and without noise.
#![warn(clippy::all)]

pub mod brdf;
pub mod environment;
pub mod error;
pub mod evaluate;
pub mod graph;
pub mod method;
pub mod output;
pub mod passes;
pub mod pipeline;
pub mod prepare;
pub mod scene;
pub mod shading;
pub mod threads;
#[allow(unsafe_code)]
pub mod vulkan;

pub use error::{Error, Result};
