//! `threadlight bench speed`: time of a frame by its number of threads, beside its floor, and as other things grow.
use super::arguments::{CasesArguments, Defaults, OutputArguments};
use crate::cli::progress::TerminalProgress;
use crate::cli::{nameable, print};
use clap::value_parser;
use threadlight::Error;
use threadlight::low_level::evaluate::speed::{self, Speed, Timings};
use threadlight::low_level::evaluate::{plots, tables};
use threadlight::low_level::method::Method;
use threadlight::low_level::threads::MAX_COUNT;

const EXAMPLES: &str = "\
Examples:
  threadlight bench speed
  threadlight bench speed --scene dragon.obj --materials alumina-oxide.binary --environments lebombo.hdr
  threadlight bench speed --methods paper,filtered --counts 16,64 --size 320x240 --json speed.json --plot plots

The first tables are the paper's table 1: for each number of threads the time on the GPU of each pass and of all of them, and \
the floor: what a compute pass takes that makes as many trilinear lookups in the same environment, and nothing else. Of fitted \
threads and Gaussians these have the directions and levels of the threads at all view angles, one row for pixels that are near each \
other; of other methods they are all around, over four levels.

The others have what a frame costs as its pixels (a quarter, half, all of --size), its sub-pixels (1, 2 and 4 per axis), its \
threads (a quarter, half, all of --threads) and its triangles (each split into 4 and 16) grow; ratio is the time over that of \
the line above.

All that is compared takes turns, frame by frame; times are medians.

The JSON is an object. `frames` is a list with these fields, in this order:
  method, threads, material, environment, scene     what was measured
  width, height, subpixels, triangles, lookups,     how much of it; sub-pixels are per axis,
  covered_pixels                                    and these pixels see a surface
  passes                                            list of name and gpu_ms of each pass
  gpu_ms, frame_ms                                  all passes; from recording until the picture is read back
  floor_ms                                          as many bare lookups
  ns_per_lookup                                     time of the pass `shade` for each of its lookups
`growths` is a list of what (grows), quantity, ratio (or null), and the same fields.

The plots are SVG, log-log: frame_over_threads.svg, and METHOD_cost_over_growth.svg for each method.";

/// Measures times on the GPU: by threads, beside the floor, and as things double. Lists are separated by commas.
#[derive(clap::Args)]
#[command(after_help = defaults().help(None, EXAMPLES), allow_negative_numbers = true)]
pub struct BenchSpeed {
    #[command(flatten)]
    cases: CasesArguments,
    #[arg(long, help = nameable::most_threads("Threads or samples while other things grow"), value_name = "N", default_value_t = 100, value_parser = value_parser!(u32).range(1..=MAX_COUNT as i64))]
    threads: u32,
    /// Render this often; times are medians.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = value_parser!(u32).range(1..))]
    repeat: u32,
    #[command(flatten)]
    output: OutputArguments,
}

fn defaults() -> Defaults {
    Defaults {
        materials: vec!["gold"],
        methods: vec![Method::Fitted, Method::Paper],
        counts: &[16, 32, 64, 100, 200, 512],
        size: None,
    }
}

impl BenchSpeed {
    pub fn run(self) -> anyhow::Result<()> {
        let cases = self.cases.cases(&defaults())?;
        self.output.check(&self.cases.files(&cases))?;
        let speed = Speed { cases, threads: self.threads, repeat: self.repeat };
        let device = self.cases.device.open()?;
        let memo = self.cases.device.memo();
        let progress = TerminalProgress::of("bench speed", "frames")?;
        let mut timings = Timings::default();
        let result = speed::run(&speed, &device, &memo, &progress, &mut timings);
        progress.finish();
        if !matches!(result, Err(Error::Input { .. })) && !timings.frames.is_empty() {
            let mut sections = tables::frame_tables(&timings);
            sections.extend(tables::growth_tables(&timings));
            let printed = print(tables::text(&sections));
            self.output.json.write(&timings)?;
            if let Some(folder) = &self.output.plot {
                plots::write(&plots::speed_charts(&timings), folder)?;
            }
            printed?;
        }
        Ok(result?)
    }
}
