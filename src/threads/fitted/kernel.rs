//! Von Mises-Fisher kernels: what one trilinear lookup in the environment's pyramid weighs directions by.
//!
//! vMF(w; d, kappa) = kappa / (2 pi (1 - exp(-2 kappa))) exp(kappa (w . d - 1)); its width is sigma = 1 / sqrt(kappa) (F8). Level l of a
//! pyramid holds the environment convolved with the kernel of width [`FINEST_WIDTH_RAD`] 2^l, and a lookup between two levels has a
//! linear blend of their kernels (F9). Level -1 is the environment as it is.
use std::f64::consts::PI;

use glam::DVec3;

use crate::brdf::{LobeShape, MIN_COS_THETA_D};
use crate::shader_constants::vmf_pyramid;

/// Width of the kernel of level 0 in radians: 0.22 degrees, two texels in the middle of a face of 1024.
pub const FINEST_WIDTH_RAD: f64 = vmf_pyramid::FINEST_WIDTH_RAD as f64;

/// The sharpest level: no blur, for lobes that are mirrors.
pub const SHARPEST_LEVEL: f64 = -1.0;

/// The widest level: there the kernel has a width of one radian.
pub const WIDEST_LEVEL: f64 = 8.0;

/// A thread in one row: a kernel of the environment's pyramid, and the radiance it gives under light of radiance 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kernel {
    /// Where it looks, unit, in the shading frame.
    pub direction: DVec3,
    /// Level of the pyramid, [`SHARPEST_LEVEL`] to [`WIDEST_LEVEL`]: its width.
    pub level: f64,
    /// Linear Rec. 709, not negative.
    pub weight: DVec3,
}

impl Kernel {
    /// The one that is the part `t` of the way to `other`, as shading has it between rows: that blends places on a map of directions, which
    /// for neighbours a degree apart is the same to 2e-5 radians.
    pub fn between(&self, other: &Self, t: f64) -> Self {
        Self {
            direction: self.direction.lerp(other.direction, t).normalize(),
            level: self.level + t * (other.level - self.level),
            weight: self.weight.lerp(other.weight, t),
        }
    }
}

/// Each kernel of `a` the part `t` of the way to that of `b`.
pub fn all_between(a: &[Kernel], b: &[Kernel], t: f64) -> Vec<Kernel> {
    a.iter().zip(b).map(|(a, b)| a.between(b, t)).collect()
}

/// The same with `scale` times the weights.
pub(super) fn scaled(kernels: &[Kernel], scale: f64) -> Vec<Kernel> {
    kernels.iter().map(|kernel| Kernel { weight: scale * kernel.weight, ..*kernel }).collect()
}

/// kappa of the kernel of a whole `level`.
pub fn kappa_of_level(level: f64) -> f64 {
    // For none at all a width of 0.002 degrees: far narrower than any light or pixel, and its square is no trouble to f64.
    const SHARP_KAPPA: f64 = 1e9;
    if level < 0.0 { SHARP_KAPPA } else { (FINEST_WIDTH_RAD * level.exp2()).powi(-2) }
}

/// 4^n. Twin of `power_of_4` in glsl/vmf_pyramid.glsl.
fn power_of_4(n: i32) -> f32 {
    f32::from_bits(((127 + 2 * n) as u32) << 23)
}

/// Variance along each axis of the kernel of `level`, over that of level 0. Twin of `variance_of_level` in glsl/vmf_pyramid.glsl.
pub fn variance_of_level(level: f32) -> f32 {
    let whole = level.floor();
    if level < 0.0 { level + 1.0 } else { power_of_4(whole as i32) * (1.0 + 3.0 * (level - whole)) }
}

/// The level of a kernel of this variance. Twin of `level_of_variance` in glsl/vmf_pyramid.glsl.
pub fn level_of_variance(variance: f32) -> f32 {
    if variance < 1.0 {
        return variance - 1.0;
    }
    let whole = (((variance.to_bits() >> 23) as i32) - 127) >> 1;
    whole as f32 + (variance * power_of_4(-whole) - 1.0) / 3.0
}

/// How much of a kernel of `level` is the environment as it is, where a pyramid begins at level `finest`: see `sharp_part` in
/// glsl/vmf_pyramid.glsl, whose twin it is.
pub fn sharp_part(level: f32, finest: f32) -> f32 {
    (1.0 - variance_of_level(level) / (vmf_pyramid::AS_SHARP * variance_of_level(finest))).max(0.0)
}

/// No kernel is narrower than this part of the lobe's width in half vectors: a Gaussian as wide as the lobe has 2.6 times that. Narrower
/// ones would answer the lights of the fit, not those between them: a comb, if there are many. Lights tell kernels that are wider than
/// [`TOLD_RAD`], so these have no such bound. Chrome beside 300 small lamps, close to the limb, errs by 0.0032 with 128 threads, not by 0.0074.
const NARROWEST_IN_LOBE: f64 = 1.25;
pub(super) const TOLD_RAD: f64 = 0.02;

/// No kernel of a cusp is sharper than this: shading would look up a map of 1024 columns as it is, which costs several lookups.
/// [`sharp_part`] is 0 there from 0.5 on, and half floats round levels by less than a thousandth.
///
/// Nor is one of few threads of a lobe that is wide enough up to a view of this cosine: few pixels see it beyond that, but all would pay.
const SHARPEST_WITHOUT_MAP: f64 = 0.51;
const MOST_WITHOUT_MAP: usize = 16;
const COS_OF_WIDE: f64 = 0.5;

/// The level that kernels of so many threads of a BRDF with this lobe are no sharper than, at the view angle `theta_o` in radians.
pub fn sharpest_level(lobe: &LobeShape, count: usize, theta_o: f64) -> f64 {
    let at = |cos: f64| ((NARROWEST_IN_LOBE * lobe.width_rad).min(TOLD_RAD) * cos / FINEST_WIDTH_RAD).log2();
    let is_wide = count <= MOST_WITHOUT_MAP && at(COS_OF_WIDE) > SHARPEST_WITHOUT_MAP;
    let least = if lobe.is_cusp || is_wide { SHARPEST_WITHOUT_MAP } else { SHARPEST_LEVEL };
    at(theta_o.cos().max(MIN_COS_THETA_D)).max(least)
}

/// A length on the scale of a kernel of `level`: its width; for those sharper than level 0, as if widths went on halving.
pub fn scale_rad(level: f64) -> f64 {
    FINEST_WIDTH_RAD * level.exp2()
}

/// vMF in its own direction, in 1/sr.
pub fn vmf_peak(kappa: f64) -> f64 {
    kappa / (2.0 * PI * -(-2.0 * kappa).exp_m1())
}

/// The direction in a kernel around `d` that has the part `u` of its mass nearer to `d`, at angle `azimuth` around it.
pub fn vmf_direction(d: DVec3, kappa: f64, u: f64, azimuth: f64) -> DVec3 {
    // 1 - cos of the angle: inverse of the CDF.
    let one_minus = -(1.0 - u * -(-2.0 * kappa).exp_m1()).ln() / kappa;
    let sin = (one_minus * (2.0 - one_minus)).max(0.0).sqrt();
    let (x, y) = d.any_orthonormal_pair();
    (1.0 - one_minus) * d + sin * (azimuth.cos() * x + azimuth.sin() * y)
}
