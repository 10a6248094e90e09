//! What shading looks up of the environment, on the device: only what its method and its materials need.
use super::background::check_map_size;
use super::vmf_pyramid::blurred;
use crate::Result;
use crate::brdf::{MIN_COS_THETA_D, half_vector_width};
use crate::environment::sources::{CLEAR, clearance};
use crate::environment::{Environment, LightMap, LightSource, Pyramid};
use crate::method::Method;
use crate::prepare::PreparedMaterial;
use crate::threads::Threads;
use crate::threads::fitted::kernel::FINEST_WIDTH_RAD;
use crate::vulkan::{self, Bound, Buffer, Device, ImageKind, ImageShape, PipelineCache, Sampler, SamplerKind};
use ash::vk;
use glam::DVec3;
use std::path::Path;
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
    /// For kernels: what is there besides the pyramid, whose finest level is this one.
    extras: Extras,
    finest_level: f32,
}

/// What kernels may look up besides the pyramid.
#[derive(Clone, Copy, Default)]
struct Extras {
    /// The environment as it is, for those sharper than the pyramid.
    map: bool,
    /// The sources, for lobes in which they are mirrored.
    sources: bool,
}

impl Extras {
    /// What those of `materials` do, in a pyramid of this finest level.
    fn of(environment: &Environment, materials: &[PreparedMaterial], finest_level: f32) -> Self {
        let sources = &environment.small_sources().list;
        let mirrors = |material: &PreparedMaterial| {
            let lobe_width = (MIN_COS_THETA_D * half_vector_width(&material.brdf)) as f32;
            sources.iter().any(|source| clearance(0.0, source.width_rad() as f32, lobe_width) < CLEAR[1])
        };
        let is_sharp = |material: &PreparedMaterial| match material.threads.as_deref() {
            Some(Threads::Fitted(table)) => table.sharpest_level() < finest_level,
            _ => false,
        };
        Self { map: materials.iter().any(is_sharp), sources: materials.iter().any(mirrors) }
    }
}

/// A pyramid on the device.
pub(super) struct DevicePyramid {
    pub(super) image: vulkan::Image,
    pub(super) sampler: Sampler,
    face_size: u32,
    /// Radiance of a texel of value 1: what keeps suns within half floats.
    scale: f32,
}

impl DeviceLight {
    /// Makes and uploads what `method` looks up of `environment` for `materials`; what takes long is kept in `cache_folder`.
    ///
    /// # Errors
    /// No device memory left, or a map wider or higher than the device's images can be.
    pub fn new(
        device: &Arc<Device>,
        cache: &PipelineCache,
        cache_folder: Option<&Path>,
        method: Method,
        environment: &Environment,
        materials: &[PreparedMaterial],
    ) -> Result<Self> {
        let shader = method.shader()?;
        let mut light = Self::default();
        if shader.declares("irradiance_map")? {
            light.add_blurred(device, cache, cache_folder, environment, materials)?;
            return Ok(light);
        }
        if shader.declares("environment_pyramid")? {
            let pyramid = environment.box_filtered();
            let scale = pyramid.radiance_scale();
            light.pyramid = Some(DevicePyramid::new(device, "environment pyramid", pyramid, scale)?);
        }
        if shader.declares("environment_map")? {
            let map = LightMap::new(environment);
            light.map = Some(upload_map(device, environment, &map, 1.0)?);
            if shader.declares("LightAliases")? {
                let (aliases, storage) = (map.aliases(), vk::BufferUsageFlags::STORAGE_BUFFER);
                let aliases = bytemuck::cast_slice(&aliases);
                light.aliases = Some(Buffer::with_contents(device, "light aliases", storage, aliases)?);
            }
        }
        Ok(light)
    }

