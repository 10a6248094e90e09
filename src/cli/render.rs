//! `threadlight render`: a picture of a scene.
use super::number;
use super::progress::TerminalProgress;
use super::scene_flags::{MachineFlags, SceneFlags};
use anyhow::Context;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::value_parser;
use std::io::Write;
use std::path::PathBuf;
use threadlight::Error;
use threadlight::low_level::evaluate::expected::prepare_within;
use threadlight::low_level::evaluate::reference::{self, Processor, ReferenceSettings};
use threadlight::low_level::memo::{Asked, Memo, Origin, Step};
use threadlight::low_level::method::Method;
use threadlight::low_level::output::{self, Format};
use threadlight::low_level::pipeline::{DeviceScene, Rendering, Wanted};
use threadlight::low_level::prepare::{Prepared, prepare};
use threadlight::low_level::scene::Background;
use threadlight::low_level::steps::FitThreads;
use threadlight::low_level::vulkan::{Device, Instance};

const EXAMPLES: &str = "\
Examples:
  threadlight render -o image.png                       the built-in scene
  threadlight render --material silver --environment sun --size 1280x960 -o silver.png
  threadlight render --mesh dragon.obj --material alumina-oxide.binary --environment lebombo.hdr -o dragon.exr
  threadlight render --error 0.002 -o good.png          as few threads as that takes
  threadlight render scene.toml --repeat 20 --stats times.json
  threadlight render --method reference --tolerance 1e-3 -o truth.exr
  threadlight render --method reference --reference-on gpu -o truth.exr
  threadlight render --print-plan                       what a frame does, in which order, in which memory";

/// Renders a scene to a PNG or EXR file. Flags override the scene file.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES, allow_negative_numbers = true)]
pub struct Render {
    #[command(flatten)]
    scene: SceneFlags,
    /// Takes as few threads as give an expected RMS of display values of at most X, instead of --threads.
    #[arg(long, value_name = "X", conflicts_with = "threads", value_parser = number(f64::MIN_POSITIVE..=1.0, "a positive number up to 1"))]
    error: Option<f64>,
    /// Method `reference` goes on until its estimated error of display values is below this: each pixel's on the
    /// CPU (default 2e-4), their RMS over the picture on the GPU (default 1e-3).
    #[arg(long, value_name = "X", value_parser = number(f64::MIN_POSITIVE..=1.0, "a positive number up to 1"))]
    tolerance: Option<f64>,
    /// Where method `reference` runs: `cpu`, by quadrature in double precision, or `gpu`, by 4096
    /// samples or more (default cpu).
    #[arg(long, value_name = "cpu|gpu", value_parser = processor(), hide_possible_values = true)]
    reference_on: Option<Processor>,
    #[command(flatten)]
    machine: MachineFlags,
    /// Render this often; times are medians.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = value_parser!(u32).range(1..))]
    repeat: u32,
    /// Write times, counts and memory as JSON.
    #[arg(long, value_name = "FILE")]
    stats: Option<PathBuf>,
    /// Print the plan of the frame: passes, barriers, what was culled, memory.
    #[arg(long)]
    print_plan: bool,
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
    /// Only with `--error`.
    #[serde(skip_serializing_if = "Option::is_none")]
    expected_rms: Option<f64>,
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
        let scene = self.scene.scene()?;
        let memo = Memo::new(self.machine.cache().as_deref());
        let is_reference = scene.shading.method == Method::Reference.name();
        let useless = [
            ("--tolerance", self.tolerance.is_some() && !is_reference),
            ("--reference-on", self.reference_on.is_some() && !is_reference),
            ("--print-plan", self.print_plan && is_reference),
            ("--error", self.error.is_some() && is_reference),
        ];
        if let Some((flag, _)) = useless.into_iter().find(|(_, useless)| *useless) {
            let problem = format!("is of no use to method \"{}\"", scene.shading.method);
            return Err(Error::input(flag, problem, "leave it out, or choose another --method").into());
        }
        let instance = Instance::new(self.machine.validate).map_err(Error::from)?;
        let messages = instance.messages();
        let device = Device::new(&instance, self.machine.device.as_deref()).map_err(Error::from)?;
        drop(instance);
        let device_name = device.description().name.clone();

