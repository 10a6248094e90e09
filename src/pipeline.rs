//! The method on one screen: the frame as a graph of passes, and the scene on a device that runs it.
use crate::Result;
use crate::graph::{BufferHandle, Executable, FrameGraph, ImageHandle};
use crate::light::finest_level;
use crate::memo::{Held, Keyed, Round};
use crate::passes::*;
use crate::prepare::{NamedMesh, Prepared};
use crate::progress::Observer;
use crate::rendering::Rendering;
use crate::specialise::{ShadersOfMaterials, classify_constants};
use crate::statistics::median;
use crate::steps::{
    CheckDevice, CompileCompute, CompileGeometryCache, KeyedMaterial, UploadBackground, UploadIrradiance, UploadLight,
    UploadMaterials, UploadMesh, UploadShaders, light, pipelines,
};
use crate::vulkan::{ComputePipeline, Device, Frames, PassTime, Shader, compiled};
use std::sync::Arc;

/// Which results of a frame are wanted; what none of them needs is not computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wanted {
    /// Linear radiance, for EXR.
    pub radiance: bool,
    /// Display values, for PNG.
    pub display: bool,
    /// The geometry cache, for the shader's CPU twin.
    pub geometry: bool,
}

impl Wanted {
    /// Linear radiance alone.
    pub const RADIANCE: Self = Self { radiance: true, display: false, geometry: false };
    /// Display values alone.
    pub const DISPLAY: Self = Self { radiance: false, display: true, geometry: false };
}

/// The frame: pass 1 and pass 2 of the paper and what surrounds them.
pub(crate) fn declare<'a>(
    graph: &mut FrameGraph<'a>,
    device_scene: &'a DeviceScene,
    region: Region,
    view: &'a View,
) -> Frame {
    let geometry = geometry_cache(graph, &device_scene.geometry_cache, region, view); // pass 1 of the paper
    let tiles = classify(graph, &device_scene.classify, geometry, region, view);
    let Shaded { radiance, lookups } = shade(graph, &device_scene.shade, geometry, &tiles, view); // pass 2 of the paper
    let radiance = background(graph, &device_scene.background, radiance, &tiles, view);
    let display = tone_map(graph, &device_scene.tone_map, radiance, view);
    Frame { geometry, counters: tiles.counters, lookups, radiance, display }
}

/// What a frame leaves.
pub(crate) struct Frame {
    pub geometry: ImageHandle,
    pub counters: BufferHandle,
    pub lookups: BufferHandle,
    pub radiance: ImageHandle,
    pub display: ImageHandle,
}

/// A scene on a device, ready to render. Cheap to clone.
#[derive(Clone)]
pub struct DeviceScene {
    /// Where from and how it is looked at. Its number of sub-pixels is that which the shaders were compiled for.
    pub view: View,
    geometry_cache: GeometryCache,
    classify: Classify,
    shade: Shade,
    background: Background,
    tone_map: ToneMap,
    way_around: Option<WayAround>,
    device: Arc<Device>,
    /// All that its round was asked for: what the next one has in common with this one is not made again.
    _held: Held,
}

