//! The floor of shading: as many trilinear lookups as a method makes, and nothing else.
use super::cube_borders::WayAround;
use super::light::DevicePyramid;
use crate::Result;
use crate::environment::Pyramid;
use crate::graph::{BufferDesc, BufferHandle, FrameGraph};
use crate::vulkan::{ComputePipeline, Device, PipelineCache, compiled};
use bytemuck::{Pod, Zeroable};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Workgroups along an axis that every device can dispatch.
const MAX_GROUPS: u32 = 65535;

/// What the pass is made of.
pub struct BareLookups {
    pipeline: ComputePipeline,
    pyramid: DevicePyramid,
    push: Push,
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Push {
    pixel_count: u32,
    lookup_count: u32,
    level: f32,
}

impl BareLookups {
    /// `lookup_count` lookups in `pyramid`, uploaded by `way_around`, for each of `pixel_count` pixels (at least 1).
    ///
    /// # Errors
    /// No device memory left, or a driver that cannot compile the shader.
    pub fn new(
        device: &Arc<Device>,
        cache: &PipelineCache,
        pyramid: &Pyramid,
        pixel_count: u32,
        lookup_count: u32,
        way_around: Option<WayAround>,
    ) -> Result<Self> {
        // About where texels are as large as a lookup's share of the hemisphere, and between two levels, so that both are fetched.
        let texel_sr = 2.0 * TAU / (6.0 * (pyramid.face_size * pyramid.face_size) as f64);
        let level = 0.5 * (TAU / f64::from(lookup_count) / texel_sr).log2();
        let level = level.clamp(0.0, (pyramid.levels.len() - 1) as f64 - 0.5).floor() + 0.5;
        let scale = pyramid.radiance_scale();
        Ok(Self {
            pipeline: ComputePipeline::new(device, cache, &compiled::BARE_LOOKUPS, &[])?,
            pyramid: DevicePyramid::new(device, "environment pyramid", pyramid, scale, way_around)?,
            push: Push { pixel_count, lookup_count, level: level as f32 },
        })
    }

    /// Size of what the pass leaves.
    pub fn sums_bytes(&self) -> u64 {
        u64::from(self.push.pixel_count) * size_of::<[f32; 4]>() as u64
    }
}

/// Looks up; leaves for each pixel the sum of what it saw, RGB in units of the pyramid's texels, and 1.
pub fn bare_lookups<'a>(graph: &mut FrameGraph<'a>, bare: &'a BareLookups) -> BufferHandle {
    let BareLookups { pipeline, pyramid, push } = bare;
    let mut sums = graph.buffer("sums", BufferDesc { size_bytes: bare.sums_bytes() });
    let groups = push.pixel_count.div_ceil(pipeline.group_size()[0]);
    graph
        .compute("bare_lookups", pipeline)
        .sampled("environment_pyramid", &pyramid.image, &pyramid.sampler)
        .write("Sums", &mut sums)
        .push(push)
        .groups([groups.min(MAX_GROUPS), groups.div_ceil(MAX_GROUPS), 1]);
    sums
}
