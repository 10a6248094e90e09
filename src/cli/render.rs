//! `threadlight render`: a picture of a scene.
use super::progress::Progress;
use super::{cache_folder, number};
use anyhow::Context;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::value_parser;
use std::io::Write;
use std::path::PathBuf;
use threadlight::evaluate::reference::{self, Processor, ReferenceImage, ReferenceSettings};
use threadlight::method::Method;
use threadlight::output::{self, ExrHeader, Format};
use threadlight::pipeline::{Renderer, Rendering, Wanted};
use threadlight::prepare::{Prepared, prepare};
use threadlight::scene::{
    Background, EXPOSURE, GAMMA, MAX_SAMPLES, MAX_SIZE_PX, MAX_SUBPIXELS, MaterialSource, Scene, Source, mesh,
};
use threadlight::threads::CacheState;
use threadlight::vulkan::{Device, Instance};
use threadlight::{Error, environment};

const EXAMPLES: &str = "\
Examples:
  threadlight render -o image.png                       the built-in scene
  threadlight render --material silver --environment sun --size 1280x960 -o silver.png
  threadlight render --mesh dragon.obj --material alumina-oxide.binary --environment lebombo.hdr -o dragon.exr
  threadlight render scene.toml --repeat 20 --stats times.json
  threadlight render --method reference --tolerance 1e-3 -o truth.exr
  threadlight render --method reference --reference-on gpu -o truth.exr
  threadlight render --print-plan                       what a frame does, in which order, in which memory";

/// Renders a scene to a PNG or EXR file. Flags override the scene file.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES, allow_negative_numbers = true)]
pub struct Render {
    /// Scene file (TOML); without one, the built-in scene: a gold sphere in a studio.
    scene: Option<PathBuf>,
    /// Mesh in place of the scene's objects: a built-in name or an OBJ file.
    #[arg(long, value_name = "NAME|FILE")]
    mesh: Option<String>,
    /// Material of every object: a built-in name, a MERL .binary, or a .toml with a model and its parameters.
    #[arg(long, value_name = "NAME|FILE")]
    material: Option<String>,
    /// Light from all directions: a built-in name, a Radiance .hdr or an .exr, latitude-longitude.
    #[arg(long, value_name = "NAME|FILE")]
    environment: Option<String>,
    /// Shading method.
    #[arg(long, value_name = "NAME", value_parser = methods())]
    method: Option<String>,
    /// Sample threads per pixel: fitted 1 to 128 (default 16), paper 1 to 1024 (default 100); or samples per pixel of methods that
    /// have none, 1 to 10000 (default 100).
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=i64::from(MAX_SAMPLES)))]
    threads: Option<u32>,
    /// Method `reference` goes on until its estimated error of display values is below this: each pixel's on the
    /// CPU (default 2e-4), their RMS over the picture on the GPU (default 1e-3).
    #[arg(long, value_name = "X", value_parser = number(f64::MIN_POSITIVE..=1.0, "a positive number up to 1"))]
    tolerance: Option<f64>,
    /// Where method `reference` runs: `cpu`, by quadrature in double precision, or `gpu`, by 4096
    /// samples or more (default cpu).
    #[arg(long, value_name = "cpu|gpu", value_parser = processor(), hide_possible_values = true)]
    reference_on: Option<Processor>,
    /// Sub-pixels per axis, 1 to 4.
    #[arg(long, value_name = "S", value_parser = value_parser!(u32).range(1..=i64::from(MAX_SUBPIXELS)))]
    subpixels: Option<u32>,
    /// Size of the picture in pixels, each side 1 to 16384.
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<(u32, u32)>,
    /// Factor on radiance before display.
    #[arg(long, value_name = "X", value_parser = number(EXPOSURE, "a finite number that is not negative"))]
    exposure: Option<f64>,
    /// Display values are radiance to the power of 1/X.
    #[arg(long, value_name = "X", value_parser = number(GAMMA, "a finite number above 0"))]
    gamma: Option<f64>,
    /// What is seen behind the objects.
    #[arg(long, value_name = "environment|none", value_parser = background(), hide_possible_values = true)]
    background: Option<Background>,
    /// Turns the environment about the vertical axis, counter-clockwise seen from above, in degrees.
    #[arg(long, value_name = "DEG", value_parser = number(f64::MIN..=f64::MAX, "a finite number"))]
    rotation: Option<f64>,
    /// Seed of everything random; the same seed gives the same bytes.
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Vulkan device: its index or part of its name, as `threadlight devices` lists them.
    #[arg(long, value_name = "NAME|INDEX")]
    device: Option<String>,
    /// Turn on Vulkan's validation layer, with synchronisation validation; any message is a failure.
    #[arg(long)]
    validate: bool,
    /// Render this often; times are medians.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = value_parser!(u32).range(1..))]
    repeat: u32,
    /// Write times, counts and memory as JSON.
    #[arg(long, value_name = "FILE")]
    stats: Option<PathBuf>,
    /// Print the plan of the frame: passes, barriers, what was culled, memory.
    #[arg(long)]
    print_plan: bool,
    /// Neither read nor write cached threads, blurred environments and pipelines.
    #[arg(long)]
    no_cache: bool,
    /// Picture to write: .png (8 bit, display values) or .exr (32-bit float, linear radiance).
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// What `--stats` writes.
#[derive(serde::Serialize)]
struct Stats<'a> {
    version: &'a str,
    device: &'a str,
    method: &'a str,
    threads: u32,
    subpixels: u32,
    width: u32,
    height: u32,
    /// Sub-pixels that see a surface.
    covered_subpixels: u32,
    /// Pixels that share one sum over the threads among their sub-pixels.
    interior_pixels: u32,
    /// Pixels that sum over all threads in each covered sub-pixel.
    edge_pixels: u32,
    /// Lookups in the environment that shading made.
    lookups: u64,
    passes: Vec<Pass<'a>>,
    frame_ms: f64,
    thread_generation_ms: f64,
    thread_cache: &'a str,
    device_memory_bytes: u64,
    validation_messages: usize,
    /// Only for method `reference`.
    #[serde(flatten)]
    reference: Option<ReferenceStats>,
}

