//! What shading looks up of the environment, on the device: only what its method and its materials need.
use super::background::check_map_size;
use super::cube_borders::{WayAround, draw_with_cube_map};
use crate::Result;
use crate::environment::{Alias, Environment, LightMap, Pyramid};
use crate::light::{BlurredLight, Light, PrefilteredLight, finest_level};
use crate::method::Method;
use crate::vulkan::{self, Bound, Buffer, Device, ImageKind, ImageShape, Sampler, SamplerKind};
use ash::vk;
use std::sync::Arc;

/// What a method looks up of the environment, on the device.
#[derive(Default)]
pub struct DeviceLight {
    pyramid: Option<DevicePyramid>,
    source_pyramid: Option<DevicePyramid>,
    irradiance: Option<DevicePyramid>,
    sources: Option<Buffer>,
    map: Option<vulkan::Image>,
    aliases: Option<Buffer>,
    has_lamps: bool,
    /// Level 0 of the blurred environment on the scale of kernels; 0 if there is none.
    pub(super) finest_level: f32,
}

impl DeviceLight {
    /// Whether there are small bright sources that are shaded by the BRDF.
    pub(super) fn has_lamps(&self) -> bool {
        self.has_lamps
    }
}

/// Whether `method` can draw by the light of an `environment` on this device, if it does so.
///
/// # Errors
/// The environment has more pixels than shaders of the device see of a buffer.
pub fn check_aliases(device: &Device, method: Method, environment: &Environment) -> Result<()> {
    let most = device.limits().max_storage_buffer_range as usize / size_of::<Alias>();
    if method.lookups().aliases { check_pixels(most, environment) } else { Ok(()) }
}

fn check_pixels(most: usize, environment: &Environment) -> Result<()> {
    let &Environment { width, height, .. } = environment;
    if width * height <= most {
        return Ok(());
    }
    let problem =
        format!("is {width} x {height} pixels; on this device samples are drawn by the light of {most} at most");
    Err(crate::Error::input(&environment.name, problem, "scale it down, or use method filtered"))
}

/// The irradiance by each base of the scene's materials, on the device.
pub struct DeviceIrradiance(DevicePyramid);

impl DeviceIrradiance {
    /// Uploads what `light` has; cube maps by `way_around`.
    ///
    /// # Errors
    /// No device memory left, or more bases than an image has layers for: Vulkan promises 42.
    pub fn new(device: &Arc<Device>, light: &BlurredLight, way_around: Option<WayAround>) -> Result<Self> {
        let maps: Vec<&Pyramid> = light.irradiance.iter().map(|map| &**map).collect();
        let kind = ImageKind::Cubes(maps.len() as u32);
        let scale = light.radiance_scale();
        DevicePyramid::of_kind(device, "irradiance maps", kind, &maps, scale, way_around).map(Self)
    }

    /// What it is in the shader.
    pub(super) fn binding(&self) -> (&'static str, Bound<'_>) {
        ("irradiance_maps", Bound::Sampled(&self.0.image, &self.0.sampler))
    }
}

/// A pyramid on the device.
pub(super) struct DevicePyramid {
    pub(super) image: vulkan::Image,
    pub(super) sampler: Sampler,
    face_size: u32,
    /// Radiance of a texel of value 1: what keeps suns within half floats.
    pub(super) scale: f32,
}

impl DeviceLight {
    /// Uploads what `method` looks up of `environment`, whose filtered forms are `light`; cube maps by `way_around`.
    ///
    /// # Errors
    /// No device memory left, a map wider or higher than the device's images can be, or [`check_aliases`].
    pub fn new(
        device: &Arc<Device>,
        method: Method,
        environment: &Environment,
        light: &Light,
        way_around: Option<WayAround>,
    ) -> Result<Self> {
        let lookups = method.lookups();
        check_aliases(device, method, environment)?;
        let mut on_device = Self::default();
        if let Some(blurred) = &light.blurred {
            on_device.add_blurred(device, environment, blurred, way_around)?;
        }
        if let Some(pyramid) = &light.box_filtered {
            let scale = pyramid.radiance_scale();
            on_device.pyramid = Some(DevicePyramid::new(device, "environment pyramid", pyramid, scale, way_around)?);
        }
        if let Some(prefiltered) = &light.prefiltered {
            let (PrefilteredLight { by_ggx, irradiance }, scale) = (prefiltered, prefiltered.radiance_scale());
            on_device.pyramid = Some(DevicePyramid::new(device, "environment pyramid", by_ggx, scale, way_around)?);
            on_device.irradiance = Some(DevicePyramid::new(device, "irradiance map", irradiance, scale, way_around)?);
        }
        if lookups.map {
            let map = LightMap::new(environment);
            on_device.map = Some(upload_map(device, environment, &map, 1.0)?);
            if lookups.aliases {
                let (aliases, storage) = (map.aliases(), vk::BufferUsageFlags::STORAGE_BUFFER);
                let aliases = bytemuck::cast_slice(&aliases);
                on_device.aliases = Some(Buffer::with_contents(device, "light aliases", storage, aliases)?);
            }
        }
        Ok(on_device)
    }

