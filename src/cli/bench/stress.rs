//! `threadlight bench stress`: hard cases, and whether the device shades them as the CPU does.
use super::arguments::JsonArgument;
use crate::cli::none_of;
use crate::cli::progress::TerminalProgress;
use crate::cli::scene_flags::MachineFlags;
use threadlight::low_level::evaluate::stress::{self, Extent, SIZE_PX, Stressed, THREADS};

fn examples() -> String {
    format!(
        "\
Examples:
  threadlight bench stress
  threadlight bench stress --device swiftshader --json stress.json
  threadlight bench stress --all --only table --only lamps

Materials, surfaces, light, views and pictures at the ends of what they may be, by the methods that have threads, {THREADS} of them, \
{} x {} pixels. With --all also what takes long, by all methods, and all once more under light so bright that pyramids are in \
single precision. Each pixel is compared with the CPU's form of the method, given the same surface. The exit code is 1 where a \
pixel is NaN or infinite, its display value is not that of its radiance, or the RMS is above its bound.

The JSON is a list of rows with these fields, in this order:
  case, method, bright    what was shaded, and whether the light is that bright
  covered                 pixels that see a surface
  not_finite              pixels that are NaN or infinite
  wrongly_shown           pixels whose display value is off by more than a step of 8 bits
  rms, most               of the other ones, relative to the largest of their radiance, the picture's
                          mean, and a millionth of the light's maximum",
        SIZE_PX.0, SIZE_PX.1
    )
}

/// Shades hard cases and compares with the CPU; fails where a bound is broken.
#[derive(clap::Args)]
#[command(after_help = examples())]
pub struct BenchStress {
    #[command(flatten)]
    machine: MachineFlags,
    /// All cases, by all methods, with pyramids in both of their formats: takes more than an hour on a CPU.
    #[arg(long)]
    all: bool,
    /// Only the cases whose names have this in them, or another TEXT of another --only.
    #[arg(long, value_name = "TEXT")]
    only: Vec<String>,
    #[command(flatten)]
    json: JsonArgument,
}

impl BenchStress {
    pub fn run(self) -> anyhow::Result<()> {
        self.json.check(&[])?;
        let (device, messages) = self.machine.open()?;
        let progress = TerminalProgress::of("bench stress", "cases")?;
        let mut found = Vec::new();
        let extent = Extent { all: self.all, only: self.only };
        let result = stress::run(&extent, &device, &self.machine.device.memo(), &progress, &mut found);
        drop(device);
        progress.finish();
        self.json.report(result, &found, |found| vec![stress::tables(found)])?;
        let broken = found.iter().filter(|case: &&Stressed| case.is_broken()).count();
        anyhow::ensure!(broken == 0, "bench stress: {broken} of {} cases break a bound", found.len());
        none_of(&messages.all())
    }
}
