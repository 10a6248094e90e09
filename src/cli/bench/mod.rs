//! `threadlight bench`: measurements, one file each.
mod error;

use clap::Subcommand;

/// Measures: how wrong pictures are, and what they cost.
#[derive(clap::Args)]
pub struct Bench {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    Error(Box<error::BenchError>),
}

impl Bench {
    pub fn run(self) -> anyhow::Result<()> {
        match self.what {
            What::Error(bench) => bench.run(),
        }
    }
}
