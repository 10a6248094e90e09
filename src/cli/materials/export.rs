//! `threadlight materials export`: a BRDF as a file that other programs read.
use super::Named;
use std::path::PathBuf;
use threadlight::Error;
use threadlight::low_level::brdf::merl_bytes;
use threadlight::low_level::output;

/// Writes the BRDF as a table of the MERL database's form: a `.binary` file of 35 MB.
///
/// Its cells are about a degree wide, finer towards the mirror direction: a GGX lobe of roughness 0.03 comes back with an error below 1 %,
/// one of 0.01 with 2 %. Sample threads are written by `threadlight threads MATERIAL -o FILE.threads`.
#[derive(clap::Args)]
pub struct Export {
    #[command(flatten)]
    named: Named,
    /// File to write; its name ends in .binary.
    #[arg(short, long, value_name = "FILE.binary")]
    output: PathBuf,
}

impl Export {
    pub fn run(self) -> anyhow::Result<()> {
        if self.output.extension().is_none_or(|extension| extension != "binary") {
            let remedy = "end its name in .binary; for .threads there is `threadlight threads`";
            return Err(Error::in_file(&self.output, "is no known kind of material file", remedy).into());
        }
        output::check_writable(&self.output)?;
        output::check_not_read([&self.output], [&PathBuf::from(&self.named.material)])?;
        let brdf = self.named.load()?;
        if !brdf.is_isotropic() {
            let remedy = "export an isotropic material";
            return Err(Error::input(
                self.named.material,
                "is anisotropic, and such a table holds isotropic BRDFs",
                remedy,
            )
            .into());
        }
        Ok(output::write_whole(&self.output, &merl_bytes(&brdf))?)
    }
}
