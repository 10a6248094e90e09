//! What threads cost to make, beside what they are worth: `threadlight bench fit`.
use std::time::Instant;

use super::tables::{Section, Table};
use crate::error::Result;
use crate::memo::Memo;
use crate::prepare::in_own_axes;
use crate::progress::{Observer, OnlyCancels, Parts};
use crate::scene::{ImageSettings, MaterialSource};
use crate::statistics::{largest, mean, median};
use crate::steps::{FindLobe, LoadMaterial};
use crate::threads::fitted::{generate, validation_error};
use crate::threads::{ThreadKind, ThreadSettings};

/// What to fit, and how often.
#[derive(Clone, Debug)]
pub struct Fits {
    /// Materials, by names that differ.
    pub materials: Vec<(String, MaterialSource)>,
    /// Numbers of threads, each 1 to [`crate::threads::fitted::MAX_COUNT`].
    pub counts: Vec<u32>,
    /// Times are medians of so many.
    pub repeat: u32,
}

/// A fit that was measured.
#[derive(Clone, Debug, serde::Serialize)]
pub struct TimedFit {
    /// Of which material.
    pub material: String,
    /// How many threads.
    pub threads: u32,
    /// From the BRDF in memory to threads in memory.
    pub fit_ms: f64,
    /// Relative to the radiance, under the lights of the fit: what tables say of themselves.
    pub fitted_error: f64,
    /// Under others: [`validation_error`].
    pub validation_error: f64,
}

/// Fits and measures; `found` has what was measured until an error or an interruption.
///
/// # Errors
/// Materials that cannot be read, counts that cannot be fitted, [`crate::Error::Cancelled`].
pub fn run(fits: &Fits, memo: &Memo, observer: &dyn Observer, found: &mut Vec<TimedFit>) -> Result<()> {
    let total = fits.materials.len() * fits.counts.len() * fits.repeat.max(1) as usize;
    let timed = Parts::new(total, observer);
    for (material, source) in &fits.materials {
        let round = memo.round(observer);
        let (brdf, _) = in_own_axes(&round.ask(&LoadMaterial(source))?);
        let lobe = round.ask(&FindLobe(&brdf))?;
        for &threads in &fits.counts {
            let count = threads as usize;
            let settings = ThreadSettings { kind: ThreadKind::Fitted, count, ..ThreadSettings::default() };
            let settings = settings.for_picture(&lobe, ImageSettings::default().subpixels);
            let mut times_ms = Vec::new();
            let table = loop {
                let start = Instant::now();
                let table = generate(&brdf, &settings, &OnlyCancels(observer))?;
                times_ms.push(start.elapsed().as_secs_f64() * 1e3);
                timed.advance()?;
                if times_ms.len() >= fits.repeat as usize {
                    break table;
                }
            };
            found.push(TimedFit {
                material: material.clone(),
                threads,
                fit_ms: median(times_ms),
                fitted_error: table.mean_relative_error().into(),
                validation_error: validation_error(&table, &brdf),
            });
        }
    }
    Ok(())
}

/// For each number of threads a row a material, and what all of them have.
pub fn tables(found: &[TimedFit]) -> Section {
    let mut counts: Vec<u32> = found.iter().map(|fit| fit.threads).collect();
    counts.sort_unstable();
    counts.dedup();
    let of_count = |count: u32| {
        let fits: Vec<_> = found.iter().filter(|fit| fit.threads == count).collect();
        let cells = |ms: f64, fitted: f64, others: f64| {
            vec![format!("{ms:.0}"), format!("{fitted:.5}"), format!("{others:.5}")]
        };
        let row = |fit: &&TimedFit| (fit.material.clone(), cells(fit.fit_ms, fit.fitted_error, fit.validation_error));
        let over_all = |name: &str, of: fn(Vec<f64>) -> f64| {
            let value = |part: fn(&TimedFit) -> f64| of(fits.iter().map(|fit| part(fit)).collect());
            let cells =
                cells(value(|fit| fit.fit_ms), value(|fit| fit.fitted_error), value(|fit| fit.validation_error));
            (name.to_owned(), cells)
        };
        let mut rows: Vec<_> = fits.iter().map(row).collect();
        if fits.len() > 1 {
            rows.extend([over_all("median", median), over_all("mean", mean), over_all("worst", largest)]);
        }
        Table::new(format!("{count} threads"), ["ms", "its lights", "others"], rows)
    };
    let tables = counts.into_iter().map(of_count).collect();
    Section { title: "Time to fit, and error relative to the radiance:".into(), tables }
}
