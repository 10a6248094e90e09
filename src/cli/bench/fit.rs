//! `threadlight bench fit`: what fitted threads cost to make, and what error is left.
use super::arguments::{JsonArgument, files_of_materials, named_materials, once};
use crate::cli::nameable;
use crate::cli::progress::TerminalProgress;
use clap::builder::NonEmptyStringValueParser;
use clap::value_parser;
use threadlight::low_level::evaluate::fit::{self, Fits};
use threadlight::low_level::memo::Memo;
use threadlight::low_level::threads::fitted::MAX_COUNT;

const EXAMPLES: &str = "\
Without --materials, gold is measured; without --counts, 16,64.

Examples:
  threadlight bench fit
  threadlight bench fit --materials alumina-oxide.binary,nickel.binary --counts 4,16,64,128 --json fit.json

Errors are RMS, relative to the radiance, over view angles as a sphere shows them: under the lights that the threads were fitted \
to, and under others at other angles. Threads are made each time; none are read or written.

The JSON is a list of rows with these fields, in this order:
  material, threads       what was fitted
  fit_ms                  from the BRDF in memory to threads in memory
  fitted_error            under the lights of the fit
  validation_error        under others";

/// Measures how long threads take to fit, and what error is left. Lists are separated by commas.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES, allow_negative_numbers = true)]
pub struct BenchFit {
    #[arg(long, help = nameable::materials(), value_name = "LIST", value_delimiter = ',', value_parser = NonEmptyStringValueParser::new(), default_value = "gold")]
    materials: Vec<String>,
    #[arg(long, help = nameable::fitted_threads("Numbers of threads, each"), value_name = "LIST", value_delimiter = ',', default_value = "16,64", value_parser = value_parser!(u32).range(1..=MAX_COUNT as i64))]
    counts: Vec<u32>,
    /// Fit this often; times are medians.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = value_parser!(u32).range(1..))]
    repeat: u32,
    #[command(flatten)]
    json: JsonArgument,
}

impl BenchFit {
    pub fn run(self) -> anyhow::Result<()> {
        let materials = named_materials("--materials", &self.materials)?;
        self.json.check(&files_of_materials(&self.materials, &materials))?;
        let fits = Fits { materials, counts: once("--counts", self.counts)?, repeat: self.repeat };
        let progress = TerminalProgress::of("bench fit", "fits")?;
        let mut found = Vec::new();
        let result = fit::run(&fits, &Memo::new(None), &progress, &mut found);
        progress.finish();
        self.json.report(result, &found, |found| vec![fit::tables(found)])
    }
}
