//! Directions drawn roughly in proportion to f cos: the BRDF's slices tabulated over the half vector, as a sampling density.
use std::f64::consts::{FRAC_1_PI, FRAC_PI_2};
use std::sync::OnceLock;

use glam::{DVec2, DVec3, dvec3};

use super::inversion::find_step;
use super::{KEPT_POINTS, lobe_uv};
use crate::brdf::Brdf;

/// Steps over the polar angle and the azimuth of the half vector.
const POLAR_STEPS: usize = 128;
const TURN_STEPS: usize = 64;
/// Ranges of view angles that share a table, crowded towards grazing ones, where slices change fast.
const VIEW_RANGES: usize = 96;
/// What the view angle is held below: at 90 degrees f is 0 and no slice is left. A renderer only meets it where an
/// interpolated normal turns from the eye.
pub const MAX_THETA_O_DEG: f64 = 89.99;
/// Part of the density that is cos / pi, whatever the BRDF: no direction is forgotten.
const COSINE_PART: f64 = 0.1;

/// A BRDF with tables to sample it by, each made when it is first needed.
pub struct Lobe<'a> {
    brdf: &'a Brdf,
    sets: usize,
    tables: Vec<OnceLock<Table>>,
}

/// A density of half vectors h, constant over cells of (x, turn): tan(theta_h / 2) = x^4, which gives narrow lobes as many cells
/// as wide ones, and turn is an azimuth without trigonometry, see [`turn_of`]. It serves a range of view angles: whichever of them it
/// is used with, pdf and samples agree exactly.
pub struct Table {
    /// CDF over x: POLAR_STEPS + 1 values.
    polar_cdf: Vec<f64>,
    /// CDF over the turn in each step of x: TURN_STEPS + 1 values each.
    turn_cdf: Vec<f64>,
    /// For each scramble its first samples, made when they are first needed.
    kept: Vec<OnceLock<Vec<LobeSample>>>,
}

/// A half vector drawn from a table.
#[derive(Clone, Copy, Debug)]
pub struct LobeSample {
    /// Unit.
    pub h: DVec3,
    /// With which it is drawn, per solid angle of h, in 1/sr.
    pub pdf: f64,
}

impl LobeSample {
    /// The density in 1/sr of the w_i that mirrors w_o in h: dw_i = 4 cos_theta_d dw_h (Walter 2007, eq 14).
    #[inline]
    pub fn pdf_of_w_i(self, cos_theta_d: f64) -> f64 {
        self.pdf / (4.0 * cos_theta_d)
    }
}

impl<'a> Lobe<'a> {
    /// Nothing is tabulated yet. Samples of scrambles below `sets` will be kept.
    pub fn new(brdf: &'a Brdf, sets: usize) -> Self {
        Self { brdf, sets, tables: (0..VIEW_RANGES).map(|_| OnceLock::new()).collect() }
    }

    /// f(w_i, w_o) (n . w_i) per channel, in 1/sr.
    #[inline]
    pub fn f_cos(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
        self.brdf.evaluate(w_i, w_o) * w_i.z
    }

    /// The table for view angle `theta_o` in radians.
    pub fn table(&self, theta_o: f64) -> &Table {
        let from_grazing = (1.0 - theta_o / FRAC_PI_2).clamp(0.0, 1.0).sqrt();
        let range = ((1.0 - from_grazing) * VIEW_RANGES as f64).min((VIEW_RANGES - 1) as f64) as usize;
        self.tables[range].get_or_init(|| {
            let edges = [range, range + 1].map(|edge| {
                let theta_o = FRAC_PI_2 * (1.0 - (1.0 - edge as f64 / VIEW_RANGES as f64).powi(2));
                let theta_o = theta_o.min(MAX_THETA_O_DEG.to_radians());
                dvec3(theta_o.sin(), 0.0, theta_o.cos())
            });
            Table::new(self.brdf, edges, self.sets)
        })
    }
}

