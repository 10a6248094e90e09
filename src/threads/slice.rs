//! The pdf of incident directions for one view angle, equation (4), with its integral, its CDF and the CDF's inverse.
use std::f64::consts::{FRAC_1_PI, FRAC_PI_2, PI, TAU};

use glam::{DVec2, DVec3, dvec3};

use super::azimuths::View;
use crate::brdf::{Brdf, Ellipse, LobeShape, SeenBrdf, luminance, reflect};

/// Numbers of steps over theta_h and phi_h.
#[derive(Clone, Copy, Debug)]
pub struct Resolution {
    /// Rings.
    pub theta: usize,
    /// Azimuths of each.
    pub phi: usize,
    /// The ellipse whose azimuths these are, none for a circle; and its angle of -x, where azimuths begin: on a circle, too, so that they move
    /// steadily while one axis outgrows the other.
    ellipse: Option<(Ellipse, f64)>,
}

impl Resolution {
    /// Albedos of lobes about the mirror direction come out within 1e-3 (tested), the CDF is finer than 1024 threads can tell.
    pub const FULL: Self = Self { theta: 192, phi: 128, ellipse: None };
    /// Of an anisotropic BRDF, which has twenty times the views: a third of the work. Albedos come out within 2e-4, those of lobes of 0.001 x 0.1
    /// at grazing views within 2e-3 (tested).
    pub const OF_AZIMUTHS: Self = Self { theta: 128, phi: 64, ..Self::FULL };
    /// For drafts, a twelfth of the work.
    pub const DRAFT: Self = Self { theta: 64, phi: 32, ..Self::FULL };

    /// The same for a BRDF with this lobe, seen from the azimuth `phi_o` (radians from the tangent).
    fn along(self, lobe: &LobeShape, phi_o: f64) -> Self {
        if lobe.is_isotropic {
            return self;
        }
        let ellipse = Ellipse::of(lobe).turned(-phi_o);
        let start = ellipse.circle_of(DVec2::NEG_X).to_angle();
        Self { phi: ellipse.azimuths(self.phi), ellipse: Some((ellipse, start)), ..self }
    }
}

/// p(w) = f(w, w_o) (n.w) / integral of the same, in luminance, for one view angle.
///
/// It is tabulated over the half vector h: theta_h = 90 deg x^2 with x uniform, phi_h uniform over the whole circle (measured
/// tables need not be mirror-symmetric about the plane of incidence). With w_i the reflection of w_o about h,
/// dw_i = 4 (w_o . h) dw_h (F1). A glossy lobe thus lies about x = 0 at every view angle, and the square resolves a narrow one.
pub struct Slice<'a> {
    brdf: SeenBrdf<'a>,
    w_o: DVec3,
    /// Luminance of f below which nothing counts: 0, or the median of f ([`Slice::with_lobes`]).
    base: f64,
    albedo: DVec3,
    /// The integral of luminance f (n . w_i) above the base: the denominator of equation (4).
    total: f64,
    resolution: Resolution,
    /// CDF over x: a value more than steps, from 0 to 1.
    ring_cdf: Vec<f64>,
    /// CDF over phi_h within each step of x: a value more than steps of phi_h, from 0 to 1.
    azimuth_cdf: Vec<f64>,
    /// The half vector of the middle of a step, or the normal, where the pdf is greatest of all of these; and how far the next one is, in radians.
    highest: (DVec3, f64),
}

/// The middle of a step of x and phi_h.
#[derive(Clone, Copy)]
struct Cell {
    /// The half vector.
    h: DVec3,
    /// w_o . h.
    cos_theta_d: f64,
    /// n . w_i.
    cos_theta_i: f64,
    /// How much wider its step of phi_h is than an even one.
    widened: f64,
    /// f there.
    f: DVec3,
}

/// What of `f` is above a base of this luminance.
fn above_base(f: DVec3, base: f64) -> DVec3 {
    let value = luminance(f);
    if value > base { f * ((value - base) / value) } else { DVec3::ZERO }
}

