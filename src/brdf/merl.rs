//! MERL: a measured isotropic BRDF as a table over half and difference angles. Twin: glsl/brdf/merl.glsl.
//!
//! Matusik et al., "A Data-Driven Reflectance Model" (2003). The `.binary` file: three little-endian i32 (90, 90, 180), then
//! the red, green and blue planes of f64, index phi_d + 180 (theta_d + 90 theta_h). Angles: Rusinkiewicz (1998).
use std::f64::consts::{FRAC_PI_2, PI};
use std::path::Path;
use std::sync::{Arc, LazyLock};

use glam::{DVec3, Vec4, dvec3};

use super::{Model, Parameters};
use crate::error::{Error, Result};

/// Bins over theta_h (square-root spaced, 0 to 90 degrees).
pub const THETA_H_BINS: usize = 90;
/// Bins over theta_d (0 to 90 degrees).
pub const THETA_D_BINS: usize = 90;
/// Bins over phi_d (0 to 180 degrees; reciprocity gives the rest).
pub const PHI_D_BINS: usize = 180;

const CELLS: usize = THETA_H_BINS * THETA_D_BINS * PHI_D_BINS;
const HEADER_BYTES: usize = 12;
const FILE_BYTES: usize = HEADER_BYTES + 3 * 8 * CELLS;

/// Stored value to 1/sr, per channel (the database's own reader, BRDFRead.cpp).
const SCALE: [f64; 3] = [1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0];

/// A measured BRDF. Cheap to clone.
#[derive(Clone)]
pub struct MerlTable {
    /// (rgb valid, valid) of each cell, index phi_d + 180 (theta_d + 90 theta_h).
    texels: Arc<[Vec4]>,
    fingerprint: blake3::Hash,
}

impl std::fmt::Debug for MerlTable {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("MerlTable").field("fingerprint", &self.fingerprint).finish_non_exhaustive()
    }
}

impl MerlTable {
    /// Reads a `.binary` file. Errors: unreadable, other dimensions, wrong size, a value that is not finite, nothing
    /// but zeros or invalid cells.
    pub fn load(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path).map_err(|cause| Error::unreadable(path, cause))?;
        Self::from_bytes(&bytes).map_err(|problem| {
            Error::in_file(path, problem, "fetch or write the file again; a MERL table is 90 x 90 x 180 cells")
        })
    }

    /// The table in the bytes of a `.binary` file; the error is what is wrong with them.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, String> {
        let header = bytes.get(..HEADER_BYTES).ok_or("is too short to be a MERL table")?;
        let dims: Vec<i32> = header.as_chunks().0.iter().map(|&dim| i32::from_le_bytes(dim)).collect();
        if dims != [THETA_H_BINS as i32, THETA_D_BINS as i32, PHI_D_BINS as i32] {
            return Err(format!("has dimensions {} x {} x {}", dims[0], dims[1], dims[2]));
        }
        if bytes.len() != FILE_BYTES {
            return Err(format!("has {} bytes instead of {FILE_BYTES}", bytes.len()));
        }
        let (values, _) = bytes[HEADER_BYTES..].as_chunks::<8>();
        let stored = |channel: usize, cell: usize| f64::from_le_bytes(values[channel * CELLS + cell]);

        let mut texels = Vec::with_capacity(CELLS);
        for theta_h in 0..THETA_H_BINS {
            for theta_d in 0..THETA_D_BINS {
                let horizon = Horizon::of_bins(theta_h, theta_d);
                for phi_d in 0..PHI_D_BINS {
                    let cell = texels.len();
                    let stored = [stored(0, cell), stored(1, cell), stored(2, cell)];
                    let rgb = [stored[0] * SCALE[0], stored[1] * SCALE[1], stored[2] * SCALE[2]].map(|f| f as f32);
                    if let Some(channel) = (0..3).find(|&channel| !rgb[channel].is_finite()) {
                        let name = ["red", "green", "blue"][channel];
                        return Err(format!(
                            "holds {} in the {name} cell theta_h {theta_h}, theta_d {theta_d}, phi_d {phi_d}",
                            stored[channel]
                        ));
                    }
                    let valid = stored.iter().all(|&value| value >= 0.0) && horizon.is_above(phi_d);
                    texels.push(if valid { Vec4::new(rgb[0], rgb[1], rgb[2], 1.0) } else { Vec4::ZERO });
                }
            }
        }
        if texels.iter().all(|texel| texel.truncate() == glam::Vec3::ZERO) {
            return Err("holds nothing but zero or invalid cells".into());
        }
        let mut hasher = blake3::Hasher::new();
        for texel in &texels {
            for value in texel.to_array() {
                hasher.update(&value.to_le_bytes());
            }
        }
        Ok(Self { texels: texels.into(), fingerprint: hasher.finalize() })
    }

    /// The table for a 3D texture: RGBA = (rgb valid, valid) with f in 1/sr and valid 0 or 1; x = phi_d (180), y = theta_d
    /// (90), z = theta_h (90), x fastest. Interpolate all four, then divide rgb by a.
    pub fn texels(&self) -> &[Vec4] {
        &self.texels
    }
}

