//! How narrow a BRDF's lobe is, and along which axis.
use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DVec2, dvec2};

use super::Brdf;

/// Half vectors closer to the normal than this count as one: a tenth of the narrowest lobe that a model may have.
const NARROWEST_RAD: f64 = 1e-4;

/// At grazing angles lobes grow ever thinner across the plane of incidence, by the cosine; who goes by their width takes it for no less than
/// this: beyond 87 degrees is a rim of 0.1 % of a sphere.
pub const MIN_COS_THETA_D: f64 = 0.05;

/// The angle of the half vector to the normal from which f, summed over channels, differs by more than a quarter from what it is in the mirror
/// direction: the first of 1e-4, 1.25e-4, 1.25^2 1e-4 and so on to 45 degrees, or a right angle if it is none of these. In radians. Seen along
/// the normal, where lobes are widest; of an anisotropic BRDF the least over azimuths of the half vector.
pub fn half_vector_width(brdf: &Brdf) -> f64 {
    LobeShape::of(brdf).width_rad
}

/// What stands out of the least value of f by less than this part of it is no lobe.
const LEAST_RISE: f64 = 0.1;

/// The angle of the half vector to the normal from which f, as far as it is above its least value, falls to less than half at twice the
/// angle: nearer to the normal there is but a plateau, or a cusp of little energy. A right angle if there is no such lobe. In radians.
/// Seen from `theta_o` (radians), with half vectors across the plane of incidence; of an anisotropic BRDF the least over their azimuths.
pub fn lobe_radius(brdf: &Brdf, theta_o: f64) -> f64 {
    azimuths(brdf.is_isotropic()).map(|azimuth| lobe_radius_along(brdf, theta_o, azimuth)).fold(FRAC_PI_2, f64::min)
}

fn lobe_radius_along(brdf: &Brdf, theta_o: f64, azimuth: DVec2) -> f64 {
    let profile = |angle: f64| profile(brdf, theta_o, azimuth, angle);
    let least = angles().map(profile).fold(f64::INFINITY, f64::min).max(0.0);
    let rise = |angle: f64| profile(angle) - least;
    // Beyond 45 degrees f is 0, which is no lobe.
    first_angle(|angle| {
        2.0 * angle < 0.5 * FRAC_PI_2 && rise(angle) > LEAST_RISE * least && rise(angle) > 2.0 * rise(2.0 * angle)
    })
}

/// What shading goes by of a lobe, seen along the normal. Finding it takes 0.5 ms, of some models more:
/// [`FindLobe`](crate::steps::FindLobe) does so once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LobeShape {
    /// [`Brdf::is_isotropic`].
    pub is_isotropic: bool,
    /// [`half_vector_width`].
    pub width_rad: f64,
    /// The width across the long axis over the one along it, both as [`half_vector_width`] defines them: 1 of an isotropic BRDF.
    pub narrowness: f64,
    /// The direction of the long axis in the tangent plane, a unit vector. Any for an isotropic BRDF.
    pub long_axis: DVec2,
    /// The width, or where that is so small that it may be of a cusp, [`lobe_radius`] seen along the normal.
    pub radius_rad: f64,
    /// The angle of the half vector to the normal, in radians, at which a Gaussian has fallen by e that falls as f does, as far as that is above
    /// scattered light, to a thousandth or to as much as is scattered. Across the long axis. 0 if flanks are not as steep as a Gaussian's, or have no
    /// foot.
    pub flank_rad: f64,
    /// Whether such flanks end in the dark, not in scattered light.
    pub is_dark_beyond: bool,
    /// Whether that width is but of a cusp on a wider lobe, as many measured tables have it: narrower than what kernels tell, and of little of
    /// what is reflected.
    pub is_cusp: bool,
    /// How much narrower the lobe is in half vectors at each view of [`NARROWING_COSINES`] than at the one before, as logarithms to the base 2: surfaces
    /// that are matt along their normal may mirror at grazing views. 0 where it stays one lobe, and of an anisotropic BRDF.
    pub narrowing: [f64; 4],
}

