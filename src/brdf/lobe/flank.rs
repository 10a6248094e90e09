//! Flanks that fall as steeply as a Gaussian, and where they end.
use glam::DVec2;

use super::{STEP, angles, first_angle, profile};
use crate::brdf::Brdf;

/// Where f of a lobe that reflects all light is below this, in 1/sr, it is dark under any lamp.
pub(super) const DARK: f64 = 1.5e-4;

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

/// [`flank_rad`](super::LobeShape::flank_rad) of a lobe of this width, towards `azimuth`, and whether f falls to `FOOT` there.
pub(super) fn flank(brdf: &Brdf, azimuth: DVec2, width_rad: f64) -> (f64, bool) {
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

#[cfg(test)]
mod tests {
    use crate::brdf::LobeShape;
    use crate::brdf::tests::samples::of_model;

    #[test]
    fn steep_flanks_are_those_of_gaussians_and_end_in_the_dark_or_in_scattered_light() {
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
            let lobe = LobeShape::of(&of_model(model, &parameters));
            let flank = lobe.flank_rad;
            // One step of the angles that are tried.
            assert!((expected..=1.26 * expected).contains(&flank), "{parameters}: {flank}");
            assert_eq!(lobe.is_dark_beyond, is_dark_beyond, "{parameters}");
        }
    }
}