/// Tells which cells of one (theta_h, theta_d) have both light and view above the horizon at their centre.
pub(super) struct Horizon {
    both: f64,
    swing: f64,
}

impl Horizon {
    pub(super) fn of_bins(theta_h: usize, theta_d: usize) -> Self {
        let x = (theta_h as f64 + 0.5) / THETA_H_BINS as f64;
        let (sin_theta_h, cos_theta_h) = (FRAC_PI_2 * x * x).sin_cos();
        let (sin_theta_d, cos_theta_d) = (FRAC_PI_2 * (theta_d as f64 + 0.5) / THETA_D_BINS as f64).sin_cos();
        Self { both: cos_theta_h * cos_theta_d, swing: sin_theta_h * sin_theta_d }
    }

    /// n . w = cos th cos td -+ sin th sin td cos pd for light and view.
    pub(super) fn is_above(&self, phi_d: usize) -> bool {
        let phi_d = PI * (phi_d as f64 + 0.5) / PHI_D_BINS as f64;
        self.both - (self.swing * phi_d.cos()).abs() >= 0.0
    }
}

/// Rusinkiewicz angles as positions in index space, where bin i covers [i, i + 1): (theta_h, theta_d, phi_d).
#[inline]
fn table_coordinate(w_i: DVec3, w_o: DVec3) -> DVec3 {
    let h = (w_i + w_o).normalize();
    let sin_theta_h = (h.x * h.x + h.y * h.y).sqrt();
    // The azimuth of a half vector at the pole is arbitrary.
    let (cos_phi_h, sin_phi_h) = if sin_theta_h > 0.0 { (h.x / sin_theta_h, h.y / sin_theta_h) } else { (1.0, 0.0) };
    // d: w_i seen from a frame with h as its pole.
    let along = w_i.x * cos_phi_h + w_i.y * sin_phi_h;
    let d = dvec3(h.z * along - sin_theta_h * w_i.z, w_i.y * cos_phi_h - w_i.x * sin_phi_h, w_i.dot(h));
    // Tangents rather than cosines, which have no digits left near the pole, just where bins are smallest.
    let theta_h = acute_angle(sin_theta_h, h.z);
    let theta_d = acute_angle((d.x * d.x + d.y * d.y).sqrt(), d.z);
    // Reciprocity: phi_d and phi_d + 180 degrees are the same cell, so d may be turned to where y is positive.
    let phi_d = acute_angle(d.y.abs(), d.x.abs());
    dvec3(
        THETA_H_BINS as f64 * (theta_h / FRAC_PI_2).sqrt(),
        THETA_D_BINS as f64 * (theta_d / FRAC_PI_2),
        PHI_D_BINS as f64 * (if d.x * d.y < 0.0 { PI - phi_d } else { phi_d } / PI),
    )
}

/// Steps from 0 to 1 at which [`acute_angle`] knows the arc tangent.
const TANGENT_STEPS: usize = 64;

