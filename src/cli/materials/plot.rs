//! `threadlight materials plot`: a BRDF drawn.
use super::Named;
use crate::cli::stem;
use std::path::{Path, PathBuf};
use threadlight::Error;
use threadlight::low_level::evaluate::material_plot;
use threadlight::low_level::files;

/// Draws the BRDF as SVG: lobes in the plane of incidence, the image over half and difference angle, albedo by angle.
///
/// An anisotropic one is drawn twice, from the azimuths 0, along the tangent, and 90 degrees.
#[derive(clap::Args)]
pub struct Plot {
    #[command(flatten)]
    named: Named,
    /// Picture to write.
    #[arg(short, long, value_name = "FILE.svg")]
    output: PathBuf,
}

impl Plot {
    pub fn run(self) -> anyhow::Result<()> {
        if self.output.extension().is_none_or(|extension| !extension.eq_ignore_ascii_case("svg")) {
            return Err(Error::in_file(&self.output, "is no SVG", "end its name in .svg").into());
        }
        files::check_writable(&self.output)?;
        self.named.check_is_not(&self.output)?;
        let name = stem(Path::new(&self.named.material));
        let svg = material_plot::svg(&*self.named.load()?, &name, &self.output)?;
        Ok(files::write_whole(&self.output, svg.as_bytes())?)
    }
}
