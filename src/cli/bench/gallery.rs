//! `threadlight bench gallery`: pictures beside each other, of materials and of methods.
use super::arguments::{
    CasesArguments, Defaults, OutputArguments, QUICK_TOLERANCE, TruthArguments, files_of_materials, named_materials,
};
use crate::cli::nameable;
use crate::cli::progress::TerminalProgress;
use clap::builder::NonEmptyStringValueParser;
use clap::value_parser;
use std::path::Path;
use threadlight::low_level::brdf::Brdf;
use threadlight::low_level::evaluate::gallery::{self, Named};
use threadlight::low_level::evaluate::sweep::Measured;
use threadlight::low_level::evaluate::{Cases, Estimator, Sweep, tables};
use threadlight::low_level::files;
use threadlight::low_level::picture;
use threadlight::low_level::progress::Observer;
use threadlight::low_level::threads::MAX_COUNT;
use threadlight::{Error, Result};

const EXAMPLES: &str = "\
Examples:
  threadlight bench gallery --plot gallery
  threadlight bench gallery --materials-only --threads 32 --plot gallery
  threadlight bench gallery --materials gold,nickel.binary --compare nickel.binary --environments lebombo.hdr --plot gallery
  threadlight bench gallery --methods split_sum,filtered_fixed,gaussian,paper,fitted --counts 1,16 --size 320x240 --plot gallery
  threadlight bench gallery --scene dragon.obj --size 320x240 --methods paper,filtered --counts 16,64 --plot gallery

PNG pictures are written into the folder that --plot names:
  materials.png                         all materials by family, by the first of the methods (the paper's figure 13); with
                                        several environments or scenes, materials_ENVIRONMENT_SCENE.png
  MATERIAL_ENVIRONMENT_SCENE.png        a material of --compare by methods and counts, with RMS, and the reference as the last
                                        row (the paper's figures 10 and 11)
  MATERIAL_ENVIRONMENT_SCENE_side_by_side.png
                                        the same by each method at the highest of its counts, with time and RMS

The table and the JSON have the errors of the latter, as `threadlight bench error` has them.";

/// Draws pictures beside each other: materials, and methods by their number of samples. Lists are separated by commas.
#[derive(clap::Args)]
#[command(after_help = defaults().help(Some(QUICK_TOLERANCE), EXAMPLES), allow_negative_numbers = true)]
pub struct BenchGallery {
    #[command(flatten)]
    cases: CasesArguments,
    /// Materials to compare methods on, named as those of --materials.
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = NonEmptyStringValueParser::new(), default_value = "gold")]
    compare: Vec<String>,
    /// Draw all materials, and compare no methods.
    #[arg(long, conflicts_with_all = ["compare", "reference_tolerance", "reference_on", "json"])]
    materials_only: bool,
    #[arg(long, help = threads(), value_name = "N", default_value_t = 100, value_parser = value_parser!(u32).range(1..=MAX_COUNT as i64))]
    threads: u32,
    #[command(flatten)]
    truth: TruthArguments,
    #[command(flatten)]
    output: OutputArguments,
}

fn threads() -> String {
    let fitted = nameable::fitted_threads("fitted threads");
    format!("Threads or samples of the pictures of all materials, 1 to {MAX_COUNT}; {fitted}")
}

fn defaults() -> Defaults {
    Defaults::of_pictures(Brdf::builtin_names().collect(), &[1, 4, 16, 64, 100])
}

impl BenchGallery {
    pub fn run(self) -> anyhow::Result<()> {
        let Some(folder) = &self.output.plot else {
            return Err(
                Error::input("bench gallery", "has nowhere to put pictures", "name a folder with --plot DIR").into()
            );
        };
        let materials = self.cases.cases(&defaults())?;
        let estimator = Estimator { variant: materials.methods[0], count: self.threads };
        let compared = named_materials("--compare", &self.compare)?;
        self.output.check(&[self.cases.files(&materials), files_of_materials(&self.compare, &compared)].concat())?;
        let sweep = Sweep {
            cases: Cases { materials: compared, ..materials.clone() },
            repeat: 3,
            whole_picture: false,
            expected: false,
            keep_pictures: true,
        };

        let memo = self.cases.device.memo();
        sweep.cases.check_materials(&memo)?;
        let device = self.cases.device.open()?;
        let progress = TerminalProgress::of("materials", "pictures")?;
        let mut sheets = gallery::material_sheets(&materials, estimator, &device, &memo, &progress)?;
        if self.materials_only {
            progress.finish();
            return Ok(write_pictures(&sheets, folder)?);
        }
        progress.begin("methods");
        let mut measured = Measured::default();
        let compared = self.truth.sweep(QUICK_TOLERANCE, &sweep, &device, &memo, &progress, &mut measured);
        progress.finish();
        // Of methods that were not all measured there is the table alone.
        if compared.is_ok() {
            sheets.extend(gallery::comparison_sheets(&measured));
            sheets.extend(gallery::side_by_side_sheets(&measured));
        }
        write_pictures(&sheets, folder)?;
        self.output.json.report(compared, &measured.rows, tables::error_tables)
    }
}

/// Writes each picture as PNG into `folder`, which is made if it is not there.
fn write_pictures(pictures: &[Named], folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(|cause| Error::unwritable(folder, cause))?;
    for (name, picture) in pictures {
        let rgba: Vec<u8> = picture.pixels().flat_map(|pixel| [pixel[0], pixel[1], pixel[2], 255]).collect();
        picture::write_png(&files::file_in(folder, name, "png"), picture.width(), picture.height(), &rgba, false)?;
    }
    Ok(())
}
