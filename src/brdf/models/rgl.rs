//! RGL: a measured BRDF of EPFL's material database, in the parameterisation that follows the material.
//!
//! Dupuy and Jakob, "An Adaptive Parameterization for Efficient Material Acquisition and Rendering" (2018). A direction is a point of the
//! unit square, u = (sqrt(2 theta / pi), (phi + pi) / (2 pi)), phi of isotropic materials relative to the plane of the measured direction
//! `a`, of others from the tangent. The half vector's point u_h is warped by the distribution of the normals that are visible from `a`,
//! which spreads the lobe over the whole square; there the measured values M are looked up. With the distribution of normals D and the
//! projected area sigma of the database's fit,
//!
//! ```text
//! f cos theta_b = M(warp_a(u_h), phi_a, theta_a) D(u_h) / (4 sigma(u_a))
//! ```
//!
//! Of anisotropic materials with symmetries only a part of the azimuths phi_a was measured: those from -180 to 0 degrees if half a turn leaves f
//! as it is, those to -90 if the mirrors x to -x and y to -y do. Both directions are taken there first.
//!
//! **Which direction is the light.** Files call `a` omega_i and `b` omega_o, and the lamp was at `a`. But what they hold, and what renderers
//! evaluate, is f times the cosine of `b`: so `b` is the light in the rendering equation, and `a` the view, the direction that is known when
//! the other is sampled. Here then, as in Mitsuba 3 and pbrt 4, `a` is w_o and `b` is w_i. Taken the other way round, f cos theta_i is
//! divided by the cosine of the view: the noise of grazing detectors grows without bound, and white paper reflects 2.8 times the
//! light that it receives at 89 degrees (as it is here, at most 0.99). By reciprocity both would be the same, but measurements are reciprocal
//! only approximately: to some per cent at moderate angles, by factors up to 4 at 85 degrees.
//!
//! Channels of saturated colours are negative in places, since they are out of Rec. 709's gamut; these count as 0.
use std::f64::consts::{FRAC_1_PI, FRAC_2_PI};
use std::ops::{Add, Mul};
use std::sync::Arc;

use glam::{DVec2, DVec3, DVec4, FloatExt, Vec3, Vec4, dvec2, dvec4};

use crate::brdf::{Model, Parameters, theta};
use crate::error::{Error, Result};

/// From here on to the horizon f is as it is here, so that it is finite: f cos theta_i is, which all that is seen is a sum of.
const MIN_COS_THETA_I: f64 = 1e-6;

/// A measured BRDF. Cheap to clone.
#[derive(Clone)]
pub struct Rgl {
    tables: Arc<RglTables>,
    fingerprint: blake3::Hash,
}

/// What a file holds.
pub(crate) struct RglTables {
    /// The azimuths phi_a that were measured, ascending, in radians; at least one. Of at most two the material is isotropic.
    pub phi_a: Vec<f64>,
    /// Whether they are all of them, or those of a half or of a quarter of a turn: 1, 2 or 4.
    pub parts: u32,
    /// The angles theta_a that were measured, ascending, in radians; at least one.
    pub theta_a: Vec<f64>,
    /// The distribution of normals that are visible from each theta_a of each phi_a.
    pub visible_normals: Warp,
    /// M for each theta_a of each phi_a, linear Rec. 709.
    pub values: Grid<Vec3>,
    /// D over u_h.
    pub normals: Grid<f32>,
    /// sigma over u_a.
    pub projected_area: Grid<f32>,
    /// Whether M is to be multiplied by D / (4 sigma).
    pub has_jacobian: bool,
}

/// Values over the unit square, one square after the other: nodes lie on its border too, at least two along each axis.
pub(crate) struct Grid<T> {
    /// Columns and rows.
    pub size: [usize; 2],
    /// Rows from v = 0 on, in each u from 0 on.
    pub values: Vec<T>,
}

/// A cell of a grid: the index of its first node, and where in it a point lies, 0 to 1.
struct Cell {
    first: usize,
    row: usize,
    inside: DVec2,
}

