//! The numbers of the shaders that Rust needs, too: each stands in `glsl`, with its reason, and build.rs reads it there.
#![allow(dead_code, missing_docs, clippy::approx_constant, clippy::excessive_precision)]

include!(concat!(env!("OUT_DIR"), "/shader_constants.rs"));
