//! Error and time of every method at every number of threads, over materials, environments and scenes.
use std::path::PathBuf;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::metrics::{Comparable, Display, Metrics, compare};
use super::reference_picture::ReferencePicture;
use crate::error::{Error, Result};
use crate::method::Method;
use crate::passes::Sampling;
use crate::pipeline::{Renderer, Rendering, Wanted};
use crate::prepare::{Prepared, PreparedMaterial, load_material, prepare};
use crate::scene::{Background, EnvironmentSettings, MaterialSettings, MaterialSource, Scene, Source};
use crate::threads::{self, Observer};
use crate::vulkan::Device;

/// What to measure: each method at each count, for each material in each environment in each scene.
#[derive(Clone, Debug)]
pub struct Sweep {
    /// Estimators.
    pub methods: Vec<Method>,
    /// Numbers of threads, or of samples: each 1 to 1024.
    pub counts: Vec<u32>,
    /// Materials, by names that differ. One at a time is that of all objects.
    pub materials: Vec<(String, MaterialSource)>,
    /// Environments, by names that differ. Turn and intensity are the scene's.
    pub environments: Vec<(String, Source)>,
    /// Scenes, by names that differ. What they say of materials, environment, method, threads and background is not used.
    pub scenes: Vec<(String, Scene)>,
    /// Seed of whatever is random.
    pub seed: u64,
    /// Times are medians over so many frames.
    pub repeat: u32,
    /// Count background pixels too. They are equal in all pictures, so that they only thin the error out.
    pub whole_picture: bool,
    /// Where threads and pipelines are cached.
    pub cache: Option<PathBuf>,
}

/// One measurement: how far a picture is from the reference picture, and what it cost.
///
/// A list of these, as JSON, is what `threadlight bench error --json` writes: the fields have the names and the order here,
/// in all versions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Name of the method.
    pub method: String,
    /// Number of threads, or of samples of the other estimators.
    pub threads: u32,
    /// Name of the material.
    pub material: String,
    /// Name of the environment.
    pub environment: String,
    /// Name of the scene.
    pub scene: String,
    /// See [`Metrics::rms`].
    pub rms: f64,
    /// See [`Metrics::rms_linear`].
    pub rms_linear: f64,
    /// See [`Metrics::ssim`].
    pub ssim: f64,
    /// See [`Metrics::flip`].
    pub flip: f64,
    /// See [`Metrics::max`].
    pub max: f64,
    /// See [`Metrics::nan`].
    pub nan: u64,
    /// Time of the passes that make linear radiance, on the GPU: geometry cache, classification and shading, without copying the
    /// picture back; in milliseconds.
    pub gpu_ms: f64,
    /// From the start of recording until the GPU is done and has copied the picture back, in milliseconds.
    pub frame_ms: f64,
    /// Lookups in the environment that shading made.
    pub lookups: u64,
}

/// All measurements.
#[derive(Clone, Debug, Default)]
pub struct Measured {
    /// By material, scene, environment, method and count, the last one changing fastest.
    pub rows: Vec<Row>,
    /// The largest error that a reference picture estimates of itself, in display values.
    pub reference_error: f64,
}

