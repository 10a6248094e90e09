//! Linear radiance to 8-bit display values: exposure, clamp, gamma.
use super::View;
use crate::Result;
use crate::graph::{FrameGraph, ImageDesc, ImageHandle};
use crate::vulkan::{ComputePipeline, Device, PipelineCache, compiled};
use ash::vk;
use bytemuck::{Pod, Zeroable};
use std::sync::Arc;

/// What the pass is made of.
pub struct ToneMap {
    pipeline: ComputePipeline,
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Push {
    size_px: [u32; 2],
    exposure: f32,
    inverse_gamma: f32,
}

impl ToneMap {
    /// Compiles the shader.
    ///
    /// # Errors
    /// A driver that cannot compile it.
    pub fn new(device: &Arc<Device>, cache: &PipelineCache) -> Result<Self> {
        Ok(Self { pipeline: ComputePipeline::new(device, cache, &compiled::TONE_MAP, &[])? })
    }
}

/// Makes the picture to look at out of `radiance`: RGBA, 8 bits each.
pub fn tone_map<'a>(
    graph: &mut FrameGraph<'a>,
    tone_map: &'a ToneMap,
    radiance: ImageHandle,
    view: &'a View,
) -> ImageHandle {
    let (width, height) = (view.width, view.height);
    let mut display = graph.kept_image("display", ImageDesc { format: vk::Format::R8G8B8A8_UNORM, width, height });
    graph
        .compute("tone_map", &tone_map.pipeline)
        .read("radiance", radiance)
        .write("display", &mut display)
        .push(&Push { size_px: [width, height], exposure: view.exposure, inverse_gamma: 1.0 / view.gamma })
        .cover([width, height, 1]);
    display
}
