//! The fit of all rows: from the middle one outwards, each starts from its neighbour.
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{DVec3, dvec3};
use rayon::prelude::*;

use super::cells::cells;
use super::kernel::{Kernel, scale_rad};
use super::lights::{Quadrature, TestLights};
use super::solve::{Effort, Fit};
use super::table::FittedTable;
use crate::brdf::Brdf;
use crate::error::Result;
use crate::progress::Observer;
use crate::threads::slice::{Resolution, Slice};
use crate::threads::{ThreadSettings, theta_o};

/// Steps of the first row, which starts from cells, and of the others.
const FIRST: Effort = Effort { steps: 300, least_gain: 1e-5 };
const NEXT: Effort = Effort { steps: 40, least_gain: 3e-3 };

/// All rows have the same lights where these are not placed by the slice: threads follow the BRDF, not the lights.
const LIGHTS_SEED: usize = 0;

/// How strongly a row is tied to what is carried over from its neighbour: [`Fit::tied`]. With this, and the same lights in all
/// rows, threads turn from row to row by 2 to 4 times less than without, for errors up to a third larger.
const TIED: f64 = 1e-6;

/// Test lights of a row: so many, and so many more for each thread. Of too few, many threads answer each alone and err between them: with
/// 64 threads 1536 lights leave a tenth less error than 1200. Up to 16 threads have the same lights, which are made once for all of them.
const FEWEST_LIGHTS: usize = 1000;
const LIGHTS_A_THREAD: usize = 8;
const FEWEST_THREADS: usize = 16;

/// What a BRDF differs from a diffuse one by at least, relative to the radiance: less is that of the lights' few points, and kernels would be
/// fitted to it.
const LEAST_ERROR: f64 = 3e-3;

/// Kernels narrower than this, in radians, stay where a facet mirrors the view to; wider ones stay where they are.
const FOLLOWS_BELOW_RAD: f64 = 0.15;

/// A row: its kernels, the albedo and the relative error.
pub(super) type Row = (Vec<Kernel>, DVec3, f64);

/// A row that has been fitted, and its number; none for the first one.
pub(super) type Neighbour<'a> = Option<(usize, &'a Row)>;

/// What threads of a BRDF are fitted to: lights, and what it makes of them, in each row.
pub struct Targets {
    /// The lights and the albedo.
    rows: Vec<(TestLights, DVec3)>,
}

/// How many lights there are in a row for so many threads.
pub fn light_count(threads: usize) -> usize {
    FEWEST_LIGHTS + LIGHTS_A_THREAD * threads.max(FEWEST_THREADS)
}

impl Targets {
    /// Of `rows` rows with about `lights` lights each. 3 MB for 90 rows and 1128 lights.
    ///
    /// # Errors
    /// Cancelled by `observer` (noticed within a row).
    pub fn new(brdf: &Brdf, rows: usize, lights: usize, observer: &dyn Observer) -> Result<Self> {
        let target = |row: usize| -> Result<(TestLights, DVec3)> {
            observer.check()?;
            let slices = Slice::with_lobes(brdf, theta_o(row, rows), Resolution::FULL);
            Ok((TestLights::new(&slices, lights, LIGHTS_SEED, Quadrature::FIT), slices[0].albedo()))
        };
        Ok(Self { rows: (0..rows).into_par_iter().map(target).collect::<Result<_>>()? })
    }

    /// Whether the cosine kernel alone does in all rows.
    fn are_diffuse(&self) -> bool {
        let error =
            |(lights, albedo): &(TestLights, DVec3)| Fit::new(lights, *albedo / lights.unit).relative_error(&[]);
        self.rows.par_iter().all(|row| error(row) < LEAST_ERROR)
    }
}

/// Fits `settings.count` threads to `brdf`, the same to the last bit on any number of cores.
///
/// # Errors
/// No or too many threads, no rows, or cancelled by `observer` (noticed within a step of a row).
pub fn generate(brdf: &Brdf, settings: &ThreadSettings, observer: &dyn Observer) -> Result<FittedTable> {
    settings.check()?;
    let targets = Targets::new(brdf, settings.rows, light_count(settings.count), observer)?;
    generate_for(brdf, &targets, settings, observer)
}

