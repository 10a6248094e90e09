//! How narrow a BRDF's lobe is.
use std::f64::consts::FRAC_PI_2;

use glam::{DVec3, dvec3};

use super::Brdf;

/// Half vectors closer to the normal than this count as one: a tenth of the narrowest lobe that a model may have.
const NARROWEST_RAD: f64 = 1e-4;

/// The angle of the half vector to the normal within which f stays within a quarter of what it is in the mirror direction;
/// a right angle if it does so everywhere. In radians. Seen along the normal, where lobes are widest.
pub fn half_vector_width(brdf: &Brdf) -> f64 {
    let f = |theta_h: f64| {
        let theta_i = 2.0 * theta_h;
        brdf.evaluate(dvec3(0.0, theta_i.sin(), theta_i.cos()), DVec3::Z).element_sum()
    };
    let peak = f(0.0);
    let widths = std::iter::successors(Some(NARROWEST_RAD), |width| Some(1.25 * width));
    // Half vectors beyond 45 degrees belong to light below the horizon.
    let mut above_horizon = widths.take_while(|&width| width < 0.5 * FRAC_PI_2);
    above_horizon.find(|&width| (f(width) - peak).abs() > 0.25 * peak).unwrap_or(FRAC_PI_2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn widths_follow_roughness() {
        for (alpha, distribution) in [(0.001, "ggx"), (0.02, "beckmann"), (0.2, "ggx")] {
            let parameters = format!("distribution = '{distribution}'\nalpha = {alpha}\neta = 0.2\nk = 3.9");
            let width = half_vector_width(&Brdf::from_parameters("conductor", parameters.parse().unwrap()).unwrap());
            assert!((0.3..1.0).contains(&(width / alpha)), "{distribution} {alpha}: {width}");
        }
        let lambert = Brdf::from_parameters("lambert", "reflectance = 0.5".parse().unwrap()).unwrap();
        assert_eq!(half_vector_width(&lambert), FRAC_PI_2);
    }
}