/// The measurements of `sweep` on `device`, one after another into `measured`, so that those made before an error are not lost.
///
/// `reference` makes the true picture of what it is given, whatever method and threads are in there: once for each material,
/// environment and scene. `observer` sees finished rows.
///
/// # Errors
/// The first material, environment or scene that cannot be used; whatever Vulkan refuses; `reference`'s; cancelled.
pub fn run(
    sweep: &Sweep,
    device: &Arc<Device>,
    reference: &dyn Fn(&Prepared) -> Result<ReferencePicture>,
    observer: &dyn Observer,
    measured: &mut Measured,
) -> Result<()> {
    let total = sweep.row_count();
    observer.progress(0, total);
    let mut environments = Vec::new();
    for (name, source) in &sweep.environments {
        let settings = EnvironmentSettings { source: source.clone(), ..EnvironmentSettings::default() };
        environments.push((name, settings.load()?));
    }
    let mut scenes = Vec::new();
    for (name, scene) in &sweep.scenes {
        scenes.push((
            name,
            sweep.prepare_scene(scene)?,
            Display { exposure: scene.image.exposure, gamma: scene.image.gamma },
        ));
    }
    for (material_name, source) in &sweep.materials {
        let brdf = load_material(source)?;
        let mut tables = Vec::new();
        for &method in &sweep.methods {
            for &count in &sweep.counts {
                let table = |kind| -> Result<_> {
                    let settings =
                        threads::Settings { kind, count: count as usize, seed: sweep.seed, ..Default::default() };
                    let cache = sweep.cache.as_deref();
                    Ok(threads::load_or_generate(&brdf, &settings, cache, &OnlyCancels(observer))?.0)
                };
                tables.push(method.threads().map(table).transpose()?);
            }
        }
        let mut material = vec![PreparedMaterial { name: material_name.clone(), brdf, threads: None }];
        for (scene_name, prepared, display) in &mut scenes {
            // The scene borrows the material and the environment while they are measured together.
            std::mem::swap(&mut prepared.materials, &mut material);
            for (environment_name, environment) in &mut environments {
                std::mem::swap(&mut prepared.environment, environment);
                let (width, height) = (prepared.view.width as usize, prepared.view.height as usize);
                let comparable =
                    |radiance: &[[f32; 4]]| Comparable::from_radiance(width, height, radiance, true, *display);
                let truth = reference(prepared)?;
                measured.reference_error = measured.reference_error.max(truth.error_estimate);
                let truth = comparable(&truth.radiance);
                for (&method, tables) in sweep.methods.iter().zip(tables.chunks(sweep.counts.len())) {
                    prepared.method = method;
                    for (&count, table) in sweep.counts.iter().zip(tables) {
                        if observer.cancelled() {
                            return Err(Error::Cancelled);
                        }
                        prepared.materials[0].threads.clone_from(table);
                        prepared.sampling = Sampling { count, seed: prepared.sampling.seed };
                        let renderer = Renderer::new(device, sweep.cache.as_deref(), prepared)?;
                        let wanted = Wanted { radiance: true, ..Wanted::default() };
                        let rendering = renderer.render(wanted, sweep.repeat)?;
                        let metrics = compare(&comparable(&rendering.radiance), &truth, !sweep.whole_picture)
                            .map_err(|error| error.within(format!("{material_name} on {scene_name}")))?;
                        let place = [material_name, environment_name, scene_name];
                        measured.rows.push(row(method, count, place, &metrics, &rendering));
                        observer.progress(measured.rows.len(), total);
                    }
                }
                std::mem::swap(&mut prepared.environment, environment);
            }
            std::mem::swap(&mut prepared.materials, &mut material);
        }
    }
    Ok(())
}

impl Sweep {
    /// How many measurements this is.
    pub fn row_count(&self) -> usize {
        let all =
            [self.methods.len(), self.counts.len(), self.materials.len(), self.environments.len(), self.scenes.len()];
        all.iter().product()
    }

    /// The meshes, camera and settings of `scene`, with material and environment yet to come.
    fn prepare_scene(&self, scene: &Scene) -> Result<Prepared> {
        let mut scene = scene.clone();
        // Something that costs no time in their place.
        let placeholder = MaterialSource::Model {
            model: "lambert".to_owned(),
            parameters: toml::Table::from_iter([("reflectance".to_owned(), toml::Value::Float(0.5))]),
        };
        scene.materials = vec![MaterialSettings { name: "placeholder".to_owned(), source: placeholder }];
        scene.objects.iter_mut().for_each(|object| object.material = "placeholder".to_owned());
        scene.environment.source = Source::Builtin("white".to_owned());
        scene.image.background = Background::None;
        scene.shading.threads = 1;
        prepare(&scene, self.cache.as_deref(), &())
    }
}

fn row(method: Method, threads: u32, place: [&String; 3], metrics: &Metrics, rendering: &Rendering) -> Row {
    let [material, environment, scene] = place.map(String::clone);
    let &Metrics { rms, rms_linear, max, ssim, flip, nan, .. } = metrics;
    let passes = rendering.passes.iter().filter(|pass| !pass.name.starts_with("read_"));
    Row {
        method: method.name().to_owned(),
        threads,
        material,
        environment,
        scene,
        rms,
        rms_linear,
        ssim,
        flip,
        max,
        nan,
        gpu_ms: passes.map(|pass| pass.gpu_ms).sum(),
        frame_ms: rendering.frame_ms,
        lookups: rendering.lookups,
    }
}

/// Passes on whether to stop, but no progress: that of a part is not that of the whole.
pub struct OnlyCancels<'a>(pub &'a dyn Observer);

impl Observer for OnlyCancels<'_> {
    fn progress(&self, _done: usize, _total: usize) {}
    fn cancelled(&self) -> bool {
        self.0.cancelled()
    }
}
