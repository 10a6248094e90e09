//! `threadlight bench error`: error and time of methods and thread counts over materials, environments and scenes.
use super::arguments::{CasesArguments, Defaults, OutputArguments, TruthArguments};
use crate::cli::print;
use crate::cli::progress::TerminalProgress;
use clap::value_parser;
use threadlight::Error;
use threadlight::low_level::evaluate::sweep::Measured;
use threadlight::low_level::evaluate::{Row, Shard, Sweep, plots, reference, tables};
use threadlight::low_level::method::Method;

const EXAMPLES: &str = "\
Examples:
  threadlight bench error
  threadlight bench error --materials gold,alumina-oxide.binary --environments studio,lebombo.hdr --counts 4,16,64
  threadlight bench error --materials gold,clay --environments studio,sky --shard 2/4 --json part_2.json
  threadlight bench error --methods paper --scene sphere,dragon.obj --json errors.json --plot plots

Each picture is compared with the reference picture of its material, environment and scene, over the pixels that see a \
surface. Tables are printed: mean RMS and SSIM for each material (the paper's tables 2 and 3), and over all of them \
(table 4) with FLIP, the worst RMS, lookups for each pixel that sees a surface, the time on the GPU, that of \
shading alone and, where fitted threads were measured, how many times as long as they the other methods shade for the same RMS.

The JSON is a list of rows with these fields, in this order:
  method, threads, material, environment, scene     what was measured
  rms, rms_linear, ssim, flip, max, nan             as `threadlight compare` has them, against the reference
  gpu_ms                                            time of the passes that make linear radiance
  frame_ms                                          from recording until the picture is read back
  lookups, covered_pixels                           lookups in the environment, and pixels that see a surface
  shade_ms                                          what of gpu_ms is shading
  settings                                          width, height, subpixels, seed, repeat and whole_picture of the run
  shard, combinations                               which part it is of, 1/1 without --shard; of how many combinations of
                                                    materials and environments in all
  expected_rms                                      only with --expected: what rms was expected to be

The plots are SVG, log-log, a line a method: rms_over_threads.svg (the paper's figure 12) and rms_over_shade_ms.svg, and \
where there are several materials, MATERIAL_rms_over_threads.svg and MATERIAL_rms_over_shade_ms.svg; with --expected, also \
expected_over_measured.svg.";

/// Measures RMS, SSIM, FLIP and time on the GPU against the reference. Lists are separated by commas.
#[derive(clap::Args)]
#[command(after_help = defaults().help(Some(reference::TOLERANCE), EXAMPLES), allow_negative_numbers = true)]
pub struct BenchError {
    #[command(flatten)]
    cases: CasesArguments,
    /// Measure only part I, from 1, of N of the combinations of materials and environments; `bench report --from` puts parts together.
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    #[command(flatten)]
    truth: TruthArguments,
    /// Count background pixels too; they are equal in all pictures.
    #[arg(long)]
    whole_picture: bool,
    /// Estimate the error of each picture from a few hundred pixels, too, as `threadlight render --error` does.
    #[arg(long)]
    expected: bool,
    /// Render this often; times are medians.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = value_parser!(u32).range(1..))]
    repeat: u32,
    #[command(flatten)]
    output: OutputArguments,
}

fn defaults() -> Defaults {
    Defaults {
        materials: vec!["gold"],
        methods: Method::on_gpu().collect(),
        counts: &[1, 4, 16, 32, 64, 100, 512],
        size: None,
    }
}

impl BenchError {
    pub fn run(self) -> anyhow::Result<()> {
        let mut cases = self.cases.cases(&defaults())?;
        self.output.check(&self.cases.files(&cases))?;
        cases.shard = self.shard.unwrap_or(Shard::WHOLE);
        cases.check_shard()?;
        let sweep = Sweep {
            cases,
            repeat: self.repeat,
            whole_picture: self.whole_picture,
            expected: self.expected,
            keep_pictures: false,
        };
        let device = self.cases.device.open()?;
        let memo = self.cases.device.memo();
        let progress = TerminalProgress::of("bench error", "pictures")?;
        let mut measured = Measured::default();
        let result = self.truth.sweep(reference::TOLERANCE, &sweep, &device, &memo, &progress, &mut measured);
        progress.finish();
        match result {
            Ok(()) => write(&measured.rows, Some(measured.reference_error), &self.output),
            Err(error) => unfinished(error, &measured, &self.output),
        }
    }
}

/// Writes what was `measured` before this error: what took hours is not thrown away because it was interrupted. Bad input leaves no files
/// behind.
pub(super) fn unfinished(error: Error, measured: &Measured, output: &OutputArguments) -> anyhow::Result<()> {
    if !matches!(error, Error::Input { .. }) && !measured.rows.is_empty() {
        write(&measured.rows, Some(measured.reference_error), output)?;
    }
    Err(error.into())
}

/// Prints the tables of `rows`, and writes what `output` asks for.
pub(super) fn write(rows: &[Row], reference_error: Option<f64>, output: &OutputArguments) -> anyhow::Result<()> {
    let mut text = tables::text(&tables::error_tables(rows));
    if let Some(error) = reference_error {
        text += &format!("The reference is within {error:.1e} by its own estimate.\n");
    }
    let printed = print(text);
    write_files(rows, output)?;
    Ok(printed?)
}

/// Writes the JSON and the plots of `rows` that `output` asks for.
pub(super) fn write_files(rows: &[Row], output: &OutputArguments) -> anyhow::Result<()> {
    output.json.write(&rows)?;
    if let Some(folder) = &output.plot {
        let expectations = plots::expectation_chart(rows);
        plots::write(&plots::error_charts(rows).into_iter().chain(expectations).collect::<Vec<_>>(), folder)?;
    }
    Ok(())
}
