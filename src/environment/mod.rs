//! Distant light from all directions: the lat-long environment, and the function of direction that is its ground truth.
use std::f64::consts::{PI, TAU};
use std::sync::{Arc, OnceLock};

use glam::DVec3;

use crate::files::file_formats;

mod box_filter;
pub mod cube;
mod custom;
mod ggx_pyramid;
mod irradiance;
mod light_map;
mod lights;
mod load;
pub mod moments_file;
mod procedural;
pub mod pyramid;
pub mod pyramid_file;
pub mod sources;
mod vmf_pyramid;

pub use custom::CustomEnvironment;
pub use ggx_pyramid::{FINEST_ALPHA, ggx_pyramid, level_of_alpha};
pub use irradiance::LightMoments;
pub use light_map::{Alias, LightMap};
pub use procedural::builtin_names;
pub use pyramid::{FractionBits, Pyramid};
pub use sources::{LightSource, MAX_SOURCES, SmallSources, SourceRecord};
pub use vmf_pyramid::{BlurKernel, BlurStep, VmfPyramid, width_rad_of};

file_formats!(Environment: hdr_file, exr_file);

/// Columns and rows of a map that filters and small sources do well with. Where a map has fewer, lobes may be narrower than its pixels, and then
/// than the finest blur and the parts of sources.
const FEWEST: [usize; 2] = [128, 64];

/// How many pixels of a picture were no radiance, by the worst that was wrong with each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RepairCounts {
    /// Pixels with a NaN: replaced by the mean of those of their eight neighbours that were whole, or by black.
    pub nan: usize,
    /// Pixels with a channel that is infinite or above 1e30: set to the largest finite value in the picture, but at most to 1e30.
    pub infinite: usize,
    /// Pixels with a negative channel (colours outside Rec. 709, or ringing): set to 0, and what they lacked taken from
    /// their surroundings, so that the light stays the same as a whole.
    pub negative: usize,
}

/// Radiance from every direction, as a lat-long picture: linear, Rec. 709.
///
/// Column and row belong to angles phi = 2 pi (column + 0.5) / width about +Y and theta = pi (row + 0.5) / height from
/// +Y, and these to the direction (sin theta sin phi, cos theta, -sin theta cos phi): the middle of the picture
/// is +Z, its top row +Y.
#[derive(Clone, Debug)]
pub struct Environment {
    /// The built-in's name, or the file's or a program's as it was given.
    pub name: String,
    /// Columns, at least 1.
    pub(crate) width: usize,
    /// Rows, at least 1.
    pub(crate) height: usize,
    /// Radiance at the pixel centres, row by row from the top; finite and not negative. Others are those of another environment:
    /// [`Self::with_texels`].
    pub(crate) texels: Arc<Vec<[f32; 3]>>,
    /// What had to be repaired when it was read.
    pub repaired: RepairCounts,
    /// Made when first asked for.
    small_sources: OnceLock<SmallSources>,
    /// Made when first asked for.
    fingerprint: OnceLock<blake3::Hash>,
}

/// What [`Environment::directions`] gives.
struct Directions<'a> {
    environment: &'a Environment,
    along_horizon: Vec<DVec3>,
}

impl Directions<'_> {
    /// Those of a row, as [`Environment::direction`] has them.
    fn of_row(&self, row: f64) -> impl Iterator<Item = DVec3> {
        let DVec3 { y, z: minus_sin, .. } = self.environment.direction(-0.5, row);
        self.along_horizon.iter().map(move |along_horizon| DVec3 { y, ..-minus_sin * along_horizon })
    }
}

impl Environment {
    /// A picture whose pixels are finite and not negative.
    pub(crate) fn new(
        name: String,
        width: usize,
        height: usize,
        texels: Vec<[f32; 3]>,
        repaired: RepairCounts,
    ) -> Self {
        let texels = Arc::new(texels);
        Self { name, width, height, texels, repaired, small_sources: OnceLock::new(), fingerprint: OnceLock::new() }
    }

    /// Columns and rows, each at least 1.
    pub fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    /// Radiance at the pixel centres, row by row from the top; finite and not negative.
    pub fn texels(&self) -> &[[f32; 3]] {
        &self.texels
    }

    /// The same picture with other `texels`, as many, which are taken as they are.
    #[must_use]
    pub fn with_texels(&self, texels: Vec<[f32; 3]>) -> Self {
        let Self { ref name, width, height, repaired, .. } = *self;
        Self::new(name.clone(), width, height, texels, repaired)
    }