impl DeviceScene {
    /// Asks `round` for all that a frame of `prepared` needs on `device`: filtered, compiled and uploaded.
    ///
    /// # Errors
    /// No device memory left, a limit of the device exceeded, a method that does not run there; cancelled.
    pub fn new(device: &Arc<Device>, prepared: &Prepared, round: &Round) -> Result<Self> {
        let &Prepared { method, sampling, ref view, ref environment, .. } = prepared;
        let shader = shade_shader(method)?;
        if prepared.show_environment {
            BackgroundMap::check_size(device, environment)?;
        }
        // Held, so that it is opened once for all that is compiled.
        pipelines(round, device)?;
        let way_around = round.ask(&CheckDevice(device))?.way_around(device)?;
        let geometry_cache = ask_geometry_cache(device, prepared, round)?;
        let materials = prepared.materials.iter();
        let materials: Vec<_> =
            materials.map(|m| KeyedMaterial { brdf: &m.brdf, threads: m.threads.as_ref() }).collect();
        let evaluates_brdf = method.evaluates_brdf(environment);
        let shaded = prepared.shaded();
        // Drafts follow each other faster than light could be uploaded and shaders compiled for what each of them needs.
        let light = light(round, Some(device), method, environment, &shaded, prepared.is_draft)?;
        let finest_level = light.blurred.as_ref().map(|blurred| finest_level(&blurred.rest));
        let upload = UploadMaterials { device, method, materials: &materials, evaluates_brdf, finest_level };
        let materials = round.ask(&upload)?;
        let View { width, height, .. } = prepared.view;
        let most = most_shaders([width, height], device.limits().max_storage_buffer_range);
        let shaders = ShadersOfMaterials::new(prepared, light.blurred.as_ref(), most);
        let irradiance = light.blurred.as_ref().map(|light| round.ask(&UploadIrradiance { device, light, way_around }));
        let irradiance = irradiance.transpose()?;
        let light = round.ask(&UploadLight { device, method, environment, light: &light, way_around })?;
        let Pipelines { classify, background, tone_map, shade } =
            ask_pipelines(device, prepared, shader, &shaders, round)?;
        let background = match prepared.show_environment {
            true => Background::Environment {
                pipeline: background,
                map: round.ask(&UploadBackground { device, environment })?,
            },
            false => Background::Nothing(background),
        };
        Ok(Self {
            view: view.clone(),
            geometry_cache,
            classify: Classify {
                pipeline: classify,
                smooth_variance: prepared.smooth_variance(),
                shaders: round.ask(&UploadShaders { device, of_materials: &shaders.of_materials })?,
                shader_count: shaders.constants.len() as u32,
                shader_of_mixed: shaders.of_mixed,
            },
            shade: Shade {
                pipelines: shade,
                materials,
                light,
                irradiance,
                sampling,
                method,
                most_samples: most_samples(device.description().kind),
            },
            background,
            tone_map: ToneMap { pipeline: tone_map },
            way_around,
            device: device.clone(),
            _held: round.held(),
        })
    }

    /// Whether it shades by the same compiled shaders as `other`.
    pub fn shades_as(&self, other: &Self) -> bool {
        let [keys, other_keys] = [self, other].map(|scene| scene.shade.pipelines.iter().map(|pipeline| pipeline.key));
        keys.eq(other_keys)
    }

    /// Where in the picture objects may be.
    pub(crate) fn region(&self, view: &View) -> Region {
        self.geometry_cache.region(view)
    }

    /// An error for a `view` that is larger than the device can do with the shaders that the scene has.
    pub(crate) fn check_size(&self, view: &View) -> Result<()> {
        check_cache_size(&self.device, view.cache_size())?;
        check_lists(&self.device, [view.width, view.height], self.classify.shader_count as usize)
    }

    /// Starts the random numbers of later frames from `seed`: other noise, for methods that have any.
    pub fn reseed(&mut self, seed: u64) {
        self.shade.sampling.seed = seed;
    }

    /// Renders the frame `repeat` times and reads back what is `wanted`.
    ///
    /// # Errors
    /// A view that is larger than the device can do; whatever Vulkan refuses.
    pub fn render(&self, wanted: Wanted, repeat: u32) -> Result<Rendering> {
        self.render_watched(wanted, repeat, &())
    }

