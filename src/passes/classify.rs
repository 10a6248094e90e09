//! Sorts pixels into interior, edge and background, and by the shader of their material. It lists those to shade: nothing else is looked at again.
use super::{CameraRays, Region, View};
use crate::Result;
use crate::environment::Environment;
use crate::graph::{BufferDesc, BufferHandle, FrameGraph, ImageHandle};
use crate::memo::Keyed;
use crate::method::Method;
use crate::shader_constants::tiles::{PART_PIXELS, TILE_SIDE};
use crate::threads::fitted::NEARLY_FLAT_RAD;
use crate::vulkan::{Buffer, ComputePipeline, Device};
use ash::vk;
use bytemuck::{Pod, Zeroable};
use std::sync::Arc;

/// Name of the pass.
pub const CLASSIFY_PASS: &str = "classify";

/// Sub-pixels whose normals differ by less share one partitioned sum over the threads. Narrower than this, and curved
/// parts of a mesh count as edges and cost as much as all sub-pixels shaded alone; wider, and the parts of the sum
/// belong to visibly different normals.
pub const SMOOTH_DEG: f32 = 10.0;

/// Variance of the normal along each of two axes, in rad^2, from which sub-pixels do not share one sum at their mean normal: normals
/// 0.6 degrees from their mean.
const NEARLY_FLAT_VARIANCE: f32 = (NEARLY_FLAT_RAD * NEARLY_FLAT_RAD) as f32;

/// The most where some lobe is so wide that sub-pixels share more than that: 3.6 degrees.
const WIDEST_VARIANCE: f32 = 4e-3;

/// How many shaders there can be at most: each is compiled twice and has two lists of pixels. glsl/classify.comp has room for 32.
pub const MAX_SHADERS: usize = 16;

/// How many of them a picture of this size in pixels may have where shaders see buffers of so many bytes: the lists of all classes are in one.
pub fn most_shaders(size_px: [u32; 2], max_buffer_bytes: u32) -> usize {
    (u64::from(max_buffer_bytes) / part_list_bytes(size_px, 1).max(1)).clamp(1, MAX_SHADERS as u64) as usize
}

/// Bytes of the longest list of a picture of this size in pixels, by so many shaders.
pub(super) fn longest_list_bytes(size_px: [u32; 2], shaders: usize) -> u64 {
    pixel_list_bytes(size_px).max(part_list_bytes(size_px, shaders))
}

/// Pixels of whole tiles.
fn tiled_pixels(size_px: [u32; 2]) -> u64 {
    let [columns, rows] = size_px.map(|side| u64::from(side).next_multiple_of(TILE_SIDE.into()));
    columns * rows
}

/// Each pixel is listed once.
fn pixel_list_bytes(size_px: [u32; 2]) -> u64 {
    4 * tiled_pixels(size_px)
}

/// Interior and edge pixels of each shader have room for all parts of all tiles.
fn part_list_bytes(size_px: [u32; 2], shaders: usize) -> u64 {
    2 * shaders as u64 * PART_BYTES * (tiled_pixels(size_px) / u64::from(PART_PIXELS))
}

/// What the pass counts: `Counted` in glsl/tiles.glsl. Its buffer goes on with the tiles of each class: interior and edge pixels of each shader.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct Counters {
    /// Pixels that see one smooth surface in all sub-pixels.
    pub interior_pixels: u32,
    /// Pixels at an edge of something.
    pub edge_pixels: u32,
    /// Sub-pixels that see a surface.
    pub covered_subpixels: u32,
    /// Those among them that are in edge pixels.
    pub covered_edge_subpixels: u32,
}

/// Bytes of a listed part: see `pack_part` in glsl/tiles.glsl.
const PART_BYTES: u64 = 4;

/// Bytes of `TileClass` in glsl/tiles.glsl: the arguments of an indirect dispatch, and a count.
const TILE_CLASS_BYTES: u64 = 16;

impl Counters {
    /// Pixels that see a surface.
    pub fn covered_pixels(&self) -> u64 {
        u64::from(self.interior_pixels) + u64::from(self.edge_pixels)
    }

    /// Byte offset of the dispatch arguments of a class: 2 k are the interior pixels of shader k, 2 k + 1 its edge pixels.
    pub fn arguments_of(pixel_class: usize) -> u64 {
        size_of::<Self>() as u64 + pixel_class as u64 * TILE_CLASS_BYTES
    }
}

/// What the pass is made of.
#[derive(Clone)]
pub struct Classify {
    /// The shader, for a number of sub-pixels.
    pub pipeline: Keyed<ComputePipeline>,
    /// From which variances of their normals and tangents on sub-pixels are no smooth surface: see [`SmoothVariance::of`].
    pub smooth_variance: SmoothVariance,
    /// [`ShaderOfMaterial`] of each material.
    pub shaders: Keyed<Buffer>,
    /// How many there are.
    pub shader_count: u32,
    /// That of pixels of materials that have different ones.
    pub shader_of_mixed: u32,
}

