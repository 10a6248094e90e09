//! `threadlight render`: a picture of a scene.
use super::progress::TerminalProgress;
use super::rendered::{ReferenceStats, Rendered, Stats};
use super::scene_flags::{MachineFlags, SceneFlags, one_of};
use super::{display_error, json, nameable, none_of, print, say};
use clap::builder::TypedValueParser;
use clap::value_parser;
use std::path::PathBuf;
use std::sync::Arc;
use threadlight::low_level::evaluate::expected::prepare_within;
use threadlight::low_level::evaluate::reference::{self, Processor, ReferenceSettings};
use threadlight::low_level::files;
use threadlight::low_level::memo::{Memo, Step};
use threadlight::low_level::method::Method;
use threadlight::low_level::passes::check_picture;
use threadlight::low_level::picture::Format;
use threadlight::low_level::pipeline::{DeviceScene, Wanted};
use threadlight::low_level::prepare::prepare;
use threadlight::low_level::progress::Observer;
use threadlight::low_level::rendering::Rendering;
use threadlight::low_level::scene::Scene;
use threadlight::low_level::steps::FitThreads;
use threadlight::low_level::vulkan::Device;
use threadlight::{Error, Result};

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
    /// Takes as few threads as give an expected RMS of display values of at most X, instead of --threads. It makes those of
    /// each number that it tries, and the reference in some pixels: minutes where X is small.
    #[arg(long, value_name = "X", conflicts_with = "threads", value_parser = display_error())]
    error: Option<f64>,
    #[arg(long, help = nameable::tolerance(), value_name = "X", value_parser = display_error())]
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

impl Render {
    pub fn run(self) -> anyhow::Result<()> {
        // Whatever is wrong with the command is said before the work begins.
        let format = self.output.as_deref().map(Format::of).transpose()?;
        let scene = self.checked_scene()?;
        let (device, messages) = self.machine.open()?;
        check_picture(&device, &scene)?;
        let memo = self.machine.device.memo();
        // Closing what was made and the device is part of what validation checks.
        let rendered = self.render(&scene, format, &device, &memo)?;
        drop(device);

        if let Some(path) = &self.output {
            rendered.write(path)?;
        }
        let messages = messages.all();
        if let Some(path) = &self.stats {
            files::write_whole(path, json("--stats", &Stats::new(&rendered, messages.len()))?.as_bytes())?;
        }
        if self.print_plan {
            print(&rendered.rendering.plan)?;
        }
        none_of(&messages)
    }

    /// The scene, where there is something to write and a place for it, and no flag is of no use.
    fn checked_scene(&self) -> Result<Scene> {
        if self.output.is_none() && self.stats.is_none() && !self.print_plan {
            let remedy = "name a picture with -o FILE.png, or ask for --stats or --print-plan";
            return Err(Error::input("render", "has nothing to write", remedy));
        }
        files::check_all_writable(self.output.iter().chain(&self.stats))?;
        let scene = self.scene.scene()?;
        files::check_not_read(self.output.iter().chain(&self.stats), &self.scene.files(&scene))?;
        let method = scene.shading.method;
        let is_reference = method == Method::Reference;
        let useless = [
            ("--tolerance", self.tolerance.is_some() && !is_reference),
            ("--reference-on", self.reference_on.is_some() && !is_reference),
            ("--print-plan", self.print_plan && is_reference),
            ("--error", self.error.is_some() && is_reference),
        ];
        if let Some((flag, _)) = useless.into_iter().find(|(_, useless)| *useless) {
            let problem = format!("is of no use to method \"{}\"", method.name());
            return Err(Error::input(flag, problem, "leave it out, or choose another --method"));
        }
        // A script may go through all methods with these.
        let ignored = [
            ("--threads", self.scene.threads.is_some() && is_reference),
            ("--seed", self.scene.seed.is_some() && !method.has_seed()),
            ("--repeat", self.repeat > 1 && is_reference),
            ("--pattern", self.scene.pattern.is_some() && !method.has_pattern()),
        ];
        for (flag, _) in ignored.into_iter().filter(|(_, is_ignored)| *is_ignored) {
            tracing::warn!("{flag} is ignored: method \"{}\" knows nothing of it", method.name());
        }
        Ok(scene)
    }

    fn render(
        &self,
        scene: &Scene,
        format: Option<Format>,
        device: &Arc<Device>,
        memo: &Memo,
    ) -> anyhow::Result<Rendered> {
        let progress = TerminalProgress::new("threads")?;
        let round = memo.round(&progress);
        let prepared = match self.error {
            Some(most) => prepare_within(scene, most, device, &round).map(|(prepared, rms)| (prepared, Some(rms))),
            None => prepare(scene, &round).map(|prepared| (prepared, None)),
        };
        let (prepared, expected_rms) = prepared.map_err(|error| self.scene.in_file(error))?;
        if let Some(rms) = expected_rms {
            say(format_args!("{} threads or samples: expected RMS {rms:.1e}", prepared.sampling.count));
        }
        let (rendering, reference) = if prepared.method == Method::Reference {
            let processor = self.reference_on.unwrap_or_default();
            let tolerance = self.tolerance.unwrap_or(processor.default_tolerance());
            let image = reference::reference(&prepared, device, &ReferenceSettings { tolerance, processor }, &round)?;
            let device_memory_bytes = device.allocated_bytes();
            let rendering = Rendering { device_memory_bytes, ..image.rendering(&prepared) };
            (rendering, Some(ReferenceStats::new(tolerance, &image)))
        } else {
            let renderer = DeviceScene::new(device, &prepared, &round)?;
            progress.finish();
            let radiance = format == Some(Format::Exr);
            let wanted = Wanted { radiance, display: !radiance, ..Wanted::default() };
            (renderer.render_watched(wanted, self.repeat, &progress)?, None)
        };
        // What was stopped during its last frame is not written either.
        progress.check()?;
        progress.finish();
        // Those of the last attempt, where there were several.
        let threads = round.asked(FitThreads::NAME);
        let threads = threads[threads.len().saturating_sub(prepared.materials.len())..].to_vec();
        let device = device.description().name.clone();
        Ok(Rendered { prepared, rendering, reference, expected_rms, threads, device })
    }
}

/// `cpu` or `gpu`.
pub fn processor() -> impl TypedValueParser<Value = Processor> {
    one_of([("cpu", Processor::Cpu), ("gpu", Processor::Gpu)])
}
