//! `threadlight bench fractions`: what it costs that devices blend texels and levels by fractions of few bits.
use super::arguments::{CasesArguments, Defaults, write_json};
use crate::cli::progress::TerminalProgress;
use std::io::Write;
use std::path::PathBuf;
use threadlight::low_level::evaluate::{fractions, tables};
use threadlight::low_level::method::Method;
use threadlight::low_level::output;

const EXAMPLES: &str = "\
Without --materials gold and clay are measured; without --methods, fitted; without --counts, 16; without --size, 80x60.

Examples:
  threadlight bench fractions
  threadlight bench fractions --materials nickel.binary,steel.binary --environments room.hdr,studio.hdr

The CPU's form of a method shades the same surfaces by lookups in cube maps with all bits, with 8 bits and with 4.

The JSON is a list of rows with these fields, in this order:
  material, environment, scene, method, count   what was shaded
  bits                                          of the fractions between texels and between levels
  rms, most                                     of display values, over the pixels that see a surface";

/// Measures what it costs that devices blend texels and levels by fractions of few bits.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct BenchFractions {
    #[command(flatten)]
    cases: CasesArguments,
    /// Write all measurements as JSON.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

impl BenchFractions {
    pub fn run(self) -> anyhow::Result<()> {
        self.json.as_deref().map_or(Ok(()), output::check_writable)?;
        let cases = self.cases.cases(&Defaults {
            materials: vec!["gold", "clay"],
            methods: vec![Method::Fitted],
            counts: &[16],
            size: Some((80, 60)),
        })?;
        let (device, memo) = (self.cases.open_device()?, self.cases.memo());
        let progress = TerminalProgress::of("bench fractions", "pictures")?;
        let mut found = Vec::new();
        let result = fractions::run(&cases, &device, &memo, &progress, &mut found);
        progress.finish();
        if !found.is_empty() {
            write!(std::io::stdout().lock(), "{}", tables::text(&[fractions::tables(&found)]))?;
            write_json(self.json.as_deref(), &found)?;
        }
        Ok(result?)
    }
}
