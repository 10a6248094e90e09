//! `threadlight bench`: measurements, one file each.
mod arguments;
mod error;
mod fit;
mod gallery;
mod live;
mod report;
mod rounding;
mod shaders;
mod speed;
mod stress;
mod together;

use clap::Subcommand;

/// Measures: how wrong pictures are, what they cost, and how they look.
#[derive(clap::Args)]
pub struct Bench {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    Error(Box<error::BenchError>),
    Speed(Box<speed::BenchSpeed>),
    Together(together::BenchTogether),
    Fit(fit::BenchFit),
    Shaders(Box<shaders::BenchShaders>),
    Rounding(rounding::BenchRounding),
    Live(Box<live::BenchLive>),
    Stress(stress::BenchStress),
    Gallery(Box<gallery::BenchGallery>),
    Report(Box<report::BenchReport>),
}

impl Bench {
    pub fn run(self) -> anyhow::Result<()> {
        match self.what {
            What::Error(bench) => bench.run(),
            What::Speed(bench) => bench.run(),
            What::Together(bench) => bench.run(),
            What::Fit(bench) => bench.run(),
            What::Shaders(bench) => bench.run(),
            What::Rounding(bench) => bench.run(),
            What::Live(bench) => bench.run(),
            What::Stress(bench) => bench.run(),
            What::Gallery(bench) => bench.run(),
            What::Report(bench) => bench.run(),
        }
    }
}