/// What is known of the error of a reference.
#[derive(serde::Serialize)]
struct ReferenceStats {
    tolerance: f64,
    /// RMS over covered pixels of the estimated error of display values.
    error_estimate: f64,
    /// The largest of a pixel.
    max_error_estimate: f64,
    reference_cache: &'static str,
}

#[derive(serde::Serialize)]
struct Pass<'a> {
    name: &'a str,
    gpu_ms: f64,
}

impl Render {
    pub fn run(self) -> anyhow::Result<()> {
        if self.output.is_none() && self.stats.is_none() && !self.print_plan {
            let remedy = "name a picture with -o FILE.png, or ask for --stats or --print-plan";
            return Err(Error::input("render", "has nothing to write", remedy).into());
        }
        // Whatever is wrong with the command is said before the work begins.
        let format = self.output.as_deref().map(Format::of).transpose()?;
        for path in self.output.iter().chain(&self.stats) {
            output::check_writable(path)?;
        }
        let scene = self.scene()?;
        let cache = cache_folder(self.no_cache);
        let is_reference = scene.shading.method == Method::Reference.name();
        let useless = [
            ("--tolerance", self.tolerance.is_some() && !is_reference),
            ("--reference-on", self.reference_on.is_some() && !is_reference),
            ("--print-plan", self.print_plan && is_reference),
        ];
        if let Some((flag, _)) = useless.into_iter().find(|(_, useless)| *useless) {
            let problem = format!("is of no use to method \"{}\"", scene.shading.method);
            return Err(Error::input(flag, problem, "leave it out, or choose another --method").into());
        }
        let progress = Progress::new("threads")?;
        let prepared = prepare(&scene, cache.as_deref(), &progress)?;
        progress.finish();

        let instance = Instance::new(self.validate).map_err(Error::from)?;
        let messages = instance.messages();
        let device = Device::new(&instance, self.device.as_deref()).map_err(Error::from)?;
        drop(instance);
        let device_name = device.description().name.clone();
        let (rendering, reference) = if prepared.method == Method::Reference {
            progress.restart("reference");
            let processor = self.reference_on.unwrap_or_default();
            let tolerance = self.tolerance.unwrap_or(processor.default_tolerance());
            let settings = ReferenceSettings { tolerance, processor, cache: cache.clone() };
            let image = reference::reference(&prepared, &device, &settings, &progress)?;
            progress.finish();
            let reference = ReferenceStats {
                tolerance,
                error_estimate: image.error_estimate,
                max_error_estimate: image.max_error_estimate,
                reference_cache: if image.cached { "hit" } else { "miss" },
            };
            (rendering_of(&image, &prepared, device.allocated_bytes()), Some(reference))
        } else {
            let renderer = Renderer::new(&device, cache.as_deref(), &prepared)?;
            let radiance = format == Some(Format::Exr);
            let wanted = Wanted { radiance, display: !radiance, ..Wanted::default() };
            // Closing the renderer and the device is part of what validation checks.
            (renderer.render(wanted, self.repeat)?, None)
        };
        drop(device);

        if self.print_plan {
            write!(std::io::stdout(), "{}", rendering.plan)?;
        }
        if let Some(path) = &self.output {
            let view = &prepared.view;
            let transparent = scene.image.background == Background::None;
            match format {
                Some(Format::Exr) => {
                    let mut header = self.exr_header(&prepared, &rendering, &device_name);
                    if let Some(reference) = &reference {
                        let number = |name: &str, value: f64| (name.to_owned(), value.to_string());
                        header.more.push(number("tolerance", reference.tolerance));
                        header.more.push(number("error_estimate", reference.error_estimate));
                    }
                    output::write_exr(path, view.width, view.height, &rendering.radiance, transparent, &header)?;
                }
                _ => output::write_png(path, view.width, view.height, &rendering.display, transparent)?,
            }
        }
        let messages = messages.all();
        if let Some(path) = &self.stats {
            let stats = Stats { reference, ..stats(&prepared, &rendering, &device_name, messages.len()) };
            let text = serde_json::to_string_pretty(&stats).context("--stats")? + "\n";
            output::write_whole(path, text.as_bytes())?;
        }
        if let Some(first) = messages.first() {
            anyhow::bail!("validation: {} messages, the first: {}", messages.len(), first.replace('\n', " "));
        }
        Ok(())
    }

