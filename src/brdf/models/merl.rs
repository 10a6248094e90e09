//! MERL: a measured isotropic BRDF as a table over half and difference angles. Twin: glsl/brdf/merl.glsl.
//!
//! Matusik et al., "A Data-Driven Reflectance Model" (2003). The `.binary` file: three little-endian i32 (90, 90, 180), then
//! the red, green and blue planes of f64, index phi_d + 180 (theta_d + 90 theta_h). Angles: Rusinkiewicz (1998).
use std::f64::consts::{FRAC_1_PI, FRAC_2_PI, FRAC_PI_2, PI};
use std::sync::Arc;

use glam::{DVec2, DVec3, Vec3, Vec4, dvec2, dvec3};
use half::f16;

use crate::brdf::made_table::GREATEST_TEXEL;
use crate::brdf::models::MOST_MEASURED;
use crate::brdf::{Model, Parameters};
use crate::error::{Error, Result};
use crate::shader_constants::merl as glsl;
use crate::vector_math::half_floats;

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
pub(crate) const SCALE: [f64; 3] = [1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0];

/// Of so many bins over phi_d shaders have the mean: f varies least along it, and of smaller tables more stays in the cache.
const BINS_A_TEXEL: usize = 3;

/// Texels of a table on the device along x, y and z of a 3D texture: phi_d, theta_d and theta_h.
pub const DEVICE_TABLE_SIZE: [usize; 3] = [PHI_D_BINS / BINS_A_TEXEL, THETA_D_BINS, THETA_H_BINS];
const _: () = assert!(DEVICE_TABLE_SIZE[0] == glsl::PHI_D_TEXELS as usize);
const _: () = assert!(THETA_D_BINS == glsl::THETA_TEXELS as usize && THETA_H_BINS == THETA_D_BINS);

/// A measured BRDF. Cheap to clone.
#[derive(Clone)]
pub struct MerlTable {
    /// (rgb valid, valid) of each cell, valid from 0 to 1, index phi_d + phi_d_bins (theta_d + 90 theta_h).
    texels: Arc<[Vec4]>,
    /// [`PHI_D_BINS`], or fewer of a table as shaders have it.
    phi_d_bins: usize,
    /// What a texel of 1 stands for on the device, of a table as shaders have it.
    device_scale: f32,
    fingerprint: blake3::Hash,
}

impl std::fmt::Debug for MerlTable {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("MerlTable").field("fingerprint", &self.fingerprint).finish_non_exhaustive()
    }
}

/// The planes of a file, in their order.
const CHANNELS: [&str; 3] = ["red", "green", "blue"];