    /// [`render`](Self::render), watched by `observer`, which can stop it between frames, and between portions of a long one.
    ///
    /// # Errors
    /// As there; [`Error::Cancelled`](crate::Error::Cancelled).
    pub fn render_watched(&self, wanted: Wanted, repeat: u32, observer: &dyn Observer) -> Result<Rendering> {
        self.check_size(&self.view)?;
        let mut graph = FrameGraph::new();
        let region = match wanted.geometry {
            true => Region::whole(&self.view),
            false => self.region(&self.view),
        };
        let frame = declare(&mut graph, self, region, &self.view);
        let mut readbacks = Readbacks::new(&self.device, graph);
        let counters = readbacks.buffer("counters", frame.counters, size_of::<Counters>() as u64)?;
        let lookups = readbacks.buffer("lookups", frame.lookups, size_of::<u64>() as u64)?;
        let radiance = readbacks.image("radiance", frame.radiance, wanted.radiance)?;
        let display = readbacks.image("display", frame.display, wanted.display)?;
        let geometry = readbacks.image("geometry", frame.geometry, wanted.geometry)?;
        let Readbacks { graph, imports, .. } = readbacks;
        let executable = Executable::new(&self.device, graph, &imports)?;

        let mut frames = Frames::new(&self.device, "frame", 2)?;
        let mut frame_ms = Vec::new();
        let mut passes: Vec<Vec<PassTime>> = Vec::new();
        for _ in 0..repeat.max(1) {
            observer.check()?;
            let start = std::time::Instant::now();
            passes.push(executable.execute_timed(&self.device, &mut frames, observer)?);
            frame_ms.push(start.elapsed().as_secs_f64() * 1e3);
        }
        let pass_median = |index: usize| PassTime {
            name: passes[0][index].name.clone(),
            gpu_ms: median(passes.iter().map(|frame| frame[index].gpu_ms)),
        };
        Ok(Rendering {
            radiance: texels(radiance.as_deref()),
            display: texels(display.as_deref()),
            geometry: texels(geometry.as_deref()),
            counters: texels(Some(&counters)).first().copied().unwrap_or_default(),
            lookups: texels(Some(&lookups)).first().copied().unwrap_or_default(),
            passes: (0..passes[0].len()).map(pass_median).collect(),
            frame_ms: median(frame_ms),
            device_memory_bytes: self.device.allocated_bytes(),
            plan: executable.plan.to_string(),
            way_around: self.way_around,
        })
    }
}

/// What computes a frame.
struct Pipelines {
    classify: Keyed<ComputePipeline>,
    background: Keyed<ComputePipeline>,
    tone_map: Keyed<ComputePipeline>,
    /// For each class of pixels.
    shade: Vec<Keyed<ComputePipeline>>,
}

/// Compiling takes long: so all are asked for at once, and are compiled on several cores.
fn ask_pipelines(
    device: &Arc<Device>,
    prepared: &Prepared,
    shade: &'static Shader,
    shaders: &ShadersOfMaterials,
    round: &Round,
) -> Result<Pipelines> {
    let background = if prepared.show_environment { &compiled::BACKGROUND } else { &compiled::CLEAR_UNCOVERED };
    let around = [
        (&compiled::CLASSIFY, classify_constants(prepared, shaders)),
        (background, vec![]),
        (&compiled::TONE_MAP, vec![]),
    ];
    let of_classes = shaders.constants_of_classes().map(|constants| (shade, constants));
    let all: Vec<_> = around.into_iter().chain(of_classes).collect();
    let all: Vec<_> = all.iter().map(|(shader, constants)| CompileCompute { device, shader, constants }).collect();
    let mut asked = round.ask_all(&all)?;
    let shade = asked.split_off(3);
    let [classify, background, tone_map] = asked.try_into().unwrap_or_else(|_| unreachable!("three were split off"));
    Ok(Pipelines { classify, background, tone_map, shade })
}

/// The pass that draws the objects of `prepared`, where the geometry cache of its view is within what `device` can do.
fn ask_geometry_cache(device: &Arc<Device>, prepared: &Prepared, round: &Round) -> Result<GeometryCache> {
    check_cache_size(device, prepared.view.cache_size())?;
    let upload = |NamedMesh { name, mesh }: &NamedMesh| round.ask(&UploadMesh { device, name, mesh });
    Ok(GeometryCache {
        pipeline: round.ask(&CompileGeometryCache { device, has_tangents: prepared.has_tangents() })?,
        meshes: prepared.meshes.iter().map(upload).collect::<Result<_>>()?,
        objects: prepared.objects.clone(),
    })
}

/// Only pass 1 of the paper: the texels of the geometry cache, as [`Rendering::geometry`] has them. Needs no threads.
///
/// # Errors
/// No device memory left, or a limit of the device exceeded.
pub fn render_geometry(device: &Arc<Device>, prepared: &Prepared, round: &Round) -> Result<Vec<[u32; 2]>> {
    let pass = ask_geometry_cache(device, prepared, round)?;
    let mut graph = FrameGraph::new();
    let geometry = geometry_cache(&mut graph, &pass, Region::whole(&prepared.view), &prepared.view);
    let mut readbacks = Readbacks::new(device, graph);
    let target = readbacks.image("geometry", geometry, true)?;
    readbacks.run("geometry")?;
    Ok(texels(target.as_deref()))
}

#[cfg(test)]
#[path = "pipeline_tests.rs"]
mod tests;
