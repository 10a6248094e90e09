//! `threadlight bench error`: error and time of methods and thread counts over materials, environments and scenes.
use crate::cli::progress::Progress;
use crate::cli::render::{parse_size, processor};
use crate::cli::{cache_folder, material_of, number, stem};
use anyhow::Context;
use clap::value_parser;
use std::io::Write;
use std::path::{Path, PathBuf};
use threadlight::evaluate::reference::{Processor, ReferenceSettings};
use threadlight::evaluate::sweep::{self, Measured, OnlyCancels, Sweep};
use threadlight::evaluate::{plots, reference_picture, tables};
use threadlight::method::Method;
use threadlight::output;
use threadlight::scene::{MAX_SUBPIXELS, ObjectSettings, Scene, Source, mesh};
use threadlight::threads::MAX_COUNT;
use threadlight::vulkan::{Device, Instance};
use threadlight::{Error, Result, environment};

const EXAMPLES: &str = "\
Examples:
  threadlight bench error
  threadlight bench error --materials gold,alumina-oxide.binary --environments studio,lebombo.hdr --counts 4,16,64
  threadlight bench error --methods paper --scene sphere,dragon.obj --json errors.json --plot plots

Each picture is compared with the reference picture of its material, environment and scene, over the pixels that see a
surface. Tables are printed: mean RMS and SSIM for each material (the paper's tables 2 and 3), and over all of them
(table 4) with FLIP, the worst RMS and the time on the GPU.

The JSON is a list of rows with these fields, in this order:
  method, threads, material, environment, scene     what was measured
  rms, rms_linear, ssim, flip, max, nan             as `threadlight compare` has them, against the reference
  gpu_ms                                            time of the passes that make linear radiance
  frame_ms                                          from recording until the picture is read back
  lookups                                           lookups in the environment

The plots are SVG, log-log, a line a method: rms_over_threads.svg (the paper's figure 12) and rms_over_gpu_ms.svg, and
where there are several materials, MATERIAL_rms_over_threads.svg and MATERIAL_rms_over_gpu_ms.svg.";

/// Measures RMS, SSIM, FLIP and time on the GPU against the reference. Lists are separated by commas.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES, allow_negative_numbers = true)]
pub struct BenchError {
    /// Materials: built-in names, MERL .binary files, or .toml files with a model and its parameters.
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "gold")]
    materials: Vec<String>,
    /// Environments: built-in names, or latitude-longitude .hdr or .exr files.
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "studio")]
    environments: Vec<String>,
    /// Shading methods; without it, all of them.
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    methods: Vec<String>,
    /// Numbers of threads, or of samples of the other estimators, each 1 to 1024.
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "1,4,16,32,64,100,512",
        value_parser = value_parser!(u32).range(1..=MAX_COUNT as i64))]
    counts: Vec<u32>,
    /// Scenes: built-in meshes, .obj files, or .toml scene files, whose camera and objects are used.
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "sphere")]
    scene: Vec<String>,
    /// Size of the pictures in pixels, each side 11 to 16384; without it, the scene's.
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<(u32, u32)>,
    /// Sub-pixels per axis, 1 to 4; without it, the scene's.
    #[arg(long, value_name = "S", value_parser = value_parser!(u32).range(1..=i64::from(MAX_SUBPIXELS)))]
    subpixels: Option<u32>,
    /// Error of the reference pictures, in display values, that is good enough (default 2e-4, on the GPU 1e-3).
    #[arg(long, value_name = "X", value_parser = number(f64::MIN_POSITIVE..=1.0, "a number above 0, at most 1"))]
    reference_tolerance: Option<f64>,
    /// Where the reference pictures are made, as `threadlight render --help` explains.
    #[arg(long, value_name = "cpu|gpu", default_value = "cpu", value_parser = processor(), hide_possible_values = true)]
    reference_on: Processor,
    /// Count background pixels too; they are equal in all pictures.
    #[arg(long)]
    whole_picture: bool,
    /// Seed of everything random.
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Render this often; times are medians.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = value_parser!(u32).range(1..))]
    repeat: u32,
    /// Vulkan device: its index or part of its name, as `threadlight devices` lists them.
    #[arg(long, value_name = "NAME|INDEX")]
    device: Option<String>,
    /// Neither read nor write cached threads and pipelines.
    #[arg(long)]
    no_cache: bool,
    /// Write all measurements as JSON.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Folder for plots; made if it is not there.
    #[arg(long, value_name = "DIR")]
    plot: Option<PathBuf>,
}