    /// Digest of its size and pixels: of equal ones are only equal environments, but for their names.
    pub fn fingerprint(&self) -> blake3::Hash {
        *self.fingerprint.get_or_init(|| {
            let mut hasher = blake3::Hasher::new();
            for size in [self.width, self.height] {
                hasher.update(&(size as u64).to_le_bytes());
            }
            hasher.update(bytemuck::cast_slice(&self.texels)).finalize()
        })
    }

    /// Its small bright sources.
    pub fn small_sources(&self) -> &SmallSources {
        self.small_sources.get_or_init(|| SmallSources::of(self))
    }

    /// Whether it has any.
    pub fn has_small_sources(&self) -> bool {
        !self.small_sources().nodes.is_empty()
    }

    /// Its small sources alone, or this environment with them cut out.
    pub fn part(&self, of_sources: bool) -> Self {
        let pixels = &self.small_sources().pixels;
        let kept = |(texel, is_source): (&[f32; 3], &bool)| if *is_source == of_sources { *texel } else { [0.0; 3] };
        let texels = self.texels.iter().zip(pixels).map(kept).collect();
        Self::new(self.name.clone(), self.width, self.height, texels, self.repaired)
    }

    /// The same light in more pixels, if it has fewer than `FEWEST` together: an odd number for each along an axis that has fewer. What is
    /// bilinear between the old centres is so between the new ones, of which some are the old, so [`Self::radiance`] stays what it is.
    pub fn in_fine_pixels(self) -> Self {
        let size = [self.width, self.height];
        let is_uniform = || self.texels.iter().all(|texel| texel == &self.texels[0]);
        if self.texels.len() >= FEWEST[0] * FEWEST[1] || is_uniform() {
            return self;
        }
        let times: [usize; 2] = std::array::from_fn(|axis| FEWEST[axis].div_ceil(size[axis]) | 1);
        let [width, height] = std::array::from_fn(|axis| times[axis] * size[axis]);
        let centre = |pixel: usize, axis: usize| (pixel as f64 + 0.5) / times[axis] as f64 - 0.5;
        let radiance = |pixel: usize| self.radiance_at(centre(pixel % width, 0), centre(pixel / width, 1));
        let texels = (0..width * height).map(|pixel| radiance(pixel).as_vec3().to_array()).collect();
        Self::new(self.name, width, height, texels, self.repaired)
    }

    /// The radiance that arrives from `direction` (any length but 0): bilinear between pixel centres, wrapped in u,
    /// clamped at the poles. This function is the environment; everything else approximates it.
    pub fn radiance(&self, direction: DVec3) -> DVec3 {
        let (column, row) = self.pixel(direction);
        self.radiance_at(column, row)
    }

    /// The same from [`Self::direction`] of this column and row, which needs no angles.
    fn radiance_at(&self, x: f64, y: f64) -> DVec3 {
        let (left, top) = (x.floor(), y.floor());
        let row = |row: f64| {
            self.texel(left as isize, row as isize).lerp(self.texel(left as isize + 1, row as isize), x - left)
        };
        row(top).lerp(row(top + 1.0), y - top)
    }

    /// The direction of a pixel's centre, unit; fractions name points between the centres.
    pub fn direction(&self, column: f64, row: f64) -> DVec3 {
        let phi = TAU * (column + 0.5) / self.width as f64;
        let theta = PI * (row + 0.5) / self.height as f64;
        DVec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos())
    }

    /// The directions of these columns in any row. Sines take longer than most of what is done with a direction, so each is taken once: of columns
    /// along the horizon, where theta has the sine 1, of rows at phi = 0.
    fn directions(&self, columns: impl Iterator<Item = f64>) -> Directions<'_> {
        let horizon = self.height as f64 / 2.0 - 0.5;
        Directions { environment: self, along_horizon: columns.map(|column| self.direction(column, horizon)).collect() }
    }

    /// Where in a lat-long picture `direction` (any length but 0) is seen: parts of its width and height, 0 to 1.
    pub fn lat_long(direction: DVec3) -> [f64; 2] {
        let [phi, theta] = angles(direction);
        [(phi / TAU).rem_euclid(1.0), theta / PI]
    }

    /// The solid angle of one pixel of `row`, in sr; over the whole picture they sum to 4 pi.
    pub fn solid_angle(&self, row: usize) -> f64 {
        let edge = |row: usize| (PI * row as f64 / self.height as f64).cos();
        TAU / self.width as f64 * (edge(row) - edge(row + 1))
    }

    /// The integral of a pixel's bilinear weight over the sphere, in sr: the share that a pixel of `row` has in the energy
    /// of [`Self::radiance`]. It differs from [`Self::solid_angle`] where the sine of theta bends: most at the poles.
    pub fn weight_solid_angle(&self, row: usize) -> f64 {
        weight_solid_angle(self.width, self.height, row)
    }

    /// The mean of [`Self::radiance`] over the sphere.
    pub fn mean_radiance(&self) -> DVec3 {
        let rows = self.texels.chunks_exact(self.width).enumerate();
        rows.map(|(row, texels)| self.weight_solid_angle(row) * texels.iter().map(to_dvec3).sum::<DVec3>())
            .sum::<DVec3>()
            / (4.0 * PI)
    }

    /// The largest value of any channel.
    pub fn max_radiance(&self) -> f64 {
        f64::from(self.texels.iter().flatten().copied().fold(0.0, f32::max))
    }

    /// The pixel at `column`, wrapped, and `row`, clamped.
    fn texel(&self, column: isize, row: isize) -> DVec3 {
        let column = column.rem_euclid(self.width as isize) as usize;
        let row = row.clamp(0, self.height as isize - 1) as usize;
        to_dvec3(&self.texels[row * self.width + column])
    }

    /// Column and row of `direction`; whole numbers are pixel centres.
    fn pixel(&self, direction: DVec3) -> (f64, f64) {
        let [phi, theta] = angles(direction);
        (phi / TAU * self.width as f64 - 0.5, theta / PI * self.height as f64 - 0.5)
    }
}

