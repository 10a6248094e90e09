//! Stray kernels: sharp ones in directions from which the BRDF reflects little, where no light of the fit was.
//!
//! A narrow lobe over a diffuse base leaves kernels over. These answer single lights far from it, and each shows as a ghost of what the lobe
//! mirrors.
use std::f64::consts::TAU;

use glam::DVec3;

use super::kernel::{FINEST_WIDTH_RAD, Kernel, TOLD_RAD, scale_rad, variance_of_level};
use super::lights::{NARROWEST_RAD, points_of_narrowest};
use super::solve::{Effort, Fit};
use crate::brdf::luminance;
use crate::error::Result;
use crate::progress::Observer;

/// A kernel strays if it gives the narrowest light in its direction so many times what the BRDF gives it. Within a lobe none gives much more
/// than all do together.
const MOST_OVER: f64 = 3.0;

/// What the BRDF gives counts as more by this part of the mean radiance: where it gives next to nothing, ghosts are as dim.
const LEAST_RESPONSE: f64 = 0.1;

/// How often a row is fitted again: others may stray then.
const ROUNDS: usize = 8;

/// f (n . w) of a direction.
pub type FCos<'a> = dyn Fn(DVec3) -> DVec3 + 'a;

/// Fits `kernels` of `fit` again, with those that stray so wide that lights tell them, until none does. Weights are in units of `unit`.
///
/// # Errors
/// Cancelled by `observer`.
pub fn call_back(
    fit: &Fit,
    unit: f64,
    f_cos: &FCos,
    kernels: &mut Vec<Kernel>,
    effort: Effort,
    observer: &dyn Observer,
) -> Result<()> {
    let mut least_levels = vec![f64::NEG_INFINITY; kernels.len()];
    for _ in 0..ROUNDS {
        let strays = strays(kernels, fit.sets(), unit, f_cos);
        if strays.is_empty() {
            break;
        }
        strays.into_iter().for_each(|k| least_levels[k] = (TOLD_RAD / FINEST_WIDTH_RAD).log2());
        let fit = fit.each_no_sharper_than(&least_levels);
        fit.bound(kernels);
        fit.solve(kernels, effort, observer)?;
    }
    Ok(())
}

/// Which of `kernels`, in so many sets, stray.
pub fn strays(kernels: &[Kernel], sets: usize, unit: f64, f_cos: &FCos) -> Vec<usize> {
    let strays = |kernel: &Kernel| {
        // Lights tell wider ones; half floats round levels.
        if scale_rad(kernel.level) > 0.99 * TOLD_RAD {
            return false;
        }
        let kernel_variance = FINEST_WIDTH_RAD.powi(2) * f64::from(variance_of_level(kernel.level as f32));
        let peak = 1.0 / (TAU * (kernel_variance + NARROWEST_RAD.powi(2)));
        // A set that stands alone has as many times the weights.
        let given = sets as f64 * unit * luminance(kernel.weight) * peak;
        let is_over = |f_cos: DVec3| given > MOST_OVER * (luminance(f_cos) + LEAST_RESPONSE * unit);
        // What is in a lobe that is narrower than the light may be beside its peak.
        is_over(f_cos(kernel.direction)) && {
            let points = points_of_narrowest(kernel.direction);
            is_over(points.iter().map(|w| f_cos(*w)).sum::<DVec3>() / points.len() as f64)
        }
    };
    (0..kernels.len()).filter(|k| strays(&kernels[*k])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kernel_strays_by_what_its_set_gives_alone_and_not_beside_a_peak_or_if_it_is_wide() {
        let kernel = Kernel { direction: DVec3::Z, level: 0.0, weight: DVec3::ONE };
        let peak = 1.0 / (TAU * (FINEST_WIDTH_RAD.powi(2) + NARROWEST_RAD.powi(2)));
        let strays =
            |sets: usize, level: f64, f_cos: &FCos| !strays(&[Kernel { level, ..kernel }], sets, 1.0, f_cos).is_empty();
        assert!(strays(1, 0.0, &|_| DVec3::ZERO) && !strays(1, 3.0, &|_| DVec3::ZERO));
        let half = |_: DVec3| DVec3::splat(0.5 * peak);
        assert!(!strays(1, 0.0, &half) && strays(4, 0.0, &half));
        let beside = |w: DVec3| DVec3::splat(if w.z > 1.0 - 1e-9 { 0.0 } else { peak });
        assert!(!strays(1, 0.0, &beside));
    }
}
