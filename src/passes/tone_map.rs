//! Linear radiance to 8-bit display values: exposure, clamp, gamma.
use super::View;
use crate::graph::{FrameGraph, ImageDesc, ImageHandle};
use crate::memo::Keyed;
use crate::vulkan::ComputePipeline;
use ash::vk;
use bytemuck::{Pod, Zeroable};

/// What the pass is made of.
#[derive(Clone)]
pub struct ToneMap {
    /// The shader.
    pub pipeline: Keyed<ComputePipeline>,
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Push {
    size_px: [u32; 2],
    exposure: f32,
    inverse_gamma: f32,
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
