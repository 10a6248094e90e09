//! `threadlight bench together`: what many materials in one picture cost, beside each alone.
use super::arguments::{JsonArgument, files_of_materials, named_environments, named_materials};
use crate::cli::nameable;
use crate::cli::progress::TerminalProgress;
use crate::cli::scene_flags::{DeviceFlags, parse_size};
use clap::builder::NonEmptyStringValueParser;
use clap::value_parser;
use std::path::PathBuf;
use threadlight::low_level::brdf::Brdf;
use threadlight::low_level::evaluate::together::{self, Together};
use threadlight::low_level::threads::fitted::MAX_COUNT;

const EXAMPLES: &str = "\
Without --materials, all that are built in are measured.

Examples:
  threadlight bench together
  threadlight bench together --materials alumina-oxide.binary,nickel.binary,gold --environments lebombo.hdr --json together.json

The picture has a sphere of each material. It is compared with the same picture of each material alone, all spheres of that: with the \
mean of these. All pictures take turns; times are medians.

The JSON is a list of rows with these fields, in this order:
  environment, threads, width, height   what was measured
  covered_pixels, lookups               pixels that see a surface, and lookups that shading made
  device_memory_bytes                   all that is on the device while the picture with all materials is rendered
  classify_ms, shade_ms                 time on the GPU of these passes
  ratio                                 shade_ms over the mean of those of `alone`
  alone                                 a list of material, lookups, classify_ms and shade_ms of each alone";

/// Measures what a picture of many materials costs, beside that of each alone. Lists are separated by commas.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES, allow_negative_numbers = true)]
pub struct BenchTogether {
    #[arg(long, help = nameable::materials(), value_name = "LIST", value_delimiter = ',', value_parser = NonEmptyStringValueParser::new())]
    materials: Vec<String>,
    #[arg(long, help = nameable::environment("Environments, each"), value_name = "LIST", value_delimiter = ',', value_parser = NonEmptyStringValueParser::new(), default_value = "studio")]
    environments: Vec<String>,
    #[arg(long, help = nameable::fitted_threads("Fitted threads of each material"), value_name = "N", default_value_t = 16, value_parser = value_parser!(u32).range(1..=MAX_COUNT as i64))]
    threads: u32,
    #[arg(long, help = nameable::size("Size of the picture", 1), value_name = "WxH", value_parser = parse_size, allow_hyphen_values = true, default_value = "640x480")]
    size: (u32, u32),
    /// Render each picture this often; times are medians.
    #[arg(long, value_name = "N", default_value_t = 5, value_parser = value_parser!(u32).range(1..))]
    repeat: u32,
    #[command(flatten)]
    device: DeviceFlags,
    #[command(flatten)]
    json: JsonArgument,
}

impl BenchTogether {
    pub fn run(self) -> anyhow::Result<()> {
        let materials = match self.materials.as_slice() {
            [] => Brdf::builtin_names().map(str::to_owned).collect(),
            named => named.to_vec(),
        };
        let together = Together {
            materials: named_materials("--materials", &materials)?,
            environments: named_environments("--environments", &self.environments)?,
            threads: self.threads,
            size: self.size,
            repeat: self.repeat,
        };
        let environments = self.environments.iter().map(PathBuf::from);
        let read: Vec<_> = environments.chain(files_of_materials(&self.materials, &together.materials)).collect();
        self.json.check(&read)?;
        let device = self.device.open()?;
        let progress = TerminalProgress::of("bench together", "pictures")?;
        let mut found = Vec::new();
        let result = together::run(&together, &device, &self.device.memo(), &progress, &mut found);
        progress.finish();
        self.json.report(result, &found, together::tables)
    }
}
