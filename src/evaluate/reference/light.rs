//! The environment as the reference sees it: cells of the sphere, and for each the weights of a quadrature that are exact for its light.
//!
//! A product quadrature: for g smooth over a cell, the integral of L g is a sum of g at a few nodes times weights, which are the
//! integrals of L times the Lagrange polynomials of the nodes. Weights are exact however rough the light is, a sun or an edge,
//! so only g has to be resolved.
use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::environment::Environment;

/// Nodes of a cell per axis: equal steps from edge to edge, so that the cells within a cell share them.
pub const NODES: usize = 3;
/// Nodes of a cell, row by row.
pub const CELL_NODES: usize = NODES * NODES;
/// Nodes per axis of the four cells within a cell.
pub const FINE_NODES: usize = 2 * NODES - 1;
/// The level that quadrature starts from: cells of 45 degrees.
pub const FIRST_LEVEL: u32 = 2;
/// The level that it ends at: cells of 4e-7 rad, still far from the roundings of their places.
pub const LAST_LEVEL: u32 = 23;

/// Weights are kept for cells of about so many pixels a side or more; those of smaller ones are cheap to make again.
const KEPT_PX: usize = 2;
/// Kept levels end here, at 302 MB in all, however large the picture is; and here, where the sine of theta is a polynomial over a cell.
const LAST_KEPT_LEVEL: u32 = 10;
const LEAST_KEPT_LEVEL: u32 = 5;

/// A part of the sphere: phi from 2 pi column / 2^(level + 1) and theta from pi row / 2^level, to the next.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellPlace {
    pub level: u32,
    pub column: u32,
    pub row: u32,
}

impl CellPlace {
    /// All cells of a level.
    pub fn all(level: u32) -> impl Iterator<Item = Self> {
        (0..1 << level).flat_map(move |row| (0..2 << level).map(move |column| Self { level, column, row }))
    }

    /// The four cells within: row by row.
    pub fn parts(self) -> [Self; 4] {
        let part = |i: u32| Self { level: self.level + 1, column: 2 * self.column + i % 2, row: 2 * self.row + i / 2 };
        [0, 1, 2, 3].map(part)
    }

    /// The length of an edge of constant phi, in radians; other edges are at most as long.
    pub fn side(self) -> f64 {
        PI / f64::from(1 << self.level)
    }

    /// The direction in the middle.
    pub fn middle(self) -> DVec3 {
        let [phi, theta] = self.middle_angles();
        DVec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos())
    }

    /// Half of the cell's width at its widest row, towards the middle of an edge of constant phi; and half of its height, towards that of an
    /// edge of constant theta.
    pub fn half_edges(self) -> [DVec3; 2] {
        let [phi, theta] = self.middle_angles();
        let half = 0.5 * self.side();
        let widest = [theta - half, theta + half].map(f64::sin).into_iter().fold(theta.sin(), f64::max);
        let along_phi = DVec3::new(phi.cos(), 0.0, phi.sin());
        let along_theta = DVec3::new(theta.cos() * phi.sin(), -theta.sin(), -theta.cos() * phi.cos());
        [half * widest * along_phi, half * along_theta]
    }

    fn middle_angles(self) -> [f64; 2] {
        [self.column, self.row].map(|index| (f64::from(index) + 0.5) * self.side())
    }

    /// Nodes in `N` equal steps from edge to edge along each axis, row by row: names and directions. `N` - 1 divides 4.
    pub fn nodes<const N: usize>(self) -> [[(NodePlace, DVec3); N]; N] {
        let step = 4 / (N - 1) as u32;
        let fraction = |index: u32, i: usize| 4 * index + step * i as u32;
        let angle = |index: u32, i: usize| f64::from(fraction(index, i)) * (0.25 * self.side());
        let finest = |fraction: u32| fraction << (LAST_LEVEL - self.level);
        let phis: [_; N] = std::array::from_fn(|i| (finest(fraction(self.column, i)), angle(self.column, i).sin_cos()));
        std::array::from_fn(|j| {
            let (sin_theta, cos_theta) = angle(self.row, j).sin_cos();
            let row = finest(fraction(self.row, j));
            phis.map(|(column, (sin_phi, cos_phi))| {
                ([column, row], DVec3::new(sin_theta * sin_phi, cos_theta, -sin_theta * cos_phi))
            })
        })
    }
}