/// Half vector at x in [0, 1] and in the direction of phi_h.
fn half_vector(x: f64, phi: DVec2) -> DVec3 {
    let (sin_theta, cos_theta) = (FRAC_PI_2 * x * x).sin_cos();
    (phi * sin_theta).extend(cos_theta)
}

impl Resolution {
    /// The direction of phi_h at a part of the way around, counted from -x; and how much wider steps of phi_h are there than even ones.
    fn azimuth(&self, turn: f64) -> (DVec2, f64) {
        let angle = 2.0 * PI * turn;
        match self.ellipse {
            None => (DVec2::from_angle(angle - PI), 1.0),
            Some((ellipse, start)) => ellipse.of_circle(DVec2::from_angle(angle + start)),
        }
    }

    /// The inverse: the part of the way around, of a direction of any length.
    fn turn(&self, direction: DVec2) -> f64 {
        match self.ellipse {
            None => (direction.y.atan2(direction.x) + PI) / (2.0 * PI),
            Some((ellipse, start)) => ((ellipse.circle_of(direction).to_angle() - start) / (2.0 * PI)).rem_euclid(1.0),
        }
    }
}

/// Those of all steps of x and phi_h, ring by ring.
fn cells(brdf: &SeenBrdf, w_o: DVec3, resolution: Resolution) -> Vec<Cell> {
    let Resolution { theta, phi, .. } = resolution;
    let azimuths: Vec<_> = (0..phi).map(|j| resolution.azimuth((j as f64 + 0.5) / phi as f64)).collect();
    let mut cells = Vec::with_capacity(theta * phi);
    let (mut seen, mut directions) = (Vec::new(), Vec::new());
    for i in 0..theta {
        let x = (i as f64 + 0.5) / theta as f64;
        for &(phi, widened) in &azimuths {
            let h = half_vector(x, phi);
            let cos_theta_d = w_o.dot(h);
            let w_i = reflect(w_o, h);
            if cos_theta_d > 0.0 && w_i.z > 0.0 {
                seen.push(cells.len());
                directions.push(w_i);
            }
            cells.push(Cell { h, cos_theta_d, cos_theta_i: w_i.z, widened, f: DVec3::ZERO });
        }
    }
    for (cell, f) in seen.into_iter().zip(brdf.evaluate_all(&directions, w_o)) {
        cells[cell].f = f;
    }
    cells
}

impl<'a> Slice<'a> {
    /// Tabulates `brdf` seen from `theta_o` (radians, less than pi / 2). Where it reflects nothing the pdf is that of a
    /// diffuse surface, cos / pi: a thread then still has a direction, and its samples add up to the zero they should.
    pub fn new(brdf: &SeenBrdf<'a>, theta_o: f64) -> Self {
        Self::of_view(brdf, dvec3(theta_o.sin(), 0.0, theta_o.cos()))
    }

    /// The same seen from `w_o`, unit and above the horizon, which need not be in the plane of x and z if `brdf` is that of no azimuth: x and y
    /// are then the surface's own axes.
    pub fn of_view(brdf: &SeenBrdf<'a>, w_o: DVec3) -> Self {
        Self::above(brdf, w_o, &cells(brdf, w_o, Resolution::FULL), Resolution::FULL, 0.0)
    }

    /// The same, and the slice of what is above the median of f, by luminance: lobes without the base that they stand on. A tenth of
    /// the mass of a glossy plastic is in its lobe; the second slice has all of its mass there.
    pub fn with_lobes(brdf: &SeenBrdf<'a>, theta_o: f64, resolution: Resolution) -> [Self; 2] {
        const POINTS: usize = 512;
        let w_o = dvec3(theta_o.sin(), 0.0, theta_o.cos());
        let directions: Vec<_> = fibonacci_lattice(POINTS)
            .map(|uv| (DVec2::from_angle(2.0 * PI * uv.y) * uv.x.sqrt()).extend((1.0 - uv.x).sqrt()))
            .collect();
        let mut values: Vec<f64> = brdf.evaluate_all(&directions, w_o).into_iter().map(luminance).collect();
        values.sort_by(f64::total_cmp);
        let cells = cells(brdf, w_o, resolution);
        [0.0, values[POINTS / 2]].map(|base| Self::above(brdf, w_o, &cells, resolution, base))
    }

