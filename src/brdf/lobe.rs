//! How narrow a BRDF's lobe is.
use std::f64::consts::FRAC_PI_2;

use glam::{DVec3, dvec3};

use super::Brdf;

/// Half vectors closer to the normal than this count as one: a tenth of the narrowest lobe that a model may have.
const NARROWEST_RAD: f64 = 1e-4;

/// At grazing angles lobes grow ever thinner across the plane of incidence, by the cosine; who goes by their width takes it for no less than
/// this: beyond 87 degrees is a rim of 0.1 % of a sphere.
pub const MIN_COS_THETA_D: f64 = 0.05;

/// The angle of the half vector to the normal within which f stays within a quarter of what it is in the mirror direction;
/// a right angle if it does so everywhere. In radians. Seen along the normal, where lobes are widest.
pub fn half_vector_width(brdf: &Brdf) -> f64 {
    let peak = profile(brdf, 0.0);
    first_angle(|angle| (profile(brdf, angle) - peak).abs() > 0.25 * peak)
}

/// What stands out of the least value of f by less than this part of it is no lobe.
const LEAST_RISE: f64 = 0.1;

/// The angle of the half vector to the normal from which f, as far as it is above its least value, falls to less than half at twice the
/// angle: nearer to the normal there is but a plateau, or a cusp of little energy. A right angle if there is no such lobe. In radians.
/// Seen along the normal.
pub fn lobe_radius(brdf: &Brdf) -> f64 {
    let least = angles().map(|angle| profile(brdf, angle)).fold(f64::INFINITY, f64::min).max(0.0);
    let rise = |angle: f64| profile(brdf, angle) - least;
    // Beyond 45 degrees f is 0, which is no lobe.
    first_angle(|angle| {
        2.0 * angle < 0.5 * FRAC_PI_2 && rise(angle) > LEAST_RISE * least && rise(angle) > 2.0 * rise(2.0 * angle)
    })
}

/// f, summed over channels, where the half vector is at `theta_h` to the normal.
fn profile(brdf: &Brdf, theta_h: f64) -> f64 {
    let theta_i = 2.0 * theta_h;
    brdf.evaluate(dvec3(0.0, theta_i.sin(), theta_i.cos()), DVec3::Z).element_sum()
}

/// Ever larger angles of half vectors. Those beyond 45 degrees belong to light below the horizon.
fn angles() -> impl Iterator<Item = f64> {
    let angles = std::iter::successors(Some(NARROWEST_RAD), |angle| Some(1.25 * angle));
    angles.take_while(|&angle| angle < 0.5 * FRAC_PI_2)
}

/// The first of them of which `is_so`; a right angle if there is none.
fn first_angle(is_so: impl Fn(f64) -> bool) -> f64 {
    angles().find(|&angle| is_so(angle)).unwrap_or(FRAC_PI_2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn widths_follow_roughness() {
        for (alpha, distribution) in [(0.001, "ggx"), (0.02, "beckmann"), (0.2, "ggx")] {
            let parameters = format!("distribution = '{distribution}'\nalpha = {alpha}\neta = 0.2\nk = 3.9");
            let brdf = Brdf::from_parameters("conductor", parameters.parse().unwrap()).unwrap();
            for width in [half_vector_width(&brdf), lobe_radius(&brdf)] {
                assert!((0.3..1.0).contains(&(width / alpha)), "{distribution} {alpha}: {width}");
            }
        }
        // A lobe is found however much light is scattered beside it.
        let parameters = "distribution = 'ggx'\nalpha = 0.05\nior = 1.5\ndiffuse = 0.9";
        let plastic = lobe_radius(&Brdf::from_parameters("plastic", parameters.parse().unwrap()).unwrap());
        assert!((0.3..1.0).contains(&(plastic / 0.05)), "{plastic}");
        let lambert = Brdf::from_parameters("lambert", "reflectance = 0.5".parse().unwrap()).unwrap();
        assert_eq!((half_vector_width(&lambert), lobe_radius(&lambert)), (FRAC_PI_2, FRAC_PI_2));
    }
}
