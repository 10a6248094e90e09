//! The method on one screen: the frame as a graph of passes, and the renderer that runs it.
use crate::graph::{BufferHandle, Executable, FrameGraph, ImageHandle};
use crate::method::Method;
use crate::output::ExrHeader;
use crate::passes::*;
use crate::prepare::{Prepared, PreparedMaterial};
use crate::vulkan::{Device, Frames, PassTime, PipelineCache};
use crate::{Error, Result};
use std::path::Path;
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

/// The frame: pass 1 and pass 2 of the paper and what surrounds them.
pub(crate) fn declare<'a>(graph: &mut FrameGraph<'a>, renderer: &'a Renderer, view: &'a View) -> Frame {
    let geometry = geometry_cache(graph, &renderer.geometry_cache, view); // pass 1 of the paper
    let tiles = classify(graph, &renderer.classify, geometry, view);
    let Shaded { radiance, lookups } = shade(graph, &renderer.shade, geometry, &tiles, view); // pass 2 of the paper
    let radiance = match &renderer.background {
        Some(environment) => background(graph, environment, radiance, view),
        None => radiance,
    };
    let display = tone_map(graph, &renderer.tone_map, radiance, view);
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

/// A scene on a device, ready to render.
#[derive(Clone)]
pub struct Renderer {
    /// Where from and how it is looked at. Its number of sub-pixels is that which the shaders were compiled for.
    pub view: View,
    geometry_cache: Arc<GeometryCache>,
    classify: Arc<Classify>,
    shade: Shade,
    background: Option<Arc<Background>>,
    tone_map: Arc<ToneMap>,
    device: Arc<Device>,
}

/// Results of a rendering, as far as they were wanted.
#[derive(Clone, Debug, Default)]
pub struct Rendering {
    /// RGBA, linear radiance times coverage, row by row from the top left.
    pub radiance: Vec<[f32; 4]>,
    /// RGBA, 8 bits each; colour not multiplied by alpha.
    pub display: Vec<u8>,
    /// Texels of the geometry cache, row by row at sub-pixel resolution.
    pub geometry: Vec<[u32; 2]>,
    /// What the classification counted.
    pub counters: Counters,
    /// Lookups in the environment that shading made.
    pub lookups: u64,
    /// Time on the GPU by pass, median over the repetitions; empty where the device cannot tell.
    pub passes: Vec<PassTime>,
    /// From the start of recording until the GPU is done, in milliseconds: median over the repetitions.
    pub frame_ms: f64,
    /// Device memory in use while rendering.
    pub device_memory_bytes: u64,
    /// The plan of the frame as text.
    pub plan: String,
}

impl Renderer {
    /// Uploads `prepared` and compiles the shaders that it needs.
    ///
    /// # Errors
    /// No device memory left, or a limit of the device exceeded.
    pub fn new(device: &Arc<Device>, cache_folder: Option<&Path>, prepared: &Prepared) -> Result<Self> {
        let mut renderer = Self::of_objects(device, cache_folder, prepared, prepared.method, prepared.sampling)?;
        if prepared.show_environment {
            let cache = PipelineCache::new(device, cache_folder)?;
            renderer.background = Some(Arc::new(Background::new(device, &cache, &prepared.environment)?));
        }
        Ok(renderer)
    }

    /// The same for only the objects of `prepared`, by `method`, for which it may not have been prepared if that needs no threads.
    ///
    /// # Errors
    /// No device memory left, or a limit of the device exceeded.
    pub fn of_objects(
        device: &Arc<Device>,
        cache_folder: Option<&Path>,
        prepared: &Prepared,
        method: Method,
        sampling: Sampling,
    ) -> Result<Self> {
        let Prepared { view, .. } = prepared;
        let cache = PipelineCache::new(device, cache_folder)?;
        let geometry_cache = Arc::new(upload_geometry(device, &cache, prepared)?);
        let materials = upload_materials(device, method, prepared)?;
        let light = upload_light(device, &cache, cache_folder, method, prepared)?;
        Ok(Self {
            view: view.clone(),
            geometry_cache,
            classify: Arc::new(Classify::new(device, &cache, view.subpixels)?),
            shade: Shade::new(device, &cache, method, sampling, view.subpixels, materials, light)?,
            background: None,
            tone_map: Arc::new(ToneMap::new(device, &cache)?),
            device: device.clone(),
        })
    }

    /// The same as this one, which was made for `before`, for `prepared`: what both have in common (see
    /// [`crate::prepare::prepare_again`]) is neither uploaded nor compiled again, and passes of the same parts make the same.
    ///
    /// # Errors
    /// No device memory left, or a limit of the device exceeded.
    pub fn again(&self, cache_folder: Option<&Path>, before: &Prepared, prepared: &Prepared) -> Result<Self> {
        let Prepared { method, sampling, environment, .. } = prepared;
        let (device, cache) = (&self.device, PipelineCache::new(&self.device, cache_folder)?);
        let mut renderer = self.clone();
        renderer.view = prepared.view.clone();
        let subpixels = renderer.view.subpixels;
        check_size(device, &renderer.view)?;
        let meshes =
            |prepared: &Prepared| prepared.meshes.iter().map(|(_, mesh)| Arc::as_ptr(mesh)).collect::<Vec<_>>();
        if meshes(before) != meshes(prepared) || before.objects != prepared.objects {
            renderer.geometry_cache = Arc::new(upload_geometry(device, &cache, prepared)?);
        }
        let same_method = before.method == *method;
        let same_environment = Arc::ptr_eq(&before.environment, environment);
        let same_subpixels = self.view.subpixels == subpixels;
        if !same_subpixels {
            renderer.classify = Arc::new(Classify::new(device, &cache, subpixels)?);
        }
        let brdfs = |prepared: &Prepared| {
            let of =
                |material: &PreparedMaterial| (material.source.clone(), material.threads.as_ref().map(Arc::as_ptr));
            prepared.materials.iter().map(of).collect::<Vec<_>>()
        };
        let same_use = method.evaluates_brdf(&before.environment) == method.evaluates_brdf(environment);
        let same_materials = same_method && same_use && brdfs(before) == brdfs(prepared);
        if !same_materials || !same_method || !same_environment || !same_subpixels {
            let materials = match same_materials {
                true => self.shade.materials.clone(),
                false => upload_materials(device, *method, prepared)?,
            };
            let same_light = same_method && same_environment;
            let light = match same_light && self.shade.light.serves(environment, &prepared.materials) {
                true => self.shade.light.clone(),
                false => upload_light(device, &cache, cache_folder, *method, prepared)?,
            };
            renderer.shade = Shade::new(device, &cache, *method, *sampling, subpixels, materials, light)?;
        }
        renderer.shade.sampling = *sampling;
        if !prepared.show_environment {
            renderer.background = None;
        } else if renderer.background.is_none() || !same_environment {
            renderer.background = Some(Arc::new(Background::new(device, &cache, environment)?));
        }
        Ok(renderer)
    }

    /// Starts the random numbers of later frames from `seed`: other noise, for methods that have any.
    pub fn reseed(&mut self, seed: u64) {
        self.shade.sampling.seed = seed;
    }

    /// Renders the frame `repeat` times and reads back what is `wanted`.
    ///
    /// # Errors
    /// Whatever Vulkan refuses.
    pub fn render(&self, wanted: Wanted, repeat: u32) -> Result<Rendering> {
        let mut graph = FrameGraph::new();
        let frame = declare(&mut graph, self, &self.view);
        let mut readbacks = Readbacks::new(&self.device, graph);
        let counters = readbacks.buffer("read_counters", frame.counters, size_of::<Counters>() as u64)?;
        let lookups = readbacks.buffer("read_lookups", frame.lookups, size_of::<u64>() as u64)?;
        let View { width, height, .. } = self.view;
        let radiance = readbacks.image("read_radiance", frame.radiance, [width, height], 16, wanted.radiance)?;
        let display = readbacks.image("read_display", frame.display, [width, height], 4, wanted.display)?;
        let geometry = readbacks.image("read_geometry", frame.geometry, self.view.cache_size(), 8, wanted.geometry)?;
        let Readbacks { graph, imports, .. } = readbacks;
        let executable = Executable::new(&self.device, graph, &imports)?;

        let mut frames = Frames::new(&self.device, "frame", 2)?;
        let mut frame_ms = Vec::new();
        let mut passes: Vec<Vec<PassTime>> = Vec::new();
        for _ in 0..repeat.max(1) {
            let start = std::time::Instant::now();
            passes.push(executable.execute_timed(&self.device, &mut frames)?);
            frame_ms.push(start.elapsed().as_secs_f64() * 1e3);
        }
        let pass_median = |index: usize| PassTime {
            name: passes[0][index].name.clone(),
            gpu_ms: median(passes.iter().map(|frame| frame[index].gpu_ms).collect()),
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
        })
    }
}

