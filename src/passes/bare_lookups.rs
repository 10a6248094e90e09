//! The floor of shading: as many trilinear lookups as a method makes, and nothing else.
use super::cube_borders::WayAround;
use super::light::DevicePyramid;
use crate::Result;
use crate::environment::Pyramid;
use crate::graph::{BufferDesc, BufferHandle, FrameGraph};
use crate::shader_constants::tiles::MAX_GROUPS;
use crate::vulkan::{Buffer, ComputePipeline, Device, PipelineCache, compiled};
use ash::vk;
use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};
use std::f32::consts::TAU;
use std::sync::Arc;

/// What the pass is made of.
pub struct BareLookups {
    pipeline: ComputePipeline,
    pyramid: DevicePyramid,
    lookups: Buffer,
    push: Push,
}

/// A lookup: a unit direction, z up, and the pyramid's level.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct BareLookup {
    /// x, y, z.
    pub direction: [f32; 3],
    /// 0 is the finest; between two whole ones both are fetched.
    pub level: f32,
}

/// Red, green, blue and 1.
const SUM_BYTES: u64 = size_of::<[f32; 4]>() as u64;

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Push {
    pixel_count: u32,
    lookup_count: u32,
    row_count: u32,
    sum_mask: u32,
}

impl BareLookups {
    /// `lookup_count` lookups (at least 1) in `pyramid`, uploaded by `way_around`, for each of `pixel_count` pixels (at least 1): a row of `rows`,
    /// turned about z.
    ///
    /// # Errors
    /// No device memory left, or a driver that cannot compile the shader.
    pub fn new(
        device: &Arc<Device>,
        cache: &PipelineCache,
        pyramid: &Pyramid,
        [pixel_count, lookup_count]: [u32; 2],
        rows: &[BareLookup],
        way_around: Option<WayAround>,
    ) -> Result<Self> {
        let row_count = rows.len() as u32 / lookup_count;
        let scale = pyramid.radiance_scale();
        let storage = vk::BufferUsageFlags::STORAGE_BUFFER;
        // Where a buffer cannot hold the sums of all pixels, several write the same one.
        let most = u64::from(device.limits().max_storage_buffer_range) / SUM_BYTES;
        let sum_mask = if u64::from(pixel_count) <= most { u32::MAX } else { (1 << most.ilog2()) - 1 };
        Ok(Self {
            pipeline: ComputePipeline::new(device, cache, &compiled::BARE_LOOKUPS, &[])?,
            pyramid: DevicePyramid::new(device, "environment pyramid", pyramid, scale, way_around)?,
            lookups: Buffer::with_contents(device, "lookups", storage, bytemuck::cast_slice(rows))?,
            push: Push { pixel_count, lookup_count, row_count, sum_mask },
        })
    }

    /// Size of what the pass leaves.
    pub fn sums_bytes(&self) -> u64 {
        u64::from((self.push.pixel_count - 1).min(self.push.sum_mask) + 1) * SUM_BYTES
    }

    /// What the pass sees from `pixel` by the `rows` and in the `pyramid` that it was made with, in units of radiance. Twin of glsl/bare_lookups.comp.
    pub fn sum(&self, rows: &[BareLookup], pyramid: &Pyramid, pixel: u32) -> Vec3 {
        let Push { pixel_count, lookup_count, row_count, .. } = self.push;
        let size = self.pipeline.group_size()[0];
        let (group, group_count) = (pixel / size, pixel_count.div_ceil(size));
        let row = (group as f32 / group_count as f32 * row_count as f32) as usize;
        let turns = (pixel_count as f32 / TAU).sqrt();
        let turn = Vec2::from_angle(TAU * (turns * (pixel as f32 / pixel_count as f32)).fract());
        let looked_up = |BareLookup { direction: [x, y, z], level }: &BareLookup| {
            pyramid.lookup(turn.rotate(Vec2::new(*x, *y)).extend(*z), *level)
        };
        rows[row * lookup_count as usize..][..lookup_count as usize].iter().map(looked_up).sum()
    }
}

/// Looks up; leaves for each pixel the sum of what it saw, RGB in units of the pyramid's texels, and 1; where the device has no buffer of that size, for
/// as many as it has one for.
pub fn bare_lookups<'a>(graph: &mut FrameGraph<'a>, bare: &'a BareLookups) -> BufferHandle {
    let BareLookups { pipeline, pyramid, lookups, push } = bare;
    let mut sums = graph.buffer("sums", BufferDesc { size_bytes: bare.sums_bytes() });
    let groups = push.pixel_count.div_ceil(pipeline.group_size()[0]);
    graph
        .compute("bare_lookups", pipeline)
        .sampled("environment_pyramid", &pyramid.image, &pyramid.sampler)
        .bind("Lookups", lookups)
        .write("Sums", &mut sums)
        .push(push)
        .groups([groups.min(MAX_GROUPS), groups.div_ceil(MAX_GROUPS), 1]);
    sums
}
