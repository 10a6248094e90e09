//! Threads of an edited material at once: a few steps from those that are on screen, in few rows.
use glam::DVec3;
use rayon::prelude::*;

use super::generate::{carried, scaled};
use super::kernel::Kernel;
use super::lights::{Quadrature, TestLights};
use super::solve::{Effort, Fit};
use super::table::FittedTable;
use crate::brdf::Brdf;
use crate::error::Result;
use crate::progress::Observer;
use crate::threads::slice::{Resolution, Slice};
use crate::threads::theta_o;

/// Every so many rows one is fitted, and the last; the others are between them.
const ROW_STEP: usize = 5;

/// Small changes need two or three.
const EFFORT: Effort = Effort { steps: 8, least_gain: 0.02 };

/// How strongly threads are tied to where they were: [`Fit::tied`]. With a hundredth of this they wander in a drag of a hundred drafts,
/// each row its own way, until those between them err; with three times as much it is the same.
const TIED: f64 = 3e-4;

/// Test lights of a row: a third of those of a fit.
const FEWEST_LIGHTS: usize = 256;
const LIGHTS_A_THREAD: usize = 16;

/// Threads of `brdf` that continue those of `before`, of a BRDF not far away: their error is up to three times that of [`super::generate()`],
/// in a fortieth of the time. The same to the last bit on any number of cores.
///
/// # Errors
/// Cancelled by `observer`.
pub fn draft(brdf: &Brdf, before: &FittedTable, observer: &dyn Observer) -> Result<FittedTable> {
    let (rows, count) = (before.rows, before.count);
    let mut places: Vec<usize> = (0..rows).step_by(ROW_STEP).collect();
    if !places.contains(&(rows - 1)) {
        places.push(rows - 1);
    }
    let fit = |&row: &usize| -> Result<(Vec<Kernel>, DVec3, f64)> {
        observer.check()?;
        let slices = Slice::with_lobes(brdf, theta_o(row, rows), Resolution::DRAFT);
        let lights = TestLights::new(&slices, FEWEST_LIGHTS + LIGHTS_A_THREAD * count, 0, Quadrature::DRAFT);
        let albedo = slices[0].albedo();
        let start = scaled(&in_proportion(before, row, albedo), 1.0 / lights.unit);
        let mut kernels = start.clone();
        let fit = Fit::new(&lights, albedo / lights.unit).tied(&start, TIED);
        fit.solve(&mut kernels, EFFORT, observer)?;
        let error = fit.relative_error(&kernels);
        Ok((scaled(&kernels, lights.unit), albedo, error))
    };
    let fitted: Vec<_> = places.par_iter().map(fit).collect::<Result<_>>()?;
    let row = |row: usize| {
        let high = places.partition_point(|&place| place < row);
        if places[high] == row {
            return fitted[high].clone();
        }
        let low = high - 1;
        let t = (row - places[low]) as f64 / (places[high] - places[low]) as f64;
        let [a, b] = [low, high].map(|i| carried(&fitted[i].0, theta_o(places[i], rows), theta_o(row, rows)));
        let kernels = a.iter().zip(&b).map(|(a, b)| a.between(b, t)).collect();
        let ((_, albedo_a, error_a), (_, albedo_b, error_b)) = (&fitted[low], &fitted[high]);
        (kernels, albedo_a.lerp(*albedo_b, t), error_a + t * (error_b - error_a))
    };
    Ok(FittedTable::pack(&(0..rows).map(row).collect::<Vec<_>>()))
}

/// The kernels of `row` of `table` with weights for this albedo: another colour, or none, has them at once.
fn in_proportion(table: &FittedTable, row: usize, albedo: DVec3) -> Vec<Kernel> {
    let kernels: Vec<_> = table.row(row).iter().map(|packed| packed.kernel()).collect();
    let cosine_part = DVec3::from_array(table.cosine_part[row].map(f64::from));
    let before = kernels.iter().map(|kernel| kernel.weight).sum::<DVec3>() + cosine_part;
    let factor = DVec3::select(before.cmpgt(DVec3::ZERO), albedo / before, DVec3::ZERO);
    kernels.into_iter().map(|kernel| Kernel { weight: factor * kernel.weight, ..kernel }).collect()
}
