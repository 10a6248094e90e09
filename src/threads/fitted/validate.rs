//! How well a table answers lights that it was not fitted to.
use rayon::prelude::*;

use super::kernel::Kernel;
use super::lights::{BaseAnswers, LightSettings, Quadrature, TestLights};
use super::solve::Fit;
use super::table::FittedTable;
use crate::brdf::{Brdf, LobeShape};
use crate::threads::azimuths::View;
use crate::threads::slice::{Resolution, Slice};

/// View angles, in degrees: of rows and between them, denser where pictures of spheres have more pixels or lobes are cut.
const ANGLES_DEG: [f64; 12] = [3.25, 10.5, 20.75, 30.0, 37.5, 45.25, 52.5, 60.75, 68.5, 76.25, 83.5, 87.5];

/// Azimuths of the view from the tangent, in degrees, for anisotropic BRDFs: of rows and between them.
const AZIMUTHS_DEG: [f64; 6] = [0.0, 7.5, 33.0, 48.0, 82.0, 139.0];

/// Lights at each angle, turned away from those of a fit. They count as where 16 threads are fitted, whatever the number of those that are validated:
/// so errors compare.
const LIGHTS: LightSettings = LightSettings { count: 2400, threads: 16, seed: 5 };

/// The error of `table` relative to the radiance that `brdf` has under lights of all sizes, others than those of the fit and integrated
/// with more points: RMS over view angles, each with the weight sin(2 theta_o) that it has on a sphere.
pub fn validation_error(table: &FittedTable, brdf: &Brdf) -> f64 {
    let lobe = LobeShape::of(brdf);
    let base = BaseAnswers::of(&table.base);
    let error = |index: usize| {
        let theta_o = ANGLES_DEG[index % ANGLES_DEG.len()].to_radians();
        let phi_o = AZIMUTHS_DEG[index / ANGLES_DEG.len()].to_radians();
        let slices = Slice::with_lobes_of_view(brdf, &lobe, View { theta_o, phi_o }, Resolution::FULL);
        let lights = TestLights::new(&slices, LIGHTS, Quadrature::FINE, &base);
        let in_units = |kernel: Kernel| Kernel { weight: kernel.weight / lights.unit, ..kernel };
        let kernels: Vec<_> = table.seen_from(theta_o, phi_o).into_iter().map(in_units).collect();
        let error = Fit::new(&lights, slices[0].albedo() / lights.unit).relative_error(&kernels);
        let weight = (2.0 * theta_o).sin();
        (weight * error * error, weight)
    };
    let azimuths = if table.azimuths == 1 { 1 } else { AZIMUTHS_DEG.len() };
    let errors: Vec<_> = (0..azimuths * ANGLES_DEG.len()).into_par_iter().map(error).collect();
    let [squares, weights] = errors.iter().fold([0.0; 2], |[s, w], (square, weight)| [s + square, w + weight]);
    (squares / weights).sqrt()
}