/// Neighbours among squares, and the weight of each.
struct Blend {
    squares: [(usize, f64); 4],
    count: usize,
}

/// Densities over the unit square, bilinear between nodes, with their integrals.
pub(crate) struct Warp {
    /// Of each square the integral is 1, with cells of size 1.
    density: Grid<f32>,
    /// The integral over a row from its first node to each.
    along_rows: Vec<f64>,
    /// The integral over the square from its first row to each.
    across_rows: Vec<f64>,
}

/// What the view alone decides.
struct View<'a> {
    tables: &'a RglTables,
    /// See [`RglTables::to_measured_part`].
    part: DVec3,
    /// There.
    w_o: DVec3,
    /// The squares around it.
    blend: Blend,
    /// sigma.
    projected_area: f64,
}

impl Blend {
    /// The means of what is `at` each square.
    #[inline]
    fn mean<T: Default + Add<Output = T> + Mul<f64, Output = T>>(&self, at: impl Fn(usize) -> T) -> T {
        let weighted = self.squares[..self.count].iter().map(|&(square, weight)| at(square) * weight);
        weighted.fold(T::default(), |sum, value| sum + value)
    }
}

impl<T> Grid<T> {
    fn nodes(&self) -> usize {
        self.size[0] * self.size[1]
    }

    #[inline]
    fn cell(&self, u: DVec2) -> Cell {
        let [columns, rows] = self.size;
        let position = u.clamp(DVec2::ZERO, DVec2::ONE) * dvec2((columns - 1) as f64, (rows - 1) as f64);
        let (column, row) = ((position.x as usize).min(columns - 2), (position.y as usize).min(rows - 2));
        Cell { first: column + columns * row, row, inside: position - dvec2(column as f64, row as f64) }
    }
}

impl<T: Copy> Grid<T> {
    /// The four nodes of a cell in one square: (0, 0), (1, 0), (0, 1), (1, 1).
    #[inline]
    fn corners(&self, square: usize, cell: &Cell) -> [T; 4] {
        let low = &self.values[square * self.nodes() + cell.first..];
        let high = &low[self.size[0]..];
        [low[0], low[1], high[0], high[1]]
    }
}

impl Grid<f32> {
    /// Bilinear between nodes of the first square.
    fn at(&self, u: DVec2) -> f64 {
        let cell = self.cell(u);
        let [low, high] = along_cell(Vec4::from(self.corners(0, &cell)).as_dvec4(), cell.inside.y);
        low.lerp_monotonic(high, cell.inside.x)
    }
}

impl Grid<Vec3> {
    /// Bilinear between nodes, linear between squares.
    fn at(&self, blend: &Blend, u: DVec2) -> DVec3 {
        let cell = self.cell(u);
        blend.mean(|square| {
            let [a, b, c, d] = self.corners(square, &cell);
            let (low, high) =
                (a.as_dvec3().lerp(b.as_dvec3(), cell.inside.x), c.as_dvec3().lerp(d.as_dvec3(), cell.inside.x));
            low.lerp(high, cell.inside.y)
        })
    }
}

impl Warp {
    /// The warp of densities that are not negative; the error is what is wrong with them.
    pub fn of(mut density: Grid<f32>) -> Result<Self, String> {
        let [columns, rows] = density.size;
        let mut along_rows = Vec::with_capacity(density.values.len());
        let mut across_rows = Vec::with_capacity(density.values.len() / columns);
        for (index, square) in density.values.chunks_exact_mut(columns * rows).enumerate() {
            let start = along_rows.len();
            for row in square.chunks_exact(columns) {
                along_rows.extend(integrals(row.iter().map(|&value| f64::from(value))));
            }
            let totals = along_rows[start..].chunks_exact(columns).map(|row| row[columns - 1]);
            let across: Vec<f64> = integrals(totals).collect();
            let total = across[rows - 1];
            if total.is_nan() || total <= 0.0 {
                return Err(format!("holds nothing but zeros in vndf for angle {index}"));
            }
            square.iter_mut().for_each(|value| *value = (f64::from(*value) / total) as f32);
            along_rows[start..].iter_mut().for_each(|sum| *sum /= total);
            across_rows.extend(across.iter().map(|sum| sum / total));
        }
        Ok(Self { density, along_rows, across_rows })
    }