    /// The scene file, or the built-in scene, with the flags laid over it.
    fn scene(&self) -> threadlight::Result<Scene> {
        let mut scene = match &self.scene {
            Some(path) => Scene::load(path)?,
            None => Scene::default(),
        };
        if let Some(material) = &self.material {
            scene.use_material(material, MaterialSource::named(material));
        }
        if let Some(mesh) = &self.mesh {
            scene.use_mesh(Source::named(mesh, mesh::builtin_names()));
        }
        if let Some(name) = &self.environment {
            scene.environment.source = Source::named(name, environment::builtin_names());
        }
        if let Some((width, height)) = self.size {
            (scene.image.width, scene.image.height) = (width, height);
        }
        fn lay<T: Clone>(flag: &Option<T>, setting: &mut T) {
            if let Some(value) = flag {
                *setting = value.clone();
            }
        }
        lay(&self.method, &mut scene.shading.method);
        scene.shading.threads = self.threads.or(scene.shading.threads);
        lay(&self.seed, &mut scene.shading.seed);
        lay(&self.subpixels, &mut scene.image.subpixels);
        lay(&self.exposure, &mut scene.image.exposure);
        lay(&self.gamma, &mut scene.image.gamma);
        lay(&self.background, &mut scene.image.background);
        lay(&self.rotation, &mut scene.environment.rotation_deg);
        Ok(scene)
    }

    fn exr_header(&self, prepared: &Prepared, rendering: &Rendering, device: &str) -> ExrHeader {
        let materials: Vec<_> = prepared.materials.iter().map(|material| material.name.as_str()).collect();
        ExrHeader {
            method: prepared.method.name().to_owned(),
            threads: prepared.sampling.count,
            material: materials.join(", "),
            environment: prepared.environment.name.clone(),
            device: device.to_owned(),
            seconds: rendering.frame_ms * 1e-3,
            ..ExrHeader::default()
        }
    }
}

fn stats<'a>(
    prepared: &'a Prepared,
    rendering: &'a Rendering,
    device: &'a str,
    validation_messages: usize,
) -> Stats<'a> {
    let counters = &rendering.counters;
    Stats {
        version: env!("CARGO_PKG_VERSION"),
        device,
        method: prepared.method.name(),
        threads: prepared.sampling.count,
        subpixels: prepared.view.subpixels,
        width: prepared.view.width,
        height: prepared.view.height,
        covered_subpixels: counters.covered_subpixels,
        interior_pixels: counters.interior_pixels,
        edge_pixels: counters.edge_pixels,
        lookups: rendering.lookups,
        passes: rendering.passes.iter().map(|pass| Pass { name: &pass.name, gpu_ms: pass.gpu_ms }).collect(),
        frame_ms: rendering.frame_ms,
        thread_generation_ms: prepared.thread_time.as_secs_f64() * 1e3,
        thread_cache: if prepared.thread_cache == CacheState::Hit { "hit" } else { "miss" },
        device_memory_bytes: rendering.device_memory_bytes,
        validation_messages,
        reference: None,
    }
}

/// A reference as the other methods' results are.
fn rendering_of(image: &ReferenceImage, prepared: &Prepared, device_memory_bytes: u64) -> Rendering {
    let radiance = image.over_background(prepared);
    let mut rendering = Rendering {
        display: reference::tone_map(&radiance, &prepared.view),
        radiance,
        lookups: image.evaluations,
        frame_ms: image.seconds * 1e3,
        device_memory_bytes,
        ..Rendering::default()
    };
    rendering.counters.covered_subpixels = image.covered_subpixels as u32;
    rendering
}

/// `640x480`.
pub fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let side = |text: &str| text.parse().ok().filter(|side| (1..=MAX_SIZE_PX).contains(side));
    let sides = text.split_once(['x', 'X']).and_then(|(width, height)| Some((side(width)?, side(height)?)));
    sides.ok_or_else(|| format!("use width x height in pixels, each 1 to {MAX_SIZE_PX}, such as 640x480"))
}

/// The name of a method.
fn methods() -> PossibleValuesParser {
    PossibleValuesParser::new(Method::ALL.iter().map(|method| method.name()))
}

/// `environment` or `none`.
fn background() -> impl TypedValueParser<Value = Background> {
    PossibleValuesParser::new(["environment", "none"])
        .map(|name| if name == "none" { Background::None } else { Background::Environment })
}

/// `cpu` or `gpu`.
pub fn processor() -> impl TypedValueParser<Value = Processor> {
    PossibleValuesParser::new(["cpu", "gpu"]).map(|name| if name == "gpu" { Processor::Gpu } else { Processor::Cpu })
}
