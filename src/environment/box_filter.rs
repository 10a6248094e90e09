//! Means of an environment over the solid angles of the texels of a cube map.
//!
//! Along a meridian the integral has a closed form. Between the centres of two columns of pixels, and between the corners of a texel, it is a
//! smooth function of the meridian's angle but for small bends, so that Gauss's rule needs few meridians, also near the poles, where pixels
//! are slivers.
use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use super::cube::point_of;
use super::{Environment, angles, to_dvec3};

/// Where Gauss's rule of two points, which have the same weight, has them in [0, 1].
const GAUSS: [f64; 2] = [0.211_324_865_405_187_1, 0.788_675_134_594_812_9];

/// Where the edges of a texel slant they cross rows, at which the integrals bend: there are so many parts for each row in the height of a texel.
const PARTS_PER_ROW: f64 = 1.5;

/// No part is wider than this, as the angle at which edges are seen turns.
const MOST_RAD: f64 = 1.0 / 8.0;

/// The filter of one environment.
pub(super) struct BoxFilter<'a> {
    environment: &'a Environment,
    /// Texels along the edge of a face; even, so that the poles are corners of texels.
    face_size: usize,
    /// Of each row: cosine and sine of theta.
    rows: Vec<DVec2>,
    /// There are so many at least between two corners of a texel.
    parts: f64,
}

/// Of a texel: radiance times weight, and weights.
#[derive(Default)]
struct Sum {
    radiance: DVec3,
    weight: f64,
}

impl<'a> BoxFilter<'a> {
    pub fn new(environment: &'a Environment, face_size: usize) -> Self {
        assert!(face_size.is_multiple_of(2), "the poles are corners of texels");
        let rows =
            (0..environment.height).map(|row| DVec2::from_angle(PI * (row as f64 + 0.5) / environment.height as f64));
        let parts = (PARTS_PER_ROW * 2.0 / face_size as f64 / PI * environment.height as f64).ceil();
        Self { environment, face_size, rows: rows.collect(), parts }
    }

    /// The mean of [`Environment::radiance`] over a texel.
    pub fn mean_over_texel(&self, face: usize, row: usize, column: usize) -> DVec3 {
        let edge = |index: usize| 2.0 * index as f64 / self.face_size as f64 - 1.0;
        let (s, t) = ([edge(column), edge(column + 1)], [edge(row), edge(row + 1)]);
        let mut sum = Sum::default();
        match face {
            2 => self.add_beside_pole(&mut sum, s, t, 1.0),
            3 => self.add_beside_pole(&mut sum, s, t, -1.0),
            _ => {
                let [middle, _] = angles(point_of(face, 0.5, 0.5));
                let ends = |angle: f64| t.map(|t| DVec2::new(-t, angle.cos().recip()));
                self.add(&mut sum, &s.map(f64::atan), |angle| middle - angle, ends);
            }
        }
        sum.radiance / sum.weight
    }

    /// Adds a texel of the face at y = `up`. As each is within a quadrant, it is as if it were in the first.
    fn add_beside_pole(&self, sum: &mut Sum, s: [f64; 2], t: [f64; 2], up: f64) {
        let into_quadrant =
            |[from, to]: [f64; 2]| if from < 0.0 { (-1.0, [to.abs(), -from]) } else { (1.0, [from, to]) };
        let ((sign_s, s), (sign_t, t)) = (into_quadrant(s), into_quadrant(t));
        let phi = |angle: f64| sign_s * if sign_t * up < 0.0 { angle } else { PI - angle };
        let ends = |angle: f64| {
            let (sin, cos) = angle.sin_cos();
            let (near, far) = ((s[0] / sin).max(t[0] / cos), (s[1] / sin).min(t[1] / cos));
            // Downwards from the zenith.
            (if up > 0.0 { [near, far] } else { [far, near] }).map(|radius| DVec2::new(up, radius))
        };
        let [near, far] = [0, 1].map(|i| s[i].atan2(t[i]));
        let corners = [s[0].atan2(t[1]), near.min(far), near.max(far), s[1].atan2(t[0])];
        self.add(sum, &corners, phi, ends);
    }

    /// Adds what is between the first and the last of these angles, between which `ends` are smooth: the points, by height and by distance from
    /// the vertical axis, between which the meridian at an angle crosses the texel. `phi` is that of an angle.
    fn add(&self, sum: &mut Sum, corners: &[f64], phi: impl Fn(f64) -> f64, ends: impl Fn(f64) -> [DVec2; 2]) {
        let columns_per_rad = self.environment.width as f64 / TAU;
        for angles in corners.windows(2) {
            let [from, to] = [0, 1].map(|i| (phi(angles[i]) * columns_per_rad - 0.5, angles[i]));
            let widest = ((angles[1] - angles[0]) / self.parts).min(MOST_RAD) * columns_per_rad;
            // Phi may grow or fall with the angle.
            let ((mut column, angle), (end, _)) = if from.0 < to.0 { (from, to) } else { (to, from) };
            let (start, rad) = (column, (to.1 - from.1) / (to.0 - from.0));
            while column < end {
                let left = column.floor();
                let width = ((left + 1.0).min(end) - column).min(widest);
                for column in GAUSS.map(|node| column + node * width) {
                    self.add_meridian(sum, left as isize, column - left, width, ends(angle + (column - start) * rad));
                }
                column += width;
            }
        }
    }

    /// Adds with this `weight` what is between the `ends` of a meridian, which is at this `fraction` of the way from column `left` to the next.
    fn add_meridian(&self, sum: &mut Sum, left: isize, fraction: f64, weight: f64, ends: [DVec2; 2]) {
        let &Environment { width, height, .. } = self.environment;
        let columns = [left, left + 1].map(|column| column.rem_euclid(width as isize) as usize);
        let radiance_of = |row: f64| {
            let texels = &self.environment.texels[(row.max(0.0) as usize).min(height - 1) * width..][..width];
            let [left, right] = columns.map(|column| to_dvec3(&texels[column]));
            left.lerp(right, fraction)
        };
        let row_rad = PI / height as f64;
        let [mut from, to] = ends.map(|end| (end.to_angle() / row_rad - 0.5, end.normalize()));
        let mut above = radiance_of(from.0.floor());
        while from.0 < to.0 {
            // Between two rows radiance is linear: the integrals of its product with the sine of theta.
            let row = from.0.floor();
            let next = if row + 1.0 < to.0 { (row + 1.0, self.rows[(row + 1.0) as usize]) } else { to };
            let below = radiance_of(row + 1.0);
            let both = from.1.x - next.1.x;
            let weight_below = (from.0 - row) * from.1.x - (next.0 - row) * next.1.x + (next.1.y - from.1.y) / row_rad;
            sum.radiance += weight * (both * above + weight_below * (below - above));
            sum.weight += weight * both;
            (from, above) = (next, below);
        }
    }
}