/// A node's column and row, in quarters of a cell of the last level.
pub type NodePlace = [u32; 2];

/// The integrals of radiance times each node's polynomial over a cell, in radiance times sr. In single precision, as texels
/// are: 1e-7 of the cell's light.
pub type Weights = [Vec3; CELL_NODES];

/// The environment's cells.
pub struct Light<'a> {
    environment: &'a Environment,
    /// Weights level by level from the first, row by row.
    kept: Vec<Vec<Weights>>,
    /// The sum of [`amount`] over the cells of the first level.
    whole: f64,
}

impl<'a> Light<'a> {
    /// Integrates `environment`.
    pub fn new(environment: &'a Environment) -> Self {
        let fits =
            |level: &u32| (1 << level) * KEPT_PX >= environment.height && (2 << level) * KEPT_PX >= environment.width;
        let last = (LEAST_KEPT_LEVEL..LAST_KEPT_LEVEL).find(fits).unwrap_or(LAST_KEPT_LEVEL);
        let mut light = Self { environment, kept: Vec::new(), whole: 0.0 };
        let places: Vec<_> = CellPlace::all(last).collect();
        let mut levels = vec![places.into_par_iter().map(|place| light.integrate(place)).collect::<Vec<_>>()];
        for level in (FIRST_LEVEL..last).rev() {
            let finer = &levels[levels.len() - 1];
            let places: Vec<_> = CellPlace::all(level).collect();
            let of_parts = |place: CellPlace| sum_of_parts(place.parts().map(|part| &finer[index(part)]));
            levels.push(places.into_par_iter().map(of_parts).collect());
        }
        levels.reverse();
        light.whole = levels[0].iter().map(amount).sum();
        light.kept = levels;
        light
    }

    /// The weights of a cell at [`FIRST_LEVEL`] or below it.
    pub fn weights(&self, place: CellPlace) -> Weights {
        match self.kept.get((place.level - FIRST_LEVEL) as usize) {
            Some(level) => level[index(place)],
            None => self.integrate(place),
        }
    }

    /// The part of all light that is in a cell, 0 to 1.
    pub fn share(&self, place: CellPlace) -> f64 {
        amount(&self.weights(place)) / self.whole.max(f64::MIN_POSITIVE)
    }

    /// The weights from pixels.
    fn integrate(&self, place: CellPlace) -> Weights {
        let Environment { width, height, ref texels, .. } = *self.environment;
        let part = 1.0 / f64::from(1 << place.level);
        let (u, v) = (0.5 * part * f64::from(place.column), part * f64::from(place.row));
        let (first_column, columns) = tent_integrals(u, 0.5 * part, width, |_| TAU);
        let (first_row, rows) = tent_integrals(v, part, height, |v| PI * (PI * v).sin());
        let mut weights = [DVec3::ZERO; CELL_NODES];
        for (row, of_row) in (first_row..).zip(&rows) {
            let texels = &texels[row.clamp(0, height as isize - 1) as usize * width..][..width];
            let mut along = [DVec3::ZERO; NODES];
            for (column, of_column) in (first_column..).zip(&columns) {
                let texel = DVec3::from_array(texels[column.rem_euclid(width as isize) as usize].map(f64::from));
                for (sum, integral) in along.iter_mut().zip(of_column) {
                    *sum += texel * *integral;
                }
            }
            for (weights, integral) in weights.chunks_exact_mut(NODES).zip(of_row) {
                for (weight, along) in weights.iter_mut().zip(along) {
                    *weight += along * *integral;
                }
            }
        }
        weights.map(|weight| weight.as_vec3())
    }
}