impl MerlTable {
    /// The table in the bytes of a `.binary` file; the error is what is wrong with them: other dimensions, wrong size, a value that is
    /// not finite, nothing but zeros or invalid cells.
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
                    // What is below the horizon means nothing.
                    let is_above = horizon.is_above(phi_d);
                    if let Some(channel) = (0..3).find(|&channel| is_above && !rgb[channel].is_finite()) {
                        let name = CHANNELS[channel];
                        return Err(format!(
                            "holds {:e} in the {name} cell theta_h {theta_h}, theta_d {theta_d}, phi_d {phi_d}",
                            stored[channel]
                        ));
                    }
                    let valid = is_above && stored.iter().all(|&value| value >= 0.0);
                    let rgb = Vec3::from(rgb).min(Vec3::splat(MOST_MEASURED));
                    texels.push(if valid { rgb.extend(1.0) } else { Vec4::ZERO });
                }
            }
        }
        if texels.iter().all(|texel| texel.truncate() == Vec3::ZERO) {
            // A cell counts where all of its channels do.
            let are_void = [0, 1, 2].map(|channel| (0..CELLS).all(|cell| stored(channel, cell) < 0.0));
            return Err(match are_void.iter().position(|is_void| *is_void) {
                Some(channel) if are_void.contains(&false) => {
                    format!("holds nothing but invalid cells in {}", CHANNELS[channel])
                }
                _ => "holds nothing but zero or invalid cells".to_owned(),
            });
        }
        Ok(Self::from_texels(texels, PHI_D_BINS, 1.0))
    }

    fn from_texels(texels: Vec<Vec4>, phi_d_bins: usize, device_scale: f32) -> Self {
        let mut hasher = blake3::Hasher::new();
        // Line by line: a call for each number adds a seventh to the time of loading.
        for line in texels.chunks(phi_d_bins) {
            let bytes: Vec<u8> = line.iter().flat_map(|texel| texel.to_array()).flat_map(f32::to_le_bytes).collect();
            hasher.update(&bytes);
        }
        Self { texels: texels.into(), phi_d_bins, device_scale, fingerprint: hasher.finalize() }
    }

    /// The table as shaders have it: of the mean of each three cells along phi_d, in half precision.
    pub(crate) fn as_on_device(&self) -> Self {
        let mean = |cells: &[Vec4]| cells.iter().sum::<Vec4>() / BINS_A_TEXEL as f32;
        let cells: Vec<_> = self.texels.chunks_exact(BINS_A_TEXEL).map(mean).collect();
        let greatest = cells.iter().fold(0.0, |greatest: f32, cell| greatest.max(cell.truncate().max_element()));
        // By a power of 2 halves are multiplied without rounding.
        let scale = (greatest / GREATEST_TEXEL as f32).max(f32::MIN_POSITIVE).log2().ceil().exp2();
        let rounded = |cell: &Vec4| of_unit(scale) * Vec4::from_array(half_texel(*cell, scale).map(f16::to_f32));
        Self::from_texels(cells.iter().map(rounded).collect(), DEVICE_TABLE_SIZE[0], scale)
    }

    /// The texels of one that is as shaders have it, for a 3D texture: RGBA = (rgb valid, valid) with f in units of the table's scale and valid 0 to
    /// 1, x fastest. Interpolate all four, then divide rgb by a.
    pub fn device_texels(&self) -> Arc<[[f16; 4]]> {
        self.texels.iter().map(|&texel| half_texel(texel, self.device_scale)).collect()
    }

    /// What glsl/brdf/merl.glsl reads of a table whose first texel lies at this y and z in the atlas.
    pub(crate) fn parameters_at(&self, [y, z]: [usize; 2]) -> [f32; 12] {
        let numbers = [y as f32, z as f32, self.device_scale];
        std::array::from_fn(|i| numbers.get(i).copied().unwrap_or(0.0))
    }
}

/// What a texel on the device stands for, where 1 stands for `scale`: whether it is valid has no unit.
fn of_unit(scale: f32) -> Vec4 {
    Vec4::new(scale, scale, scale, 1.0)
}

fn half_texel(texel: Vec4, scale: f32) -> [f16; 4] {
    half_floats((texel / of_unit(scale)).to_array())
}

/// Tells which cells of one (theta_h, theta_d) have both light and view above the horizon at their centre.
pub(crate) struct Horizon {
    both: f64,
    swing: f64,
}

impl Horizon {
    pub(crate) fn of_bins(theta_h: usize, theta_d: usize) -> Self {
        let x = (theta_h as f64 + 0.5) / THETA_H_BINS as f64;
        let (sin_theta_h, cos_theta_h) = (FRAC_PI_2 * x * x).sin_cos();
        let (sin_theta_d, cos_theta_d) = (FRAC_PI_2 * (theta_d as f64 + 0.5) / THETA_D_BINS as f64).sin_cos();
        Self { both: cos_theta_h * cos_theta_d, swing: sin_theta_h * sin_theta_d }
    }

    /// n . w = cos th cos td -+ sin th sin td cos pd for light and view.
    pub(crate) fn is_above(&self, phi_d: usize) -> bool {
        let phi_d = PI * (phi_d as f64 + 0.5) / PHI_D_BINS as f64;
        self.both - (self.swing * phi_d.cos()).abs() >= 0.0
    }
}

/// Rusinkiewicz angles as positions in index space, where bin i covers [i, i + 1): (theta_h, theta_d, phi_d); of phi_d in half turns.
#[inline]
fn table_coordinate(w_i: DVec3, w_o: DVec3) -> DVec3 {
    // Angles as arc tangents, which take no unit vectors. (Cosines have no digits left near the pole, just where bins are smallest.)
    let h = w_i + w_o;
    let square = h.x * h.x + h.y * h.y;
    let length = (square + h.z * h.z).sqrt();
    let theta_h = acute_angle(square.sqrt(), h.z, length);
    let theta_d = acute_angle((w_i - w_o).length(), length, 2.0);
    // Azimuth of w_i in a frame with h as its pole. The azimuth of a half vector at the pole is arbitrary.
    let (h_x, h_y) = if square > 0.0 { (h.x, h.y) } else { (1.0, 0.0) };
    let d_x = h.z * (w_i.x * h_x + w_i.y * h_y) - square * w_i.z;
    let d_y = length * (w_i.y * h_x - w_i.x * h_y);
    // Reciprocity: phi_d and phi_d + 180 degrees are the same cell, so d may be turned to where y is positive.
    let phi_d = acute_angle(d_y.abs(), d_x.abs(), (d_x * d_x + d_y * d_y).sqrt());
    dvec3(
        THETA_H_BINS as f64 * (theta_h * FRAC_2_PI).sqrt(),
        THETA_D_BINS as f64 * FRAC_2_PI * theta_d,
        FRAC_1_PI * if d_x * d_y < 0.0 { PI - phi_d } else { phi_d },
    )
}

