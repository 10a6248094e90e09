//! Where kernels give way to the BRDF beside small bright lights.
use super::FittedTable;
use crate::brdf::LobeShape;
use crate::shader_constants::fitted::{FAR, WIDEST_WHOLE_RAD};

/// By what shading decides between what kernels make of a small bright light and the BRDF at points of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GivingWay {
    /// The radius of the lobe, in half vectors (radians): lambda in (F28).
    pub lobe_radius_rad: f64,
    /// Between which clearances kernels give way (F29).
    pub clear: [f32; 2],
}

/// Few kernels have none for a cusp on a wide lobe, and many do. Measured on all tables of MERL with a cusp: 24 kernels fit those of the
/// three wide lobes, 16 do not.
const MANY_KERNELS: usize = 24;
/// Cusps on narrower lobes are so much like the lobe that points of a lamp do for both: with 64 kernels, too, these err less by its radius.
const WIDE_UNDER_CUSP_RAD: f64 = 0.005;

/// Earlier, rims of mirrored lamps are off in mirrors; later, lamps are in glossy plastics.
const CLEAR: [f32; 2] = [1.25, 2.5];
/// Steep flanks that end in the dark show the edges of lamps, which kernels know better than squares in the place of parts.
const CLEAR_OF_FLANKS: [f32; 2] = [2.5, FAR];
/// Wider ones are slight slopes to the parts of a lamp near the mirrored view: these are no wider.
const WIDEST_STEEP_RAD: f64 = WIDEST_WHOLE_RAD as f64;
/// Kernels that are expected to err by more than this part of the radiance give way sooner, with its square root,
const GOOD_ERROR: f32 = 0.01;
/// but no sooner than this part. Measured on 20 materials with 8 to 64 threads under the lamps of a studio: of those expected to err by less
/// than 0.9 % most err least in the picture by [`CLEAR`], of the others by 0.7 or 0.8 of it.
const SOONEST: f32 = 0.7;

impl GivingWay {
    /// That of these kernels of a BRDF of this lobe.
    pub fn of(lobe: &LobeShape, table: &FittedTable) -> Self {
        let is_fitted = table.count >= MANY_KERNELS && lobe.radius_rad > WIDE_UNDER_CUSP_RAD;
        let sooner = (GOOD_ERROR / table.mean_relative_error()).sqrt().clamp(SOONEST, 1.0);
        let is_steep = lobe.is_dark_beyond && lobe.flank_rad > 0.0 && lobe.flank_rad < WIDEST_STEEP_RAD;
        let clear = if is_steep { CLEAR_OF_FLANKS } else { CLEAR };
        Self {
            lobe_radius_rad: if is_fitted { lobe.width_rad } else { lobe.radius_rad },
            clear: clear.map(|clearance| sooner * clearance),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::Brdf;
    use crate::brdf::tests::samples::of_model;

    fn table(count: usize, error: f32) -> FittedTable {
        FittedTable {
            rows: 1,
            azimuths: 1,
            count,
            sets: 1,
            material: String::new(),
            rim_power: 1.0,
            base: crate::brdf::BaseProfile::EVEN,
            albedo: vec![[0.0; 3]],
            relative_error: vec![error],
            kernels: Vec::new(),
            of_subpixels: None,
        }
    }

    /// Those of two-layer-gold and of chrome of the MERL database.
    #[test]
    fn many_kernels_go_by_the_cusp_on_a_wide_lobe_and_few_by_the_lobe() {
        let lambert = of_model("lambert", "reflectance = 0.5");
        let plain = LobeShape::of(&lambert);
        let radius = |lobe: LobeShape, count| GivingWay::of(&lobe, &table(count, 0.01)).lobe_radius_rad;
        let gold = LobeShape { width_rad: 0.0003, radius_rad: 0.0646, ..plain };
        assert_eq!([16, 64].map(|count| radius(gold, count)), [0.0646, 0.0003]);
        let chrome = LobeShape { width_rad: 0.0005, radius_rad: 0.0028, ..plain };
        assert_eq!([16, 64].map(|count| radius(chrome, count)), [0.0028; 2]);
    }

    #[test]
    fn kernels_give_way_the_sooner_the_more_they_err_within_bounds() {
        let lobe = LobeShape::of(&Brdf::builtin("gold").unwrap());
        let clear = |error: f32| GivingWay::of(&lobe, &table(16, error)).clear;
        let steps = [0.0, 0.005, 0.01, 0.012, 0.015, 0.02, 0.5, f32::INFINITY].map(clear);
        assert!(steps.is_sorted_by(|a, b| a[0] >= b[0] && a[1] >= b[1]), "{steps:?}");
        assert_eq!([steps[0], steps[2]], [CLEAR; 2]);
        let flanked = LobeShape { flank_rad: 0.01, is_dark_beyond: true, ..lobe };
        let later = GivingWay::of(&flanked, &table(16, 0.0)).clear;
        assert!(later[0] > steps[0][0] && later[1] > steps[0][1], "beside steep flanks later: {later:?}");
        assert!(steps[4][1] < 2.1 && steps.iter().all(|clear| clear[0] >= 0.7 * CLEAR[0]), "{steps:?}");
    }
}