    /// The same of `brdf` for a view, at the azimuths that suit its `lobe`.
    pub(super) fn with_lobes_of_view(
        brdf: &'a Brdf,
        lobe: &LobeShape,
        View { theta_o, phi_o }: View,
        resolution: Resolution,
    ) -> [Self; 2] {
        Self::with_lobes(&SeenBrdf::from_azimuth(brdf, phi_o), theta_o, resolution.along(lobe, phi_o))
    }

    fn above(brdf: &SeenBrdf<'a>, w_o: DVec3, cells: &[Cell], resolution: Resolution, base: f64) -> Self {
        let slice = Self::tabulate(brdf, w_o, cells, resolution, base, |f| above_base(f, base));
        if slice.total > 0.0 {
            return slice;
        }
        Self { albedo: DVec3::ZERO, ..Self::tabulate(brdf, w_o, cells, resolution, base, |_| DVec3::splat(FRAC_1_PI)) }
    }

    fn tabulate(
        brdf: &SeenBrdf<'a>,
        w_o: DVec3,
        cells: &[Cell],
        resolution: Resolution,
        base: f64,
        counted: impl Fn(DVec3) -> DVec3,
    ) -> Self {
        let Resolution { theta, phi, .. } = resolution;
        let mut albedo = DVec3::ZERO;
        let mut ring_cdf = vec![0.0];
        let mut azimuth_cdf = Vec::with_capacity(theta * (phi + 1));
        // The mirror direction is where sharp lobes have their maximum, and no cell has it as its centre.
        let mirror = dvec3(-w_o.x, 0.0 - w_o.y, w_o.z);
        let mut highest = (luminance(counted(brdf.evaluate(mirror, w_o))) * mirror.z, 0.0, DVec3::Z);
        for i in 0..theta {
            let x = (i as f64 + 0.5) / theta as f64;
            // sin(theta_h) dtheta_h dphi_h, dtheta_h = pi x dx, by 4 of the reflection.
            let ring = 4.0 * (FRAC_PI_2 * x * x).sin() * PI * x / theta as f64 * 2.0 * PI / phi as f64;
            let start = azimuth_cdf.len();
            let mut sum = 0.0;
            azimuth_cdf.push(0.0);
            for &Cell { h, cos_theta_d, cos_theta_i, widened, f } in &cells[i * phi..(i + 1) * phi] {
                if cos_theta_d > 0.0 && cos_theta_i > 0.0 {
                    let ring = ring * widened;
                    let rgb = counted(f) * cos_theta_i;
                    let value = luminance(rgb);
                    albedo += rgb * (cos_theta_d * ring);
                    sum += value * cos_theta_d * ring;
                    if value > highest.0 {
                        highest = (value, x, h);
                    }
                }
                azimuth_cdf.push(sum);
            }
            ring_cdf.push(ring_cdf[i] + sum);
            normalise(&mut azimuth_cdf[start..]);
        }
        let total = ring_cdf[theta];
        normalise(&mut ring_cdf);
        let (_, x, h) = highest;
        Self {
            brdf: brdf.clone(),
            w_o,
            base,
            albedo,
            total,
            resolution,
            ring_cdf,
            azimuth_cdf,
            highest: (h, FRAC_PI_2 * (2.0 * x + 1.0 / theta as f64) / theta as f64),
        }
    }

    /// The integral of f cos per channel: the directional albedo.
    pub fn albedo(&self) -> DVec3 {
        self.albedo
    }

    /// Equation (4): p(w_i) in 1/sr.
    pub fn pdf(&self, w_i: DVec3) -> f64 {
        if w_i.z <= 0.0 { 0.0 } else { self.pdf_of(self.f_cos(w_i), w_i) }
    }

    /// The same where f cos at `w_i`, above the horizon, is known already.
    pub fn pdf_of(&self, f_cos: DVec3, w_i: DVec3) -> f64 {
        if self.albedo == DVec3::ZERO { w_i.z * FRAC_1_PI } else { luminance(f_cos) / self.total }
    }

