//! How narrow a BRDF's lobe is, and along which axis.
use std::f64::consts::{FRAC_PI_2, PI};

use glam::DVec2;

use super::{Brdf, NARROWEST_ALPHA, reflect};

mod cusp;
mod ellipse;
mod flank;
mod narrowing;

pub use ellipse::Ellipse;
pub use narrowing::NARROWING_COSINES;

/// Half vectors closer to the normal than this count as one: a tenth of the narrowest lobe that a model may have.
const NARROWEST_RAD: f64 = 0.1 * NARROWEST_ALPHA;

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

/// What shading goes by of a lobe, seen along the normal. Finding it takes 0.5 ms, of some models more, so
/// [`FindLobe`](crate::steps::FindLobe) does so once for all that shades. A fit, which takes longer by far, finds it for itself.
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
        let (flank_rad, is_dark_beyond) = flank::flank(brdf, long_axis.perp(), width_rad);
        let radius_rad = if width_rad < WIDEST_CUSP_RAD { lobe_radius(brdf, 0.0) } else { width_rad };
        let is_cusp = cusp::is_cusp(brdf, width_rad);
        let narrowing = if is_isotropic { narrowing::narrowing(brdf, radius_rad) } else { [0.0; 4] };
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
            flank => flank * (-(4.0 * PI * flank::DARK * flank * flank).ln()).sqrt(),
        }
    }
}

/// Narrower lobes may be a cusp of little energy, as many measured tables have it, on the lobe itself.
const WIDEST_CUSP_RAD: f64 = 0.004;

/// How many azimuths, `least` or more, suit an ellipse `ratio` times as wide as it is long: a ring crosses it within that ratio in radians. GGX then
/// leaves an error of 2 e^(-ratio azimuths).
pub(super) fn azimuths_across(ratio: f64, least: usize) -> usize {
    least.max((8.0 / ratio).ceil() as usize)
}

/// [`LobeShape::narrowness`] alone.
pub(super) fn narrowness(brdf: &Brdf) -> f64 {
    if brdf.is_isotropic() { 1.0 } else { lobe_axes(brdf).0 }
}

/// Narrowness and long axis of an anisotropic lobe: exact for an ellipse, 1 / width^2 = A + B cos(2 (azimuth - that of the narrow axis)).
fn lobe_axes(brdf: &Brdf) -> (f64, DVec2) {
    // The sum over all azimuths of e^(2 i azimuth) / width^2 has the azimuth 2 (that of the narrow axis).
    let term = |azimuth: DVec2| azimuth.rotate(azimuth) / exact_width(brdf, azimuth).powi(2);
    let narrow = DVec2::from_angle(0.5 * azimuths(false).map(term).sum::<DVec2>().to_angle());
    let wide = narrow.perp();
    // Of a table of noise it might be any.
    ((exact_width(brdf, narrow) / exact_width(brdf, wide)).max(NARROWEST_ALPHA), wide)
}

/// [`half_vector_width`] towards one azimuth, to a millionth; a right angle where there is no lobe.
fn exact_width(brdf: &Brdf, azimuth: DVec2) -> f64 {
    let mut outside = first_angle(|angle| is_off_peak(brdf, azimuth, angle));
    if outside == FRAC_PI_2 {
        return outside;
    }
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
    brdf.evaluate(reflect(w_o, half_vector), w_o).element_sum()
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
    use super::*;
    use crate::brdf::tests::samples::of_model;

    #[test]
    fn widths_follow_roughness() {
        for (alpha, distribution) in [(0.001, "ggx"), (0.02, "beckmann"), (0.2, "ggx")] {
            let parameters = format!("distribution = '{distribution}'\nalpha = {alpha}\neta = 0.2\nk = 3.9");
            let brdf = of_model("conductor", &parameters);
            for width in [half_vector_width(&brdf), lobe_radius(&brdf, 0.0), lobe_radius(&brdf, 1.5)] {
                assert!((0.3..1.0).contains(&(width / alpha)), "{distribution} {alpha}: {width}");
            }
        }
        // A lobe is found however much light is scattered beside it.
        let parameters = "distribution = 'ggx'\nalpha = 0.05\nior = 1.5\ndiffuse = 0.9";
        let plastic = lobe_radius(&of_model("plastic", parameters), 0.0);
        assert!((0.3..1.0).contains(&(plastic / 0.05)), "{plastic}");
        let lambert = of_model("lambert", "reflectance = 0.5");
        assert_eq!((half_vector_width(&lambert), lobe_radius(&lambert, 0.0)), (FRAC_PI_2, FRAC_PI_2));
    }

    #[test]
    fn an_anisotropic_lobe_is_as_narrow_as_its_narrower_axis() {
        for (alpha_x, alpha_y) in [(0.001, 0.003), (0.3, 0.05), (0.01, 1.0)] {
            for rotation_deg in [0.0, 30.0, -77.7] {
                let brdf = |roughness: String| {
                    let parameters = format!("distribution = 'ggx'\neta = 0.2\nk = 3.9\n{roughness}");
                    of_model("conductor", &parameters)
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
