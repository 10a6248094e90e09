//! Incident directions in proportion to f cos, from a table of 2D CDFs. Twin of glsl/importance_sampling.glsl.
use std::f32::consts::{FRAC_1_PI, FRAC_PI_2, FRAC_PI_4, PI, TAU};

use glam::{Vec2, Vec3};

use super::random::to_unit;
use super::{rows_around, turned};
use crate::shader_constants::importance_sampling::DIFFUSE_SHARE;
use crate::threads::SliceTable;
use crate::threads::azimuths::Azimuths;
use crate::threads::slice_table::{AZIMUTHS, RINGS, ROW_SIZE};

/// The rows of the table between which a view angle lies. Twin of `SliceRows`.
pub(super) struct SliceRows<'a> {
    below: &'a [f32],
    above: &'a [f32],
    t: f32,
    next: Option<NextAzimuth<'a>>,
}

/// The same rows of the next azimuth of the view, and where between both azimuths the view is.
struct NextAzimuth<'a> {
    below: &'a [f32],
    above: &'a [f32],
    towards_next: f32,
    phi_o: Vec2,
    side: f32,
}

/// sin^2(theta_h / 2) at the inner edge of a ring. Twin of `ring_edge`.
fn ring_edge(ring: usize) -> f32 {
    let x = ring as f32 / RINGS as f32;
    (FRAC_PI_4 * x * x).sin().powi(2)
}

/// The step of `cdf` in which `mass` lies, and how far into the step. Twin of `invert_cdf`.
fn invert_cdf(cdf: &[f32], mass: f32) -> (usize, f32) {
    let index = cdf.partition_point(|&value| value <= mass) - 1;
    (index, (mass - cdf[index] + 0.5 / 16_777_216.0) / (cdf[index + 1] - cdf[index]))
}

/// The CDF of `row` over the azimuths of `ring`.
fn azimuths(row: &[f32], ring: usize) -> &[f32] {
    &row[RINGS + 1 + ring * (AZIMUTHS + 1)..][..AZIMUTHS + 1]
}

/// Twin of `sample_half_vector`.
fn sample_half_vector(row: &[f32], u: Vec2) -> Vec3 {
    let (ring, within_ring) = invert_cdf(&row[..RINGS + 1], u.x);
    let (azimuth, within_azimuth) = invert_cdf(azimuths(row, ring), u.y);
    let (inner, outer) = (ring_edge(ring), ring_edge(ring + 1));
    let s = inner + (outer - inner) * within_ring;
    let phi = TAU * (azimuth as f32 + within_azimuth) / AZIMUTHS as f32 - PI;
    (2.0 * (s * (1.0 - s)).sqrt() * Vec2::from_angle(phi)).extend(1.0 - 2.0 * s)
}

/// Ring, azimuth and solid angle (sr) of the cell that holds `h`. Twin of `slice_cell`.
fn slice_cell(h: Vec3) -> (usize, usize, f32) {
    let sin_theta_h = h.x.hypot(h.y);
    let x = (sin_theta_h.atan2(h.z) / FRAC_PI_2).sqrt();
    let ring = ((x * RINGS as f32) as usize).min(RINGS - 1);
    let azimuth = (((h.y.atan2(h.x) / TAU + 0.5) * AZIMUTHS as f32) as usize).min(AZIMUTHS - 1);
    (ring, azimuth, 4.0 * PI * (ring_edge(ring + 1) - ring_edge(ring)) / AZIMUTHS as f32)
}

/// Twin of `cell_mass`.
fn cell_mass(row: &[f32], ring: usize, azimuth: usize) -> f32 {
    let cdf = azimuths(row, ring);
    (row[ring + 1] - row[ring]) * (cdf[azimuth + 1] - cdf[azimuth])
}

impl<'a> SliceRows<'a> {
    /// Twin of `slice_rows`.
    pub(super) fn new(table: &'a SliceTable, w_o: Vec3, phi_o: Vec2) -> Self {
        let count = table.rows;
        let (position, around) = rows_around(w_o.x.atan2(w_o.z), count);
        let rows = |azimuth: usize| around.map(|row| &table.cdfs[(azimuth * count + row) * ROW_SIZE..][..ROW_SIZE]);
        let t = position.fract();
        if table.azimuths == 1 {
            let [below, above] = rows(0);
            return Self { below, above, t, next: None };
        }
        let azimuths = Azimuths::around(phi_o.to_angle().into(), table.azimuths);
        let [[below, above], [next_below, next_above]] = [azimuths.before, azimuths.before + 1].map(rows);
        let next = NextAzimuth {
            below: next_below,
            above: next_above,
            towards_next: azimuths.towards_next as f32,
            phi_o: Vec2::from_angle(azimuths.folded_rad() as f32),
            side: azimuths.side() as f32,
        };
        Self { below, above, t, next: Some(next) }
    }

