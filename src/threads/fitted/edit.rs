//! What the edit of a BRDF does to all rows of its threads, found in one of them: lobes become wider or narrower, and threads that have nothing
//! left to do go where they are needed.
use std::f64::consts::SQRT_2;

use glam::{DVec3, dvec3};

use super::kernel::{Kernel, WIDEST_LEVEL, scale_rad};
use super::solve::Fit;
use crate::brdf::{luminance, reflect};

/// A kernel with less than this part of the weight of all has nothing to do.
const IDLE: f64 = 2e-3;

/// How far widths are looked for at first, in octaves, and how closely at last. A drag in 60 steps from alpha = 0.6 to 0.05 narrows lobes by 0.02
/// to 0.2 octaves a step.
const REACH: f64 = 0.1;
const LEAST_REACH: f64 = 0.02;
const MOST_TRIES: usize = 8;

/// The edit, as a row has it.
#[derive(Debug)]
pub struct Edit {
    /// By how many octaves half vectors and widths of kernels grow.
    pub octaves: f64,
    /// Kernels that were idle, and where they are now, each in a set of its own.
    moved: Vec<(usize, Kernel)>,
}

impl Edit {
    /// What becomes of the kernels `before`, in units of `fit`, of the row for the view `theta_o` (radians).
    pub fn found(fit: &Fit, before: &[Kernel], theta_o: f64) -> Self {
        let at = |octaves: f64| {
            let mut kernels = stretched(before, octaves, theta_o);
            fit.solve_weights(&mut kernels);
            (fit.relative_error(&kernels), kernels)
        };
        let octaves = least(&|octaves| at(octaves).0);
        let (_, kernels) = at(octaves);
        let is_idle = idle(&kernels);
        // At half the width and at twice of those that have something to do.
        let used = kernels.iter().zip(&is_idle).filter(|(_, is_idle)| !**is_idle).map(|(kernel, _)| kernel);
        let level = |kernel: &Kernel, by: f64| (kernel.level + by).clamp(0.0, WIDEST_LEVEL);
        let places = used.flat_map(|kernel| [-1.0, 0.0, 1.0].map(|by| Kernel { level: level(kernel, by), ..*kernel }));
        let places: Vec<_> = places.collect();
        // One of each set, since two would go to the same place; others do in the next draft.
        let of_set = |set: usize| {
            let kernel = (set..kernels.len()).step_by(fit.sets()).find(|&kernel| is_idle[kernel])?;
            Some((kernel, fit.best_place(&kernels, set, &places)?))
        };
        Self { octaves, moved: (0..fit.sets()).filter_map(of_set).collect() }
    }

    /// The start of a row for the view `theta_o` (radians) from its kernels `before`. Idle ones are where those `beside` it are, in a row that
    /// has been fitted, or where this row, which the edit was found in, has them.
    pub fn applied(&self, before: &[Kernel], theta_o: f64, beside: Option<&[Kernel]>) -> Vec<Kernel> {
        let mut start = stretched(before, self.octaves, theta_o);
        for &(kernel, place) in &self.moved {
            start[kernel] = Kernel { weight: DVec3::ZERO, ..beside.map_or(place, |beside| beside[kernel]) };
        }
        if let Some(beside) = beside {
            let is_idle = idle(&start);
            for ((kernel, beside), _) in start.iter_mut().zip(beside).zip(is_idle).filter(|(_, is_idle)| *is_idle) {
                *kernel = Kernel { weight: kernel.weight, ..*beside };
            }
        }
        start
    }
}

/// Which kernels have nothing to do.
fn idle(kernels: &[Kernel]) -> Vec<bool> {
    let all: f64 = kernels.iter().map(|kernel| luminance(kernel.weight)).sum();
    kernels.iter().map(|kernel| luminance(kernel.weight) < IDLE * all).collect()
}

/// Where `error` is least around 0: by parabolas through three values of its square.
fn least(error: &impl Fn(f64) -> f64) -> f64 {
    let squared = |at: f64| (at, error(at).powi(2));
    let (mut best, mut reach) = (squared(0.0), REACH);
    for _ in 0..MOST_TRIES {
        let [below, above] = [squared(best.0 - reach), squared(best.0 + reach)];
        if best.1 > below.1.min(above.1) {
            best = if below.1 < above.1 { below } else { above };
            reach *= SQRT_2;
            continue;
        }
        let curvature = below.1 + above.1 - 2.0 * best.1;
        if curvature > 0.0 {
            let lowest = squared(best.0 + 0.5 * reach * (below.1 - above.1) / curvature);
            best = if lowest.1 < best.1 { lowest } else { best };
        }
        if reach < LEAST_REACH {
            break;
        }
        reach *= 0.2;
    }
    best.0
}

/// Kernels whose half vectors are 2^`octaves` as far from the normal, in the plane of the surface, and as many times as wide; but those stay in
/// their direction that would go below the horizon.
fn stretched(kernels: &[Kernel], octaves: f64, theta_o: f64) -> Vec<Kernel> {
    let w_o = dvec3(theta_o.sin(), 0.0, theta_o.cos());
    let stretch = |kernel: &Kernel| {
        let h = (kernel.direction + w_o).normalize();
        let h = (octaves.exp2() * h.truncate()).extend(h.z).normalize();
        let mirrored = reflect(w_o, h).normalize();
        // Mirrors stay mirrors.
        let level = if kernel.level < 0.0 { kernel.level } else { (kernel.level + octaves).clamp(0.0, WIDEST_LEVEL) };
        let is_above = mirrored.z > -scale_rad(level);
        Kernel { direction: if is_above { mirrored } else { kernel.direction }, level, ..*kernel }
    };
    kernels.iter().map(stretch).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_value_is_found_near_and_far() {
        for at in [0.0, 0.003, -0.02, 0.15, -1.2] {
            let found = least(&|x| (1.0 + (x - at) * (x - at)).sqrt());
            assert!((found - at).abs() < 1e-3, "{found} {at}");
        }
        assert_eq!(least(&|_| 0.0), 0.0);
    }

    #[test]
    fn kernels_that_are_stretched_and_back_are_where_they_were() {
        let kernel = |x: f64, y: f64, level: f64| Kernel {
            direction: dvec3(x, y, (1.0 - x * x - y * y).sqrt()),
            level,
            weight: DVec3::ONE,
        };
        let kernels = [kernel(-0.7, 0.1, 3.0), kernel(-0.6, -0.2, 4.5), kernel(-0.65, 0.0, -1.0)];
        let there = stretched(&kernels, 0.3, 0.75);
        assert_eq!(there.iter().map(|kernel| kernel.level).collect::<Vec<_>>(), [3.3, 4.8, -1.0]);
        for (kernel, back) in kernels.iter().zip(stretched(&there, -0.3, 0.75)) {
            assert!(kernel.direction.distance(back.direction) < 1e-12 && (kernel.level - back.level).abs() < 1e-12);
        }
        // What mirrors stays in its place.
        let mirrored = kernel(-0.6, 0.0, 2.0);
        let [stretched] = stretched(&[mirrored], 1.0, 0.6f64.asin())[..] else { panic!() };
        assert!(stretched.direction.distance(mirrored.direction) < 1e-12);
    }
}