impl LobeShape {
    /// That of the lobe of `brdf`.
    pub fn of(brdf: &Brdf) -> Self {
        let is_isotropic = brdf.is_isotropic();
        let width = |azimuth| first_angle(|angle| is_off_peak(brdf, azimuth, angle));
        let width_rad = azimuths(is_isotropic).map(width).fold(FRAC_PI_2, f64::min);
        let (narrowness, long_axis) = if is_isotropic { (1.0, DVec2::X) } else { lobe_axes(brdf) };
        let (flank_rad, is_dark_beyond) = flank(brdf, long_axis.perp(), width_rad);
        let radius_rad = if width_rad < WIDEST_CUSP_RAD { lobe_radius(brdf, 0.0) } else { width_rad };
        let is_cusp = width_rad < CUSP_RAD && holds_little(brdf);
        let narrowing = if is_isotropic { narrowing(brdf, radius_rad) } else { [0.0; 4] };
        Self {
            is_isotropic,
            width_rad,
            narrowness,
            long_axis,
            radius_rad,
            flank_rad,
            is_dark_beyond,
            is_cusp,
            narrowing,
        }
    }

    /// The sine of the half vector's angle from which flanks are dark; 0 if there are none.
    pub fn dark_from(&self) -> f64 {
        // A Gaussian that reflects all light has its peak at 1 / (4 pi flank^2).
        match self.flank_rad {
            0.0 => 0.0,
            flank => flank * (-(4.0 * PI * DARK * flank * flank).ln()).sqrt(),
        }
    }
}

/// Where f of a lobe that reflects all light is below this, in 1/sr, it is dark under any lamp.
const DARK: f64 = 1.5e-4;

/// What spaces azimuths of the half vector: a ring crosses a long lobe within few degrees of its long axis.
///
/// It is as narrow as the root of the lobe's narrowness: wide rings cross GGX's lobe within that narrowness, in radians, small ones evenly, and
/// the sums over both converge equally fast then.
#[derive(Clone, Copy, Debug)]
pub struct Ellipse {
    narrowness: f64,
    long_axis: DVec2,
}

impl Ellipse {
    /// For this lobe.
    pub fn of(lobe: &LobeShape) -> Self {
        Self { narrowness: lobe.narrowness.sqrt(), long_axis: lobe.long_axis }
    }

    /// The same turned by an angle in radians.
    pub fn turned(self, angle: f64) -> Self {
        Self { long_axis: DVec2::from_angle(angle).rotate(self.long_axis), ..self }
    }

    /// How many azimuths suit it, `least` or more. GGX then leaves an error of 2 e^(-narrowness azimuths), as in [`Brdf::albedo_from`].
    pub fn azimuths(self, least: usize) -> usize {
        least.max((8.0 / self.narrowness).ceil() as usize)
    }

    /// The direction at the angle of a unit vector of a circle, and by how much steps are wider there than the circle's.
    pub fn of_circle(self, circle: DVec2) -> (DVec2, f64) {
        let point = dvec2(circle.x, self.narrowness * circle.y);
        (self.long_axis.rotate(point.normalize()), self.narrowness / point.length_squared())
    }

    /// The point of the circle, of any length, for a direction of any length.
    pub fn circle_of(self, direction: DVec2) -> DVec2 {
        let point = dvec2(direction.dot(self.long_axis), self.long_axis.perp_dot(direction));
        dvec2(self.narrowness * point.x, point.y)
    }
}

/// Half vectors closer to the normal than this mirror the view to where a pixel of an environment of 1024 columns is.
const CUSP_RAD: f64 = 0.0028;

/// Within [`CUSP_RAD`] a cusp has less than this part of what is reflected. Kernels as sharp as a mirror's gain nothing there: with 64 threads
/// six such materials make 2 to 6 % fewer lookups without, and err as much. Of those that have more there, hematite (0.037) would err
/// by a sixth more, brass (0.05) by a tenth, chrome and steel (0.11) by half.
const MOST_IN_CUSP: f64 = 0.03;

/// And less than this part of what is within ten times that angle, where the lobe is: a clear coat on a white base reflects little, but is no
/// cusp. Lobes of GGX and of Beckmann that are narrower have a quarter there, an `abc` has 0.19, and cusps of measured tables 0.05 to 0.14.
/// With kernels of a cusp, such lobes erred by two to four times as much.
const MOST_OF_LOBE: f64 = 1.0 / 6.0;

