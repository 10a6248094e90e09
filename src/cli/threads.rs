//! `threadlight threads`: makes, writes and draws the sample threads of a material.
use super::progress::TerminalProgress;
use super::scene_flags::subpixels;
use super::{memo, nameable, say, stem};
use std::path::{Path, PathBuf};
use threadlight::Error;
use threadlight::low_level::files;
use threadlight::low_level::memo::{Asked, Origin, Step};
use threadlight::low_level::method::Method;
use threadlight::low_level::picture;
use threadlight::low_level::prepare::threads_of;
use threadlight::low_level::scene::{ImageSettings, MaterialSource};
use threadlight::low_level::steps::FitThreads;
use threadlight::low_level::threads::{self, ThreadKind, ThreadSettings};

const EXAMPLES: &str = "\
Examples:
  threadlight threads gold --count 32 -o gold.threads
  threadlight threads alumina-oxide.binary --method paper --plot curves.png";

/// Makes the sample threads of a material; writes them to a file, or draws them on the hemisphere.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES, allow_negative_numbers = true)]
pub struct Threads {
    #[arg(help = nameable::material("Material"))]
    material: String,
    #[arg(long, help = counts(), value_name = "N")]
    count: Option<u32>,
    /// Whose threads: fitted, paper or gaussian.
    #[arg(long, value_name = "METHOD", default_value = ThreadKind::default().name())]
    method: String,
    /// Seed of everything random; the same seed gives the same threads.
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    #[arg(long, help = for_subpixels(), value_name = "S", default_value_t = ImageSettings::default().subpixels, value_parser = subpixels())]
    subpixels: u32,
    /// Neither read nor write cached threads.
    #[arg(long)]
    no_cache: bool,
    /// Thread file to write.
    #[arg(short, long, value_name = "FILE.threads")]
    output: Option<PathBuf>,
    /// Picture of the threads to draw, as the paper's figures 7 and 8.
    #[arg(long, value_name = "FILE.png")]
    plot: Option<PathBuf>,
}

fn counts() -> String {
    let counts = nameable::counts_of_threads(ThreadKind::ALL.into_iter());
    format!(
        "Number of threads: {counts}; where anisotropic materials have few sets of fitted ones, fewer are made (13 of 16)"
    )
}

fn for_subpixels() -> String {
    let subpixels = nameable::subpixels("Sub-pixels per axis of the pictures that they are for");
    format!(
        "{subpixels}: fitted threads are in as many sets as a pixel has of them, those of anisotropic materials in fewer"
    )
}

impl Threads {
    /// Those of `material` that are made where nothing else is asked for, to be written to `output`.
    pub fn of(material: String, output: PathBuf) -> Self {
        let method = ThreadKind::default().name().to_owned();
        let subpixels = ImageSettings::default().subpixels;
        Self { material, count: None, method, seed: 0, subpixels, no_cache: false, output: Some(output), plot: None }
    }

    pub fn run(self) -> anyhow::Result<()> {
        if self.output.is_none() && self.plot.is_none() {
            let remedy = "name a thread file with -o FILE.threads, or a picture with --plot FILE.png";
            return Err(Error::input("threads", "has nothing to write", remedy).into());
        }
        let kind = Method::from_name(&self.method)?.threads().ok_or_else(|| {
            Error::input(format!("method \"{}\"", self.method), "has no threads", "use fitted, paper or gaussian")
        })?;
        let count = self.count.map_or(kind.default_count(), |count| count as usize);
        if !(1..=kind.max_count()).contains(&count) {
            let remedy = format!("method \"{}\" has 1 to {}", kind.name(), kind.max_count());
            return Err(Error::input("--count", format!("{count} is out of range"), remedy).into());
        }
        self.output.as_deref().map_or(Ok(()), check_threads)?;
        self.plot.as_deref().map_or(Ok(()), picture::check_png)?;
        files::check_all_writable(self.output.iter().chain(&self.plot))?;
        let source = MaterialSource::named(&self.material);
        files::check_not_read(self.output.iter().chain(&self.plot), &source.files())?;
        let name = match &source {
            MaterialSource::File(path) => stem(path),
            _ => self.material.clone(),
        };
        let progress = TerminalProgress::new("threads")?;
        let memo = memo(self.no_cache);
        let round = memo.round(&progress);
        let settings = ThreadSettings { kind, count, seed: self.seed, ..Default::default() };
        let threads = threads_of(&source, settings, self.subpixels, &round)?;
        progress.finish();
        let Asked { origin, time, .. } = round.asked(FitThreads::NAME)[0];
        let threads = (*threads).clone().of_material(&name);
        let [rows, count] = threads.size();
        let how = if origin == Origin::Disk { "read from the cache" } else { "made" };
        say(format_args!("{count} threads x {rows} rows {how} in {:.2} s", time.as_secs_f64()));
        if let threads::Threads::Fitted(table) = &threads {
            let percent = |error: f32| 100.0 * error;
            let [least, most] = [f32::min, f32::max].map(|of| table.relative_error.iter().copied().fold(f32::NAN, of));
            let mean = table.mean_relative_error();
            say(format_args!(
                "expected error: {:.2} % of radiance, under lights of all sizes ({:.2} to {:.2} % by row)",
                percent(mean),
                percent(least),
                percent(most)
            ));
        }
        if let Some(path) = &self.output {
            threads::write(&threads, path)?;
        }
        if let Some(path) = &self.plot {
            threads::plot(&threads, path)?;
        }
        Ok(())
    }
}

/// An error unless the name at `path` is that of a thread file.
fn check_threads(path: &Path) -> threadlight::Result<()> {
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    let remedy = match extension.to_str() {
        Some("threads") => return Ok(()),
        Some("png" | "jpg" | "jpeg" | "svg" | "exr") => "draw a picture with --plot FILE.png",
        _ => "end its name in .threads",
    };
    Err(Error::in_file(path, "is no thread file", remedy))
}
