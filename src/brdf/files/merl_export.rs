//! Writes any BRDF, or any values, as a file of the MERL database's form, which `merl_file.rs` reads.
use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DMat3, DVec2, DVec3};
use rayon::prelude::*;

use crate::brdf::Brdf;
use crate::brdf::merl::{Horizon, PHI_D_BINS, SCALE, THETA_D_BINS, THETA_H_BINS};

/// Gauss and Legendre's three points on 0 to 1, with their weights.
const POINTS: [(f64, f64); 3] =
    [(0.112_701_665_379_258_3, 2.5 / 9.0), (0.5, 4.0 / 9.0), (0.887_298_334_620_741_7, 2.5 / 9.0)];

/// How much the middle of a cell counts besides, of what the cell's points do: so that a cell has a value where the horizon leaves it none.
const SHARE_OF_MIDDLE: f64 = 1e-3;

/// The bytes of a `.binary` file of `brdf`; -1, as in the database, in cells in whose middle light or view is below the horizon. The form is
/// reciprocal: of a BRDF that is not, the mean of both ways is written.
///
/// Cells along theta_h are as wide as narrow lobes, and linear between their middles a convex lobe reflects too much: of roughness_alpha
/// 0.005, 3 %. So values are not those in the middles but those between which straight lines are nearest to the BRDF, in the mean
/// square over half vectors. These reflect as much as it does.
pub fn merl_bytes(brdf: &Brdf) -> Vec<u8> {
    let lines: Vec<_> = (0..THETA_D_BINS * PHI_D_BINS)
        .into_par_iter()
        .map(|line| values_along_theta_h(brdf, line / PHI_D_BINS, line % PHI_D_BINS))
        .collect();
    merl_bytes_of_values(|[theta_h, theta_d, phi_d]| lines[theta_d * PHI_D_BINS + phi_d][theta_h])
}

/// The bytes of a `.binary` file of a BRDF that has this `value` in the cell of such bins of theta_h, theta_d and phi_d, in 1/sr; where it has
/// none, -1 as in the database.
pub fn merl_bytes_of_values(value: impl Fn([usize; 3]) -> Option<DVec3>) -> Vec<u8> {
    merl_bytes_of_stored(|cell| {
        let f = value(cell);
        std::array::from_fn(|channel| f.map_or(-1.0, |f| f[channel] / SCALE[channel]))
    })
}

/// The bytes of a `.binary` file whose cells hold these numbers for red, green and blue, not scaled: what is wrong with a file can be written, too.
pub fn merl_bytes_of_stored(stored: impl Fn([usize; 3]) -> [f64; 3]) -> Vec<u8> {
    let bins = |cell: usize| [cell / PHI_D_BINS / THETA_D_BINS, cell / PHI_D_BINS % THETA_D_BINS, cell % PHI_D_BINS];
    let cells: Vec<_> = (0..THETA_H_BINS * THETA_D_BINS * PHI_D_BINS).map(|cell| stored(bins(cell))).collect();
    let sizes = [THETA_H_BINS, THETA_D_BINS, PHI_D_BINS].into_iter().flat_map(|size| (size as i32).to_le_bytes());
    let plane = |channel: usize| cells.iter().flat_map(move |cell| cell[channel].to_le_bytes());
    sizes.chain((0..3).flat_map(plane)).collect()
}