impl BenchError {
    pub fn run(self) -> anyhow::Result<()> {
        // Whatever is wrong with the command is said before the work begins.
        if let Some(path) = &self.json {
            output::check_writable(path)?;
        }
        if let Some(folder) = &self.plot {
            // A folder that is not there yet has to be made.
            output::check_writable(&if folder.exists() { folder.join("plot.svg") } else { folder.clone() })?;
        }
        let sweep = self.sweep()?;

        let instance = Instance::new(false).map_err(Error::from)?;
        let device = Device::new(&instance, self.device.as_deref()).map_err(Error::from)?;
        let progress = Progress::of("bench error", "pictures")?;
        let inner = OnlyCancels(&progress);
        let settings = ReferenceSettings {
            tolerance: self.reference_tolerance.unwrap_or(self.reference_on.default_tolerance()),
            processor: self.reference_on,
            cache: sweep.cache.clone(),
        };
        let reference = |prepared: &_| reference_picture(prepared, &device, &settings, &inner);
        let mut measured = Measured::default();
        let result = sweep::run(&sweep, &device, &reference, &progress, &mut measured);
        progress.finish();
        // What took hours is not thrown away because it was interrupted; bad input leaves no files behind.
        if !matches!(result, Err(Error::Input { .. })) && !measured.rows.is_empty() {
            self.write(&measured)?;
        }
        Ok(result?)
    }

    fn write(&self, Measured { rows, reference_error }: &Measured) -> anyhow::Result<()> {
        let mut out = std::io::stdout().lock();
        write!(out, "{}", tables::tables(rows))?;
        writeln!(out, "The reference is within {reference_error:.1e} by its own estimate.")?;
        if let Some(path) = &self.json {
            let text = serde_json::to_string_pretty(rows).context("--json")? + "\n";
            output::write_whole(path, text.as_bytes())?;
        }
        if let Some(folder) = &self.plot {
            plots::draw(rows, folder)?;
        }
        Ok(())
    }

    fn sweep(&self) -> Result<Sweep> {
        let methods = match self.methods.as_slice() {
            [] => Method::ALL.iter().copied().filter(|method| method.runs_on_gpu()).collect(),
            names => names.iter().map(|name| Method::from_name(name)).collect::<Result<Vec<_>>>()?,
        };
        if methods.contains(&Method::Reference) {
            let remedy = "name others; each is measured against it anyway";
            return Err(Error::input("--methods reference", "is the truth, not a method to measure", remedy));
        }
        let environments = named("--environments", &self.environments)?;
        let scenes = named("--scene", &self.scene)?;
        Ok(Sweep {
            methods: once("--methods", methods)?,
            counts: once("--counts", self.counts.clone())?,
            materials: named("--materials", &self.materials)?
                .into_iter()
                .map(|(name, text)| (name, material_of(text)))
                .collect(),
            environments: environments
                .into_iter()
                .map(|(name, text)| (name, Source::named(text, environment::builtin_names())))
                .collect(),
            scenes: scenes.into_iter().map(|(name, text)| Ok((name, self.scene_of(text)?))).collect::<Result<_>>()?,
            seed: self.seed,
            repeat: self.repeat,
            whole_picture: self.whole_picture,
            cache: cache_folder(self.no_cache),
        })
    }

    /// The scene that `text` names: a scene file, or a mesh in the built-in scene.
    fn scene_of(&self, text: &str) -> Result<Scene> {
        let path = Path::new(text);
        let mut scene = if path.extension().is_some_and(|extension| extension == "toml") {
            Scene::load(path)?
        } else {
            let mut scene = Scene::default();
            let material = scene.objects.first().map(|object| object.material.clone()).unwrap_or_default();
            scene.objects = vec![ObjectSettings::new(Source::named(text, mesh::builtin_names()), &material)];
            scene
        };
        if let Some((width, height)) = self.size {
            (scene.image.width, scene.image.height) = (width, height);
        }
        scene.image.subpixels = self.subpixels.unwrap_or(scene.image.subpixels);
        Ok(scene)
    }
}

/// Each of `texts` with the name that it has in tables: without folder and extension.
fn named<'a>(flag: &str, texts: &'a [String]) -> Result<Vec<(String, &'a str)>> {
    let names = once(flag, texts.iter().map(|text| stem(Path::new(text))).collect())?;
    Ok(names.into_iter().zip(texts.iter().map(String::as_str)).collect())
}

/// `values`, if none is there twice: rows could not be told apart.
fn once<T: PartialEq + std::fmt::Debug>(flag: &str, values: Vec<T>) -> Result<Vec<T>> {
    match values.iter().enumerate().find(|(i, value)| values[..*i].contains(value)) {
        Some((_, twice)) => {
            Err(Error::input(flag, format!("names {twice:?} twice"), "name each once, and files by names that differ"))
        }
        None => Ok(values),
    }
}
