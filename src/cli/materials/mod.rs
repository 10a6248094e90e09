//! `threadlight materials`: what can be named, and BRDFs by themselves, without a scene.
mod evaluate;
mod export;
mod fit;
mod list;
mod plot;

use super::nameable;
use clap::Subcommand;
use std::path::PathBuf;
use threadlight::low_level::brdf::Brdf;
use threadlight::low_level::files;
use threadlight::low_level::memo::{Keyed, Memo};
use threadlight::low_level::scene::MaterialSource;
use threadlight::low_level::steps::LoadMaterial;

const EXAMPLES: &str = "\
Examples:
  threadlight materials
  echo 30 30 180 | threadlight materials evaluate gold
  threadlight materials plot gold -o gold.svg
  threadlight materials export clay -o clay.binary
  threadlight materials fit alumina-oxide.binary --model ggx -o alumina.toml";

/// Lists what can be named: materials, models, environments, meshes, methods; or looks at one material.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Materials {
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Subcommand)]
enum Command {
    /// Lists what can be named: what is done without a subcommand.
    List,
    Evaluate(evaluate::Evaluate),
    Plot(plot::Plot),
    Export(export::Export),
    Fit(fit::Fit),
}

impl Materials {
    pub fn run(self) -> anyhow::Result<()> {
        match self.command {
            None | Some(Command::List) => list::run(),
            Some(Command::Evaluate(evaluate)) => evaluate.run(),
            Some(Command::Plot(plot)) => plot.run(),
            Some(Command::Export(export)) => export.run(),
            Some(Command::Fit(fit)) => fit.run(),
        }
    }
}

/// The material of a subcommand.
#[derive(clap::Args)]
struct Named {
    #[arg(help = nameable::material("Material"))]
    material: String,
}

impl Named {
    /// An error if `output` is a file that the material is read from.
    fn check_is_not(&self, output: &PathBuf) -> threadlight::Result<()> {
        files::check_not_read([output], &MaterialSource::named(&self.material).files())
    }

    fn load(&self) -> threadlight::Result<Keyed<Brdf>> {
        Memo::default().round(&()).ask(&LoadMaterial(&MaterialSource::named(&self.material)))
    }
}
