//! The azimuths of the view for which an anisotropic BRDF has rows, of threads or of CDFs: as few as its symmetry leaves.
use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::theta_o;
use crate::brdf::{Brdf, Symmetry};
use crate::shader_constants::azimuths::AZIMUTH_STEP_DEG;

/// From one to the next, in radians. With steps of 10 degrees, half the memory and half the time to
/// fit, four brushed materials in three maps err by a tenth more with 16 fitted threads, and by an eighth more with 64.
pub const STEP_RAD: f64 = AZIMUTH_STEP_DEG as f64 * PI / 180.0;

/// How many azimuths of the view there are rows for: 1 if it does not matter; else every [`STEP_RAD`] from the tangent on, both
/// ends included, to 90 degrees if the BRDF has mirror planes along and across the tangent, to 180 if half a turn leaves it as it is, to 360.
pub fn azimuth_count(brdf: &Brdf) -> usize {
    let Symmetry { isotropic, half_turn, mirror_x, mirror_y } = brdf.symmetry();
    count_of(match (half_turn, mirror_x && mirror_y) {
        _ if isotropic => 0.0,
        (true, true) => FRAC_PI_2,
        (true, false) => PI,
        (false, _) => TAU,
    })
}

/// Whether it is the [`azimuth_count`] of some BRDF.
pub fn is_azimuth_count(count: usize) -> bool {
    [0.0, FRAC_PI_2, PI, TAU].map(count_of).contains(&count)
}

fn count_of(span_rad: f64) -> usize {
    (span_rad / STEP_RAD).round() as usize + 1
}

/// Where a surface is seen from.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    /// Angle between the normal and w_o, in radians.
    pub theta_o: f64,
    /// Azimuth of w_o from the tangent, in radians.
    pub phi_o: f64,
}

impl View {
    /// That of row `index`, where there are `rows` for each azimuth.
    pub fn of_row(index: usize, rows: usize) -> Self {
        Self { theta_o: theta_o(index % rows, rows), phi_o: (index / rows) as f64 * STEP_RAD }
    }
}

/// Where the azimuth `phi_o` (radians) of a view is among `count` of them, in steps, and whether what is seen is the mirror image of what is
/// there. Twin: `fold_azimuth` in glsl/azimuths.glsl, in single precision.
pub fn fold_azimuth(phi_o: f64, count: usize) -> (f64, bool) {
    let span = (count - 1) as f64 * STEP_RAD;
    // Half a turn leaves a BRDF with two mirror planes as it is, and so do both of them.
    let turns = phi_o.rem_euclid(span.max(PI));
    let is_mirrored = turns > span;
    let folded = if is_mirrored { PI - turns } else { turns };
    ((folded / STEP_RAD).min((count - 1) as f64), is_mirrored)
}

/// Between which azimuths a view is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Azimuths {
    /// The one before; the next is one more.
    pub before: usize,
    /// How far the view is from that one to the next, 0 to 1.
    pub towards_next: f64,
    /// Whether what is seen is the mirror image of what is there.
    pub is_mirrored: bool,
}

impl Azimuths {
    /// Those around the azimuth `phi_o` (radians) of a view, of `count`, which are at least 2.
    pub fn around(phi_o: f64, count: usize) -> Self {
        let (at, is_mirrored) = fold_azimuth(phi_o, count);
        let before = (at as usize).min(count - 2);
        Self { before, towards_next: at - before as f64, is_mirrored }
    }

    /// The three of the table's rows that a view is between, the part `t` of the way from row `below` to row `above` of an azimuth that has
    /// `rows`: the corners of a triangle of view angles and azimuths, and the share of each in what is linear between them. Twin: `rows_at`
    /// in glsl/methods/fitted.glsl.
    pub fn triangle(&self, [below, above]: [usize; 2], t: f64, rows: usize) -> ([usize; 3], [f64; 3]) {
        let first = self.before * rows + below;
        let opposite = (self.before + 1) * rows + above;
        let u = self.towards_next;
        let second = if u > t { first + rows } else { self.before * rows + above };
        ([first, second, opposite], [1.0 - t.max(u), (t - u).abs(), t.min(u)])
    }

    /// The azimuth, in radians, of the view or of its mirror image.
    pub fn folded_rad(&self) -> f64 {
        (self.before as f64 + self.towards_next) * STEP_RAD
    }

    /// 1, or -1 where what is seen is the mirror image: what y of a direction in the frame of the view is to be multiplied by.
    pub fn side(&self) -> f64 {
        if self.is_mirrored { -1.0 } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn azimuths_are_folded_by_the_symmetry_that_their_number_stands_for() {
        let near = |(at, is_mirrored): (f64, bool), to: f64, mirrored: bool| {
            assert!((at - to).abs() < 1e-9 && is_mirrored == mirrored, "{at} {is_mirrored}, not {to} {mirrored}");
        };
        let degrees = |phi_o: f64, count| fold_azimuth(phi_o.to_radians(), count);
        for (phi_o, to, mirrored) in [
            (0.0, 0.0, false),
            (45.0, 9.0, false),
            (90.0, 18.0, false),
            (110.0, 14.0, true),
            (-12.0, 2.4, true),
            (192.0, 2.4, false),
        ] {
            near(degrees(phi_o, 19), to, mirrored);
        }
        near(degrees(110.0, 37), 22.0, false);
        near(degrees(-12.0, 37), 33.6, false);
        near(degrees(-12.0, 73), 69.6, false);
    }

    /// So rows next to each other are blended without a step, and what is linear in both angles is what it is.
    #[test]
    fn what_is_linear_over_rows_and_azimuths_is_so_between_the_corners_of_triangles() {
        let rows = 90;
        let linear = |row: f64, azimuth: f64| 3.0 + 0.7 * row - 2.1 * azimuth;
        for row in [0.0_f64, 0.25, 17.0, 17.5, 60.999, 88.3] {
            for azimuth in [0.0, 0.2, 0.5, 3.0, 7.25, 7.75, 9.0] {
                let azimuths = Azimuths::around(azimuth * STEP_RAD, 19);
                let (index, shares) = azimuths.triangle([row as usize, row as usize + 1], row.fract(), rows);
                let at_corners = index.map(|index| linear((index % rows) as f64, (index / rows) as f64));
                let between = DVec3::from(at_corners).dot(shares.into());
                assert!((between - linear(row, azimuth)).abs() < 1e-12, "{row} {azimuth}");
                assert!(shares.iter().all(|share| (-1e-12..=1.0 + 1e-12).contains(share)), "{shares:?}");
            }
        }
    }
}