/// The values of the cells of one theta_d and phi_d; none below the horizon. By the normal equations of least squares, which couple
/// neighbours alone.
fn values_along_theta_h(brdf: &Brdf, theta_d: usize, phi_d: usize) -> [Option<DVec3>; THETA_H_BINS] {
    let is_above: [bool; THETA_H_BINS] =
        std::array::from_fn(|theta_h| Horizon::of_bins(theta_h, theta_d).is_above(phi_d));
    let f = |(w_i, w_o): (DVec3, DVec3)| match brdf.is_reciprocal() {
        true => brdf.evaluate(w_i, w_o),
        false => 0.5 * (brdf.evaluate(w_i, w_o) + brdf.evaluate(w_o, w_i)),
    };
    let [mut squares, mut with_next] = [[0.0; THETA_H_BINS]; 2];
    let mut sums = [DVec3::ZERO; THETA_H_BINS];
    // From the middle of one cell to that of the next; before the first one and beyond the last their own values hold.
    for interval in 0..=THETA_H_BINS {
        let (before, next) = (interval.saturating_sub(1), interval.min(THETA_H_BINS - 1));
        let (from, to) = ((interval as f64 - 0.5).max(0.0), (interval as f64 + 0.5).min(THETA_H_BINS as f64));
        for (part, weight) in POINTS {
            let at = from + part * (to - from);
            let (w_i, w_o) = directions(at, theta_d, phi_d);
            if w_i.z <= 0.0 || w_o.z <= 0.0 {
                continue;
            }
            // As a reader has it: cells below the horizon have no weight.
            let share = match [is_above[before], is_above[next]] {
                [true, true] if before != next => at - (before as f64 + 0.5),
                [true, _] => 0.0,
                [false, true] => 1.0,
                [false, false] => continue,
            };
            let x = at / THETA_H_BINS as f64;
            // Solid angle of half vectors, but for a factor: sin theta_h d theta_h, where theta_h goes with the square of x.
            let weight = weight * (to - from) * x * (FRAC_PI_2 * x * x).sin();
            let value = f((w_i, w_o));
            squares[before] += weight * (1.0 - share) * (1.0 - share);
            with_next[before] += weight * share * (1.0 - share);
            sums[before] += weight * (1.0 - share) * value;
            squares[next] += weight * share * share;
            sums[next] += weight * share * value;
        }
    }
    for theta_h in (0..THETA_H_BINS).filter(|&theta_h| is_above[theta_h]) {
        let weight = if squares[theta_h] > 0.0 { SHARE_OF_MIDDLE * squares[theta_h] } else { 1.0 };
        squares[theta_h] += weight;
        sums[theta_h] += weight * f(directions(theta_h as f64 + 0.5, theta_d, phi_d));
    }
    // Gauss's elimination, downwards and back.
    for i in 1..THETA_H_BINS {
        if squares[i - 1] > 0.0 {
            let factor = with_next[i - 1] / squares[i - 1];
            squares[i] -= factor * with_next[i - 1];
            let before = sums[i - 1];
            sums[i] -= factor * before;
        }
    }
    let mut values = [None; THETA_H_BINS];
    let mut next = DVec3::ZERO;
    for i in (0..THETA_H_BINS).rev() {
        if is_above[i] {
            next = (sums[i] - with_next[i] * next) / squares[i];
            // Beside a lobe that is narrower than a cell straight lines would undershoot.
            values[i] = Some(next.max(DVec3::ZERO));
        } else {
            next = DVec3::ZERO;
        }
    }
    values
}

/// The directions w_i and w_o at the position `theta_h` in cells and in the middle of the others, with the half vector in the plane of
/// x and z.
fn directions(theta_h: f64, theta_d: usize, phi_d: usize) -> (DVec3, DVec3) {
    let x = theta_h / THETA_H_BINS as f64;
    let to_shading_frame = DMat3::from_rotation_y(FRAC_PI_2 * x * x);
    let (sin_theta_d, cos_theta_d) = (FRAC_PI_2 * (theta_d as f64 + 0.5) / THETA_D_BINS as f64).sin_cos();
    let across = sin_theta_d * DVec2::from_angle(PI * (phi_d as f64 + 0.5) / PHI_D_BINS as f64);
    (to_shading_frame * across.extend(cos_theta_d), to_shading_frame * (-across).extend(cos_theta_d))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::MerlTable;
    use crate::brdf::tests::samples::of_model;
    use crate::farthest::Farthest;

    #[test]
    fn an_exported_brdf_comes_back() {
        let text = "distribution = 'ggx'\nalpha = 0.2\nior = 1.5\ndiffuse = [0.3, 0.1, 0.05]";
        let brdf = of_model("plastic", text);
        let table = Brdf::MerlTable(MerlTable::from_bytes(&merl_bytes(&brdf)).unwrap());
        for theta_o_deg in [0.0f64, 30.0, 60.0, 80.0] {
            let [found, expected] = [&table, &brdf].map(|brdf| brdf.albedo(theta_o_deg.to_radians()));
            assert!(((found - expected) / expected).farthest() < 5e-3, "{theta_o_deg}: {found}, {expected}");
        }
        // In the middle of a cell it is nearly the value itself.
        let (w_i, w_o) = directions(30.5, 20, 50);
        let [found, expected] = [&table, &brdf].map(|brdf| brdf.evaluate(w_i, w_o));
        assert!(((found - expected) / expected).farthest() < 1e-2, "{found}, {expected}");
    }

    /// With the values in the middles of cells the second reflects 3 % too much.
    #[test]
    fn lobes_as_narrow_as_cells_come_back_with_their_energy() {
        for alpha in [0.02, 0.005, 0.003] {
            let text = format!("distribution = 'ggx'\nalpha = {alpha}\nmetal = 'Al'");
            let brdf = of_model("conductor", &text);
            let table = Brdf::MerlTable(MerlTable::from_bytes(&merl_bytes(&brdf)).unwrap());
            for theta_o_deg in [5.0f64, 45.0, 70.0] {
                let [found, expected] = [&table, &brdf].map(|brdf| brdf.albedo(theta_o_deg.to_radians()));
                let error = ((found - expected) / expected).farthest();
                println!("{alpha} at {theta_o_deg}: {error:.5}");
                assert!(error < 5e-3, "{alpha} at {theta_o_deg}: {found}, {expected}");
            }
        }
    }
}