/// Whether there is little within [`CUSP_RAD`].
fn holds_little(brdf: &Brdf) -> bool {
    let [cusp, lobe, all] = [CUSP_RAD, 10.0 * CUSP_RAD, 0.5 * FRAC_PI_2].map(|angle| mass_within(brdf, angle));
    cusp < MOST_IN_CUSP * all && cusp < MOST_OF_LOBE * lobe
}

/// What half vectors within this angle of the normal mirror the view to, seen along the normal; in the sum of channels, and in no unit.
fn mass_within(brdf: &Brdf, theta_h: f64) -> f64 {
    const STEPS: usize = 200;
    let of_ring = |azimuth, i| {
        // Steps of albedos; d(theta) is in proportion to x.
        let x = (i as f64 + 0.5) / STEPS as f64;
        let angle = theta_h * x * x;
        theta_h * x * profile(brdf, 0.0, azimuth, angle) * (4.0 * angle).sin()
    };
    azimuths(brdf.is_isotropic()).map(|azimuth| (0..STEPS).map(|i| of_ring(azimuth, i)).sum::<f64>()).sum()
}

/// Narrower lobes may be a cusp of little energy, as many measured tables have it, on the lobe itself.
const WIDEST_CUSP_RAD: f64 = 0.004;

/// Flanks end where f has fallen to this part of its peak, or to as much as there is of scattered light.
const FOOT: f64 = 1e-3;

/// Beside more scattered light, as a part of the peak, flanks are no matter.
const MOST_SCATTERED: f64 = 0.05;

/// f of scattered light changes by less than this part of it from one angle to the next, within this angle, in radians: beyond, diffuse bases have
/// their horizon.
const FLAT: f64 = 0.1;
const WIDEST_FLAT_RAD: f64 = 0.35;

/// Wider ones have no foot: f does not fall that far.
const WIDEST_FLANK_RAD: f64 = 0.5;

/// [`LobeShape::flank_rad`] of a lobe of this width, towards `azimuth`, and whether f falls to `FOOT` there.
fn flank(brdf: &Brdf, azimuth: DVec2, width_rad: f64) -> (f64, bool) {
    let profile = |angle: f64| profile(brdf, 0.0, azimuth, angle);
    let change = |angle: f64| (profile(angle) / profile(STEP * angle) - 1.0).abs();
    let beyond = angles().filter(|angle| (2.0 * width_rad..WIDEST_FLAT_RAD).contains(angle));
    let flattest = beyond.min_by(|&a, &b| change(a).total_cmp(&change(b)));
    let scattered = flattest.filter(|&angle| change(angle) < FLAT).map_or(0.0, profile);
    let peak = profile(0.0);
    let depth = FOOT.max(scattered / peak);
    let foot = first_angle(|angle| profile(angle) - scattered < depth * peak);
    // e^-(foot/flank)^2 = depth. Of GGX f falls to that at `slow` roughnesses.
    let [fast, slow] = [(-depth.ln()).sqrt(), (1.0 / depth.sqrt() - 1.0).sqrt()];
    let flank = foot / fast;
    // Half way between both, in units of their widths: a Gaussian's is 0.536 of its flank, GGX's 0.393 of its roughness.
    let is_steep = foot < (fast / 0.536 * slow / 0.393).sqrt() * width_rad;
    let is_flank = is_steep && flank < WIDEST_FLANK_RAD && depth < MOST_SCATTERED;
    (if is_flank { flank } else { 0.0 }, depth == FOOT)
}

/// The cosines of the view angles between which lobes are taken to become narrower evenly. The same in glsl/methods/fitted.glsl.
pub const NARROWING_COSINES: [f64; 5] = [1.0, 0.6, 0.4, 0.25, 0.1];

/// A lobe that becomes narrower by less than this from view to view is the same lobe. Most measured ones do, and err more if that counts: nickel
/// under lamps by 0.0077, not 0.0060.
const LEAST_NARROWING: f64 = -2.0;

