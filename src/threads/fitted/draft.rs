//! Threads of an edited material at once: a few steps from those that are on screen, in few rows.
use glam::DVec3;

use super::generate::{Neighbour, Row, carried, from_the_middle, scaled};
use super::kernel::{Kernel, all_between};
use super::lights::{Quadrature, TestLights};
use super::solve::{Effort, Fit};
use super::table::FittedTable;
use crate::brdf::{Brdf, SeenBrdf};
use crate::error::Result;
use crate::progress::Observer;
use crate::threads::azimuths::View;
use crate::threads::slice::{Resolution, Slice};
use crate::threads::theta_o;

/// Every so many rows one is fitted, and the last; the others are between them.
const ROW_STEP: usize = 5;

/// Steps of the first row, from where its threads were, and of the others.
const FIRST: Effort = Effort { steps: 24, least_gain: 1e-3 };
const NEXT: Effort = Effort { steps: 12, least_gain: 3e-3 };

/// How strongly the first row is tied to where its threads were, and the others to their neighbours: [`Fit::tied`]. Tied to where they were
/// themselves, rows stay together too, but all of them near where a drag began: over gold of all roughnesses that errs by half as much
/// again. A third of this, and rows part; ten times, and a narrow lobe is not followed.
const FIRST_TIED: f64 = 1e-6;
const TIED: f64 = 1e-5;

/// Test lights of a row: of 16 threads, half of those of a fit.
const FEWEST_LIGHTS: usize = 256;
const LIGHTS_A_THREAD: usize = 16;

/// Threads of `brdf`, which is isotropic, that continue those of `before`, of a BRDF not far away: their error is about twice that of [`super::generate()`], in a
/// twentieth of the time; the guide's chapter on results has where it is more. The same to the last bit on any number of cores.
///
/// # Errors
/// Cancelled by `observer`.
pub fn draft(brdf: &Brdf, before: &FittedTable, observer: &dyn Observer) -> Result<FittedTable> {
    let Some(of_subpixels) = &before.of_subpixels else { return continued(brdf, before, observer) };
    let (of_pixels, of_subpixels) =
        rayon::join(|| continued(brdf, before, observer), || continued(brdf, of_subpixels, observer));
    Ok(of_pixels?.with_subpixels(of_subpixels?))
}

/// The threads of `before`, but not those of its sub-pixels.
fn continued(brdf: &Brdf, before: &FittedTable, observer: &dyn Observer) -> Result<FittedTable> {
    let FittedTable { rows, count, sets, .. } = *before;
    let mut places: Vec<usize> = (0..rows).step_by(ROW_STEP).collect();
    if !places.contains(&(rows - 1)) {
        places.push(rows - 1);
    }
    let view = |row: usize| View::of_angle(theta_o(row, rows));
    let seen = SeenBrdf::from_azimuth(brdf, 0.0);
    let fit = |at: usize, neighbour: Neighbour| -> Result<Row> {
        observer.check()?;
        let row = places[at];
        let slices = Slice::with_lobes(&seen, view(row).theta_o, Resolution::DRAFT);
        let lights = TestLights::new(&slices, FEWEST_LIGHTS + LIGHTS_A_THREAD * count, 0, Quadrature::DRAFT);
        let albedo = slices[0].albedo();
        let start = scaled(&in_proportion(before, row, albedo), 1.0 / lights.unit);
        // Only directions and levels are tied, so weights may be in any unit.
        let (tied_to, strength, effort) = match neighbour {
            Some((from, (kernels, ..))) => (carried(kernels, view(places[from]), view(row)), TIED, NEXT),
            None => (start.clone(), FIRST_TIED, FIRST),
        };
        let mut kernels = start;
        let fit = Fit::new(&lights, albedo / lights.unit).in_sets(sets).tied(&tied_to, strength);
        fit.solve(&mut kernels, effort, observer)?;
        let error = fit.relative_error(&kernels);
        Ok((scaled(&kernels, lights.unit), albedo, error))
    };
    let fitted = from_the_middle(places.len(), &fit)?;
    let row = |row: usize| {
        let high = places.partition_point(|&place| place < row);
        if places[high] == row {
            return fitted[high].clone();
        }
        let low = high - 1;
        let t = (row - places[low]) as f64 / (places[high] - places[low]) as f64;
        let [a, b] = [low, high].map(|i| carried(&fitted[i].0, view(places[i]), view(row)));
        let kernels = all_between(&a, &b, t);
        let ((_, albedo_a, error_a), (_, albedo_b, error_b)) = (&fitted[low], &fitted[high]);
        (kernels, albedo_a.lerp(*albedo_b, t), error_a + t * (error_b - error_a))
    };
    Ok(FittedTable::pack(&(0..rows).map(row).collect::<Vec<_>>(), 1, sets))
}

/// The kernels of `row` of `table` with weights for this albedo: another colour, or none, has them at once.
fn in_proportion(table: &FittedTable, row: usize, albedo: DVec3) -> Vec<Kernel> {
    let kernels: Vec<_> = table.row(row).iter().map(|packed| packed.kernel()).collect();
    let before = DVec3::from_array(table.albedo[row].map(f64::from));
    let factor = DVec3::select(before.cmpgt(DVec3::ZERO), albedo / before, DVec3::ZERO);
    kernels.into_iter().map(|kernel| Kernel { weight: factor * kernel.weight, ..kernel }).collect()
}
