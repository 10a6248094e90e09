//! Lobes that are others at grazing views: surfaces that are matt along their normal may mirror there.
use super::lobe_radius;
use crate::brdf::Brdf;

/// The cosines of the view angles between which lobes are taken to become narrower evenly. The same in glsl/methods/fitted.glsl.
pub const NARROWING_COSINES: [f64; 5] = [1.0, 0.6, 0.4, 0.25, 0.1];

/// A lobe that becomes narrower by less than this from view to view is the same lobe. Most measured ones do, and err more if that counts: nickel
/// under lamps by 0.0077, not 0.0060.
const LEAST_NARROWING: f64 = -2.0;

/// [`narrowing`](super::LobeShape::narrowing) of a lobe of this radius, seen along the normal.
pub(super) fn narrowing(brdf: &Brdf, radius_rad: f64) -> [f64; 4] {
    let mut before = radius_rad;
    std::array::from_fn(|i| {
        let radius = lobe_radius(brdf, NARROWING_COSINES[i + 1].acos()).min(before);
        let step = (radius / before).log2();
        before = radius;
        if step < LEAST_NARROWING { step } else { 0.0 }
    })
}

#[cfg(test)]
mod tests {
    use crate::brdf::LobeShape;
    use crate::brdf::tests::samples::of_model;

    #[test]
    fn a_matt_surface_that_mirrors_at_grazing_views_has_a_narrow_lobe_there_alone() {
        let narrowing = |model: &str, parameters: &str| LobeShape::of(&of_model(model, parameters)).narrowing;
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
}