impl Rendering {
    /// What an EXR file of it, rendered from `prepared` on the device of this name, says of how it was made.
    pub fn exr_header(&self, prepared: &Prepared, device: &str) -> ExrHeader {
        let materials: Vec<_> = prepared.materials.iter().map(|material| material.name.as_str()).collect();
        ExrHeader {
            method: prepared.method.name().to_owned(),
            threads: prepared.sampling.count,
            material: materials.join(", "),
            environment: prepared.environment.name.clone(),
            device: device.to_owned(),
            seconds: self.frame_ms * 1e-3,
            ..ExrHeader::default()
        }
    }

    /// Time on the GPU of all passes but those that copy results back, in milliseconds.
    pub fn gpu_ms(&self) -> f64 {
        self.passes.iter().filter(|pass| !pass.is_readback()).map(|pass| pass.gpu_ms).sum()
    }
}

impl PassTime {
    /// Whether the pass only copies results into memory that the CPU reads.
    pub fn is_readback(&self) -> bool {
        self.name.starts_with("read_")
    }
}

/// Uploads the meshes of `prepared`, where the geometry cache of its view is within what `device` can do.
fn upload_geometry(device: &Arc<Device>, cache: &PipelineCache, prepared: &Prepared) -> Result<GeometryCache> {
    check_size(device, &prepared.view)?;
    let meshes = prepared.meshes.iter().map(|(name, mesh)| DeviceMesh::new(device, name, mesh));
    GeometryCache::new(device, cache, meshes.collect::<Result<_>>()?, prepared.objects.clone())
}