/// [`generate`] for `targets` of `brdf` that are at hand: [`light_count`] lights in each of the rows of `settings`.
///
/// # Errors
/// Those of [`generate`].
pub fn generate_for(
    brdf: &Brdf,
    targets: &Targets,
    settings: &ThreadSettings,
    observer: &dyn Observer,
) -> Result<FittedTable> {
    settings.check()?;
    let rows = settings.rows;
    let done = AtomicUsize::new(0);
    let fit = |row: usize, from: Neighbour| -> Result<Row> {
        observer.check()?;
        let (lights, albedo) = &targets.rows[row];
        let (start, effort) = match from {
            Some((before, (kernels, ..))) => (carried(kernels, theta_o(before, rows), theta_o(row, rows)), NEXT),
            None => {
                let [_, lobes] = Slice::with_lobes(brdf, theta_o(row, rows), Resolution::FULL);
                (cells(&lobes, settings.count), FIRST)
            }
        };
        let start = scaled(&start, 1.0 / lights.unit);
        let mut kernels = start.clone();
        let fit = Fit::new(lights, *albedo / lights.unit);
        let fit = if from.is_some() { fit.tied(&start, TIED) } else { fit };
        fit.solve(&mut kernels, effort, observer)?;
        let error = fit.relative_error(&kernels);
        let kernels = scaled(&kernels, lights.unit);
        observer.progress(done.fetch_add(1, Ordering::Relaxed) + 1, rows);
        Ok((kernels, *albedo, error))
    };
    let mut fitted = from_the_middle(rows, &fit)?;
    if targets.are_diffuse() {
        // Where kernels are is kept, for drafts to start from.
        fitted.iter_mut().for_each(|(kernels, ..)| *kernels = scaled(kernels, 0.0));
    }
    Ok(FittedTable::pack(&fitted))
}

/// `fit` of each of `count` rows: of the middle one, then of the others one after the other outwards, each with the number of its neighbour
/// and what came of that.
pub(super) fn from_the_middle(
    count: usize,
    fit: &(impl Fn(usize, Neighbour) -> Result<Row> + Sync),
) -> Result<Vec<Row>> {
    let middle = count / 2;
    let first = fit(middle, None)?;
    let chain = |order: &mut dyn Iterator<Item = usize>| -> Result<Vec<Row>> {
        let mut chain: Vec<Row> = Vec::new();
        let mut before = middle;
        for row in order {
            let next = fit(row, Some((before, chain.last().unwrap_or(&first))))?;
            chain.push(next);
            before = row;
        }
        Ok(chain)
    };
    let (down, up) = rayon::join(|| chain(&mut (0..middle).rev()), || chain(&mut (middle + 1..count)));
    let mut all = down?;
    all.reverse();
    all.push(first);
    all.extend(up?);
    Ok(all)
}

/// The same with `scale` times the weights.
pub(super) fn scaled(kernels: &[Kernel], scale: f64) -> Vec<Kernel> {
    kernels.iter().map(|kernel| Kernel { weight: scale * kernel.weight, ..*kernel }).collect()
}

/// Kernels of the row for view angle `from` as a start for that of `to`.
pub(super) fn carried(kernels: &[Kernel], from: f64, to: f64) -> Vec<Kernel> {
    let [w_from, w_to] = [from, to].map(|theta_o| dvec3(theta_o.sin(), 0.0, theta_o.cos()));
    let carry = |kernel: &Kernel| {
        let h = (kernel.direction + w_from).normalize();
        let mirrored = (2.0 * w_to.dot(h) * h - w_to).normalize();
        let width = scale_rad(kernel.level);
        let follows = width < FOLLOWS_BELOW_RAD && mirrored.z > -width;
        Kernel { direction: if follows { mirrored } else { kernel.direction }, ..*kernel }
    };
    kernels.iter().map(carry).collect()
}
