//! `threadlight materials`: what --material, --environment and --mesh can name without a file.
use std::io::Write;
use threadlight::brdf::Brdf;
use threadlight::scene::mesh;
use threadlight::{environment, method::Method};

/// Lists what can be named: materials, models, environments, meshes, methods.
#[derive(clap::Args)]
pub struct Materials {}

impl Materials {
    pub fn run(self) -> anyhow::Result<()> {
        let mut out = std::io::stdout().lock();
        writeln!(out, "Materials (--material; or a MERL .binary, or a .toml with a model and its parameters):")?;
        for name in Brdf::builtin_names() {
            let model = Brdf::builtin(name).map_or("", |brdf| brdf.model());
            writeln!(out, "  {name:<24} {model}")?;
        }
        let list = |names: &[&str]| names.join(", ");
        let models: Vec<_> = Brdf::MODELS.iter().copied().filter(|model| *model != "merl").collect();
        writeln!(out, "Models (in a .toml or a scene file): {}", list(&models))?;
        writeln!(out, "Environments (--environment; or an .hdr or .exr): {}", list(environment::builtin_names()))?;
        writeln!(out, "Meshes (--mesh; or an .obj): {}", list(mesh::builtin_names()))?;
        writeln!(out, "Methods (--method):")?;
        for method in Method::ALL {
            writeln!(out, "  {:<24} {}", method.name(), method.summary())?;
        }
        Ok(())
    }
}
