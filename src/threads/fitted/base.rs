//! What takes what kernels leave of the albedo: Lambert's base, or the BRDF's own where few kernels do better with that.
use rayon::prelude::*;

use super::cells::in_sets;
use super::kernel::{scaled, sharpest_level};
use super::lights::{BaseAnswers, LightSettings, Quadrature, TestLights};
use super::solve::{Effort, Fit};
use crate::brdf::{BaseProfile, Brdf, LobeShape};
use crate::error::Result;
use crate::progress::Observer;
use crate::threads::azimuths::View;
use crate::threads::slice::{Resolution, Slice};

/// Views that are tried: radians from the normal, and from the tangent.
const VIEWS: [View; 4] = [
    View { theta_o: 0.2, phi_o: 0.0 },
    View { theta_o: 0.6, phi_o: 0.5 },
    View { theta_o: 0.9, phi_o: 1.0 },
    View { theta_o: 1.2, phi_o: 1.5 },
];
const KERNELS: usize = 4;
const LIGHTS: LightSettings = LightSettings { count: 512, threads: KERNELS, seed: 0 };
const EFFORT: Effort = Effort { steps: 60, least_gain: 1e-3 };

/// A base of one's own has a map of its own, so it has to leave less than this part of the error.
const WORTH_A_MAP: f64 = 0.9;

/// The profile of the base that suits threads of `brdf`, which has this `lobe`.
///
/// # Errors
/// Cancelled by `observer`.
pub(super) fn base_of(brdf: &Brdf, lobe: &LobeShape, observer: &dyn Observer) -> Result<BaseProfile> {
    let own = BaseProfile::of(brdf);
    if own == BaseProfile::EVEN {
        return Ok(own);
    }
    let bases = [BaseProfile::EVEN, own].map(|base| BaseAnswers::of(&base));
    let squares = |view: &View| -> Result<[f64; 2]> {
        let slices = Slice::with_lobes_of_view(brdf, lobe, *view, Resolution::DRAFT);
        let starts = in_sets(&slices[1], KERNELS, 1);
        let square = |base: &BaseAnswers| -> Result<f64> {
            let lights = TestLights::new(&slices, LIGHTS, Quadrature::DRAFT, base);
            let fit = Fit::new(&lights, slices[0].albedo() / lights.unit);
            let fit = fit.no_sharper_than(sharpest_level(lobe, KERNELS, view.theta_o));
            let mut kernels = starts.first().map(|start| scaled(start, 1.0 / lights.unit)).unwrap_or_default();
            fit.bound(&mut kernels);
            fit.solve(&mut kernels, EFFORT, observer)?;
            Ok((2.0 * view.theta_o).sin() * fit.relative_error(&kernels).powi(2))
        };
        Ok([square(&bases[0])?, square(&bases[1])?])
    };
    let all = VIEWS.par_iter().map(squares).collect::<Result<Vec<_>>>()?;
    let [even, of_own] = all.iter().fold([0.0; 2], |[a, b], [even, own]| [a + even, b + own]);
    Ok(if of_own < WORTH_A_MAP * WORTH_A_MAP * even { own } else { BaseProfile::EVEN })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_coated_base_is_its_own_and_one_that_is_no_product_is_lamberts() {
        let has_own = |material: &str| {
            let brdf = Brdf::builtin(material).unwrap();
            base_of(&brdf, &LobeShape::of(&brdf), &()).unwrap() != BaseProfile::EVEN
        };
        for material in ["porcelain", "red-plastic", "green-enamel", "red-car-paint"] {
            assert!(has_own(material), "{material}");
        }
        for material in ["clay", "terracotta", "moon-dust", "gold", "chrome"] {
            assert!(!has_own(material), "{material}");
        }
    }
}
