//! Sorts pixels into interior, edge and background, and lists those to shade: nothing else is looked at again.
use super::View;
use crate::environment::Environment;
use crate::graph::{BufferDesc, BufferHandle, FrameGraph, ImageHandle};
use crate::memo::Keyed;
use crate::method::Method;
use crate::threads::fitted::NEARLY_FLAT_RAD;
use crate::vulkan::ComputePipeline;
use bytemuck::{Pod, Zeroable};

/// Sub-pixels whose normals differ by less share one partitioned sum over the threads. Narrower than this, and curved
/// parts of a mesh count as edges and cost as much as all sub-pixels shaded alone; wider, and the parts of the sum
/// belong to visibly different normals.
pub const SMOOTH_DEG: f32 = 10.0;

/// Variance of the normal along each of two axes, in rad^2, from which sub-pixels do not share one sum at their mean normal: normals
/// 0.6 degrees from their mean.
const NEARLY_FLAT_VARIANCE: f32 = (NEARLY_FLAT_RAD * NEARLY_FLAT_RAD) as f32;

/// The same where some lobe is so wide that sub-pixels share more than that: 3.6 degrees.
const WIDE_LOBE_VARIANCE: f32 = 4e-3;

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
    /// Pixels that see a surface.
    pub fn covered_pixels(&self) -> u64 {
        u64::from(self.interior_pixels) + u64::from(self.edge_pixels)
    }

    /// Byte offset of the dispatch arguments of class `kind`: 0 interior, 1 edge.
    pub fn arguments_of(kind: u32) -> u64 {
        u64::from(kind) * size_of::<TileClass>() as u64
    }
}

/// What the pass is made of.
#[derive(Clone)]
pub struct Classify {
    /// The shader, for a number of sub-pixels.
    pub pipeline: Keyed<ComputePipeline>,
    /// From which variances of their normals and tangents on sub-pixels are no smooth surface: see [`SmoothVariance::of`].
    pub smooth_variance: SmoothVariance,
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Push {
    size_px: [u32; 2],
    smooth_variance: SmoothVariance,
    cos_smooth: f32,
}

/// From which variances on, in rad^2, sub-pixels are no smooth surface.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct SmoothVariance {
    /// Of normals, along each of two axes.
    pub of_normals: f32,
    /// Of tangents, around the normal.
    pub of_tangents: f32,
}

impl SmoothVariance {
    /// What `method` asks for where sub-pixels of some material share a sum up to a deviation of normals, `most_shared` in radians. If they
    /// never do, nothing that [`SMOOTH_DEG`] allows. Two values for all materials, so that the lists of pixels seldom depend on these.
    ///
    /// Small bright sources light a curved surface from a low angle here and not at all there: under these only nearly flat pixels are smooth.
    pub fn of(method: Method, environment: &Environment, most_shared: f64) -> Self {
        let is_wide = most_shared.powi(2) > f64::from(NEARLY_FLAT_VARIANCE) && !environment.has_small_sources();
        let (of_normals, of_tangents) = match method.shares_surface() {
            false => (1.0, 1.0),
            true if is_wide => (WIDE_LOBE_VARIANCE, NEARLY_FLAT_VARIANCE),
            true => (NEARLY_FLAT_VARIANCE, NEARLY_FLAT_VARIANCE),
        };
        Self { of_normals, of_tangents }
    }
}

/// What is to be shaded.
#[derive(Clone, Copy)]
pub struct Tiles {
    /// [`Counters`].
    pub counters: BufferHandle,
    /// The tiles that hold interior pixels, then, from the middle, those that hold edge pixels.
    pub tiles: BufferHandle,
    /// For each tile of the image the places of its pixels in it: interior ones from the front, edge ones from the back.
    pub pixels: BufferHandle,
}

/// Lists the pixels of `geometry` that hold surface.
pub fn classify<'a>(graph: &mut FrameGraph<'a>, classify: &'a Classify, geometry: ImageHandle, view: &View) -> Tiles {
    let (width, height) = (view.width, view.height);
    // A workgroup is a tile.
    let [columns, rows, _] = classify.pipeline.group_size();
    let tile_count = u64::from(width.div_ceil(columns)) * u64::from(height.div_ceil(rows));
    let tile_pixels = u64::from(columns * rows);
    // Kept: as long as nothing moves, other light and other materials are shaded by the same lists.
    let mut counters = graph.kept_buffer("counters", BufferDesc { size_bytes: size_of::<Counters>() as u64 });
    graph.clear_buffer("clear_counters", &mut counters);
    let mut tiles = graph.kept_buffer("tile_list", BufferDesc { size_bytes: 2 * 4 * tile_count });
    let mut pixels = graph.kept_buffer("pixel_list", BufferDesc { size_bytes: 4 * tile_pixels * tile_count });
    graph
        .compute("classify", &classify.pipeline)
        .read("geometry", geometry)
        .modify("counters", &mut counters)
        .write("tile_list", &mut tiles)
        .write("pixel_list", &mut pixels)
        .push(&Push {
            size_px: [width, height],
            smooth_variance: classify.smooth_variance,
            cos_smooth: SMOOTH_DEG.to_radians().cos(),
        })
        .cover([width, height, 1]);
    Tiles { counters, tiles, pixels }
}
