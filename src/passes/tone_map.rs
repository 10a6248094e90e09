//! Linear radiance to 8-bit display values: exposure, clamp, gamma.
use super::{FrameGraph, View, tiles_of};
use crate::graph::{Access, Image, ImageDesc};
use crate::memo::Keyed;
use crate::vulkan::{Bindings, ComputePipeline, Groups};
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
pub fn tone_map<'a>(graph: &mut FrameGraph<'a>, tone_map: &'a ToneMap, radiance: Image, view: &'a View) -> Image {
    let (width, height) = (view.width, view.height);
    let display = graph.kept_image("display", ImageDesc { format: vk::Format::R8G8B8A8_UNORM, width, height });
    let mut pass = graph.pass("tone_map");
    pass.read(radiance, Access::StorageReadCompute);
    let display = pass.write(display, Access::StorageWriteCompute);
    let push = Push { size_px: [width, height], exposure: view.exposure, inverse_gamma: 1.0 / view.gamma };
    pass.depends_on(&tone_map.pipeline.key).depends_on(&bytemuck::bytes_of(&push));
    pass.record(Box::new(move |commands, resources| {
        let bindings =
            Bindings::new().image("radiance", resources.image(radiance)).image("display", resources.image(display));
        commands.dispatch(&tone_map.pipeline, &bindings, bytemuck::bytes_of(&push), Groups::Direct(tiles_of(view)))
    }));
    display
}