/// How much light a cell has: weights at some of its nodes may be negative.
fn amount(weights: &Weights) -> f64 {
    weights.iter().map(|weight| f64::from(weight.abs().element_sum())).sum()
}

/// A cell's index in its level.
fn index(place: CellPlace) -> usize {
    place.row as usize * (2 << place.level) + place.column as usize
}

/// The weights of a cell from those of its parts: a polynomial of the whole is, on a part, the sum over the part's nodes of
/// its values there times their polynomials.
fn sum_of_parts(parts: [&Weights; 4]) -> Weights {
    let mut whole = [DVec3::ZERO; CELL_NODES];
    for (part, weights) in parts.into_iter().enumerate() {
        let (left, top) = (part % 2 * (NODES - 1), part / 2 * (NODES - 1));
        for (node, weight) in weights.iter().enumerate() {
            let (along, down) = (&FINE_VALUES[left + node % NODES], &FINE_VALUES[top + node / NODES]);
            for (i, sum) in whole.iter_mut().enumerate() {
                *sum += weight.as_dvec3() * (along[i % NODES] * down[i / NODES]);
            }
        }
    }
    whole.map(|weight| weight.as_vec3())
}

/// What a cell's polynomial is at the nodes of its parts, from the values there: every other one is at a node of the cell.
pub fn interpolate(fine: &[[DVec3; FINE_NODES]; FINE_NODES]) -> [[DVec3; FINE_NODES]; FINE_NODES] {
    let along: [[DVec3; FINE_NODES]; NODES] =
        std::array::from_fn(|row| FINE_VALUES.map(|values| (0..NODES).map(|i| fine[2 * row][2 * i] * values[i]).sum()));
    FINE_VALUES.map(|values| std::array::from_fn(|column| (0..NODES).map(|i| along[i][column] * values[i]).sum()))
}

/// The polynomials at the nodes of the parts.
static FINE_VALUES: [[f64; NODES]; FINE_NODES] = {
    let mut values = [[0.0; NODES]; FINE_NODES];
    let mut i = 0;
    while i < FINE_NODES {
        values[i] = polynomials(i as f64 / (FINE_NODES - 1) as f64);
        i += 1;
    }
    values
};

/// The Lagrange polynomials of the nodes at t in [0, 1]: each is 1 at its own node and 0 at the others.
const fn polynomials(t: f64) -> [f64; NODES] {
    let mut values = [1.0; NODES];
    let mut i = 0;
    while i < NODES {
        let mut j = 0;
        while j < NODES {
            if i != j {
                values[i] *= (t * (NODES - 1) as f64 - j as f64) / (i as f64 - j as f64);
            }
            j += 1;
        }
        i += 1;
    }
    values
}

/// Abscissae in (0, 1) and weights of the Gauss-Legendre rule of four points: exact for degree 7.
const GAUSS: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_9, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];