    /// Adds what fitted threads look up. Bindings that no kernel will use have a single texel.
    fn add_blurred(
        &mut self,
        device: &Arc<Device>,
        environment: &Environment,
        blurred: &BlurredLight,
        way_around: Option<WayAround>,
    ) -> Result<()> {
        let nothing = Pyramid { face_size: 1, levels: vec![vec![[0.0; 3]; 6]] };
        self.finest_level = finest_level(&blurred.rest);
        let pyramid = &blurred.rest.levels;
        let source_pyramid = blurred.sources.as_ref().map_or(&nothing, |pyramid| &pyramid.levels);
        let scale = blurred.radiance_scale();
        let map = match blurred.needs.map {
            true => LightMap::with_sources_marked(environment),
            false => LightMap { width: 1, height: 1, texels: vec![[0.0; 4]] },
        };
        self.map = Some(upload_map(device, environment, &map, scale)?);
        let upload = |name, pyramid: &Pyramid| DevicePyramid::new(device, name, pyramid, scale, way_around).map(Some);
        self.pyramid = upload("environment pyramid", pyramid)?;
        self.source_pyramid = upload("source pyramid", source_pyramid)?;
        self.has_lamps = environment.has_small_sources();
        let (words, uniform) = (environment.small_sources().device_words(scale), vk::BufferUsageFlags::UNIFORM_BUFFER);
        self.sources = Some(Buffer::with_contents(device, "light sources", uniform, bytemuck::cast_slice(&words))?);
        Ok(())
    }

    /// All of it, by name in the shader.
    pub(super) fn bindings(&self) -> Vec<(&'static str, Bound<'_>)> {
        let pyramids = [
            ("environment_pyramid", &self.pyramid),
            ("source_pyramid", &self.source_pyramid),
            ("irradiance_map", &self.irradiance),
        ];
        let pyramids = pyramids.into_iter().filter_map(|(name, pyramid)| {
            let DevicePyramid { image, sampler, .. } = pyramid.as_ref()?;
            Some((name, Bound::Sampled(image, sampler)))
        });
        let buffers = [("LightAliases", &self.aliases), ("Sources", &self.sources)];
        let buffers = buffers.into_iter().filter_map(|(name, buffer)| Some((name, Bound::from(buffer.as_ref()?))));
        let map = self.map.iter().map(|map| ("environment_map", Bound::from(map)));
        pyramids.chain(map).chain(buffers).collect()
    }

    /// Texels along the edge of a face of the pyramid; 0 if there is none.
    pub(super) fn face_size(&self) -> f32 {
        self.pyramid.as_ref().map_or(0.0, |pyramid| pyramid.face_size as f32)
    }

    /// Radiance of a texel of value 1.
    pub(super) fn radiance_scale(&self) -> f32 {
        self.pyramid.as_ref().map_or(1.0, |pyramid| pyramid.scale)
    }
}

/// Uploads `map`, of `environment`: its radiance over `scale`.
fn upload_map(device: &Arc<Device>, environment: &Environment, map: &LightMap, scale: f32) -> Result<vulkan::Image> {
    check_map_size(device, environment, [map.width, map.height], "scale it down, or use method filtered")?;
    let shape = ImageShape::plane(vk::Format::R32G32B32A32_SFLOAT, map.width as u32, map.height as u32);
    let texels: Vec<_> = map.texels.iter().map(|&[r, g, b, a]| [r / scale, g / scale, b / scale, a]).collect();
    Ok(vulkan::Image::with_texels(device, "environment map", shape, &[bytemuck::cast_slice(&texels).to_vec()])?)
}

impl DevicePyramid {
    /// Uploads `pyramid` by `way_around`, as half floats of radiance over `scale` where they hold it.
    pub(super) fn new(
        device: &Arc<Device>,
        name: &str,
        pyramid: &Pyramid,
        scale: f32,
        way_around: Option<WayAround>,
    ) -> Result<Self> {
        Self::of_kind(device, name, ImageKind::Cube, &[pyramid], scale, way_around)
    }

    /// The same of several pyramids alike, one after the other.
    fn of_kind(
        device: &Arc<Device>,
        name: &str,
        kind: ImageKind,
        pyramids: &[&Pyramid],
        scale: f32,
        way_around: Option<WayAround>,
    ) -> Result<Self> {
        let single = vk::Format::R32G32B32A32_SFLOAT;
        let fit_half = pyramids.iter().all(|pyramid| pyramid.fits_half(scale));
        let use_single = !fit_half && device.filters_linearly(single);
        let level = |level| -> Vec<u8> {
            let of_pyramid = |pyramid: &&Pyramid| -> Vec<u8> {
                if use_single {
                    bytemuck::cast_slice(&pyramid.texels_rgba32f(level, scale)).to_vec()
                } else {
                    bytemuck::cast_slice(&pyramid.texels_rgba16f(level, scale)).to_vec()
                }
            };
            pyramids.iter().map(of_pyramid).collect::<Vec<_>>().concat()
        };
        let first = pyramids[0];
        let levels: Vec<_> = (0..first.levels.len()).map(level).collect();
        let face_size = first.face_size as u32;
        let shape = ImageShape {
            format: if use_single { single } else { vk::Format::R16G16B16A16_SFLOAT },
            extent: [face_size, face_size, 1],
            levels: levels.len() as u32,
            kind,
        };
        let image = vulkan::Image::with_texels(device, name, shape, &levels)?;
        let sampler = Sampler::new(device, name, SamplerKind::Trilinear)?;
        match way_around {
            Some(WayAround::DrawWithCubeMaps) => draw_with_cube_map(device, &image, &sampler)?,
            None => {}
        }
        Ok(Self { image, sampler, face_size, scale })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::RepairCounts;

    #[test]
    fn light_of_more_pixels_than_a_buffer_can_list_is_refused_by_name() {
        let map = Environment::new("big.exr".into(), 3, 2, vec![[1.0; 3]; 6], RepairCounts::default());
        assert!(check_pixels(6, &map).is_ok());
        let error = check_pixels(5, &map).unwrap_err().to_string();
        assert!(error.starts_with("big.exr: is 3 x 2 pixels") && error.contains("5 at most"), "{error}");
    }
}