impl Table {
    /// The mean of the slices at the two view directions that bound the range.
    fn new(brdf: &Brdf, edges: [DVec3; 2], sets: usize) -> Self {
        const CELLS: usize = POLAR_STEPS * TURN_STEPS;
        let (mut lobe, mut cosine) = (vec![0.0; CELLS], vec![0.0; CELLS]);
        for (cell, (lobe, cosine)) in lobe.iter_mut().zip(&mut cosine).enumerate() {
            // Two points a side, so that cells cut by the horizon are not forgotten.
            for quarter in 0..4 {
                let polar = (cell / TURN_STEPS) as f64 + if quarter < 2 { 0.25 } else { 0.75 };
                let turn = (cell % TURN_STEPS) as f64 + if quarter % 2 == 0 { 0.25 } else { 0.75 };
                let h = half_vector(polar / POLAR_STEPS as f64, turn / TURN_STEPS as f64);
                for w_o in edges {
                    let cos_theta_d = w_o.dot(h);
                    let w_i = 2.0 * cos_theta_d * h - w_o;
                    if cos_theta_d > 0.0 && w_i.z > 0.0 {
                        let measure = 4.0 * cos_theta_d * measure(h);
                        *lobe += brdf.evaluate(w_i, w_o).element_sum() * w_i.z * measure;
                        *cosine += FRAC_1_PI * w_i.z * measure;
                    }
                }
            }
        }
        let [lobe_sum, cosine_sum] = [&lobe, &cosine].map(|cells| cells.iter().sum::<f64>());
        let lobe_scale = if lobe_sum > 0.0 { (1.0 - COSINE_PART) / (COSINE_PART * lobe_sum) * cosine_sum } else { 0.0 };
        let mut table = Self {
            polar_cdf: vec![0.0],
            turn_cdf: Vec::with_capacity(POLAR_STEPS * (TURN_STEPS + 1)),
            kept: (0..sets).map(|_| OnceLock::new()).collect(),
        };
        let mut total = 0.0;
        for (lobe, cosine) in lobe.chunks_exact(TURN_STEPS).zip(cosine.chunks_exact(TURN_STEPS)) {
            let mut sum = 0.0;
            let start = table.turn_cdf.len();
            table.turn_cdf.push(0.0);
            for (lobe, cosine) in lobe.iter().zip(cosine) {
                sum += lobe_scale * lobe + cosine;
                table.turn_cdf.push(sum);
            }
            if sum > 0.0 {
                table.turn_cdf[start..].iter_mut().for_each(|value| *value /= sum);
            }
            total += sum;
            table.polar_cdf.push(total);
        }
        table.polar_cdf.iter_mut().for_each(|value| *value /= total);
        table
    }

    /// The first samples of scramble `set`.
    pub fn kept(&self, set: usize) -> &[LobeSample] {
        self.kept[set].get_or_init(|| (0..KEPT_POINTS).map(|index| self.sample(lobe_uv(set, index))).collect())
    }

    /// The half vector at `uv` in (0, 1)^2.
    pub fn sample(&self, uv: DVec2) -> LobeSample {
        let (i, x) = find_step(POLAR_STEPS, uv.x, |edge| self.polar_cdf[edge]);
        let turns = self.turns(i);
        let (j, turn) = find_step(TURN_STEPS, uv.y, |edge| turns[edge]);
        let h = half_vector((i as f64 + x) / POLAR_STEPS as f64, (j as f64 + turn) / TURN_STEPS as f64);
        LobeSample { h, pdf: self.cell_density(i, j) / measure(h) }
    }

    /// `h` with the density with which [`Self::sample`] draws it.
    #[inline]
    pub fn evaluate(&self, h: DVec3) -> LobeSample {
        let i = ((x_of(h) * POLAR_STEPS as f64) as usize).min(POLAR_STEPS - 1);
        let j = ((turn_of(h) * TURN_STEPS as f64) as usize).min(TURN_STEPS - 1);
        LobeSample { h, pdf: self.cell_density(i, j) / measure(h) }
    }

    /// The density over (x, turn) in a cell.
    #[inline]
    fn cell_density(&self, i: usize, j: usize) -> f64 {
        let turns = self.turns(i);
        let mass = (self.polar_cdf[i + 1] - self.polar_cdf[i]) * (turns[j + 1] - turns[j]);
        mass * (POLAR_STEPS * TURN_STEPS) as f64
    }

