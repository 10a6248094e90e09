//! Values of a BRDF without a twin at the nodes of a grid, as shaders look them up: what tables of every shape share.
use std::sync::Arc;

use glam::{DVec3, Vec3};
use half::f16;
use rayon::prelude::*;

use super::{Brdf, lobe_radius};

/// What the greatest value is stored as. Half precision then keeps eleven bits of all that is above a billionth of it.
pub(super) const GREATEST_TEXEL: f64 = 6e4;

/// Greater values count as this, which leaves single precision room for products with light: f that grows without bound towards the horizon may
/// have any value there.
const GREATEST_VALUE: f64 = 1e30;

/// Tables of all shapes have so many texels along x and y, so that an image packs them without gaps.
pub const MADE_TABLE_SIZE: [usize; 2] = [17, 75];

/// Texels, x fastest. Cheap to clone.
#[derive(Clone)]
pub struct MadeTable {
    /// Values over `scale`; the fourth channel is not used.
    texels: Arc<[[f16; 4]]>,
    /// What a texel of 1 stands for.
    pub(super) scale: f64,
}

impl MadeTable {
    /// The table of `value` at each of `count` texels.
    pub(super) fn of(count: usize, value: impl Fn(usize) -> DVec3 + Send + Sync) -> Self {
        let value = |index: usize| value(index).min(DVec3::splat(GREATEST_VALUE));
        let values: Vec<DVec3> = (0..count).into_par_iter().map(value).collect();
        let greatest = values.iter().fold(0.0, |greatest: f64, value| greatest.max(value.max_element()));
        // A table that is black has any scale.
        let scale = if greatest > 0.0 { greatest / GREATEST_TEXEL } else { 1.0 };
        let texel = |value: &DVec3| (*value / scale).extend(1.0).to_array().map(f16::from_f64);
        Self { texels: values.iter().map(texel).collect(), scale }
    }

    /// The texels. Between them one interpolates linearly.
    pub fn texels(&self) -> &Arc<[[f16; 4]]> {
        &self.texels
    }

    /// Number of texels along x, y and z of a 3D texture.
    pub fn size(&self) -> [usize; 3] {
        let [x, y] = MADE_TABLE_SIZE;
        [x, y, self.texels.len() / (x * y)]
    }

    /// The value at `position` in the texels along x, y and z from `first`, trilinearly between two along each.
    pub(super) fn between(&self, first: [usize; 3], fraction: Vec3) -> DVec3 {
        let [columns, rows] = MADE_TABLE_SIZE;
        let start = first[0] + columns * (first[1] + rows * first[2]);
        let texel = |place: usize| Vec3::from_slice(&self.texels[place].map(f16::to_f32));
        let line = |offset: usize| texel(start + offset).lerp(texel(start + offset + 1), fraction.x);
        let plane = |offset: usize| line(offset).lerp(line(offset + columns), fraction.y);
        plane(0).lerp(plane(columns * rows), fraction.z).as_dvec3() * self.scale
    }

    pub(super) fn hash_content(&self, hasher: &mut blake3::Hasher) {
        super::hash_numbers(hasher, [self.scale]);
        hasher.update(bytemuck::cast_slice(&self.texels));
    }
}

impl std::fmt::Debug for MadeTable {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("MadeTable")
            .field("size", &self.size())
            .field("scale", &self.scale)
            .finish_non_exhaustive()
    }
}

/// The two nodes of an axis of `count` around `position`, which is from 0 to `count` - 1: the first, and how far it is to the next.
pub(super) fn around(position: f64, count: usize) -> (usize, f64) {
    let first = (position as usize).min(count - 2);
    (first, position - first as f64)
}

/// 0 to 1 for `x` of 0 to 1: linear below the knee, logarithmic above.
pub(super) fn logarithmic(x: f64, knee: f64) -> f64 {
    (x / knee).ln_1p() / knee.recip().ln_1p()
}

/// The knee that suits half vectors where a lobe is so wide: of the angle in right angles, or of tan(theta_h / 2), which is about as much.
pub(super) fn knee_of_lobe(brdf: &Brdf, lobe_width_rad: f64) -> f64 {
    // tan(theta_h / 2) is half of theta_h, and half of the width is where f is within a tenth or so of its peak.
    (0.25 * lobe_width_rad.min(lobe_radius(brdf, 0.0))).clamp(1e-4, 1.0)
}

/// The inverse of [`logarithmic`].
pub(super) fn exponential(x: f64, knee: f64) -> f64 {
    knee * (x * knee.recip().ln_1p()).exp_m1()
}

/// The derivative of [`exponential`] where that is `value`.
pub(super) fn exponential_slope(value: f64, knee: f64) -> f64 {
    (value + knee) * knee.recip().ln_1p()
}

/// Nodes per doubling of what is far above the knee, of an axis of `count`.
pub(super) fn nodes_per_doubling(count: usize, knee: f64) -> f64 {
    (count - 1) as f64 * std::f64::consts::LN_2 / knee.recip().ln_1p()
}

/// The cosine by which f is multiplied in a table: (n . w_i + n . w_o) / 2 = cos theta_h cos theta_d, which keeps f finite where both
/// directions graze; where f is not reciprocal n . w_i, since f (n . w_i) is what was measured.
pub(super) fn stored_cosine(w_i: DVec3, w_o: DVec3, is_reciprocal: bool) -> f64 {
    if is_reciprocal { 0.5 * (w_i.z + w_o.z) } else { w_i.z }
}

/// 1 - tan(theta_d / 2) below which nodes are equally spaced rather than by factors.
pub(super) const KNEE_THETA_D: f64 = 0.2;

/// Nodes stay this far, in parts of the cosine, from the horizon, where some BRDFs are infinite.
pub(super) const FROM_HORIZON: f64 = 1e-2;

/// Sine and cosine of the angle whose half has this tangent.
pub(super) fn of_half_tangent(tangent: f64) -> (f64, f64) {
    let square = tangent * tangent;
    (2.0 * tangent / (1.0 + square), (1.0 - square) / (1.0 + square))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_beyond_single_precision_are_finite_in_a_table() {
        let table = MadeTable::of(3, |index| DVec3::splat([1e300, f64::INFINITY, 0.5][index]));
        assert!((table.scale as f32).is_finite(), "{}", table.scale);
        assert!(table.texels().iter().flatten().all(|channel| channel.is_finite()), "{:?}", table.texels());
    }
}