/// [`LobeShape::narrowing`] of a lobe of this radius, seen along the normal.
fn narrowing(brdf: &Brdf, radius_rad: f64) -> [f64; 4] {
    let mut before = radius_rad;
    std::array::from_fn(|i| {
        let radius = lobe_radius(brdf, NARROWING_COSINES[i + 1].acos()).min(before);
        let step = (radius / before).log2();
        before = radius;
        if step < LEAST_NARROWING { step } else { 0.0 }
    })
}

/// Narrowness and long axis of an anisotropic lobe: exact for an ellipse, 1 / width^2 = A + B cos(2 (azimuth - that of the narrow axis)).
fn lobe_axes(brdf: &Brdf) -> (f64, DVec2) {
    // The sum over all azimuths of e^(2 i azimuth) / width^2 has the azimuth 2 (that of the narrow axis).
    let term = |azimuth: DVec2| azimuth.rotate(azimuth) / exact_width(brdf, azimuth).powi(2);
    let narrow = DVec2::from_angle(0.5 * azimuths(false).map(term).sum::<DVec2>().to_angle());
    let wide = narrow.perp();
    (exact_width(brdf, narrow) / exact_width(brdf, wide), wide)
}

/// [`half_vector_width`] towards one azimuth, to a millionth.
fn exact_width(brdf: &Brdf, azimuth: DVec2) -> f64 {
    let mut outside = first_angle(|angle| is_off_peak(brdf, azimuth, angle));
    let mut inside = outside / STEP;
    for _ in 0..20 {
        let middle = 0.5 * (inside + outside);
        *(if is_off_peak(brdf, azimuth, middle) { &mut outside } else { &mut inside }) = middle;
    }
    outside
}

fn is_off_peak(brdf: &Brdf, azimuth: DVec2, angle: f64) -> bool {
    let peak = profile(brdf, 0.0, azimuth, 0.0);
    (profile(brdf, 0.0, azimuth, angle) - peak).abs() > 0.25 * peak
}

/// Azimuths of half vectors at which to look for a lobe: any one will do if the BRDF is isotropic. Lobes are long towards few azimuths and
/// narrow towards many: those of an ellipse within 5 degrees of the narrowest are wider by 0.4 % at most.
fn azimuths(is_isotropic: bool) -> impl Iterator<Item = DVec2> {
    let count = if is_isotropic { 1 } else { 36 };
    (0..count).map(move |i| DVec2::from_angle(2.0 * PI * f64::from(i) / f64::from(count)).rotate(DVec2::Y))
}

/// f, summed over channels, seen from `theta_o`, where the half vector is at `theta_h` to the normal, across the plane of incidence.
fn profile(brdf: &Brdf, theta_o: f64, azimuth: DVec2, theta_h: f64) -> f64 {
    let w_o = (-azimuth.perp() * theta_o.sin()).extend(theta_o.cos());
    let half_vector = (azimuth * theta_h.sin()).extend(theta_h.cos());
    brdf.evaluate(2.0 * w_o.dot(half_vector) * half_vector - w_o, w_o).element_sum()
}

/// The ratio of one angle to the next.
const STEP: f64 = 1.25;

/// Ever larger angles of half vectors. Those beyond 45 degrees belong to light below the horizon.
fn angles() -> impl Iterator<Item = f64> {
    let angles = std::iter::successors(Some(NARROWEST_RAD), |angle| Some(STEP * angle));
    angles.take_while(|&angle| angle < 0.5 * FRAC_PI_2)
}

