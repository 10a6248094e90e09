//! `threadlight compare`: how much, and where, two pictures differ.
use super::{json, number, print};
use std::path::PathBuf;
use threadlight::Result;
use threadlight::low_level::evaluate::{Comparable, Display, Metrics, compare, difference_picture};
use threadlight::low_level::files;
use threadlight::low_level::picture;
use threadlight::low_level::scene::{EXPOSURE, GAMMA, POSITIVE_SINGLE};

const EXAMPLES: &str = "\
Examples:
  threadlight compare paper.exr reference.exr
  threadlight compare paper.exr reference.exr --mask-background --difference where.png
  threadlight compare a.png b.png --json
  threadlight compare new.exr golden.exr --at-most 1e-4     fails if they differ by more: for tests

Display values are clamp(exposure L, 0, 1)^(1/gamma) of radiance L over black, compared in all three channels. A PNG \
holds display values: --exposure and --gamma then say how it was made, for rms_linear.

The difference picture shows the largest difference among the channels' display values in colours from black (1e-4 or less) \
over violet and orange to pale yellow (1), by the logarithm; grey is what was left out. Below it is the scale, with ticks at \
1e-3, 1e-2 and 1e-1.";

/// Compares two pictures of one size: RMS, SSIM, FLIP. B is the reference.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES, allow_negative_numbers = true)]
pub struct Compare {
    /// A .png or .exr.
    a: PathBuf,
    /// Another.
    b: PathBuf,
    /// Compare only pixels that see a surface in A or B, by the alpha of those rendered with --background none.
    #[arg(long)]
    mask_background: bool,
    /// End with exit code 1 where the RMS of display values is above X, or a value is NaN or infinite.
    #[arg(long, value_name = "X", value_parser = number(0.0..=1.0, "a number from 0 to 1"))]
    at_most: Option<f64>,
    /// Print JSON instead of a table.
    #[arg(long)]
    json: bool,
    /// Factor on radiance before display.
    #[arg(long, value_name = "X", default_value_t = Display::default().exposure, value_parser = number(f64::MIN_POSITIVE..=*EXPOSURE.end(), "a number above 0, at most 3.4e38"))]
    exposure: f64,
    /// Display values are radiance to the power of 1/X.
    #[arg(long, value_name = "X", default_value_t = Display::default().gamma, value_parser = number(GAMMA, POSITIVE_SINGLE))]
    gamma: f64,
    /// Picture to write of where they differ.
    #[arg(long, value_name = "FILE.png")]
    difference: Option<PathBuf>,
}

impl Compare {
    pub fn run(self) -> anyhow::Result<()> {
        if let Some(path) = &self.difference {
            picture::check_png(path)?;
            files::check_writable(path)?;
            files::check_not_read([path], [&self.a, &self.b])?;
        }
        let display = Display { exposure: self.exposure, gamma: self.gamma };
        let read = |path| -> Result<_> { Ok(Comparable::from_picture(&picture::read_image(path)?, display)) };
        let (a, b) = (read(&self.a)?, read(&self.b)?);
        let names = format!("{} and {}", self.a.display(), self.b.display());
        let metrics = compare(&a, &b, self.mask_background).map_err(|error| error.within(&names))?;
        if let Some(path) = &self.difference {
            let (width, height, rgba) = difference_picture(&a, &b, self.mask_background);
            picture::write_png(path, width, height, &rgba, false)?;
        }
        print(if self.json { json("--json", &metrics)? } else { table(&metrics) })?;
        if let Some(at_most) = self.at_most {
            anyhow::ensure!(metrics.nan == 0, "{names}: {} values are NaN or infinite", metrics.nan);
            anyhow::ensure!(metrics.rms <= at_most, "{names}: the RMS is {:.3e}, above {at_most:e}", metrics.rms);
        }
        Ok(())
    }
}

fn table(metrics: &Metrics) -> String {
    let Metrics { rms, rms_linear, max, ssim, flip, nan, pixels } = metrics;
    format!(
        "\
rms         {rms:<11.6} display values, 0 to 1
rms_linear  {rms_linear:<11.6} radiance
max         {max:<11.6} display values, 0 to 1
ssim        {ssim:<11.6} 1 is equal
flip        {flip:<11.6} 0 is equal
nan         {nan:<11} values that are NaN or infinite
pixels      {pixels:<11} compared
"
    )
}