/// The angle in [0, pi/2] of tangent y / x, neither negative; 0 if both are 0. To the last digits, in a third of the time of
/// `atan2`: the nearest tabulated arc tangent, and what is left of the angle by its series.
#[inline]
fn acute_angle(y: f64, x: f64) -> f64 {
    static ARC_TANGENTS: LazyLock<[f64; TANGENT_STEPS + 1]> =
        LazyLock::new(|| std::array::from_fn(|i| (i as f64 / TANGENT_STEPS as f64).atan()));
    let (low, high) = (y.min(x), y.max(x));
    // The smallest positive number stands in for 0, to divide by.
    let high = high.max(f64::MIN_POSITIVE);
    let step = ((low / high) * TANGENT_STEPS as f64 + 0.5) as usize;
    let tangent = step as f64 / TANGENT_STEPS as f64;
    // tan(a - b) = (tan a - tan b) / (1 + tan a tan b): at most 1/128, whose ninth power is nothing to a double.
    let rest = (low - tangent * high) / (high + tangent * low);
    let square = rest * rest;
    let rest_angle = rest * (1.0 - square * (1.0 / 3.0 - square * (1.0 / 5.0 - square / 7.0)));
    let angle = ARC_TANGENTS[step] + rest_angle;
    if y > x { FRAC_PI_2 - angle } else { angle }
}

/// The two bins whose centres enclose `position`, clamped at the ends, and the weight of the second.
#[inline]
fn clamped_pair(position: f64, bins: usize) -> (usize, usize, f64) {
    let x = (position - 0.5).clamp(0.0, (bins - 1) as f64);
    let low = (x as usize).min(bins - 2);
    (low, low + 1, x - low as f64)
}

impl Model for MerlTable {
    /// Trilinear between bin centres, clamped in theta_h and theta_d, periodic in phi_d; invalid cells have no weight.
    fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
        let position = table_coordinate(w_i, w_o);
        let (h0, h1, h_weight) = clamped_pair(position.x, THETA_H_BINS);
        let (d0, d1, d_weight) = clamped_pair(position.y, THETA_D_BINS);
        // + bins - 0.5 keeps the number positive, so that truncation is the floor.
        let p = position.z + PHI_D_BINS as f64 - 0.5;
        let p_weight = p - (p as usize) as f64;
        let p0 = p as usize % PHI_D_BINS;
        let p1 = if p0 + 1 == PHI_D_BINS { 0 } else { p0 + 1 };

        // In single precision, as texels are: 1e-7 of the largest of the eight.
        let [h_weight, d_weight, p_weight] = [h_weight, d_weight, p_weight].map(|weight| weight as f32);
        let line = |theta_h: usize, theta_d: usize| {
            let texels = &self.texels[PHI_D_BINS * (theta_d + THETA_D_BINS * theta_h)..][..PHI_D_BINS];
            texels[p0].lerp(texels[p1], p_weight)
        };
        let plane = |theta_h: usize| line(theta_h, d0).lerp(line(theta_h, d1), d_weight);
        let sum = plane(h0).lerp(plane(h1), h_weight);
        if sum.w > 0.0 { sum.truncate().as_dvec3() / f64::from(sum.w) } else { DVec3::ZERO }
    }

    fn from_parameters(_: &mut Parameters) -> Result<Self> {
        Err(Error::input("model `merl`", "has no parameters", "name the table with file = \"....binary\" instead"))
    }

    /// Where the table lies is known only once it is uploaded: a.x and a.y, its y and z offset in texels, are the uploader's.
    fn gpu_parameters(&self) -> [f32; 12] {
        [0.0; 12]
    }

    fn hash_content(&self, hasher: &mut blake3::Hasher) {
        hasher.update(self.fingerprint.as_bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn acute_angles_are_arc_tangents() {
        assert_eq!(acute_angle(0.0, 0.0), 0.0);
        assert_eq!((acute_angle(0.0, 1.0), acute_angle(1.0, 0.0)), (0.0, FRAC_PI_2));
        for i in 0..=10_000 {
            let angle = FRAC_PI_2 * f64::from(i) / 10_000.0;
            let (y, x) = angle.sin_cos();
            assert!((acute_angle(y, x.max(0.0)) - angle).abs() < 1e-15, "{angle}");
            let small = 1e-9 * angle;
            assert!((acute_angle(small, 1.0) / small.max(f64::MIN_POSITIVE) - 1.0).abs() < 1e-12 || i == 0, "{small}");
        }
    }
}