/// Which shader a material is shaded by: the same in glsl/classify.comp.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct ShaderOfMaterial {
    /// Its number.
    pub shader: u32,
    /// Where cos theta_o is less, it is the one of mixed pixels: that has what only grazing views need.
    pub cos_grazing: f32,
}

impl ShaderOfMaterial {
    /// A cosine that no view has less of.
    pub const NEVER: f32 = -2.0;

    /// Whether some views have less.
    pub fn has_grazing(&self) -> bool {
        self.cos_grazing != Self::NEVER
    }
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Push {
    camera: CameraRays,
    size_px: [u32; 2],
    first_tile: [u32; 2],
    smooth_variance: SmoothVariance,
    cos_smooth: f32,
    shader_of_mixed: u32,
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
    /// never do, nothing that [`SMOOTH_DEG`] allows. Pixels that are listed as smooth and share nothing hold up those beside them that do: with
    /// 3.6 degrees for all wide lobes, shading a dragon of GGX 0.12 by 16 threads took 1.3 times as long.
    ///
    /// Small bright sources light a curved surface from a low angle here and not at all there: under these only nearly flat pixels are smooth.
    pub fn of(method: Method, environment: &Environment, most_shared: f64) -> Self {
        if !method.shares_surface() {
            return Self { of_normals: 1.0, of_tangents: 1.0 };
        }
        let most_shared = if environment.has_small_sources() { 0.0 } else { most_shared.powi(2) as f32 };
        let of_normals = most_shared.clamp(NEARLY_FLAT_VARIANCE, WIDEST_VARIANCE);
        Self { of_normals, of_tangents: NEARLY_FLAT_VARIANCE }
    }
}

/// What is to be shaded.
#[derive(Clone, Copy)]
pub struct Tiles {
    /// Where there may be any.
    pub region: Region,
    /// [`Counters`].
    pub counters: BufferHandle,
    /// For each class of pixels the parts of tiles that hold them.
    pub parts: BufferHandle,
    /// For each tile of the image the places of its pixels in it, class by class.
    pub pixels: BufferHandle,
    /// For each tile of the image two bits a pixel, written for those of the region: whether it sees any surface, and whether it sees nothing else.
    pub coverage: BufferHandle,
}

/// Uploads the shader of each material.
///
/// # Errors
/// No device memory left.
pub fn upload_shaders(device: &Arc<Device>, of_materials: &[ShaderOfMaterial]) -> Result<Buffer> {
    // The binding needs something where there are no materials.
    let none = [ShaderOfMaterial { shader: 0, cos_grazing: ShaderOfMaterial::NEVER }];
    let shaders = if of_materials.is_empty() { &none } else { of_materials };
    let usage = vk::BufferUsageFlags::STORAGE_BUFFER;
    Ok(Buffer::with_contents(device, "shaders of materials", usage, bytemuck::cast_slice(shaders))?)
}

/// Lists the pixels of `geometry` that hold surface, all of which is in `region`.
pub fn classify<'a>(
    graph: &mut FrameGraph<'a>,
    classify: &'a Classify,
    geometry: ImageHandle,
    region: Region,
    view: &View,
) -> Tiles {
    let size_px = [view.width, view.height];
    let shaders = classify.shader_count as usize;
    // Kept: as long as nothing moves, other light and other materials that let as many pixels share a sum are shaded by the same lists.
    let mut kept = |name, size_bytes| graph.kept_buffer(name, BufferDesc { size_bytes });
    let mut counters = kept("counters", Counters::arguments_of(2 * shaders));
    let mut parts = kept("part_list", part_list_bytes(size_px, shaders));
    let mut pixels = kept("pixel_list", pixel_list_bytes(size_px));
    let mut coverage = kept("coverage", tiled_pixels(size_px) / 4);
    graph.clear_buffer("clear_counters", &mut counters);
    graph
        .compute(CLASSIFY_PASS, &classify.pipeline)
        .read("geometry", geometry)
        .bind("Shaders", &*classify.shaders)
        .modify("counters", &mut counters)
        .write("part_list", &mut parts)
        .write("pixel_list", &mut pixels)
        .write("Coverage", &mut coverage)
        .push(&Push {
            camera: view.camera_rays(),
            size_px,
            first_tile: region.first_tile,
            smooth_variance: classify.smooth_variance,
            cos_smooth: SMOOTH_DEG.to_radians().cos(),
            shader_of_mixed: classify.shader_of_mixed,
        })
        .groups([region.tiles()[0], region.tiles()[1], 1]);
    Tiles { region, counters, parts, pixels, coverage }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_pictures_have_as_many_shaders_as_their_lists_have_room_for() {
        // As lavapipe has it.
        let most = |size_px| most_shaders(size_px, 128 << 20);
        assert_eq!([[640, 480], [3840, 2160], [4096, 4096], [8192, 4096]].map(most), [16, 16, 8, 4]);
        // No list is longer than a buffer, but for pictures of more pixels than can be listed at all.
        let longest = |size_px| longest_list_bytes(size_px, most(size_px));
        assert_eq!([[4096, 4096], [8192, 4096], [5793, 5792]].map(longest), [128 << 20, 128 << 20, 4 * 5800 * 5792]);
    }
}