    /// Twin of `to_rows`.
    fn to_rows(&self, h: Vec3) -> Vec3 {
        self.next.as_ref().map_or(h, |next| turned(h.with_y(next.side * h.y), next.phi_o))
    }

    /// Twin of `to_view`.
    fn to_view(&self, h: Vec3) -> Vec3 {
        self.next.as_ref().map_or(h, |next| {
            let seen = turned(h, Vec2::new(next.phi_o.x, -next.phi_o.y));
            seen.with_y(next.side * seen.y)
        })
    }

    /// Density in 1/sr of [`Self::sample_brdf`] at `w_i` above the horizon, of which `h` is the half vector.
    /// Twin of `brdf_pdf`.
    pub(super) fn brdf_pdf(&self, w_i: Vec3, w_o: Vec3, h: Vec3) -> f32 {
        let (ring, azimuth, solid_angle) = slice_cell(self.to_rows(h));
        let between = |below: &[f32], above: &[f32]| {
            let (below, above) = (cell_mass(below, ring, azimuth), cell_mass(above, ring, azimuth));
            below + (above - below) * self.t
        };
        let mut mass = between(self.below, self.above);
        if let Some(next) = &self.next {
            mass += (between(next.below, next.above) - mass) * next.towards_next;
        }
        let of_table = mass / (4.0 * solid_angle * w_o.dot(h));
        of_table + (w_i.z * FRAC_1_PI - of_table) * DIFFUSE_SHARE
    }