    /// f(w_i, w_o) (n . w_i) per channel, in 1/sr.
    pub fn f_cos(&self, w_i: DVec3) -> DVec3 {
        above_base(self.brdf.evaluate(w_i, self.w_o), self.base) * w_i.z
    }

    /// The same for many directions: quicker for tables.
    pub fn f_cos_all(&self, w_i: &[DVec3]) -> Vec<DVec3> {
        let f = self.brdf.evaluate_all(w_i, self.w_o);
        f.into_iter().zip(w_i).map(|(f, w_i)| above_base(f, self.base) * w_i.z).collect()
    }

    /// Where the pdf is greatest.
    pub fn peak(&self) -> DVec3 {
        let (h, step) = self.highest;
        let height = |h: DVec3| if self.w_o.dot(h) > 0.0 { self.pdf(reflect(self.w_o, h).normalize()) } else { 0.0 };
        reflect(self.w_o, climb(h, step, height)).normalize()
    }

    /// Inverse CDF: the unit square onto the hemisphere, equal areas onto equal masses.
    pub fn direction(&self, uv: DVec2) -> DVec3 {
        let (i, x) = invert(&self.ring_cdf, uv.x);
        let (j, turn) = invert(self.azimuths(i), uv.y);
        let Resolution { theta, phi, .. } = self.resolution;
        let (phi, _) = self.resolution.azimuth((j as f64 + turn) / phi as f64);
        let h = half_vector((i as f64 + x) / theta as f64, phi);
        reflect(self.w_o, h).normalize()
    }

    /// CDF: the point of the unit square that `direction` maps to `w_i`.
    pub fn coordinate(&self, w_i: DVec3) -> DVec2 {
        let h = (w_i + self.w_o).normalize();
        let x = (h.x.hypot(h.y).atan2(h.z) / FRAC_PI_2).sqrt();
        let turn = self.resolution.turn(h.truncate());
        let (i, u) = interpolate(&self.ring_cdf, x);
        let (_, v) = interpolate(self.azimuths(i), turn);
        DVec2::new(u, v)
    }

    /// The CDF in steps `merged` times as wide: over rings (x), and ring by ring over the azimuths (phi_h from -180 degrees,
    /// on a circle). Each goes from 0 to 1. `merged` divides both numbers of steps.
    pub fn coarse_cdfs(&self, merged: usize) -> (Vec<f64>, Vec<Vec<f64>>) {
        let rings = self.ring_cdf.iter().copied().step_by(merged).collect();
        let Resolution { theta, phi, .. } = self.resolution;
        let azimuths = (0..theta).step_by(merged).map(|start| {
            let mut sum = vec![0.0; phi / merged + 1];
            for ring in start..start + merged {
                let mass = self.ring_cdf[ring + 1] - self.ring_cdf[ring];
                let steps = self.azimuths(ring).iter().step_by(merged);
                sum.iter_mut().zip(steps).for_each(|(sum, cdf)| *sum += mass * cdf);
            }
            normalise(&mut sum);
            sum
        });
        (rings, azimuths.collect())
    }

    /// `count` directions of equal mass: a Fibonacci lattice in the CDF's square.
    pub fn points(&self, count: usize) -> impl Iterator<Item = DVec3> + '_ {
        fibonacci_lattice(count).map(|uv| self.direction(uv))
    }

    fn azimuths(&self, ring: usize) -> &[f64] {
        let values = self.resolution.phi + 1;
        &self.azimuth_cdf[ring * values..][..values]
    }
}

/// `count` evenly spread points of the unit square.
pub fn fibonacci_lattice(count: usize) -> impl Iterator<Item = DVec2> {
    const GOLDEN_RATIO_CONJUGATE: f64 = 0.618_033_988_749_894_9;
    (0..count).map(move |i| DVec2::new((i as f64 + 0.5) / count as f64, (i as f64 * GOLDEN_RATIO_CONJUGATE).fract()))
}

/// The direction at a place of the unit square, which covers the sphere evenly.
pub fn on_sphere(uv: DVec2) -> DVec3 {
    let z = 1.0 - 2.0 * uv.x;
    (DVec2::from_angle(TAU * uv.y) * (1.0 - z * z).sqrt()).extend(z)
}