/// The angle in [0, pi/2] of tangent y / x, neither negative, in a triangle of this hypotenuse; 0 if all are 0. To the last
/// digits, in a third of the time of `atan2`. Twin, in single precision: `acute_angle` in glsl/arc_tangent.glsl.
#[inline]
fn acute_angle(y: f64, x: f64, hypotenuse: f64) -> f64 {
    let low = if y < x { y } else { x };
    let high = if y > x { y } else { x };
    // tan(a / 2) = sin a / (1 + cos a): at most tan(22.5 deg). The smallest positive number stands in for 0, to divide by.
    let tangent = low / (high + hypotenuse).max(f64::MIN_POSITIVE);
    let square = tangent * tangent;
    // Even and odd terms side by side: half as long to wait.
    let series = ARC_TANGENT.iter().rev().fold(DVec2::ZERO, |sum, terms| sum * (square * square) + *terms);
    let angle = 2.0 * tangent * (series.x + square * series.y);
    if y > x { FRAC_PI_2 - angle } else { angle }
}

/// atan(t) / t as a polynomial in t^2, two terms at a time, through Chebyshev's nodes of its range, [0, tan^2(22.5 deg)].
const ARC_TANGENT: [DVec2; 5] = [
    dvec2(0.999_999_999_999_999, -0.333_333_333_332_214_3),
    dvec2(0.199_999_999_783_926_63, -0.142_857_126_616_847_93),
    dvec2(0.111_110_488_537_512_96, -0.090_895_299_565_623_07),
    dvec2(0.076_735_354_281_832_85, -0.065_059_829_671_708_4),
    dvec2(0.050_247_621_189_401_28, -0.025_316_479_573_776_477),
];

/// The first of the two bins whose centres enclose `position`, clamped at the ends, and the weight of the second.
#[inline]
fn clamped_pair(position: f64, bins: usize) -> (usize, f32) {
    let x = (position - 0.5).clamp(0.0, (bins - 1) as f64);
    let low = (x as u32).min(bins as u32 - 2);
    (low as usize, (x - f64::from(low)) as f32)
}

/// Where in the table a position lies: its eight cells, and in single precision, as texels are, the weights of the second ones
/// along theta_h, theta_d and phi_d.
struct Place {
    /// Which line along phi_d is the first.
    line: usize,
    /// The cells in each line.
    phi_d: [usize; 2],
    weights: [f32; 3],
}

impl Place {
    #[inline]
    fn of(w_i: DVec3, w_o: DVec3, phi_d_bins: usize) -> Self {
        let position = table_coordinate(w_i, w_o);
        let (theta_h, h_weight) = clamped_pair(position.x, THETA_H_BINS);
        let (theta_d, d_weight) = clamped_pair(position.y, THETA_D_BINS);
        // Half a bin before the first one is after the last.
        let p = phi_d_bins as f64 * position.z;
        let p = if p < 0.5 { p + phi_d_bins as f64 } else { p } - 0.5;
        let p0 = (p as u32).min(phi_d_bins as u32 - 1);
        let p1 = if p0 + 1 == phi_d_bins as u32 { 0 } else { p0 + 1 };
        Self {
            line: theta_d + THETA_D_BINS * theta_h,
            phi_d: [p0 as usize, p1 as usize],
            weights: [h_weight, d_weight, (p - f64::from(p0)) as f32],
        }
    }

