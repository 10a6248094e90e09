//! Linear radiance to 8-bit display values: exposure, clamp, gamma.
use super::{FrameGraph, Identity, View, tiles_of};
use crate::Result;
use crate::graph::{Access, ImageDesc, ImageHandle};
use crate::vulkan::{Bindings, ComputePipeline, Device, Groups, PipelineCache, compiled};
use ash::vk;
use bytemuck::{Pod, Zeroable};
use std::sync::Arc;

/// What the pass is made of.
pub struct ToneMap {
    pipeline: ComputePipeline,
    identity: Identity,
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
        let pipeline = ComputePipeline::new(device, cache, &compiled::TONE_MAP, &[])?;
        Ok(Self { pipeline, identity: Identity::new() })
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
    let display = graph.kept_image("display", ImageDesc { format: vk::Format::R8G8B8A8_UNORM, width, height });
    let mut pass = graph.pass("tone_map");
    pass.read(radiance, Access::StorageReadCompute);
    let display = pass.write(display, Access::StorageWriteCompute);
    let push = Push { size_px: [width, height], exposure: view.exposure, inverse_gamma: 1.0 / view.gamma };
    pass.depends_on(&tone_map.identity).depends_on(&bytemuck::bytes_of(&push));
    pass.record(Box::new(move |commands, resources| {
        let bindings =
            Bindings::new().image("radiance", resources.image(radiance)).image("display", resources.image(display));
        commands.dispatch(&tone_map.pipeline, &bindings, bytemuck::bytes_of(&push), Groups::Direct(tiles_of(view)))
    }));
    display
}