/// Scales a cumulative sum to end at 1; one without mass becomes uniform.
fn normalise(cdf: &mut [f64]) {
    let (last, steps) = (cdf[cdf.len() - 1], cdf.len() - 1);
    for (i, value) in cdf.iter_mut().enumerate() {
        *value = if last > 0.0 { *value / last } else { i as f64 / steps as f64 };
    }
}

/// The step of a piecewise linear CDF in which it reaches `mass`, and how far into the step.
fn invert(cdf: &[f64], mass: f64) -> (usize, f64) {
    let step = cdf.partition_point(|&value| value <= mass).clamp(1, cdf.len() - 1) - 1;
    // `mass` beyond the last step with any mass lands in an empty one: go back to where the CDF rose last.
    let step =
        if cdf[step + 1] > cdf[step] { step } else { cdf.partition_point(|&value| value < cdf[step]).max(1) - 1 };
    (step, ((mass - cdf[step]) / (cdf[step + 1] - cdf[step])).clamp(0.0, 1.0))
}

/// The step in which `position` (0 to 1 over all steps) lies, and the value there of a piecewise linear CDF.
fn interpolate(cdf: &[f64], position: f64) -> (usize, f64) {
    let steps = cdf.len() - 1;
    let scaled = position.clamp(0.0, 1.0) * steps as f64;
    let step = (scaled as usize).min(steps - 1);
    (step, cdf[step] + (scaled - step as f64) * (cdf[step + 1] - cdf[step]))
}

