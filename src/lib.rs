//! Threadlight: measured and analytic BRDFs under HDR environment light, in real time and without noise.
#![warn(clippy::all)]

pub mod brdf;
pub mod environment;
pub mod error;
pub mod graph;
pub mod output;
pub mod scene;
pub mod threads;
#[allow(unsafe_code)]
pub mod vulkan;

pub use error::{Error, Result};