/// An error for a view whose geometry cache is larger than images of `device` can be.
fn check_size(device: &Device, view: &View) -> Result<()> {
    let largest = device.limits().max_image_dimension2_d;
    let [width, height] = view.cache_size();
    if width.max(height) <= largest {
        return Ok(());
    }
    let problem = format!("needs {width} x {height} sub-pixels, this device's images have at most {largest} a side");
    Err(Error::input("image size", problem, "use a smaller --size or fewer --subpixels"))
}

/// Uploads what `method` looks up of the materials of `prepared`.
fn upload_materials(device: &Arc<Device>, method: Method, prepared: &Prepared) -> Result<Arc<DeviceMaterials>> {
    let brdfs = prepared.materials.iter().map(|material| (&material.brdf, material.threads.as_deref()));
    let evaluates_brdf = method.evaluates_brdf(&prepared.environment);
    Ok(Arc::new(DeviceMaterials::new(device, method, brdfs, evaluates_brdf)?))
}

/// Uploads what `method` looks up of the environment of `prepared`.
fn upload_light(
    device: &Arc<Device>,
    cache: &PipelineCache,
    cache_folder: Option<&Path>,
    method: Method,
    prepared: &Prepared,
) -> Result<Arc<DeviceLight>> {
    let Prepared { environment, materials, .. } = prepared;
    Ok(Arc::new(DeviceLight::new(device, cache, cache_folder, method, environment, materials)?))
}

/// Only pass 1 of the paper: the texels of the geometry cache, as [`Rendering::geometry`] has them. Needs no threads.
///
/// # Errors
/// No device memory left, or a limit of the device exceeded.
pub fn render_geometry(
    device: &Arc<Device>,
    cache_folder: Option<&Path>,
    prepared: &Prepared,
) -> Result<Vec<[u32; 2]>> {
    let cache = PipelineCache::new(device, cache_folder)?;
    let pass = upload_geometry(device, &cache, prepared)?;
    let mut graph = FrameGraph::new();
    let geometry = geometry_cache(&mut graph, &pass, &prepared.view);
    let mut readbacks = Readbacks::new(device, graph);
    let target = readbacks.image("read_geometry", geometry, prepared.view.cache_size(), 8, true)?;
    let Readbacks { graph, imports, .. } = readbacks;
    let executable = Executable::new(device, graph, &imports)?;
    let mut frames = Frames::new(device, "geometry", 1)?;
    executable.execute(&mut frames)?;
    frames.wait()?;
    Ok(texels(target.as_deref()))
}

/// The floor of shading: milliseconds on the GPU that `bare` takes, and the sums of its lookups, rgb.
///
/// # Errors
/// Whatever Vulkan refuses.
pub fn time_bare_lookups(device: &Arc<Device>, bare: &BareLookups) -> Result<(f64, Vec<[f32; 4]>)> {
    let mut graph = FrameGraph::new();
    let sums = bare_lookups(&mut graph, bare);
    let mut readbacks = Readbacks::new(device, graph);
    let target = readbacks.buffer("read_sums", sums, bare.sums_bytes())?;
    let Readbacks { graph, imports, .. } = readbacks;
    let executable = Executable::new(device, graph, &imports)?;
    let mut frames = Frames::new(device, "bare lookups", 1)?;
    let passes = executable.execute_timed(device, &mut frames)?;
    let gpu_ms = passes.iter().filter(|pass| !pass.is_readback()).map(|pass| pass.gpu_ms).sum();
    Ok((gpu_ms, texels(Some(&target))))
}

/// The middle value; of an even number, the mean of the two in the middle.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    if values.len() % 2 == 1 { values[middle] } else { (values[middle - 1] + values[middle]) / 2.0 }
}
