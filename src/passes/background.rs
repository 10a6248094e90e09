//! What is seen past the surface: the environment, or nothing.
use super::{CameraRays, Tiles, View};
use crate::Result;
use crate::environment::Environment;
use crate::graph::{FrameGraph, ImageHandle};
use crate::memo::Keyed;
use crate::vector_math::half_floats;
use crate::vulkan::{self, ComputePipeline, Device, ImageShape, Sampler, SamplerKind};
use ash::vk;
use bytemuck::{Pod, Zeroable};
use half::f16;
use rayon::prelude::*;
use std::sync::Arc;

/// What the pass is made of: only where a background is asked for is the map itself on the device.
#[derive(Clone)]
pub enum Background {
    /// The environment.
    Environment {
        /// The shader.
        pipeline: Keyed<ComputePipeline>,
        /// What it looks up.
        map: Keyed<BackgroundMap>,
    },
    /// Nothing, black and transparent, by this shader.
    Nothing(Keyed<ComputePipeline>),
}

/// The environment on the device, as a display shows it.
pub struct BackgroundMap {
    image: vulkan::Image,
    sampler: Sampler,
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Push {
    camera: CameraRays,
    size_px: [u32; 2],
    rotation: [f32; 2],
    region: TileRegion,
    radiance_scale: f32,
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct ClearPush {
    size_px: [u32; 2],
    region: TileRegion,
}

/// `Region` in glsl/tiles.glsl: the first tile, and those after the last.
type TileRegion = [[u32; 2]; 2];

impl BackgroundMap {
    /// An error for an environment that is larger than the device's images can be: better found out before it is filtered.
    pub fn check_size(device: &Device, environment: &Environment) -> Result<()> {
        let remedy = "scale it down, or leave the background out (none)";
        check_map_size(device, environment, [environment.width, environment.height], remedy)
    }

    /// Uploads the map.
    ///
    /// # Errors
    /// No device memory left, or a map wider or higher than the device's images can be.
    pub fn new(device: &Arc<Device>, environment: &Environment) -> Result<Self> {
        Self::check_size(device, environment)?;
        let texels = environment.texels.par_iter().map(|&[r, g, b]| [r, g, b, 1.0]);
        let single = vk::Format::R32G32B32A32_SFLOAT;
        let (format, bytes) = if !in_half_floats(environment) && device.filters_linearly(single) {
            (single, bytemuck::cast_slice(&texels.collect::<Vec<[f32; 4]>>()).to_vec())
        } else {
            let bounded = |texel: [f32; 4]| texel.map(|value| value.min(f16::MAX.to_f32()));
            let texels: Vec<[f16; 4]> = texels.map(|texel| half_floats(bounded(texel))).collect();
            (vk::Format::R16G16B16A16_SFLOAT, bytemuck::cast_slice(&texels).to_vec())
        };
        let (width, height) = (environment.width as u32, environment.height as u32);
        let shape = ImageShape::plane(format, width, height);
        Ok(Self {
            image: vulkan::Image::with_texels(device, "environment map", shape, &[bytes])?,
            sampler: Sampler::new(device, "environment map", SamplerKind::WrappedLinear)?,
        })
    }
}

/// Whether half floats hold the brightest pixel, and in their full precision what is a thousandth as bright.
fn in_half_floats(environment: &Environment) -> bool {
    let brightest = environment.texels.iter().flatten().copied().fold(0.0, f32::max);
    brightest == 0.0 || (1e3 * f16::MIN_POSITIVE.to_f32()..=f16::MAX.to_f32()).contains(&brightest)
}

/// An error for a map of `environment`, of this width and height, if the device's images cannot be as large.
pub(super) fn check_map_size(
    device: &Device,
    environment: &Environment,
    [width, height]: [usize; 2],
    remedy: &str,
) -> Result<()> {
    let largest = device.limits().max_image_dimension2_d as usize;
    if width.max(height) <= largest {
        return Ok(());
    }
    let problem = format!("is {width} x {height} pixels, more than this device's images can have ({largest})");
    Err(crate::Error::input(&environment.name, problem, remedy))
}

/// Puts `background` where `radiance` is not wholly covered, by the `tiles`. Where it is not covered at all, it may hold anything before.
pub fn background<'a>(
    graph: &mut FrameGraph<'a>,
    background: &'a Background,
    mut radiance: ImageHandle,
    tiles: &Tiles,
    view: &View,
) -> ImageHandle {
    let size_px = [view.width, view.height];
    let region = [tiles.region.first_tile, tiles.region.end_tile];
    let pass = match background {
        Background::Environment { pipeline, map } => {
            let (rotation, radiance_scale) = (view.rotation(), view.intensity as f32);
            graph.compute("background", pipeline).sampled("environment_map", &map.image, &map.sampler).push(&Push {
                camera: view.camera_rays(),
                size_px,
                rotation,
                region,
                radiance_scale,
            })
        }
        Background::Nothing(pipeline) => {
            graph.compute("clear_uncovered", pipeline).push(&ClearPush { size_px, region })
        }
    };
    let pass = pass.modify("radiance", &mut radiance).read("Coverage", tiles.coverage);
    pass.cover([view.width, view.height, 1]);
    radiance
}
