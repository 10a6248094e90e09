//! `threadlight materials list`: what --material, --environment and --mesh can name without a file.
use std::fmt::Write;
use threadlight::low_level::brdf::Brdf;
use threadlight::low_level::environment::{self, Environment};
use threadlight::low_level::method::Method;
use threadlight::low_level::scene::{Mesh, mesh};

/// Writes the list to standard output.
pub fn run() -> anyhow::Result<()> {
    let mut out = String::new();
    writeln!(out, "Materials (--material; or {}):", Brdf::FILES.names())?;
    for (family, names) in Brdf::builtin_families() {
        writeln!(out, "  {family}")?;
        for name in names {
            let model = Brdf::builtin(name).map_or("", |brdf| brdf.model());
            writeln!(out, "    {name:<24} {model}")?;
        }
    }
    let list = |names: &[&str]| names.join(", ");
    writeln!(out, "Models (in a .toml or a scene file): {}", list(&Brdf::models_with_parameters()))?;
    writeln!(
        out,
        "Environments (--environment; or {}): {}",
        Environment::FILES.names(),
        list(environment::builtin_names())
    )?;
    writeln!(out, "Meshes (--mesh; or {}): {}", Mesh::FILES.names(), list(mesh::builtin_names()))?;
    writeln!(out, "Methods (--method):")?;
    for method in Method::ALL {
        writeln!(out, "  {:<24} {}", method.name(), method.summary())?;
    }
    Ok(crate::cli::print(out)?)
}