    #[inline]
    fn interpolate(&self, texels: &[Vec4], phi_d_bins: usize) -> DVec3 {
        const NEXT_THETA_D: usize = 1;
        const NEXT_THETA_H: usize = THETA_D_BINS;
        let [h, d, p] = self.weights;
        let mut sum = Vec4::ZERO;
        for (offset, weight) in [
            (0, (1.0 - h) * (1.0 - d)),
            (NEXT_THETA_D, (1.0 - h) * d),
            (NEXT_THETA_H, h * (1.0 - d)),
            (NEXT_THETA_H + NEXT_THETA_D, h * d),
        ] {
            let [first, second] = self.phi_d.map(|phi_d| texels[phi_d_bins * (self.line + offset) + phi_d]);
            sum += weight * first.lerp(second, p);
        }
        if sum.w > 0.0 { sum.truncate().as_dvec3() * (1.0 / f64::from(sum.w)) } else { DVec3::ZERO }
    }
}

impl Model for MerlTable {
    const HAS_PARAMETERS: bool = false;

    /// Trilinear between bin centres, clamped in theta_h and theta_d, periodic in phi_d; invalid cells have no weight.
    fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
        Place::of(w_i, w_o, self.phi_d_bins).interpolate(&self.texels, self.phi_d_bins)
    }

    /// Waiting for memory takes half of the time, so it is asked for all at once.
    fn evaluate_all(&self, w_i: &[DVec3], w_o: DVec3) -> Vec<DVec3> {
        let places: Vec<_> = w_i.iter().map(|&w_i| Place::of(w_i, w_o, self.phi_d_bins)).collect();
        places.iter().map(|place| place.interpolate(&self.texels, self.phi_d_bins)).collect()
    }

    fn from_parameters(_: &mut Parameters) -> Result<Self> {
        Err(Error::input("model `merl`", "has no parameters", "name the table with file = \"....binary\" instead"))
    }

    fn hash_content(&self, hasher: &mut blake3::Hasher) {
        hasher.update(self.fingerprint.as_bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_of_the_greatest_numbers_is_one_of_numbers_on_the_device() {
        let mut bytes: Vec<u8> =
            [THETA_H_BINS, THETA_D_BINS, PHI_D_BINS].iter().flat_map(|n| (*n as i32).to_le_bytes()).collect();
        bytes.extend((0..3 * CELLS).flat_map(|_| 3e41_f64.to_le_bytes()));
        let table = MerlTable::from_bytes(&bytes).unwrap().as_on_device();
        let texels = table.device_texels();
        assert!(texels.iter().flatten().all(|value| value.is_finite()) && table.device_scale.is_finite());
    }

    #[test]
    fn acute_angles_are_arc_tangents() {
        assert_eq!(acute_angle(0.0, 0.0, 0.0), 0.0);
        assert_eq!((acute_angle(0.0, 1.0, 1.0), acute_angle(1.0, 0.0, 1.0)), (0.0, FRAC_PI_2));
        for i in 0..=10_000 {
            let angle = FRAC_PI_2 * f64::from(i) / 10_000.0;
            let (y, x) = angle.sin_cos();
            assert!((acute_angle(y, x.max(0.0), 1.0) - angle).abs() < 2e-15, "{angle}");
            let small = 1e-9 * angle;
            let relative = acute_angle(small, 1.0, 1.0) / small.max(f64::MIN_POSITIVE);
            assert!((relative - 1.0).abs() < 1e-12 || i == 0, "{small}");
        }
    }

    /// The form of glsl/arc_tangent.glsl.
    fn acute_angle_in_single_precision(y: f32, x: f32, hypotenuse: f32) -> f32 {
        use crate::shader_constants::arc_tangent::*;
        let tangent = y.min(x) / (y.max(x) + hypotenuse).max(1.2e-38);
        let terms = [ARC_TANGENT_E, ARC_TANGENT_D, ARC_TANGENT_C, ARC_TANGENT_B, ARC_TANGENT_A];
        let angle = 2.0 * tangent * terms.iter().fold(0.0, |series, term| series * tangent * tangent + term);
        if y > x { HALF_PI - angle } else { angle }
    }

    #[test]
    fn acute_angles_of_shaders_are_arc_tangents_to_single_precision() {
        assert_eq!(acute_angle_in_single_precision(0.0, 0.0, 0.0), 0.0);
        let mut worst = 0.0_f64;
        for i in 1..=10_000 {
            let angle = FRAC_PI_2 * f64::from(i) / 10_000.0;
            let (y, x) = angle.sin_cos();
            let found = acute_angle_in_single_precision(y as f32, x.max(0.0) as f32, 1.0);
            worst = worst.max((f64::from(found) / angle - 1.0).abs());
        }
        println!("{worst:.1e}");
        // Three roundings of 6e-8, and 2e-8 of the series.
        assert!(worst < 2.5e-7, "{worst}");
    }
}