    /// Adds what fitted threads look up. Bindings that no kernel of `materials` will use have a single texel.
    fn add_blurred(
        &mut self,
        device: &Arc<Device>,
        cache: &PipelineCache,
        cache_folder: Option<&Path>,
        environment: &Environment,
        materials: &[PreparedMaterial],
    ) -> Result<()> {
        let blurred = |part| blurred(device, cache, cache_folder, part, &());
        let rest = blurred(environment.rest())?;
        self.finest_level = (rest.finest_width_rad() / FINEST_WIDTH_RAD).log2() as f32;
        self.extras = Extras::of(environment, materials, self.finest_level);
        let pyramid = &rest.levels;
        let nothing = Pyramid { face_size: 1, levels: vec![vec![[0.0; 3]; 6]] };
        let sources_alone = environment.sources_alone().filter(|_| self.extras.sources);
        let source_pyramid = sources_alone.map(blurred).transpose()?.map_or(&nothing, |pyramid| &pyramid.levels);
        // One scale for all that is added up.
        let scale = pyramid.radiance_scale().max(source_pyramid.radiance_scale());
        let map = match self.extras.map {
            true => LightMap::with_sources_marked(environment),
            false => LightMap { width: 1, height: 1, texels: vec![[0.0; 4]] },
        };
        self.map = Some(upload_map(device, environment, &map, scale)?);
        self.pyramid = Some(DevicePyramid::new(device, "environment pyramid", pyramid, scale)?);
        self.source_pyramid = Some(DevicePyramid::new(device, "source pyramid", source_pyramid, scale)?);
        self.irradiance = Some(DevicePyramid::new(device, "irradiance map", environment.rest().irradiance(), scale)?);
        self.sources = Some(source_buffer(device, &environment.small_sources().list, scale)?);
        Ok(())
    }

    /// Whether it has all that fitted threads of `materials` look up of `environment`, which it was made for.
    pub fn serves(&self, environment: &Environment, materials: &[PreparedMaterial]) -> bool {
        let needed = Extras::of(environment, materials, self.finest_level);
        (self.extras.map || !needed.map) && (self.extras.sources || !needed.sources)
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
    check_map_size(device, environment, [map.width, map.height], "scale it down, or use --method filtered")?;
    let shape = ImageShape::plane(vk::Format::R32G32B32A32_SFLOAT, map.width as u32, map.height as u32);
    let texels: Vec<_> = map.texels.iter().map(|&[r, g, b, a]| [r / scale, g / scale, b / scale, a]).collect();
    Ok(vulkan::Image::with_texels(device, "environment map", shape, &[bytemuck::cast_slice(&texels).to_vec()])?)
}

/// Uploads `sources`, their power over `scale`: `Sources` in glsl/methods/fitted.glsl.
fn source_buffer(device: &Arc<Device>, sources: &[LightSource], scale: f32) -> Result<Buffer> {
    // The count, and what aligns the structures to 16 bytes.
    let mut words = vec![sources.len() as u32, 0, 0, 0];
    for source in sources {
        let LightSource { direction, axes: [x, y], power } = *source;
        let vectors = [(direction, source.width_rad()), (x, 0.0), (y, 0.0), (power / f64::from(scale), 0.0)];
        let words_of = |(vector, w): (DVec3, f64)| vector.extend(w).as_vec4().to_array().map(f32::to_bits);
        words.extend(vectors.into_iter().flat_map(words_of));
    }
    // A buffer cannot be empty, nor its array.
    words.resize(words.len().max(4 + 16), 0);
    let storage = vk::BufferUsageFlags::STORAGE_BUFFER;
    Ok(Buffer::with_contents(device, "light sources", storage, bytemuck::cast_slice(&words))?)
}

impl DevicePyramid {
    /// Uploads `pyramid`, as half floats of radiance over `scale` where they hold it.
    pub(super) fn new(device: &Arc<Device>, name: &str, pyramid: &Pyramid, scale: f32) -> Result<Self> {
        let single = vk::Format::R32G32B32A32_SFLOAT;
        let use_single = !pyramid.fits_half() && device.filters_linearly(single);
        let level = |level| -> Vec<u8> {
            if use_single {
                bytemuck::cast_slice(&pyramid.texels_rgba32f(level, scale)).to_vec()
            } else {
                bytemuck::cast_slice(&pyramid.texels_rgba16f(level, scale)).to_vec()
            }
        };
        let levels: Vec<_> = (0..pyramid.levels.len()).map(level).collect();
        let face_size = pyramid.face_size as u32;
        let shape = ImageShape {
            format: if use_single { single } else { vk::Format::R16G16B16A16_SFLOAT },
            extent: [face_size, face_size, 1],
            levels: levels.len() as u32,
            kind: ImageKind::Cube,
        };
        Ok(Self {
            image: vulkan::Image::with_texels(device, name, shape, &levels)?,
            sampler: Sampler::new(device, name, SamplerKind::Trilinear)?,
            face_size,
            scale,
        })
    }
}
