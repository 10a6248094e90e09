//! `threadlight bench rounding`: what each rounding of a device costs.
use super::arguments::{CasesArguments, Defaults, JsonArgument};
use crate::cli::progress::TerminalProgress;
use threadlight::low_level::evaluate::rounding;
use threadlight::low_level::method::Method;

const EXAMPLES: &str = "\
Examples:
  threadlight bench rounding
  threadlight bench rounding --materials nickel.binary,steel.binary --environments room.hdr,studio.hdr

The CPU's form of a method shades the same surfaces without a rounding and with it. Fractions: lookups in cube maps blend texels and \
levels by so many bits; Vulkan promises 4, and 8 are usual. Light in half floats: cube maps hold these. A step off: all numbers of the \
normals, or of fitted threads, are the next ones that their 16 bits have; to round to the nearest is 1/sqrt(12) of that, RMS. Sums backwards: \
from the last thread to the first. The device: its own picture, with all that it does.

The JSON is a list of rows with these fields, in this order:
  material, environment, scene, method, count   what was shaded
  rounding                                      which
  rms, most                                     of display values, over the pixels that see a surface";

/// Measures what each rounding of a device costs: of fractions, light, normals, threads and sums.
#[derive(clap::Args)]
#[command(after_help = defaults().help(None, EXAMPLES))]
pub struct BenchRounding {
    #[command(flatten)]
    cases: CasesArguments,
    #[command(flatten)]
    json: JsonArgument,
}

fn defaults() -> Defaults {
    Defaults { materials: vec!["gold", "clay"], methods: vec![Method::Fitted], counts: &[16], size: Some((80, 60)) }
}

impl BenchRounding {
    pub fn run(self) -> anyhow::Result<()> {
        let cases = self.cases.cases(&defaults())?;
        self.json.check(&self.cases.files(&cases))?;
        let (device, memo) = (self.cases.device.open()?, self.cases.device.memo());
        let progress = TerminalProgress::of("bench rounding", "pictures")?;
        let mut found = Vec::new();
        let result = rounding::run(&cases, &device, &memo, &progress, &mut found);
        progress.finish();
        self.json.report(result, &found, |found| vec![rounding::tables(found)])
    }
}
