//! `threadlight bench report`: everything measured, on one HTML page.
use super::arguments::{
    CasesArguments, Defaults, Given, OutputArguments, QUICK_TOLERANCE, TruthArguments, check_folder,
};
use super::error;
use crate::cli::progress::TerminalProgress;
use crate::cli::{nameable, print};
use clap::value_parser;
use std::path::{Path, PathBuf};
use threadlight::low_level::brdf::Brdf;
use threadlight::low_level::evaluate::report::Report;
use threadlight::low_level::evaluate::speed::{self, Speed};
use threadlight::low_level::evaluate::sweep::Measured;
use threadlight::low_level::evaluate::{Cases, Estimator, Row, Sweep, gallery, merged};
use threadlight::low_level::files;
use threadlight::low_level::progress::Observer;
use threadlight::low_level::scene::MaterialSource;
use threadlight::low_level::threads::MAX_COUNT;
use threadlight::low_level::vulkan::Device;
use threadlight::{Error, Result};

const EXAMPLES: &str = "\
Examples:
  threadlight bench report report
  threadlight bench report report --materials alumina-oxide.binary,nickel.binary --environments lebombo.hdr --size 320x240
  threadlight bench report report --from rows.json
  threadlight bench report --from part_1.json part_2.json --plot plots

Writes DIR/report.html, which needs no other file: machine, device, versions and command; time by threads with the floor and as \
things double (the paper's table 1); errors (tables 2 to 4) over samples and over time (figure 12); methods side by side (figures \
10 and 11); all materials, built-in ones too, by the first of the methods at the highest of the counts (figure 13); and every row. \
Times are of the first material, environment and scene.

--json and --plot write the errors, as those of `bench error` do.

With --from, errors are those of earlier runs of `bench error --json`, such as all parts of one by --shard, and methods are shown side by side for the first material, \
environment and scene only. Which these are, and size, sub-pixels and seed, is as in the first row, unless flags say otherwise; what was \
read from a file then is to be named by its flag. Without DIR nothing is measured, and flags of what to measure are refused: the tables of \
these errors are printed, and --plot and --json write what those of `bench error` write. Files that were not measured with the same settings, or that have the same row, are refused, and so \
are parts by --shard if one is missing or was interrupted.";

/// Measures everything and writes it as one HTML page. Lists are separated by commas.
#[derive(clap::Args)]
#[command(after_help = defaults().help(Some(QUICK_TOLERANCE), EXAMPLES), allow_negative_numbers = true)]
pub struct BenchReport {
    #[command(flatten)]
    given: Given,
    /// Folder for report.html; made if it is not there. With --from it can be left out: only tables are printed.
    #[arg(value_name = "DIR", required_unless_present = "from")]
    folder: Option<PathBuf>,
    /// Errors as `bench error --json` wrote them, all of several files of one sweep, in place of measuring them.
    #[arg(long, value_name = "FILES", value_delimiter = ',', num_args = 1..)]
    from: Vec<PathBuf>,
    #[command(flatten)]
    cases: CasesArguments,
    #[arg(long, help = nameable::most_threads("Threads or samples while other things double"), value_name = "N", default_value_t = 64, value_parser = value_parser!(u32).range(1..=MAX_COUNT as i64))]
    threads: u32,
    #[command(flatten)]
    truth: TruthArguments,
    /// Render this often; times are medians.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = value_parser!(u32).range(1..))]
    repeat: u32,
    #[command(flatten)]
    output: OutputArguments,
}

/// The flags that do not say what to measure, or how.
const NOT_MEASURING: [&str; 4] = ["from", "json", "plot", "verbose"];

fn defaults() -> Defaults {
    Defaults::of_pictures(vec!["gold", "red-plastic"], &[1, 4, 16, 64])
}

impl BenchReport {
    pub fn run(mut self) -> anyhow::Result<()> {
        if self.folder.is_none()
            && let Some(flag) = self.given.flags().find(|flag| !NOT_MEASURING.contains(flag))
        {
            let problem = "is of no use to tables of earlier rows: without DIR nothing is measured";
            let remedy = "leave it out, or name a folder for report.html";
            return Err(Error::input(format!("--{}", flag.replace('_', "-")), problem, remedy).into());
        }
        self.folder.as_deref().map_or(Ok(()), check_folder)?;
        let files = self.from.iter().map(|path| Ok((path.as_path(), read_rows(path)?))).collect::<Result<Vec<_>>>()?;
        let earlier = merged(files)?;
        // Without a folder there are earlier rows: clap sees to that.
        let Some(folder) = &self.folder else {
            self.output.check(&self.from)?;
            return error::write(&earlier, None, &self.output);
        };
        if let Some((row, path)) = earlier.first().zip(self.from.first()) {
            self.cases.take_from(row, path, &self.given)?;
        }
        let cases = self.cases.cases(&defaults())?;
        self.output.check(&[self.cases.files(&cases), self.from.clone()].concat())?;
        let only_first = first_place(&cases);
        let sweep = Sweep {
            cases: if earlier.is_empty() { cases.clone() } else { only_first.clone() },
            repeat: self.repeat,
            whole_picture: false,
            // Those of earlier rows have theirs, if any.
            expected: earlier.is_empty(),
            keep_pictures: true,
        };
        let speed = Speed { cases: only_first.clone(), threads: self.threads, repeat: self.repeat };
        let shown = Cases { materials: with_builtin(&cases.materials), ..only_first };
        let variant = cases.methods[0];
        let of_method = cases.estimators().into_iter().filter(|estimator| estimator.variant == variant);
        let highest = of_method.map(|estimator| estimator.count).max().unwrap_or(variant.method.default_count());
        let estimator = Estimator { variant, count: highest };

        let device = self.cases.device.open()?;
        let memo = self.cases.device.memo();
        let progress = TerminalProgress::of("errors", "done")?;
        let mut measured = Measured::default();
        let mut report = Report { facts: facts(&device), ..Report::default() };
        let mut measure = || {
            self.truth.sweep(QUICK_TOLERANCE, &sweep, &device, &memo, &progress, &mut measured)?;
            progress.begin("times");
            speed::run(&speed, &device, &memo, &progress, &mut report.timings)?;
            progress.begin("materials");
            gallery::material_sheets(&shown, estimator, &device, &memo, &progress)
        };
        let sheets = measure();
        progress.finish();
        let sheets = match sheets {
            Ok(sheets) => sheets,
            // Of what is not whole there are the errors alone, as `bench error` leaves them.
            Err(error) => return error::unfinished(error, &measured, &self.output),
        };
        let light = format!("{}, {}", shown.environments[0].0, shown.scenes[0].0);
        let caption = format!("{light}; method {}, {highest} threads or samples", variant.name());
        report.materials = sheets.into_iter().map(|(_, picture)| (caption.clone(), picture)).collect();
        let captions = measured.references.iter().map(|(place, _)| place.join(", "));
        let pictures = gallery::comparison_sheets(&measured).into_iter().map(|(_, picture)| picture);
        report.comparisons = captions.zip(pictures).collect();
        report.reference_error = earlier.is_empty().then_some(measured.reference_error);
        report.rows = if earlier.is_empty() { measured.rows } else { earlier };

        let html = report.html()?;
        std::fs::create_dir_all(folder).map_err(|cause| Error::unwritable(folder, cause))?;
        let path = folder.join("report.html");
        files::write_whole(&path, html.as_bytes())?;
        error::write_files(&report.rows, &self.output)?;
        Ok(print(format_args!("{}\n", path.display()))?)
    }
}

/// Rows that `bench error --json` wrote.
fn read_rows(path: &Path) -> Result<Vec<Row>> {
    let bytes = files::read(path)?;
    let remedy = "give a file that `threadlight bench error --json` wrote";
    let rows: Vec<Row> = serde_json::from_slice(&bytes)
        .map_err(|cause| Error::in_file(path, format!("holds no measurements ({cause})"), remedy))?;
    let is_negative = |row: &Row| {
        [row.rms, row.rms_linear, row.flip, row.max, row.gpu_ms, row.shade_ms, row.frame_ms]
            .iter()
            .any(|value| *value < 0.0)
    };
    if let Some(row) = rows.iter().position(is_negative) {
        return Err(Error::in_file(path, format!("holds a negative number in row {row}"), remedy));
    }
    if rows.is_empty() {
        return Err(Error::in_file(path, "holds no measurements", remedy));
    }
    Ok(rows)
}

/// The first material in the first environment in the first scene.
fn first_place(cases: &Cases) -> Cases {
    Cases {
        materials: cases.materials.iter().take(1).cloned().collect(),
        environments: cases.environments.iter().take(1).cloned().collect(),
        scenes: cases.scenes.iter().take(1).cloned().collect(),
        ..cases.clone()
    }
}

/// `materials`, and the built-in ones of other names.
fn with_builtin(materials: &[(String, MaterialSource)]) -> Vec<(String, MaterialSource)> {
    let builtin = Brdf::builtin_names().map(|name| (name.to_owned(), MaterialSource::Builtin(name.to_owned())));
    let others = builtin.filter(|(name, _)| materials.iter().all(|(known, _)| known != name));
    materials.iter().cloned().chain(others).collect()
}

/// What is to be known of the measurements.
fn facts(device: &Device) -> Vec<(String, String)> {
    let system = sysinfo::System::new_with_specifics(
        sysinfo::RefreshKind::nothing()
            .with_cpu(sysinfo::CpuRefreshKind::nothing())
            .with_memory(sysinfo::MemoryRefreshKind::nothing().with_ram()),
    );
    let processor = system.cpus().first().map(|cpu| cpu.brand().trim()).filter(|brand| !brand.is_empty());
    let processor = format!("{}, {} logical cores", processor.unwrap_or("unknown"), system.cpus().len());
    let memory = format!("{:.0} GiB", system.total_memory() as f64 / f64::from(1 << 30));
    let description = device.description();
    // Names of files need not be UTF-8.
    let arguments = std::env::args_os()
        .skip(1)
        .map(|argument| argument.to_string_lossy().into_owned())
        .map(|argument| if argument.contains(char::is_whitespace) { format!("'{argument}'") } else { argument });
    let command = ["threadlight".to_owned()].into_iter().chain(arguments).collect::<Vec<_>>().join(" ");
    [
        ("system", sysinfo::System::long_os_version().unwrap_or_else(|| std::env::consts::OS.to_owned())),
        ("processor", processor),
        ("memory", memory),
        ("device", description.name.clone()),
        ("driver", format!("{}, Vulkan {}", description.driver, description.api_version)),
        ("Threadlight", env!("CARGO_PKG_VERSION").to_owned()),
        ("command", command),
    ]
    .map(|(name, value)| (name.to_owned(), value))
    .to_vec()
}