    /// A direction and its density in 1/sr, unless it is below the horizon. Twin of `sample_brdf`.
    pub(super) fn sample_brdf(&self, w_o: Vec3, bits: [u32; 4]) -> Option<(Vec3, f32)> {
        let u = to_unit(bits);
        let (w_i, h) = if u.x < DIFFUSE_SHARE {
            let w_i = (u.y.sqrt() * Vec2::from_angle(TAU * u.z)).extend((1.0 - u.y).sqrt());
            (w_i, (w_i + w_o).normalize())
        } else {
            let is_above = u.x - DIFFUSE_SHARE < self.t * (1.0 - DIFFUSE_SHARE);
            let [below, above] = match &self.next {
                Some(next) if u.w < next.towards_next => [next.below, next.above],
                _ => [self.below, self.above],
            };
            let h = self.to_view(sample_half_vector(if is_above { above } else { below }, Vec2::new(u.y, u.z)));
            (2.0 * w_o.dot(h) * h - w_o, h)
        };
        (w_i.z > 0.0 && w_o.dot(h) > 0.0).then(|| (w_i, self.brdf_pdf(w_i, w_o, h)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{Brdf, SeenBrdf, luminance};
    use crate::shading::random::random_bits;
    use crate::threads::test_materials::{self, InSlices};
    use glam::{DVec3, UVec2, dvec3};

    /// The hard ones: a lobe of 0.3 degrees, a lobe on a diffuse base, a measured table.
    fn materials() -> impl Iterator<Item = &'static InSlices> {
        let hard = ["conductor 0.005", "plastic", "alumina-oxide"];
        let is_hard = move |material: &&InSlices| hard.contains(&material.name) || !material.brdf.is_isotropic();
        test_materials::in_slices().iter().filter(is_hard)
    }

    /// Azimuths of the view at which `brdf` is drawn from, in degrees: on rows, between them, and where its mirror image is seen.
    fn azimuths_deg(brdf: &Brdf) -> &'static [f32] {
        if brdf.is_isotropic() { &[0.0] } else { &[0.0, 33.0, 128.0, 251.0] }
    }

    /// All pairs of these angles of the view and its azimuths.
    fn views<'a>(brdf: &Brdf, theta_o_deg: &'a [f32]) -> impl Iterator<Item = (f32, f32)> + use<'a> {
        let azimuths = azimuths_deg(brdf);
        theta_o_deg.iter().flat_map(move |theta_o| azimuths.iter().map(move |phi_o| (*theta_o, *phi_o)))
    }

    /// Directions drawn for `theta_o_deg`, with their densities, and how many draws were made.
    fn drawn(rows: &SliceRows, w_o: Vec3, draws: u32) -> Vec<(DVec3, f64)> {
        let sample = |i| rows.sample_brdf(w_o, random_bits(UVec2::new(1, 2), i, 3));
        (0..draws).filter_map(sample).map(|(w_i, p)| (w_i.as_dvec3(), f64::from(p))).collect()
    }

    fn view(theta_o_deg: f32) -> Vec3 {
        let theta_o = theta_o_deg.to_radians();
        Vec3::new(theta_o.sin(), 0.0, theta_o.cos())
    }

    #[test]
    fn the_density_is_that_of_the_drawn_directions() {
        // The mean of g / p is the integral of g, for g of any shape: moments of the cosine lobe, wide against cells.
        for InSlices { name, brdf, table } in materials() {
            for (theta_o_deg, phi_o_deg) in views(brdf, &[0.0, 33.3, 70.6, 89.7]) {
                let w_o = view(theta_o_deg);
                let rows = SliceRows::new(table, w_o, Vec2::from_angle(phi_o_deg.to_radians()));
                let draws = 100_000;
                let directions = drawn(&rows, w_o, draws);
                let mirror = dvec3(-f64::from(w_o.x), 0.0, f64::from(w_o.z));
                // Integrals over the hemisphere of cos, cos x^2, and a part of the sphere around the mirror direction (which
                // the horizon does not cut at all but the last angle).
                let around_mirror = |w: DVec3| if w.dot(mirror) > 0.9 { 1.0 } else { 0.0 };
                let cap = if theta_o_deg < 60.0 { 2.0 * std::f64::consts::PI * 0.1 } else { f64::NAN };
                let tests: [(&dyn Fn(DVec3) -> f64, f64); 3] = [
                    (&|w| w.z, std::f64::consts::PI),
                    (&|w| w.z * w.x * w.x, std::f64::consts::PI / 4.0),
                    (&around_mirror, cap),
                ];
                for (index, (g, expected)) in tests.into_iter().enumerate().filter(|(_, test)| !test.1.is_nan()) {
                    let (mut mean, mut square) = (0.0, 0.0);
                    for &(w, p) in &directions {
                        mean += g(w) / p / f64::from(draws);
                        square += (g(w) / p).powi(2) / f64::from(draws);
                    }
                    let error = ((square - mean * mean) / f64::from(draws)).sqrt();
                    let deviation = (mean - expected) / error;
                    assert!(
                        deviation.abs() < 4.5,
                        "{name}, {theta_o_deg}, {phi_o_deg}: integral {index} {mean} {expected} {deviation}"
                    );
                }
            }
        }
    }

    /// Bins of directions: 8 by cosine and 12 by azimuth, of which the mirror direction is in the middle of one; the last is below the horizon.
    fn bin(w_i: Option<DVec3>) -> usize {
        const AZIMUTHS: usize = 12;
        let Some(w_i) = w_i.filter(|w_i| w_i.z > 0.0) else { return 8 * AZIMUTHS };
        let turn = (w_i.y.atan2(w_i.x) / std::f64::consts::TAU + 1.0 + 0.5 / AZIMUTHS as f64).fract();
        let [ring, azimuth] = [(w_i.z * 8.0) as usize, (turn * AZIMUTHS as f64) as usize];
        ring.min(7) * AZIMUTHS + azimuth.min(AZIMUTHS - 1)
    }

    /// How likely a direction is to be in each bin: the density, by midpoints of 8 x 8 parts of each of the table's cells.
    fn bin_masses(rows: &SliceRows, w_o: Vec3) -> Vec<f64> {
        const PARTS: usize = 8;
        let mut masses = vec![0.0; bin(None) + 1];
        for ring in 0..RINGS {
            let [inner, outer] = [ring, ring + 1].map(|ring| f64::from(ring_edge(ring)));
            for place in 0..PARTS * PARTS * AZIMUTHS {
                let [i, j] = [place % PARTS, place / PARTS].map(|part| (part as f64 + 0.5) / PARTS as f64);
                let s = inner + (outer - inner) * i;
                let phi = std::f64::consts::TAU * j / AZIMUTHS as f64 - std::f64::consts::PI;
                let h = (2.0 * (s * (1.0 - s)).sqrt() * glam::DVec2::from_angle(phi)).extend(1.0 - 2.0 * s);
                let cos_theta_d = w_o.as_dvec3().dot(h);
                let w_i = 2.0 * cos_theta_d * h - w_o.as_dvec3();
                if cos_theta_d > 0.0 && w_i.z > 0.0 {
                    let solid_angle = 4.0 * std::f64::consts::PI * (outer - inner) / (PARTS * PARTS * AZIMUTHS) as f64;
                    let p = f64::from(rows.brdf_pdf(w_i.as_vec3(), w_o, h.as_vec3()));
                    masses[bin(Some(w_i))] += p * 4.0 * cos_theta_d * solid_angle;
                }
            }
        }
        let above: f64 = masses.iter().sum();
        masses[bin(None)] = (1.0 - above).max(0.0);
        masses
    }

    #[test]
    fn directions_fall_where_the_density_says_by_the_chi_square_test() {
        use statrs::distribution::{ChiSquared, ContinuousCDF};
        let all = test_materials::in_slices();
        assert!(all.len() >= 8);
        for InSlices { name, brdf, table } in all {
            for (theta_o_deg, phi_o_deg) in views(brdf, &[0.0, 33.3, 70.6]) {
                let w_o = view(theta_o_deg);
                let rows = SliceRows::new(table, w_o, Vec2::from_angle(phi_o_deg.to_radians()));
                const DRAWS: u32 = 20_000;
                let masses = bin_masses(&rows, w_o);
                let mut counts = vec![0.0; masses.len()];
                for i in 0..DRAWS {
                    let drawn = rows.sample_brdf(w_o, random_bits(UVec2::new(3, 4), i, 5));
                    counts[bin(drawn.map(|(w_i, _)| w_i.as_dvec3()))] += 1.0;
                }
                // Bins of fewer than five expected are taken together, as the test wants it.
                let [mut square, mut bins] = [0.0, 0.0];
                let mut rest = (0.0, 0.0);
                for (mass, count) in masses.iter().zip(&counts) {
                    let expected = mass * f64::from(DRAWS);
                    if expected < 5.0 {
                        rest = (rest.0 + expected, rest.1 + count);
                    } else {
                        square += (count - expected).powi(2) / expected;
                        bins += 1.0;
                    }
                }
                if rest.0 >= 5.0 {
                    square += f64::powi(rest.1 - rest.0, 2) / rest.0;
                    bins += 1.0;
                }
                let p = ChiSquared::new(bins - 1.0).unwrap().sf(square);
                println!("{name}, {theta_o_deg}, {phi_o_deg}: chi square {square:.1} of {bins} bins, p = {p:.3}");
                assert!(p > 1e-4, "{name}, {theta_o_deg}, {phi_o_deg}: chi square {square} of {bins} bins, p = {p}");
            }
        }
    }

    #[test]
    fn f_cos_over_p_stays_near_the_albedo() {
        // What importance sampling is for: the spread of f cos / p, in a white furnace all of the noise, is small.
        for InSlices { name, brdf, table } in materials() {
            for (theta_o_deg, phi_o_deg) in views(brdf, &[0.0, 33.3, 70.6, 85.5]) {
                let spread = spread(brdf, table, theta_o_deg, phi_o_deg);
                println!("{name}, {theta_o_deg}, {phi_o_deg}: standard deviation {spread:.3} of the mean");
                assert!(spread < 0.35, "{name}, {theta_o_deg}, {phi_o_deg}: standard deviation {spread} of the mean");
            }
        }
    }

    /// The standard deviation of f cos / p over the mean, of directions drawn by `table`.
    fn spread(brdf: &Brdf, table: &SliceTable, theta_o_deg: f32, phi_o_deg: f32) -> f64 {
        let (w_o, phi_o) = (view(theta_o_deg), Vec2::from_angle(phi_o_deg.to_radians()));
        let rows = SliceRows::new(table, w_o, phi_o);
        let draws = 20_000;
        let seen = SeenBrdf::from_azimuth(brdf, f64::from(phi_o_deg.to_radians()));
        let weight = |(w, p): &(DVec3, f64)| luminance(seen.evaluate(*w, w_o.as_dvec3())) * w.z / p;
        let weights: Vec<f64> = drawn(&rows, w_o, draws).iter().map(weight).collect();
        let mean = weights.iter().sum::<f64>() / f64::from(draws);
        let square = weights.iter().map(|weight| weight * weight).sum::<f64>() / f64::from(draws);
        (square / (mean * mean) - 1.0).max(0.0).sqrt()
    }

    #[test]
    fn rows_of_the_views_own_azimuth_leave_a_part_of_the_noise_of_the_mean_over_azimuths() {
        for InSlices { name, brdf, table } in materials().filter(|material| !material.brdf.is_isotropic()) {
            let mean = SliceTable::of_mean(brdf);
            for (theta_o_deg, phi_o_deg) in views(brdf, &[5.0, 33.3, 70.6]) {
                let [own, mean] = [table, &mean].map(|table| spread(brdf, table, theta_o_deg, phi_o_deg));
                println!("{name}, {theta_o_deg}, {phi_o_deg}: {own:.3} of the mean, {mean:.3}");
                assert!(own < 0.3 * mean, "{name}, {theta_o_deg}, {phi_o_deg}: {own} {mean}");
            }
        }
    }
}
