//! Puts the environment behind the surface.
use super::{CameraRays, View};
use crate::Result;
use crate::environment::Environment;
use crate::graph::{FrameGraph, ImageHandle};
use crate::memo::Keyed;
use crate::vulkan::{self, ComputePipeline, Device, ImageShape, Sampler, SamplerKind};
use ash::vk;
use bytemuck::{Pod, Zeroable};
use half::f16;
use std::sync::Arc;

/// What the pass is made of: only where a background is asked for is the map itself on the device.
#[derive(Clone)]
pub struct Background {
    /// The shader.
    pub pipeline: Keyed<ComputePipeline>,
    /// The environment.
    pub map: Keyed<BackgroundMap>,
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
    radiance_scale: f32,
}

impl BackgroundMap {
    /// Uploads the map.
    ///
    /// # Errors
    /// No device memory left, or a map wider or higher than the device's images can be.
    pub fn new(device: &Arc<Device>, environment: &Environment) -> Result<Self> {
        let remedy = "scale it down, or leave the background out with --background none";
        check_map_size(device, environment, [environment.width, environment.height], remedy)?;
        // A sun as bright as the largest half float is white on any display, so here, unlike in shading, it is cut off.
        let texel = |rgb: &[f32; 3]| [rgb[0], rgb[1], rgb[2], 1.0].map(|value| f16::from_f32(value.min(65504.0)));
        let texels: Vec<[f16; 4]> = environment.texels.iter().map(texel).collect();
        let (width, height) = (environment.width as u32, environment.height as u32);
        let shape = ImageShape::plane(vk::Format::R16G16B16A16_SFLOAT, width, height);
        let bytes = bytemuck::cast_slice(&texels).to_vec();
        Ok(Self {
            image: vulkan::Image::with_texels(device, "environment map", shape, &[bytes])?,
            sampler: Sampler::new(device, "environment map", SamplerKind::WrappedLinear)?,
        })
    }
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

/// Adds the environment where `radiance` is not wholly covered.
pub fn background<'a>(
    graph: &mut FrameGraph<'a>,
    background: &'a Background,
    mut radiance: ImageHandle,
    view: &View,
) -> ImageHandle {
    let size_px = [view.width, view.height];
    let (rotation, radiance_scale) = (view.rotation(), view.intensity as f32);
    graph
        .compute("background", &background.pipeline)
        .modify("radiance", &mut radiance)
        .sampled("environment_map", &background.map.image, &background.map.sampler)
        .push(&Push { camera: view.camera_rays(), size_px, rotation, radiance_scale })
        .cover([view.width, view.height, 1]);
    radiance
}
