//! Cusps: peaks that are narrower than kernels tell, of little energy, as many measured tables have them on their lobe.
use std::f64::consts::FRAC_PI_2;

use super::{azimuths, profile};
use crate::brdf::Brdf;

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

/// Whether a lobe of this width is but a cusp.
pub(super) fn is_cusp(brdf: &Brdf, width_rad: f64) -> bool {
    width_rad < CUSP_RAD && holds_little(brdf)
}

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

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use crate::brdf::tests::samples::of_model;
    use crate::brdf::{Brdf, CustomBrdf, LobeShape};

    /// A narrow lobe and a wide one, which has this part of the sum.
    struct TwoLobes([Brdf; 2], f64);

    impl TwoLobes {
        fn of(narrow_alpha: f64, part_of_wide: f64) -> Self {
            let lobe = |alpha: f64| {
                let parameters = format!("distribution = 'beckmann'\nalpha = {alpha}\neta = 0.2\nk = 3.9");
                of_model("conductor", &parameters)
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
            let plastic = of_model("plastic", &parameters);
            assert!(!LobeShape::of(&plastic).is_cusp, "{coat}");
        }
        let lambert = of_model("lambert", "reflectance = 0.5");
        assert!(!LobeShape::of(&lambert).is_cusp);
    }
}