/// Walks a half vector uphill in `height` by steps that shrink from `step` (radians) until they are lost in rounding.
fn climb(mut h: DVec3, mut step: f64, height: impl Fn(DVec3) -> f64) -> DVec3 {
    let mut best = height(h);
    while step > 1e-7 {
        let tangent = h.any_orthonormal_vector();
        let across = h.cross(tangent);
        let up = [tangent, -tangent, across, -across].map(|side| (h + step * side).normalize());
        match up.into_iter().find(|&next| height(next) > best) {
            Some(next) => (h, best) = (next, height(next)),
            None => step *= 0.5,
        }
    }
    h
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::Brdf;
    use crate::brdf::tests::samples::of_model;
    use crate::farthest::Farthest;
    use crate::threads::test_materials;

    #[test]
    fn albedo_agrees_with_independent_quadrature() {
        for (name, brdf) in test_materials::all() {
            for theta_o_deg in [0.0f64, 30.0, 60.0, 80.0, 88.0] {
                let theta_o = theta_o_deg.to_radians();
                let (slice, exact) =
                    (Slice::new(&SeenBrdf::from_all_around(&brdf), theta_o).albedo(), brdf.albedo(theta_o));
                let error = ((slice - exact) / exact).farthest();
                assert!(error < 2e-3, "{name} at {theta_o_deg}: {slice}, {exact}");
            }
        }
    }

    #[test]
    fn albedo_of_long_lobes_agrees_with_independent_quadrature() {
        for [alpha_x, alpha_y] in [[0.005, 0.3], [0.02, 0.3], [0.001, 0.1]] {
            let text = format!(
                "distribution = 'ggx'\nmetal = 'Al'\nalpha_x = {alpha_x}\nalpha_y = {alpha_y}\nrotation_deg = 20"
            );
            let brdf = of_model("conductor", &text);
            let lobe = LobeShape::of(&brdf);
            for (theta_o, phi_o) in [(0.0, 0.0), (1.0, 1.2), (1.5, 4.0)] {
                let exact = brdf.albedo_from(theta_o, phi_o);
                let bounds = [(Resolution::FULL, 1e-3), (Resolution::OF_AZIMUTHS, 2e-3), (Resolution::DRAFT, 2e-3)];
                for (resolution, bound) in bounds {
                    let [slice, _] = Slice::with_lobes_of_view(&brdf, &lobe, View { theta_o, phi_o }, resolution);
                    let error = ((slice.albedo() - exact) / exact).farthest();
                    assert!(
                        error < bound,
                        "{alpha_x} x {alpha_y} at {theta_o}, {phi_o}, {} rings: {error}",
                        resolution.theta
                    );
                }
            }
        }
    }

    #[test]
    fn coordinate_inverts_direction() {
        for (name, brdf) in [test_materials::all(), test_materials::anisotropic()].concat() {
            let lobe = LobeShape::of(&brdf);
            for theta_o in [0.0f64, 45.0, 85.0].map(f64::to_radians) {
                let seen = SeenBrdf::from_azimuth(&brdf, 0.4);
                let view = View { theta_o, phi_o: 0.4 };
                let [on_ellipse, _] = Slice::with_lobes_of_view(&brdf, &lobe, view, Resolution::FULL);
                for slice in [Slice::new(&seen, theta_o), on_ellipse] {
                    for uv in fibonacci_lattice(101) {
                        let back = slice.coordinate(slice.direction(uv));
                        // v is periodic.
                        let error = (back - uv).abs();
                        assert!(error.x < 1e-6 && error.y.min(1.0 - error.y) < 1e-6, "{name} {theta_o}: {uv} {back}");
                    }
                }
            }
        }
    }

    #[test]
    fn points_of_a_diffuse_surface_are_cosine_distributed() {
        let brdf = of_model("lambert", "reflectance = 0.5");
        for theta_o_deg in [0.0f64, 40.0, 70.0] {
            let slice = Slice::new(&SeenBrdf::from_all_around(&brdf), theta_o_deg.to_radians());
            let (count, mut mean, mut square) = (20_000, DVec3::ZERO, 0.0);
            for w_i in slice.points(count) {
                mean += w_i / count as f64;
                square += w_i.z * w_i.z / count as f64;
            }
            // Cosine-distributed directions: mean (0, 0, 2/3), mean of cos^2 1/2.
            assert!((mean - dvec3(0.0, 0.0, 2.0 / 3.0)).length() < 2e-3, "{theta_o_deg}: {mean}");
            assert!((square - 0.5).abs() < 2e-3, "{theta_o_deg}: {square}");
        }
    }

    #[test]
    fn lobes_are_the_slice_without_its_base() {
        let plastic = test_materials::glossy_plastic();
        let [slice, lobes] =
            Slice::with_lobes(&SeenBrdf::from_all_around(&plastic), 45f64.to_radians(), Resolution::FULL);
        let mirror = dvec3(-1.0, 0.0, 1.0).normalize();
        let near = |slice: &Slice| {
            let count = 1000;
            slice.points(count).filter(|w_i| w_i.angle_between(mirror) < 0.3).count() as f64 / count as f64
        };
        let [of_all, of_lobes] = [near(&slice), near(&lobes)];
        assert!(of_all < 0.3 && of_lobes > 2.0 * of_all, "{of_all} {of_lobes}");
        // Nothing stands out of Lambert: anywhere will do.
        let lambert = of_model("lambert", "reflectance = 0.5");
        let [_, lobes] = Slice::with_lobes(&SeenBrdf::from_all_around(&lambert), 0.5, Resolution::FULL);
        assert!(lobes.albedo() == DVec3::ZERO && lobes.direction(DVec2::splat(0.5)).z > 0.0);
    }

    #[test]
    fn peak_is_the_mirror_direction_of_a_narrow_lobe_and_the_normal_of_a_diffuse_one() {
        for theta_o_deg in [0.0f64, 20.0, 50.0, 70.0] {
            let theta_o = theta_o_deg.to_radians();
            let mirror = dvec3(-theta_o.sin(), 0.0, theta_o.cos());
            let narrow = Slice::new(&SeenBrdf::from_all_around(test_materials::narrow()), theta_o).peak();
            assert!(narrow.angle_between(mirror) < 2e-4, "{theta_o_deg}: {narrow}");
            let diffuse = Slice::new(&SeenBrdf::from_all_around(&Brdf::builtin("clay").unwrap()), theta_o).peak();
            assert!(diffuse.angle_between(DVec3::Z) < 1e-3, "{theta_o_deg}: {diffuse}");
        }
    }
}