/// The integrals over an axis from `start` to `start + size` (of a whole of 1, on which `count` pixels lie) of `measure` times a
/// pixel's bilinear weight times each polynomial; for all pixels that reach into it, from the first.
fn tent_integrals(start: f64, size: f64, count: usize, measure: impl Fn(f64) -> f64) -> (isize, Vec<[f64; NODES]>) {
    let place = |x: f64| x * count as f64 - 0.5;
    let (from, to) = (place(start), place(start + size));
    let (first, last) = (from.floor() as isize, to.ceil() as isize);
    let mut integrals = vec![[0.0; NODES]; (last - first) as usize + 1];
    for piece in first..last {
        let (left, right) = (from.max(piece as f64), to.min((piece + 1) as f64));
        for (abscissa, gauss) in GAUSS {
            let x = left + (right - left) * abscissa;
            let density = gauss * (right - left) / count as f64 * measure((x + 0.5) / count as f64);
            let second = x - piece as f64;
            for (node, value) in polynomials((x - from) / (to - from)).into_iter().enumerate() {
                integrals[(piece - first) as usize][node] += density * (1.0 - second) * value;
                integrals[(piece - first) as usize + 1][node] += density * second * value;
            }
        }
    }
    (first, integrals)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::tests::environment;
    use crate::farthest::Farthest;

    /// The integral of radiance times g over a cell, by midpoints.
    fn midpoints(map: &Environment, place: CellPlace, g: impl Fn(f64, f64) -> f64) -> DVec3 {
        const STEPS: usize = 400;
        let mut sum = DVec3::ZERO;
        for (i, j) in (0..STEPS).flat_map(|i| (0..STEPS).map(move |j| (i, j))) {
            let [s, t] = [i, j].map(|step| (step as f64 + 0.5) / STEPS as f64);
            let (phi, theta) =
                ((f64::from(place.column) + s) * place.side(), (f64::from(place.row) + t) * place.side());
            let direction = DVec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos());
            sum += map.radiance(direction) * (theta.sin() * g(s, t));
        }
        sum * (place.side() / STEPS as f64).powi(2)
    }

    #[test]
    fn weights_are_exact_for_polynomials_under_any_light() {
        for (width, height) in [(1, 1), (2, 1), (1, 7), (9, 5), (40, 30), (64, 32)] {
            let map = environment(width, height, |column, row| {
                [(column * 7 % 5) as f32, (row * 3 % 7) as f32, if (column + row) % 11 == 0 { 50.0 } else { 0.0 }]
            });
            let light = Light::new(&map);
            for place in [(2, 0, 0), (2, 7, 3), (3, 5, 2), (5, 63, 31), (6, 0, 17), (9, 1000, 300)] {
                let place = CellPlace { level: place.0, column: place.1, row: place.2 };
                let weights = light.weights(place);
                let g = |s: f64, t: f64| (0.3 + s - 1.5 * s * s) * (1.0 + t + t * t);
                let nodes = weights.iter().enumerate();
                let step = 1.0 / (NODES - 1) as f64;
                let found: DVec3 = nodes
                    .map(|(i, weight)| weight.as_dvec3() * g((i % NODES) as f64 * step, (i / NODES) as f64 * step))
                    .sum();
                let exact = midpoints(&map, place, g);
                let size = midpoints(&map, place, |s, t| g(s, t).abs()).max_element();
                let error = (found - exact).farthest();
                assert!(error <= 1e-4 * size, "{width} x {height}, {place:?}: {found} {exact}");
            }
        }
    }

    #[test]
    fn weights_sum_to_the_light_as_a_whole() {
        let map = environment(11, 6, |column, row| [(column + row) as f32, 1.0, if column == 3 { 50.0 } else { 0.1 }]);
        let light = Light::new(&map);
        for level in FIRST_LEVEL..8 {
            let sum: DVec3 = CellPlace::all(level).flat_map(|place| light.weights(place)).map(Vec3::as_dvec3).sum();
            let exact = map.mean_radiance() * 4.0 * PI;
            assert!(((sum - exact) / exact).farthest() < 1e-6, "level {level}: {sum} {exact}");
        }
    }

    #[test]
    fn interpolation_reproduces_polynomials_at_nodes_of_parts() {
        let g = |s: f64, t: f64| DVec3::new(s * s, t - s * t, 1.0 + s * s * t * t);
        let at = |i: usize, count: usize| i as f64 / (count - 1) as f64;
        let values = std::array::from_fn(|j| std::array::from_fn(|i| g(at(i, FINE_NODES), at(j, FINE_NODES))));
        for (j, row) in interpolate(&values).into_iter().enumerate() {
            for (i, value) in row.into_iter().enumerate() {
                assert!((value - g(at(i, FINE_NODES), at(j, FINE_NODES))).length() < 1e-12);
            }
        }
    }
}