    fn turns(&self, i: usize) -> &[f64] {
        &self.turn_cdf[i * (TURN_STEPS + 1)..][..TURN_STEPS + 1]
    }
}

/// The half vector at (x, turn) in [0, 1]^2.
fn half_vector(x: f64, turn: f64) -> DVec3 {
    let s = (x * x) * (x * x);
    let around = direction_at(turn);
    (around * (2.0 * s)).extend(1.0 - s * s) / (1.0 + s * s)
}

/// x of a half vector.
fn x_of(h: DVec3) -> f64 {
    ((h.x * h.x + h.y * h.y).sqrt() / (1.0 + h.z)).sqrt().sqrt()
}

/// Where the ray at (x, y) meets the square |x| + |y| = 1, as a part of its circumference, counted from -x towards -y.
fn turn_of(h: DVec3) -> f64 {
    let size = h.x.abs() + h.y.abs();
    // At the pole any turn will do.
    let along = if size > 0.0 { h.x / size } else { -1.0 };
    0.25 * if h.y < 0.0 { 1.0 + along } else { 3.0 - along }
}

/// The unit vector whose turn that is.
fn direction_at(turn: f64) -> DVec2 {
    let along = if turn < 0.5 { 4.0 * turn - 1.0 } else { 3.0 - 4.0 * turn };
    let across = 1.0 - along.abs();
    DVec2::new(along, if turn < 0.5 { -across } else { across }).normalize()
}

/// dw_h / (dx dturn): dw_h = 4 s ds dphi / (1 + s^2)^2 with s = tan(theta_h / 2) = x^4, and
/// dphi = 4 (|cos phi| + |sin phi|)^2 dturn.
#[inline]
fn measure(h: DVec3) -> f64 {
    let sin2 = h.x * h.x + h.y * h.y;
    let s = sin2.sqrt() / (1.0 + h.z);
    let root = s.sqrt();
    // s ds = 4 x^7 dx.
    let s_ds = 4.0 * s * root * root.sqrt();
    let size = h.x.abs() + h.y.abs();
    let spread2 = if sin2 > 0.0 { size * size / sin2 } else { 1.0 };
    let one_plus = 1.0 + s * s;
    4.0 * s_ds / (one_plus * one_plus) * 4.0 * spread2
}

#[cfg(test)]
mod tests {
    use super::super::points::point;
    use super::*;

    #[test]
    fn pdf_is_the_density_of_samples() {
        let brdf = Brdf::builtin("gold").unwrap();
        for theta_o_deg in [0.0f64, 30.0, 80.0, 89.99] {
            let theta_o = theta_o_deg.to_radians();
            let w_o = dvec3(theta_o.sin(), 0.0, theta_o.cos());
            let lobe = Lobe::new(&brdf, 0);
            let table = lobe.table(theta_o);
            // Samples divided by the pdf sum to the solid angle of what they stand for: all half vectors that see w_o.
            let (mut sum, count) = (0.0, 1 << 14);
            for i in 0..count {
                let sample = table.sample(point(3, i));
                let cos_theta_d = w_o.dot(sample.h);
                assert!((sample.h.length() - 1.0).abs() < 1e-12);
                assert!((table.evaluate(sample.h).pdf / sample.pdf - 1.0).abs() < 1e-6);
                if cos_theta_d > 0.0 && 2.0 * cos_theta_d * sample.h.z > w_o.z {
                    sum += 1.0 / sample.pdf_of_w_i(cos_theta_d) / f64::from(count);
                }
            }
            let hemisphere = 2.0 * std::f64::consts::PI;
            assert!((sum / hemisphere - 1.0).abs() < 0.02, "{theta_o_deg}: {sum}");
        }
    }

    #[test]
    fn half_vectors_and_their_coordinates_are_inverse() {
        for i in 0..1000 {
            let p = point(0, i);
            let h = half_vector(p.x, p.y);
            assert!((x_of(h) - p.x).abs() < 1e-9 && (turn_of(h) - p.y).abs() < 1e-9, "{p}");
        }
    }
}
