//! Where a fit starts: the mass of the slice's lobes divided into cells, and each cell's moments.
use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::kernel::{FINEST_WIDTH_RAD, Kernel, SHARPEST_LEVEL, WIDEST_LEVEL, scale_rad};
use crate::threads::slice::Slice;

/// Sets of fewer kernels than this start from the same cells: dealt out, single cells leave kernels where no step brings them to the others.
const FEWEST_DEALT: usize = 4;

/// Sets of up to this many try both: of four sets of four that were dealt the cells of a lobe of 0.3 degrees, one had three times the error of the
/// others, but blue-acrylic errs by two thirds more from the same cells.
const MOST_ALIKE: usize = 7;

/// How far such sets start apart, in widths of their kernels: where they are the same, no step would part them.
const APART: f64 = 0.25;

/// Starts of `count` kernels in so many sets, of which kernel k is of set k % `sets`; which is best turns out when they are fitted.
pub fn in_sets(lobes: &Slice, count: usize, sets: usize) -> Vec<Vec<Kernel>> {
    if sets == 1 {
        return vec![cells(lobes, count)];
    }
    let each = count / sets;
    let mut starts = Vec::new();
    if each >= FEWEST_DEALT {
        starts.push(dealt(lobes, count, sets));
    }
    if each <= MOST_ALIKE {
        starts.push(alike(lobes, count, sets));
    }
    starts
}

/// Each set has its part of the cells.
fn dealt(lobes: &Slice, count: usize, sets: usize) -> Vec<Kernel> {
    // As wide as its own cell and those that other sets have in its place.
    let wider = 0.5 * (sets as f64).log2();
    let wide = |cell: Kernel| Kernel { level: (cell.level + wider).min(WIDEST_LEVEL), ..cell };
    cells(lobes, count).into_iter().map(wide).collect()
}

/// All sets have the same cells, moved apart a little.
fn alike(lobes: &Slice, count: usize, sets: usize) -> Vec<Kernel> {
    let cells = cells(lobes, count.div_ceil(sets));
    let moved = |k: usize| {
        let (cell, set) = (cells[k / sets], k % sets);
        let (x, y) = cell.direction.any_orthonormal_pair();
        let towards = APART * scale_rad(cell.level) * DVec2::from_angle(TAU * set as f64 / sets as f64);
        let direction = (cell.direction + towards.x * x + towards.y * y).normalize();
        Kernel { direction, weight: cell.weight / sets as f64, ..cell }
    };
    (0..count).map(moved).collect()
}

/// Kernels at the centroids of `count` cells of `lobes`, as wide as their second moments say, with the mass of the cell (F26).
/// What lobes stand on is left to the base: started there, most kernels stay there, and a few cannot make out a lobe's core.
///
/// Lloyd's relaxation (1982) of points of equal mass.
fn cells(lobes: &Slice, count: usize) -> Vec<Kernel> {
    const POINTS_A_CELL: usize = 60;
    const ROUNDS: usize = 20;
    let total = (count * POINTS_A_CELL).max(600);
    let points: Vec<(DVec3, DVec3)> = lobes
        .points(total)
        .map(|w| (w, lobes.f_cos(w) / (lobes.pdf(w).max(f64::MIN_POSITIVE) * total as f64)))
        .collect();
    let mut centres: Vec<DVec3> = lobes.points(count).collect();
    let mut kernels = Vec::new();
    for _ in 0..ROUNDS {
        let mut sums = vec![(DVec3::ZERO, DVec3::ZERO, 0usize); count];
        for &(w, mass) in &points {
            let nearest = (0..count).max_by(|&a, &b| w.dot(centres[a]).total_cmp(&w.dot(centres[b]))).unwrap_or(0);
            let sum = &mut sums[nearest];
            sum.0 += w;
            sum.1 += mass;
            sum.2 += 1;
        }
        kernels = sums
            .iter()
            .zip(&centres)
            .map(|(&(sum, mass, number), centre)| {
                let mean = sum / number.max(1) as f64;
                // For a narrow kernel the length of the mean is 1 - sigma^2.
                let variance = (1.0 - mean.length()).max(0.0);
                let level = (variance.sqrt() / FINEST_WIDTH_RAD).log2().clamp(SHARPEST_LEVEL, WIDEST_LEVEL);
                let direction = mean.try_normalize().unwrap_or(*centre);
                Kernel { direction, level, weight: mass }
            })
            .collect();
        centres = kernels.iter().map(|kernel| kernel.direction).collect();
    }
    kernels
}