/// The first of them of which `is_so`; a right angle if there is none.
fn first_angle(is_so: impl Fn(f64) -> bool) -> f64 {
    angles().find(|&angle| is_so(angle)).unwrap_or(FRAC_PI_2)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::brdf::CustomBrdf;

    #[test]
    fn widths_follow_roughness() {
        for (alpha, distribution) in [(0.001, "ggx"), (0.02, "beckmann"), (0.2, "ggx")] {
            let parameters = format!("distribution = '{distribution}'\nalpha = {alpha}\neta = 0.2\nk = 3.9");
            let brdf = Brdf::from_parameters("conductor", parameters.parse().unwrap()).unwrap();
            for width in [half_vector_width(&brdf), lobe_radius(&brdf, 0.0), lobe_radius(&brdf, 1.5)] {
                assert!((0.3..1.0).contains(&(width / alpha)), "{distribution} {alpha}: {width}");
            }
        }
        // A Gaussian of slopes falls by e at its roughness; a wide one has no foot, and GGX has no such flanks. cos^n falls by e at sqrt(2 / n).
        let metal = "eta = 0.2\nk = 3.9";
        for (model, parameters, expected, is_dark_beyond) in [
            ("conductor", format!("distribution = 'beckmann'\nalpha = 0.02\n{metal}"), 0.02, true),
            ("conductor", format!("distribution = 'beckmann'\nalpha_x = 0.3\nalpha_y = 0.01\n{metal}"), 0.01, true),
            ("conductor", format!("distribution = 'beckmann'\nalpha = 0.2\n{metal}"), 0.2, true),
            ("conductor", format!("distribution = 'beckmann'\nalpha = 0.5\n{metal}"), 0.0, true),
            ("conductor", format!("distribution = 'ggx'\nalpha = 0.02\n{metal}"), 0.0, true),
            ("ashikhmin_shirley", "exponent = 445\nspecular = 0.5\ndiffuse = 0".to_owned(), 0.067, true),
            ("ashikhmin_shirley", "exponent = 445\nspecular = 0.5\ndiffuse = 0.2".to_owned(), 0.067, false),
            ("ashikhmin_shirley", "exponent = 445\nspecular = 0.05\ndiffuse = 0.5".to_owned(), 0.0, false),
            ("plastic", "distribution = 'ggx'\nalpha = 0.02\nior = 1.5\ndiffuse = 0.3".to_owned(), 0.0, false),
        ] {
            let lobe = LobeShape::of(&Brdf::from_parameters(model, parameters.parse().unwrap()).unwrap());
            let flank = lobe.flank_rad;
            // One step of the angles that are tried.
            assert!((expected..=1.26 * expected).contains(&flank), "{parameters}: {flank}");
            assert_eq!(lobe.is_dark_beyond, is_dark_beyond, "{parameters}");
        }
        // A lobe is found however much light is scattered beside it.
        let parameters = "distribution = 'ggx'\nalpha = 0.05\nior = 1.5\ndiffuse = 0.9";
        let plastic = lobe_radius(&Brdf::from_parameters("plastic", parameters.parse().unwrap()).unwrap(), 0.0);
        assert!((0.3..1.0).contains(&(plastic / 0.05)), "{plastic}");
        let lambert = Brdf::from_parameters("lambert", "reflectance = 0.5".parse().unwrap()).unwrap();
        assert_eq!((half_vector_width(&lambert), lobe_radius(&lambert, 0.0)), (FRAC_PI_2, FRAC_PI_2));
    }

    /// A narrow lobe and a wide one, which has this part of the sum.
    struct TwoLobes([Brdf; 2], f64);

    impl TwoLobes {
        fn of(narrow_alpha: f64, part_of_wide: f64) -> Self {
            let lobe = |alpha: f64| {
                let parameters = format!("distribution = 'beckmann'\nalpha = {alpha}\neta = 0.2\nk = 3.9");
                Brdf::from_parameters("conductor", parameters.parse().unwrap()).unwrap()
            };
            Self([narrow_alpha, 0.05].map(lobe), part_of_wide)
        }
    }

    impl CustomBrdf for TwoLobes {
        fn name(&self) -> &str {
            "two lobes"
        }

        fn key(&self) -> Vec<u8> {
            [self.0[0].fingerprint().as_bytes().as_slice(), &self.1.to_le_bytes()].concat()
        }

        fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
            let [narrow, wide] = self.0.each_ref().map(|lobe| lobe.evaluate(w_i, w_o));
            narrow.lerp(wide, self.1)
        }
    }

    #[test]
    fn a_cusp_is_narrow_has_little_and_stands_on_a_wider_lobe() {
        for (alpha, part_of_wide, is_cusp) in
            [(0.001, 0.98, true), (0.001, 0.9, false), (0.001, 0.0, false), (0.02, 0.98, false)]
        {
            let lobe = LobeShape::of(&Brdf::custom(TwoLobes::of(alpha, part_of_wide)));
            assert_eq!(lobe.is_cusp, is_cusp, "{alpha} {part_of_wide}: {lobe:?}");
        }
        // A twentieth of what white paint under a coat without colour reflects is the coat's, but all of the lobe.
        for coat in ["alpha = 0.001\nior = 1.3", "alpha = 0.001\nior = 1.5", "alpha = 0.0045\nior = 1.5"] {
            let parameters = format!("distribution = 'ggx'\n{coat}\ndiffuse = 0.9");
            let plastic = Brdf::from_parameters("plastic", parameters.parse().unwrap()).unwrap();
            assert!(!LobeShape::of(&plastic).is_cusp, "{coat}");
        }
        let lambert = Brdf::from_parameters("lambert", "reflectance = 0.5".parse().unwrap()).unwrap();
        assert!(!LobeShape::of(&lambert).is_cusp);
    }

    #[test]
    fn a_matt_surface_that_mirrors_at_grazing_views_has_a_narrow_lobe_there_alone() {
        let narrowing = |model: &str, parameters: &str| {
            LobeShape::of(&Brdf::from_parameters(model, parameters.parse().unwrap()).unwrap()).narrowing
        };
        // Half a wavelength rough: to the eye it is smooth where cos theta_o is small.
        let parameters = "diffuse = 0\nsigma_um = 0.3\ntau_um = 2.5\nspecular_alpha = 0.018\nmetal = 'Al'";
        let [steep, half_way, slant, grazing] = narrowing("he_torrance", parameters);
        assert_eq!([steep, half_way, grazing], [0.0; 3]);
        assert!((-4.0..-3.0).contains(&slant), "{slant}");
        for (model, parameters) in [
            ("lambert", "reflectance = 0.5"),
            ("conductor", "distribution = 'ggx'\nalpha = 0.02\nmetal = 'Al'"),
            ("conductor", "distribution = 'ggx'\nalpha_x = 0.02\nalpha_y = 0.3\nmetal = 'Al'"),
            ("plastic", "distribution = 'ggx'\nalpha = 0.1\nior = 1.5\ndiffuse = 0.5"),
        ] {
            assert_eq!(narrowing(model, parameters), [0.0; 4], "{model} {parameters}");
        }
    }

    #[test]
    fn an_anisotropic_lobe_is_as_narrow_as_its_narrower_axis() {
        for (alpha_x, alpha_y) in [(0.001, 0.003), (0.3, 0.05), (0.01, 1.0)] {
            for rotation_deg in [0.0, 30.0, -77.7] {
                let brdf = |roughness: String| {
                    let parameters = format!("distribution = 'ggx'\neta = 0.2\nk = 3.9\n{roughness}");
                    Brdf::from_parameters("conductor", parameters.parse().unwrap()).unwrap()
                };
                let stretched =
                    brdf(format!("alpha_x = {alpha_x}\nalpha_y = {alpha_y}\nrotation_deg = {rotation_deg}"));
                let round = brdf(format!("alpha = {}", f64::min(alpha_x, alpha_y)));
                for width in [half_vector_width, |brdf: &_| lobe_radius(brdf, 0.0)] {
                    let ratio = width(&stretched) / width(&round);
                    // One step of the angles that are tried.
                    assert!((0.79..1.26).contains(&ratio), "{alpha_x} {alpha_y} {rotation_deg}: {ratio}");
                }
                let shape = LobeShape::of(&stretched);
                let expected = f64::max(alpha_x, alpha_y) / f64::min(alpha_x, alpha_y);
                let ratio = shape.narrowness.recip();
                // D falls by sin / alpha and not by the angle, and shadows grow: so the rougher axis gains, up to 18 %.
                assert!((ratio / expected - 1.0).abs() < 0.2, "{ratio}, expected {expected}");
                let wide_deg = rotation_deg + if alpha_x > alpha_y { 0.0 } else { 90.0 };
                let off = shape.long_axis.perp_dot(DVec2::from_angle(f64::to_radians(wide_deg)));
                assert!(off.abs() < 1e-3 / expected, "{off}");
            }
        }
    }
}
