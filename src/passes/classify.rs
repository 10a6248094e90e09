//! Sorts pixels into interior, edge and background, and lists those to shade: nothing else is looked at again.
use super::{FrameGraph, Identity, View, clear, tiles_of};
use crate::Result;
use crate::graph::{Access, BufferDesc, BufferHandle, ImageDesc, ImageHandle};
use crate::vulkan::{Bindings, ComputePipeline, Device, Groups, PipelineCache, compiled};
use ash::vk;
use bytemuck::{Pod, Zeroable};
use std::sync::Arc;

/// Sub-pixels whose normals differ by less share one partitioned sum over the threads. Narrower than this, and curved
/// parts of a mesh count as edges and cost as much as all sub-pixels shaded alone; wider, and the parts of the sum
/// belong to visibly different normals.
pub const SMOOTH_DEG: f32 = 10.0;

/// Pixels on the side of a tile. `TILE_SIDE` in glsl/tiles.glsl.
const TILE_SIDE: u32 = 8;

/// The tiles of one class: arguments of an indirect dispatch and a count. `TileClass` in glsl/tiles.glsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct TileClass {
    groups: [u32; 3],
    /// Tiles that hold pixels of the class.
    pub tile_count: u32,
}

/// What the pass counts. `Counters` in glsl/classify.comp.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct Counters {
    tiles: [TileClass; 2],
    /// Pixels that see one smooth surface in all sub-pixels.
    pub interior_pixels: u32,
    /// Pixels at an edge of something.
    pub edge_pixels: u32,
    /// Sub-pixels that see a surface.
    pub covered_subpixels: u32,
    /// Those among them that are in edge pixels.
    pub covered_edge_subpixels: u32,
}

impl Counters {
    /// Byte offset of the dispatch arguments of class `kind`: 0 interior, 1 edge.
    pub fn arguments_of(kind: u32) -> u64 {
        u64::from(kind) * size_of::<TileClass>() as u64
    }
}

/// What the pass is made of.
pub struct Classify {
    pipeline: ComputePipeline,
    identity: Identity,
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Push {
    size_px: [u32; 2],
    cos_smooth: f32,
}

impl Classify {
    /// Compiles the shader for this many sub-pixels per axis.
    ///
    /// # Errors
    /// A driver that cannot compile it.
    pub fn new(device: &Arc<Device>, cache: &PipelineCache, subpixels: u32) -> Result<Self> {
        let pipeline = ComputePipeline::new(device, cache, &compiled::CLASSIFY, &[("SUBPIXELS", subpixels)])?;
        Ok(Self { pipeline, identity: Identity::new() })
    }
}

/// What is to be shaded, and the image to shade into, already black where nothing is.
#[derive(Clone, Copy)]
pub struct Tiles {
    /// [`Counters`].
    pub counters: BufferHandle,
    /// The tiles that hold interior pixels, then, from the middle, those that hold edge pixels.
    pub tiles: BufferHandle,
    /// For each tile of the image the places of its pixels in it: interior ones from the front, edge ones from the back.
    pub pixels: BufferHandle,
    /// Linear radiance times coverage, and coverage.
    pub radiance: ImageHandle,
}

/// Lists the pixels of `geometry` that hold surface.
pub fn classify<'a>(
    graph: &mut FrameGraph<'a>,
    classify: &'a Classify,
    geometry: ImageHandle,
    view: &'a View,
) -> Tiles {
    let (width, height) = (view.width, view.height);
    let counters = graph.buffer("counters", BufferDesc { size_bytes: size_of::<Counters>() as u64 });
    let counters = clear(graph, "clear_counters", counters);
    let tile_count = u64::from(width.div_ceil(TILE_SIDE)) * u64::from(height.div_ceil(TILE_SIDE));
    let tiles = graph.buffer("tile_list", BufferDesc { size_bytes: 2 * 4 * tile_count });
    let pixels = graph.buffer("pixel_list", BufferDesc { size_bytes: 4 * u64::from(TILE_SIDE.pow(2)) * tile_count });
    let radiance = graph.kept_image("radiance", ImageDesc { format: vk::Format::R32G32B32A32_SFLOAT, width, height });
    let mut pass = graph.pass("classify");
    pass.read(geometry, Access::SampledCompute);
    let counters = pass.modify(counters, Access::StorageWriteCompute);
    let tiles = pass.write(tiles, Access::StorageWriteCompute);
    let pixels = pass.write(pixels, Access::StorageWriteCompute);
    let radiance = pass.write(radiance, Access::StorageWriteCompute);
    let push = Push { size_px: [width, height], cos_smooth: SMOOTH_DEG.to_radians().cos() };
    pass.depends_on(&classify.identity).depends_on(&bytemuck::bytes_of(&push));
    pass.record(Box::new(move |commands, resources| {
        let bindings = Bindings::new()
            .image("geometry", resources.image(geometry))
            .buffer("counters", resources.buffer(counters))
            .buffer("tile_list", resources.buffer(tiles))
            .buffer("pixel_list", resources.buffer(pixels))
            .image("radiance", resources.image(radiance));
        let groups = Groups::Direct(tiles_of(view));
        commands.dispatch(&classify.pipeline, &bindings, bytemuck::bytes_of(&push), groups)
    }));
    Tiles { counters, tiles, pixels, radiance }
}
