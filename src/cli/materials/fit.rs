//! `threadlight materials fit`: the model nearest to a BRDF.
use super::Named;
use crate::cli::{print, stem};
use std::path::{Path, PathBuf};
use threadlight::Error;
use threadlight::low_level::brdf::Brdf;
use threadlight::low_level::evaluate::material_fit::{fit, names};
use threadlight::low_level::files;

/// Writes the parameters of a model that are nearest to the BRDF, which is isotropic, as a material file, and how near they are.
///
/// The error is the RMS of the difference of ln(1 + f cos theta_i) at view angles up to 75 degrees (Löw et al. 2012), beside the same of a black
/// surface. `ggx` and `beckmann` stand for `conductor` and `plastic` of that distribution, whichever is nearer; `layered` is a diffuse base
/// under a coat. Of models with words among their parameters, each word is tried.
#[derive(clap::Args)]
pub struct Fit {
    #[command(flatten)]
    named: Named,
    /// What to fit.
    #[arg(long, value_parser = clap::builder::PossibleValuesParser::new(names()))]
    model: String,
    /// File to write; its name ends in .toml.
    #[arg(short, long, value_name = "FILE.toml")]
    output: PathBuf,
}

impl Fit {
    pub fn run(self) -> anyhow::Result<()> {
        if !Brdf::is_model_file(&self.output) {
            return Err(Error::in_file(&self.output, "is no material file", "end its name in .toml").into());
        }
        files::check_writable(&self.output)?;
        self.named.check_is_not(&self.output)?;
        let fits = fit(&*self.named.load()?, &self.model).map_err(|error| error.within(&self.named.material))?;
        let name = stem(Path::new(&self.named.material));
        // There is at least one.
        let text = fits.first().map(|nearest| nearest.to_toml(&name)).unwrap_or_default();
        files::write_whole(&self.output, text.as_bytes())?;
        for fit in &fits {
            let relative = 100.0 * fit.error / fit.error_of_black;
            let words = fit.parameters.values().filter_map(|value| value.as_str()).collect::<Vec<_>>().join(", ");
            print(format_args!(
                "{:<24} error {:.5}, {relative:.2} % of that of black  {words}\n",
                fit.model, fit.error
            ))?;
        }
        Ok(())
    }
}