    /// The point with as much of the density before it, along rows and across, as there is area of the square before the result.
    fn invert(&self, blend: &Blend, u: DVec2) -> DVec2 {
        let [columns, rows] = self.density.size;
        let cell = self.density.cell(u);
        let corners = blend.mean(|square| Vec4::from(self.density.corners(square, &cell)).as_dvec4());
        let [low, high] = along_cell(corners, cell.inside.y);

        // Of the two rows of the cell, up to it and in all; and of the rows before.
        let last = columns * (cell.row + 1) - 1;
        let [before, next_before, total, next_total] = blend
            .mean(|square| {
                let sums = &self.along_rows[square * columns * rows..];
                dvec4(sums[cell.first], sums[cell.first + columns], sums[last], sums[last + columns])
            })
            .to_array();
        let above = blend.mean(|square| self.across_rows[square * rows + cell.row]);
        let before = before.lerp_monotonic(next_before, cell.inside.y);
        let y = above + integral_in_cell(total, next_total, cell.inside.y);
        let total = total.lerp_monotonic(next_total, cell.inside.y);
        // No normal is visible in a row without density, so any place in it is as good.
        let x = if total > 0.0 { (before + integral_in_cell(low, high, cell.inside.x)) / total } else { u.x };
        dvec2(x, y)
    }
}

/// The values in the middle of the left and of the right side of a cell, `y` of the way along them.
fn along_cell(corners: DVec4, y: f64) -> [f64; 2] {
    [corners.x.lerp_monotonic(corners.z, y), corners.y.lerp_monotonic(corners.w, y)]
}

/// The integral from 0 to `x` of what goes linearly from `low` at 0 to `high` at 1.
fn integral_in_cell(low: f64, high: f64, x: f64) -> f64 {
    x * (low + 0.5 * x * (high - low))
}

/// The integral from the first of these nodes to each.
fn integrals(nodes: impl Iterator<Item = f64>) -> impl Iterator<Item = f64> {
    nodes.scan(None, |state: &mut Option<(f64, f64)>, value| {
        let sum = state.map_or(0.0, |(sum, last)| sum + 0.5 * (last + value));
        *state = Some((sum, value));
        Some(sum)
    })
}

impl Rgl {
    pub(crate) fn of(tables: RglTables) -> Self {
        let mut hasher = blake3::Hasher::new();
        for angles in [&tables.phi_a, &tables.theta_a] {
            crate::brdf::hash_numbers(&mut hasher, [angles.len() as f64]);
            crate::brdf::hash_numbers(&mut hasher, angles.iter().copied());
        }
        crate::brdf::hash_numbers(&mut hasher, [f64::from(u8::from(tables.has_jacobian))]);
        hasher.update(bytemuck::cast_slice(&tables.values.values));
        crate::brdf::hash_numbers(&mut hasher, tables.values.size.map(|size| size as f64));
        for grid in [&tables.visible_normals.density, &tables.normals, &tables.projected_area] {
            crate::brdf::hash_numbers(&mut hasher, grid.size.map(|size| size as f64));
            hasher.update(bytemuck::cast_slice(&grid.values));
        }
        Self { tables: Arc::new(tables), fingerprint: hasher.finalize() }
    }
}

impl RglTables {
    fn is_isotropic(&self) -> bool {
        self.phi_a.len() <= 2
    }

    /// What takes both directions to where `w_a` was measured: factors of their coordinates. Of an azimuth at the
    /// ends of that part, both ends are as good; signs of zeros say which, as in Mitsuba 3.
    fn to_measured_part(&self, w_a: DVec3) -> DVec3 {
        let [x, y] = [w_a.x, w_a.y].map(|coordinate| -1f64.copysign(coordinate));
        match self.parts {
            1 => DVec3::ONE,
            2 => DVec3::new(y, y, 1.0),
            _ => DVec3::new(x, y, 1.0),
        }
    }