        let progress = TerminalProgress::new("threads")?;
        let round = memo.round(&progress);
        let (prepared, expected_rms) = match self.error {
            Some(most) => {
                let (prepared, rms) = prepare_within(&scene, most, &device, &round)?;
                (prepared, Some(rms))
            }
            None => (prepare(&scene, &round)?, None),
        };
        if let Some(rms) = expected_rms {
            eprintln!("{} threads or samples: expected RMS {rms:.1e}", prepared.sampling.count);
        }
        let (rendering, reference) = if prepared.method == Method::Reference {
            let processor = self.reference_on.unwrap_or_default();
            let tolerance = self.tolerance.unwrap_or(processor.default_tolerance());
            let settings = ReferenceSettings { tolerance, processor };
            let image = reference::reference(&prepared, &device, &settings, &round)?;
            progress.finish();
            let reference = ReferenceStats {
                tolerance,
                error_estimate: image.error_estimate,
                max_error_estimate: image.max_error_estimate,
                reference_cache: if image.cached { "hit" } else { "miss" },
            };
            let device_memory_bytes = device.allocated_bytes();
            (Rendering { device_memory_bytes, ..image.rendering(&prepared) }, Some(reference))
        } else {
            let renderer = DeviceScene::new(&device, &prepared, &round)?;
            progress.finish();
            let radiance = format == Some(Format::Exr);
            let wanted = Wanted { radiance, display: !radiance, ..Wanted::default() };
            // Closing the renderer and the device is part of what validation checks.
            (renderer.render(wanted, self.repeat)?, None)
        };
        // Those of the last attempt, where there were several.
        let threads = round.asked(FitThreads::NAME);
        let threads = threads[threads.len().saturating_sub(prepared.materials.len())..].to_vec();
        drop((round, device));

        if self.print_plan {
            write!(std::io::stdout(), "{}", rendering.plan)?;
        }
        if let Some(path) = &self.output {
            let view = &prepared.view;
            let transparent = scene.image.background == Background::None;
            match format {
                Some(Format::Exr) => {
                    let mut header = rendering.exr_header(&prepared, &device_name);
                    if let Some(reference) = &reference {
                        let number = |name: &str, value: f64| (name.to_owned(), value.to_string());
                        header.more.push(number("tolerance", reference.tolerance));
                        header.more.push(number("error_estimate", reference.error_estimate));
                    }
                    header.more.extend(expected_rms.map(|rms| ("expected_rms".to_owned(), rms.to_string())));
                    output::write_exr(path, view.width, view.height, &rendering.radiance, transparent, &header)?;
                }
                _ => output::write_png(path, view.width, view.height, &rendering.display, transparent)?,
            }
        }
        let messages = messages.all();
        if let Some(path) = &self.stats {
            let stats = Stats {
                reference,
                expected_rms,
                ..stats(&prepared, &rendering, &threads, &device_name, messages.len())
            };
            let text = serde_json::to_string_pretty(&stats).context("--stats")? + "\n";
            output::write_whole(path, text.as_bytes())?;
        }
        if let Some(first) = messages.first() {
            anyhow::bail!("validation: {} messages, the first: {}", messages.len(), first.replace('\n', " "));
        }
        Ok(())
    }
}

fn stats<'a>(
    prepared: &'a Prepared,
    rendering: &'a Rendering,
    threads: &[Asked],
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
        thread_generation_ms: 1e3 * threads.iter().map(|asked| asked.time.as_secs_f64()).sum::<f64>(),
        thread_cache: if threads.iter().all(|asked| asked.origin != Origin::Made) { "hit" } else { "miss" },
        device_memory_bytes: rendering.device_memory_bytes,
        validation_messages,
        expected_rms: None,
        reference: None,
    }
}

/// `cpu` or `gpu`.
pub fn processor() -> impl TypedValueParser<Value = Processor> {
    PossibleValuesParser::new(["cpu", "gpu"]).map(|name| if name == "gpu" { Processor::Gpu } else { Processor::Cpu })
}