/// phi, -pi to pi, and theta of `direction`.
fn angles(direction: DVec3) -> [f64; 2] {
    let DVec3 { x, y, z } = direction;
    [x.atan2(-z), (x * x + z * z).sqrt().atan2(y)]
}

/// [`Environment::weight_solid_angle`] of a map of so many columns and rows.
fn weight_solid_angle(width: usize, height: usize, row: usize) -> f64 {
    let centre = |row: usize| PI * (row as f64 + 0.5) / height as f64;
    let step = PI / height as f64;
    // Integrals of sin theta times a ramp from 0 to 1 (up) or 1 to 0 (down), by parts.
    let up = |from: f64, to: f64| (to.sin() - from.sin()) / step - to.cos();
    let down = |from: f64, to: f64| from.cos() - (to.sin() - from.sin()) / step;
    let above = if row == 0 { 1.0 - centre(0).cos() } else { up(centre(row - 1), centre(row)) };
    let below = if row + 1 == height { 1.0 + centre(row).cos() } else { down(centre(row), centre(row + 1)) };
    TAU / width as f64 * (above + below)
}

fn to_dvec3(texel: &[f32; 3]) -> DVec3 {
    DVec3::from_array(texel.map(f64::from))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::farthest::Farthest;

    /// An environment of the given pixels, for tests.
    pub(crate) fn environment(width: usize, height: usize, texel: impl Fn(usize, usize) -> [f32; 3]) -> Environment {
        let texels = (0..width * height).map(|i| texel(i % width, i / width)).collect();
        Environment::new("test".into(), width, height, texels, RepairCounts::default())
    }

    /// A file of the reference images' folder, or nothing where it is absent.
    pub(crate) fn reference_environment(name: &str) -> Option<Environment> {
        let path = crate::files::measured(&format!("../reference/env/{name}"))?;
        Some(Environment::load(&path).unwrap())
    }

    #[test]
    fn directions_follow_the_convention() {
        let sky = environment(8, 4, |_, _| [1.0; 3]);
        for (column, row, expected) in [
            (3.5, 1.5, DVec3::Z),
            (-0.5, 1.5, DVec3::NEG_Z),
            (1.5, 1.5, DVec3::X),
            (5.5, 1.5, DVec3::NEG_X),
            (2.0, -0.5, DVec3::Y),
            (2.0, 3.5, DVec3::NEG_Y),
        ] {
            assert!((sky.direction(column, row) - expected).length() < 1e-15, "{column} {row}");
            let [u, v] = Environment::lat_long(expected);
            assert!((v - (row + 0.5) / 4.0).abs() < 1e-15, "{column} {row}");
            // At the poles every column is as good.
            assert!(expected.y != 0.0 || (u - (column + 0.5) / 8.0).abs() < 1e-15, "{column} {row}");
        }
    }

    #[test]
    fn directions_of_a_row_are_those_of_its_pixels() {
        for (width, height) in [(64, 32), (7, 5), (1, 1)] {
            let sky = environment(width, height, |_, _| [1.0; 3]);
            let columns = || (0..2 * width).map(|column| column as f64 / 2.0 - 0.25);
            let directions = sky.directions(columns());
            for row in (0..=2 * height).map(|row| row as f64 / 2.0 - 0.5) {
                for (column, found) in columns().zip(directions.of_row(row)) {
                    assert!((found - sky.direction(column, row)).length() < 1e-15, "{column} {row}");
                }
            }
        }
    }

    #[test]
    fn radiance_at_a_pixel_centre_is_the_pixel_and_between_them_bilinear() {
        let map = environment(7, 5, |column, row| [column as f32, row as f32, 1.0]);
        for row in 0..5 {
            for column in 0..7 {
                let radiance = map.radiance(map.direction(column as f64, row as f64));
                assert!((radiance - DVec3::new(column as f64, row as f64, 1.0)).length() < 1e-12);
            }
        }
        let between = map.radiance(map.direction(2.25, 1.75));
        assert!((between - DVec3::new(2.25, 1.75, 1.0)).length() < 1e-12);
        let wrapped = map.radiance(map.direction(6.5, 2.0));
        assert!((wrapped - DVec3::new(3.0, 2.0, 1.0)).length() < 1e-12);
        let pole = map.radiance(map.direction(3.0, -0.4));
        assert!((pole - DVec3::new(3.0, 0.0, 1.0)).length() < 1e-9);
    }

    #[test]
    fn a_small_map_has_the_same_light_in_more_pixels() {
        for (width, height) in [(1, 2), (3, 2), (7, 5), (64, 32), (64, 64), (127, 63), (1, 900)] {
            let texel = |column: usize, row: usize| [0.1 + (column * 7 + row * 3) as f32 % 5.0, column as f32, 1e6];
            let map = environment(width, height, texel);
            let fine = map.clone().in_fine_pixels();
            assert!(fine.width >= 128 && fine.height >= 64 && fine.texels.len() < 120_000, "{width} x {height}");
            for i in 0..5000 {
                let (column, row) = (f64::from(i) * 0.618 % 1.0, f64::from(i) / 5000.0);
                let direction = map.direction(column * width as f64 - 0.5, row * height as f64 - 0.5);
                let [expected, found] = [&map, &fine].map(|map| map.radiance(direction));
                let error = (found - expected).abs() / expected.max(DVec3::ONE);
                assert!(error.farthest() < 1e-6, "{width} x {height}, {direction}: {found} {expected}");
            }
        }
        for (width, height, texel) in [(128, 64, 1.0), (9000, 1, 1.0), (300, 150, 1.0), (8, 4, 0.0)] {
            let map = environment(width, height, |column, row| [texel * (column + row) as f32; 3]);
            assert_eq!(map.clone().in_fine_pixels().fingerprint(), map.fingerprint());
        }
    }

    #[test]
    fn solid_angles_sum_to_the_sphere() {
        for (width, height) in [(1, 1), (3, 2), (7, 5), (64, 32), (1, 9)] {
            let map = environment(width, height, |_, _| [1.0; 3]);
            let sum = |solid_angle: &dyn Fn(usize) -> f64| width as f64 * (0..height).map(solid_angle).sum::<f64>();
            assert!((sum(&|row| map.solid_angle(row)) - 4.0 * PI).abs() < 1e-12);
            assert!((sum(&|row| map.weight_solid_angle(row)) - 4.0 * PI).abs() < 1e-12);
            assert!((map.mean_radiance() - DVec3::ONE).length() < 1e-12);
        }
    }

    #[test]
    fn mean_radiance_is_the_integral_of_radiance() {
        let map =
            environment(5, 4, |column, row| [(column * row) as f32, row as f32, if row == 0 { 9.0 } else { 0.0 }]);
        let (mut sum, n) = (DVec3::ZERO, 800);
        for i in 0..n {
            for j in 0..n {
                let (cos_theta, phi) = (2.0 * (i as f64 + 0.5) / n as f64 - 1.0, TAU * (j as f64 + 0.5) / n as f64);
                let sin_theta = (1.0 - cos_theta * cos_theta).sqrt();
                sum += map.radiance(DVec3::new(sin_theta * phi.sin(), cos_theta, -sin_theta * phi.cos()));
            }
        }
        assert!((sum / (n * n) as f64 - map.mean_radiance()).length() < 1e-4);
    }

    #[test]
    fn radiance_matches_the_independent_renderer() {
        for (name, direction, expected) in [
            ("proc_sun.exr", [0.6, 0.64, 0.48], [0.245975, 0.332080, 0.559877]),
            ("sunset.exr", [-0.48, 0.6, 0.64], [1.605060, 1.621292, 1.903696]),
        ] {
            let Some(map) = reference_environment(name) else { continue };
            let error = map.radiance(DVec3::from_array(direction)) - DVec3::from_array(expected);
            assert!(error.farthest() < 5e-6, "{name} {error}");
        }
    }
}