    /// The view along `w_o`.
    fn seen_from(&self, w_o: DVec3) -> View<'_> {
        let part = self.to_measured_part(w_o);
        let w_o = w_o * part;
        let (theta_o, phi_o) = (theta(w_o), w_o.y.atan2(w_o.x));
        let phi_a = if self.is_isotropic() { 0.0 } else { phi_o };
        let projected_area = self.projected_area.at(in_square(theta_o, phi_a));
        View { tables: self, part, w_o, blend: self.around(phi_o, theta_o), projected_area }
    }

    /// The squares that were measured around an azimuth and an angle.
    fn around(&self, phi_a: f64, theta_a: f64) -> Blend {
        let mut blend = Blend { squares: [(0, 0.0); 4], count: 0 };
        for (phi, weight_phi) in neighbours(&self.phi_a, phi_a) {
            for (theta, weight_theta) in neighbours(&self.theta_a, theta_a) {
                if weight_phi * weight_theta > 0.0 {
                    blend.squares[blend.count] = (theta + self.theta_a.len() * phi, weight_phi * weight_theta);
                    blend.count += 1;
                }
            }
        }
        blend
    }
}

impl View<'_> {
    fn evaluate(&self, w_i: DVec3) -> DVec3 {
        let Self { tables, w_o, blend, .. } = self;
        let w_i = w_i * self.part;
        let h = (w_i + w_o).normalize();
        let phi_h = match tables.is_isotropic() {
            true => {
                // Seen along the normal there is no plane of view, but values depend on its azimuth all the same, by what the measurement erred.
                // It is the plane of x, where views have theirs that tables and threads are made for: so these go on evenly to the normal.
                let plane = if w_o.truncate() == DVec2::ZERO { DVec2::X } else { w_o.truncate() };
                plane.perp_dot(h.truncate()).atan2(plane.dot(h.truncate()))
            }
            false => h.y.atan2(h.x),
        };
        let u_h = in_square(theta(h), phi_h);
        let mut value = tables.values.at(blend, tables.visible_normals.invert(blend, u_h)).max(DVec3::ZERO);
        if tables.has_jacobian {
            value *= tables.normals.at(u_h) / (4.0 * self.projected_area);
        }
        value / w_i.z.max(MIN_COS_THETA_I)
    }
}

/// The point of the unit square that is a direction.
fn in_square(theta: f64, phi: f64) -> DVec2 {
    dvec2((theta * FRAC_2_PI).sqrt(), 0.5 + 0.5 * FRAC_1_PI * phi)
}

/// Those of `known` numbers, which ascend, that are next to `at`, and the weight of each; beyond the first and the last it is as there.
fn neighbours(known: &[f64], at: f64) -> [(usize, f64); 2] {
    let last = known.len() - 1;
    let after = known.partition_point(|&known| known <= at);
    if after == 0 || after > last {
        return [(after.min(last), 1.0), (last, 0.0)];
    }
    let weight = (at - known[after - 1]) / (known[after] - known[after - 1]);
    [(after - 1, 1.0 - weight), (after, weight)]
}

impl std::fmt::Debug for Rgl {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("Rgl").field("fingerprint", &self.fingerprint).finish_non_exhaustive()
    }
}

impl Model for Rgl {
    const HAS_PARAMETERS: bool = false;

    fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
        self.tables.seen_from(w_o).evaluate(w_i)
    }

    fn evaluate_all(&self, w_i: &[DVec3], w_o: DVec3) -> Vec<DVec3> {
        let view = self.tables.seen_from(w_o);
        w_i.iter().map(|w_i| view.evaluate(*w_i)).collect()
    }

    fn is_reciprocal(&self) -> bool {
        false
    }

    fn from_parameters(_: &mut Parameters) -> Result<Self> {
        Err(Error::input("model `rgl`", "has no parameters", "name the file with file = \"....bsdf\" instead"))
    }

    fn hash_content(&self, hasher: &mut blake3::Hasher) {
        hasher.update(self.fingerprint.as_bytes());
    }
}
