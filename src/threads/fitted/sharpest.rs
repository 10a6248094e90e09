//! How sharp the kernels of a BRDF may be.
use super::kernel::{FINEST_WIDTH_RAD, SHARPEST_LEVEL, scale_rad};
use crate::brdf::{Brdf, LobeShape, MIN_COS_THETA_D, SeenBrdf};
use crate::threads::slice::{Resolution, Slice};

/// No kernel is narrower than this part of the lobe's width in half vectors: a Gaussian as wide as the lobe has 2.6 times that. Narrower
/// ones would answer the lights of the fit, not those between them: a comb, if there are many. Lights tell kernels that are wider than
/// [`TOLD_RAD`], so these have no such bound. Chrome beside 300 small lamps, close to the limb, errs by 0.0032 with 128 threads, not by 0.0074.
const NARROWEST_IN_LOBE: f64 = 1.25;
const TOLD_RAD: f64 = 0.02;

/// Kernels sharper than this look up a map of 1024 columns as it is, which costs several lookups; wider ones do not:
/// [`sharp_part`](super::kernel::sharp_part) is 0 from 0.5 on, and half floats round levels by less than a thousandth.
const BLURRED_LEVEL: f64 = 0.51;

/// A lobe narrower than that is but a cusp where it holds less than this part of the light that is reflected, seen along the normal. Many
/// tables of MERL have one. No kernel is as sharp as a cusp: with 64 threads six materials make 2 to 6 % fewer lookups for that, and err as
/// much. Of those that mirror more, hematite (0.037) would err by a sixth more, brass (0.05) by a tenth, chrome and steel (0.11) by half.
const MOST_IN_CUSP: f64 = 0.03;

/// The bound for the kernels of a BRDF.
#[derive(Clone, Copy, Debug)]
pub struct SharpestKernels {
    lobe_width_rad: f64,
    level: f64,
}

impl SharpestKernels {
    /// That of `brdf`, whose lobe this is.
    pub fn of(brdf: &Brdf, lobe: &LobeShape) -> Self {
        // Half vectors turn half as far as what they mirror.
        let blurred_rad = 0.5 * scale_rad(BLURRED_LEVEL);
        let is_cusp = lobe.width_rad < blurred_rad && {
            let [slice, _] = Slice::with_lobes(&SeenBrdf::from_azimuth(brdf, 0.0), 0.0, Resolution::DRAFT);
            slice.mass_within(blurred_rad) < MOST_IN_CUSP
        };
        Self { lobe_width_rad: lobe.width_rad, level: if is_cusp { BLURRED_LEVEL } else { SHARPEST_LEVEL } }
    }

    /// The sharpest level at the view angle `theta_o`, in radians.
    pub fn level(&self, theta_o: f64) -> f64 {
        let narrowest_rad = (NARROWEST_IN_LOBE * self.lobe_width_rad).min(TOLD_RAD) * theta_o.cos().max(MIN_COS_THETA_D);
        (narrowest_rad / FINEST_WIDTH_RAD).log2().max(self.level)
    }
}
