//! `threadlight materials export`: a BRDF as a file that other programs read, or its threads.
use super::Named;
use crate::cli::threads::Threads;
use std::path::PathBuf;
use threadlight::Error;
use threadlight::low_level::brdf::{MerlTable, merl_bytes};
use threadlight::low_level::files;

/// Writes the BRDF, if it is isotropic, as a table of the MERL database's form, a `.binary` file of 35 MB, or its sample threads, a `.threads` file.
///
/// Cells of the table are about a degree wide, finer towards the mirror direction: a GGX lobe of roughness 0.03 comes back with an error below
/// 1 %, one of 0.01 with 2 %. Threads are as `threadlight threads` makes them, which has flags for their number and kind.
#[derive(clap::Args)]
pub struct Export {
    #[command(flatten)]
    named: Named,
    /// File to write; its name ends in .binary or .threads.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
}

impl Export {
    pub fn run(self) -> anyhow::Result<()> {
        let extension = self.output.extension().unwrap_or_default().to_ascii_lowercase();
        match extension.to_str() {
            Some("binary") => {}
            Some("threads") => return Threads::of(self.named.material, self.output).run(),
            _ => {
                let remedy = "end its name in .binary or .threads";
                return Err(Error::in_file(&self.output, "is no known kind of material file", remedy).into());
            }
        }
        files::check_writable(&self.output)?;
        self.named.check_is_not(&self.output)?;
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
        let table = merl_bytes(&brdf);
        // What is written can be read again: black could not.
        MerlTable::from_bytes(&table).map_err(|problem| {
            Error::input(
                self.named.material,
                format!("as such a table {problem}"),
                "export a material that reflects light",
            )
        })?;
        Ok(files::write_whole(&self.output, &table)?)
    }
}
