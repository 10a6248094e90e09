//! The box-filtered pyramid: the environment's mean over ever larger texels of a cube map, as the paper's method looks it
//! up (Colbert and Krivanek 2007), with the CPU twin of the GPU's seamless trilinear fetch.
use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};
use half::f16;
use rayon::prelude::*;

use super::box_filter::BoxFilter;
use super::cube::{self, direction_of, exact_texel_solid_angle, face_of};
use super::{Environment, to_dvec3};
use crate::error::Result;
use crate::progress::Observer;
use crate::vector_math::half_floats;

/// Level 0 is no finer than this: 6 x 1024^2 texels of 16 bytes are 96 MiB.
pub(super) const MAX_FACE_SIZE: usize = 1024;

/// A scale beyond this would push dim light, below 0.004, into the subnormal half floats, where steps become visible.
const MOST_HALF_SCALE: f32 = 64.0;

/// Light below this is dim: half floats have less than half of their range for it.
const DIM: f64 = 1.0 / 64.0;

/// Of a scale that single precision holds, and its inverse.
const LEAST_EXPONENT: f64 = -120.0;

/// In how many bits a device has the fractions by which a lookup blends texels and levels: at least 4 (Vulkan's `subTexelPrecisionBits` and
/// `mipmapPrecisionBits`), as a rule 8.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct FractionBits {
    /// Between texels, along each axis.
    pub texel: u32,
    /// Between levels.
    pub level: u32,
}

impl FractionBits {
    /// All that there are.
    pub const ALL: Self = Self { texel: f64::MANTISSA_DIGITS, level: f64::MANTISSA_DIGITS };
}

/// The nearest of 2^`bits` steps.
fn rounded(fraction: f64, bits: u32) -> f64 {
    if bits >= f64::MANTISSA_DIGITS {
        return fraction;
    }
    let steps = f64::from(1_u32 << bits);
    (fraction * steps).round() / steps
}

/// A cube map with its levels, each half the size of the one before; those that are box-filtered go down to one texel a face.
#[derive(Clone, Debug, PartialEq)]
pub struct Pyramid {
    /// Texels along the edge of a face at level 0; a power of two.
    pub face_size: usize,
    /// Radiance per level: six faces in the order +X -X +Y -Y +Z -Z, each row by row, oriented as Vulkan has them.
    pub levels: Vec<Vec<[f32; 3]>>,
}

impl Pyramid {
    /// The means of [`Environment::radiance`] over the solid angles of the texels. Constants stay constant to the bit,
    /// and the energy of a single bright pixel arrives to 1e-3 wherever it is.
    pub fn box_filtered(environment: &Environment) -> Self {
        Self::box_filtered_to(environment, Self::face_size_for(environment), &()).expect("nobody cancels")
    }

    /// Texels along the edge of a face, such that one at its middle, 2 / face_size rad, is no larger than a pixel at the equator,
    /// 2 pi / width and pi / height.
    pub fn face_size_for(environment: &Environment) -> usize {
        let pixels = (environment.width.max(2 * environment.height) as f64 / PI).ceil() as usize;
        pixels.next_power_of_two().clamp(1, MAX_FACE_SIZE)
    }

    /// The same with faces of this size, a power of two; the only error is that `observer` cancels it.
    pub fn box_filtered_to(environment: &Environment, face_size: usize, observer: &dyn Observer) -> Result<Self> {
        // Of a face of one texel the mean is that of four, which meet at the poles.
        let finest_size = face_size.max(2);
        let mut levels = vec![finest_level(environment, finest_size, observer)?];
        for size in (0..finest_size.ilog2()).rev().map(|log2| 1 << log2) {
            levels.push(coarser_level(levels.last().expect("there is level 0"), size));
        }
        Ok(Self { face_size, levels: levels.split_off((face_size == 1).into()) })
    }

    /// Texels along the edge of a face at `level`.
    pub fn size_of(&self, level: usize) -> usize {
        self.face_size >> level
    }

    /// The CPU twin of a seamless trilinear cube map fetch: bilinear in each of the two nearest levels, across the edges of
    /// faces too (the average of the three texels at a corner), and linear between the levels. `level` is clamped.
    pub fn lookup(&self, direction: Vec3, level: f32) -> Vec3 {
        self.lookup_by(direction, level, FractionBits::ALL)
    }

    /// The same by fractions of so many bits.
    pub fn lookup_by(&self, direction: Vec3, level: f32, bits: FractionBits) -> Vec3 {
        let direction = direction.as_dvec3();
        let level = f64::from(level).clamp(0.0, (self.levels.len() - 1) as f64);
        let (finer, fraction) = (level as usize, rounded(level.fract(), bits.level));
        let radiance = self.lookup_level(direction, finer, bits.texel);
        if fraction == 0.0 {
            return radiance.as_vec3();
        }
        radiance.lerp(self.lookup_level(direction, finer + 1, bits.texel), fraction).as_vec3()
    }

    /// The level whose texels around the unit `direction` have `solid_angle` (sr), clamped to those that there are.
    pub fn level_of(&self, solid_angle: f32, direction: Vec3) -> f32 {
        let texel = cube::texel_solid_angle(self.face_size, direction.as_dvec3());
        let level = 0.5 * (f64::from(solid_angle) / texel).log2();
        level.clamp(0.0, (self.levels.len() - 1) as f64) as f32
    }

    /// The power of two by which radiance is divided so that half floats can hold it; 1 where they can as it is. Light that is all dim is
    /// brought up to 1: below 6e-5 half floats lose bits, and below 6e-8 all of it.
    pub fn radiance_scale(&self) -> f32 {
        let max = self.brightest();
        let exponent = match max {
            0.0 => 0.0,
            max if max < DIM => max.log2().ceil().max(LEAST_EXPONENT),
            max => (max / f16::MAX.to_f64()).log2().ceil().max(0.0),
        };
        exponent.exp2() as f32
    }

    fn brightest(&self) -> f64 {
        f64::from(self.levels[0].iter().flatten().copied().fold(0.0, f32::max))
    }

    /// Whether half floats serve for radiance over `scale`, which may be that of brighter light: for what is not all dim, and by no scale that
    /// makes dim light of the rest. Otherwise use [`Self::texels_rgba32f`].
    pub fn fits_half(&self, scale: f32) -> bool {
        let brightest = self.brightest();
        scale <= MOST_HALF_SCALE && (brightest == 0.0 || brightest / f64::from(scale) >= DIM)
    }

    /// Texels of a level divided by `scale` (see [`Self::radiance_scale`]), alpha 1, for the GPU.
    pub fn texels_rgba16f(&self, level: usize, scale: f32) -> Vec<[f16; 4]> {
        self.levels[level].par_iter().map(|&[r, g, b]| half_floats([r / scale, g / scale, b / scale, 1.0])).collect()
    }

    /// What the GPU has of it where it has half floats of radiance over `scale`.
    pub fn in_half_floats(&self, scale: f32) -> Self {
        let decode = |[r, g, b, _]: [f16; 4]| [r, g, b].map(|value| scale * value.to_f32());
        let level = |level| self.texels_rgba16f(level, scale).into_iter().map(decode).collect();
        Self { face_size: self.face_size, levels: (0..self.levels.len()).map(level).collect() }
    }

    /// Texels of a level divided by `scale`, alpha 1, for the GPU.
    pub fn texels_rgba32f(&self, level: usize, scale: f32) -> Vec<[f32; 4]> {
        self.levels[level].par_iter().map(|&[r, g, b]| [r / scale, g / scale, b / scale, 1.0]).collect()
    }

    /// Bilinear in one level, by fractions of so many bits.
    fn lookup_level(&self, direction: DVec3, level: usize, bits: u32) -> DVec3 {
        let size = self.size_of(level);
        let (face, s, t) = face_of(direction);
        let (x, y) = (s * size as f64 - 0.5, t * size as f64 - 0.5);
        let (left, top) = (x.floor(), y.floor());
        let taps = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)]
            .map(|(right, down)| self.texel_across_edges(level, face, left + right, top + down));
        // Beyond the corner of the cube there is no texel: the average of the other three stands for it.
        let corner = taps.iter().flatten().sum::<DVec3>() / 3.0;
        let [top_left, top_right, bottom_left, bottom_right] = taps.map(|tap| tap.unwrap_or(corner));
        let [right, down] = [x - left, y - top].map(|fraction| rounded(fraction, bits));
        top_left.lerp(top_right, right).lerp(bottom_left.lerp(bottom_right, right), down)
    }

    /// The texel at whole coordinates that may lie one beyond the face; none beyond its corner.
    fn texel_across_edges(&self, level: usize, face: usize, column: f64, row: f64) -> Option<DVec3> {
        let size = self.size_of(level);
        let inside = |coordinate: f64| (0.0..size as f64).contains(&coordinate);
        let (face, column, row) = match (inside(column), inside(row)) {
            (true, true) => (face, column as usize, row as usize),
            (false, false) => return None,
            _ => {
                // One step beyond the edge in the plane of this face falls, seen from the centre, on the right texel of the
                // neighbour: its coordinate along the edge shrinks by less than half a texel.
                let centre = |coordinate: f64| (coordinate + 0.5) / size as f64;
                let (face, s, t) = face_of(direction_of(face, centre(column), centre(row)));
                let index = |coordinate: f64| ((coordinate * size as f64) as usize).min(size - 1);
                (face, index(s), index(t))
            }
        };
        Some(to_dvec3(&self.levels[level][(face * size + row) * size + column]))
    }
}

/// Level 0: the means over the solid angles of the texels.
fn finest_level(environment: &Environment, face_size: usize, observer: &dyn Observer) -> Result<Vec<[f32; 3]>> {
    let (filter, lit) = (BoxFilter::new(environment, face_size), LitCells::new(environment, face_size));
    let texel = |texel: usize| {
        observer.check()?;
        let (face, row, column) = (texel / face_size / face_size, texel / face_size % face_size, texel % face_size);
        if !lit.reach(face, row, column) {
            return Ok([0.0; 3]);
        }
        Ok(filter.mean_over_texel(face, row, column).as_vec3().to_array())
    };
    (0..6 * face_size * face_size).into_par_iter().map(texel).collect()
}

/// Which cells of a cube map light reaches: of a few lamps alone, hardly any.
struct LitCells {
    /// Along the edge of a face.
    count: usize,
    /// Face by face, row by row; none if these are all.
    are_lit: Option<Vec<bool>>,
}

impl LitCells {
    /// Texels along the edge of a cell.
    const TEXELS: usize = 16;
    /// Pixels along the edge of a tile of the picture.
    const PIXELS: usize = 8;

    fn new(environment: &Environment, face_size: usize) -> Self {
        let count = face_size.div_ceil(Self::TEXELS);
        let &Environment { width, height, .. } = environment;
        let across = width.div_ceil(Self::PIXELS);
        let mut are_lit = vec![false; across * height.div_ceil(Self::PIXELS)];
        for (pixel, radiance) in environment.texels.iter().enumerate() {
            are_lit[pixel / width / Self::PIXELS * across + pixel % width / Self::PIXELS] |= *radiance != [0.0; 3];
        }
        if are_lit.iter().all(|&is_lit| is_lit) {
            return Self { count, are_lit: None };
        }
        let centre = |index: usize| (index as f64 + 0.5) * Self::PIXELS as f64 - 0.5;
        let tiles = (0..are_lit.len()).filter(|&tile| are_lit[tile]);
        let tiles: Vec<_> =
            tiles.map(|tile| environment.direction(centre(tile % across), centre(tile / across))).collect();
        // A tile's half, and the pixel beside it.
        let pixel_rad = (PI / height as f64).hypot(TAU / width as f64);
        let reach = (0.5 * Self::PIXELS as f64 + 1.0) * pixel_rad;
        let is_lit = |cell: usize| {
            let (face, row, column) = (cell / count / count, cell / count % count, cell % count);
            let at = |along: f64, down: f64| {
                let part = |index: usize, offset: f64| (index as f64 + offset) * Self::TEXELS as f64 / face_size as f64;
                direction_of(face, part(column, along), part(row, down))
            };
            let middle = at(0.5, 0.5);
            let corners = [at(0.0, 0.0), at(0.0, 1.0), at(1.0, 0.0), at(1.0, 1.0)];
            let radius = corners.map(|corner| corner.angle_between(middle)).into_iter().fold(0.0, f64::max);
            let least_cos = (radius + reach).min(PI).cos();
            tiles.iter().any(|tile| tile.dot(middle) >= least_cos)
        };
        Self { count, are_lit: Some((0..6 * count * count).into_par_iter().map(is_lit).collect()) }
    }

    /// Whether light reaches this texel.
    fn reach(&self, face: usize, row: usize, column: usize) -> bool {
        let cell = |are_lit: &Vec<bool>| {
            are_lit[(face * self.count + row / Self::TEXELS) * self.count + column / Self::TEXELS]
        };
        self.are_lit.as_ref().is_none_or(cell)
    }
}

/// The level of faces of `size` from the `finer` one of twice the size: means of four, weighed by solid angle.
fn coarser_level(finer: &[[f32; 3]], size: usize) -> Vec<[f32; 3]> {
    let solid_angles: Vec<f64> = (0..4 * size * size)
        .into_par_iter()
        .map(|texel| exact_texel_solid_angle(2 * size, texel % (2 * size), texel / (2 * size)))
        .collect();
    (0..6 * size * size)
        .into_par_iter()
        .map(|texel| {
            let (face, row, column) = (texel / size / size, texel / size % size, texel % size);
            let (mut sum, mut weight_sum) = (DVec3::ZERO, 0.0);
            for (right, down) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let child = (2 * row + down) * 2 * size + 2 * column + right;
                let weight = solid_angles[child];
                sum += weight * to_dvec3(&finer[face * 4 * size * size + child]);
                weight_sum += weight;
            }
            (sum / weight_sum).as_vec3().to_array()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::tests::{environment, reference_environment};
    use super::*;
    use crate::farthest::Farthest;
    use std::sync::Arc;

    /// The mean over the sphere of a level.
    fn mean(pyramid: &Pyramid, level: usize) -> DVec3 {
        let size = pyramid.size_of(level);
        let texels = pyramid.levels[level].iter().enumerate();
        texels
            .map(|(i, texel)| exact_texel_solid_angle(size, i % size, i / size % size) * to_dvec3(texel))
            .sum::<DVec3>()
            / (4.0 * PI)
    }

    fn assert_energy(environment: &Environment, tolerance: f64) {
        let pyramid = Pyramid::box_filtered(environment);
        let expected = environment.mean_radiance();
        for level in 0..pyramid.levels.len() {
            let error = ((mean(&pyramid, level) - expected) / expected).farthest();
            assert!(error < tolerance, "{}: level {level} misses {error:e} of the energy", environment.name);
        }
    }

    #[test]
    fn a_map_of_more_rows_than_columns_is_as_sharp_as_its_rows() {
        let horizon = environment(16, 512, |_, y| [f32::from(u8::from(y < 256)); 3]);
        let up = |deg: f32| Vec3::new(0.1, deg.to_radians().tan(), 1.0).normalize();
        let pyramid = Pyramid::box_filtered(&horizon);
        let [above, below] = [1.5, -1.5].map(|deg| pyramid.lookup(up(deg), 0.0).x);
        assert!(above > 0.95 && below < 0.05, "{above} {below}");
    }

    #[test]
    fn a_constant_stays_exactly_constant() {
        for (width, height) in [(1, 1), (3, 2), (7, 5), (64, 32)] {
            let pyramid = Pyramid::box_filtered(&environment(width, height, |_, _| [1.0, 0.1, 1e6]));
            assert!(pyramid.levels.iter().flatten().all(|texel| *texel == [1.0, 0.1, 1e6]), "{width}x{height}");
            for i in 0..1000 {
                let direction = Vec3::new((i as f32).sin(), (1.7 * i as f32).cos(), (0.3 * i as f32).sin() + 0.01);
                let radiance = pyramid.lookup(direction, i as f32 * 0.007 - 0.5);
                assert!((radiance / Vec3::new(1.0, 0.1, 1e6) - 1.0).farthest() < 2e-7);
            }
        }
    }

    #[test]
    fn every_level_holds_the_energy_of_the_built_ins() {
        for name in super::super::builtin_names() {
            let mut full = Environment::builtin(name).unwrap();
            // A quarter of the rows and columns: as hard, and faster.
            let (width, height) = ((full.width / 4).max(1), (full.height / 4).max(1));
            let step = full.width / width;
            let texel = |i| full.texels[(i / width * step) * full.width + i % width * step];
            full.texels = Arc::new((0..width * height).map(texel).collect());
            (full.width, full.height) = (width, height);
            assert_energy(&full, 1e-4);
        }
    }

    #[test]
    fn every_level_holds_the_energy_of_real_environments() {
        for name in ["proc_sun.exr", "sunset.exr"] {
            if let Some(map) = reference_environment(name) {
                assert_energy(&map, 1e-4);
            }
        }
    }

    #[test]
    fn one_bright_pixel_keeps_its_energy_wherever_it_is() {
        let (width, height) = (256, 128);
        for (column, row) in [
            (222, 6),
            (159, 21),
            (227, 9),
            (16, 33),
            (200, 90),
            (255, 127),
            (100, 124),
            (64, 63),
            (32, 40),
            (0, 0),
            (77, 0),
            (5, 1),
            (32, 31),
            (16, 21),
            (127, 40),
            (48, 32),
            (90, 62),
            (3, 63),
        ] {
            let map = environment(width, height, |x, y| [if (x, y) == (column, row) { 1e6 } else { 0.0 }; 3]);
            let pyramid = Pyramid::box_filtered(&map);
            let error = mean(&pyramid, 0).x / map.mean_radiance().x - 1.0;
            assert!(error.abs() < 1e-3, "pixel ({column}, {row}): {error:e}");
        }
    }

    #[test]
    fn lamps_alone_are_what_they_add_to_other_light() {
        for (width, height) in [(256, 128), (100, 33), (16, 8)] {
            let spots = [(width / 4, height / 3), (width - 1, 0), (0, height - 1), (width / 2, height / 2)];
            let filtered = |background: f32| {
                let lit = |x, y| [background + if spots.contains(&(x, y)) { 100.0 } else { 0.0 }; 3];
                Pyramid::box_filtered(&environment(width, height, lit))
            };
            let [alone, beside] = [0.0, 1.0].map(filtered);
            for (alone, beside) in alone.levels.iter().flatten().zip(beside.levels.iter().flatten()) {
                assert!(
                    (alone[0] + 1.0 - beside[0]).abs() < 1e-6 * beside[0],
                    "{width}x{height}: {alone:?} {beside:?}"
                );
            }
        }
    }

    #[test]
    fn level_0_follows_the_environment() {
        let mut map = environment(64, 32, |_, _| [0.0; 3]);
        for i in 0..64 * 32 {
            let direction = map.direction((i % 64) as f64, (i / 64) as f64);
            Arc::make_mut(&mut map.texels)[i] =
                [1.0 + direction.x * direction.z, 1.0 + direction.y.powi(3), 0.5].map(|value| value as f32);
        }
        let pyramid = Pyramid::box_filtered(&map);
        for i in 0..2000 {
            let z: f64 = 1.0 - (f64::from(i) + 0.5) / 1000.0;
            let angle = f64::from(i) * 2.4;
            let direction = DVec3::new(angle.cos() * (1.0 - z * z).sqrt(), z, angle.sin() * (1.0 - z * z).sqrt());
            let error = (pyramid.lookup(direction.as_vec3(), 0.0).as_dvec3() - map.radiance(direction)).abs();
            // The means over texels of 0.06 rad, blurred once more by the lookup.
            assert!(error.farthest() < 0.015, "{direction}: {error}");
        }
    }

    #[test]
    fn texels_are_means_over_their_solid_angles() {
        for (width, height, face_size) in [(96, 48, 16), (37, 11, 8), (16, 8, 32), (300, 3, 4), (2, 1, 1)] {
            let lamp = |x: usize, y: usize| if (x * 7 + y * 13).is_multiple_of(29) { 100.0 } else { 0.0 };
            let map = environment(width, height, |x, y| [lamp(x, y), (x % 5) as f32, (y % 3) as f32]);
            let pyramid = Pyramid::box_filtered_to(&map, face_size, &()).unwrap();
            assert_eq!(pyramid.levels.len(), face_size.ilog2() as usize + 1);
            let points = 128 + 8 * width / face_size;
            for texel in (0..pyramid.levels[0].len()).step_by(face_size.min(7)) {
                let (face, row, column) =
                    (texel / face_size / face_size, texel / face_size % face_size, texel % face_size);
                let (mut sum, mut weight_sum) = (DVec3::ZERO, 0.0);
                for point in 0..points * points {
                    let at = |index: usize, point: usize| {
                        (index as f64 + (point as f64 + 0.5) / points as f64) / face_size as f64
                    };
                    let point = cube::point_of(face, at(column, point % points), at(row, point / points));
                    let weight = point.length_recip().powi(3);
                    sum += weight * map.radiance(point);
                    weight_sum += weight;
                }
                let error = (to_dvec3(&pyramid.levels[0][texel]) - sum / weight_sum) / DVec3::new(100.0, 4.0, 2.0);
                assert!(error.farthest() < 0.0005, "{width}x{height}: {face} {row} {column}: {error}");
            }
        }
    }

    #[test]
    fn poles_and_axes_are_where_the_convention_says() {
        let lit = |axis: DVec3| {
            let mut map = environment(64, 32, |_, _| [0.0; 3]);
            for i in 0..64 * 32 {
                let direction = map.direction((i % 64) as f64, (i / 64) as f64);
                Arc::make_mut(&mut map.texels)[i] = [if direction.dot(axis) > 0.9 { 1.0 } else { 0.0 }; 3];
            }
            Pyramid::box_filtered(&map)
        };
        let axes = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
        for (face, axis) in axes.into_iter().enumerate() {
            let pyramid = lit(axis);
            let coarsest = &pyramid.levels[pyramid.levels.len() - 1];
            assert!((0..6).all(|other| (coarsest[other][0] > 0.1) == (other == face)), "face {face}");
            assert_eq!(pyramid.lookup(axis.as_vec3(), 0.0), Vec3::ONE);
        }
    }

    #[test]
    fn lookups_have_no_seam() {
        let map = environment(32, 16, |x, y| [((x * 7 + y * 5) % 11) as f32, (x % 3) as f32, (y % 4) as f32]);
        let pyramid = Pyramid::box_filtered(&map);
        let corner = DVec3::ONE.normalize();
        let axes = [
            DVec3::X,
            DVec3::Y,
            DVec3::Z,
            DVec3::new(1.0, 1.0, 0.0),
            DVec3::new(1.0, -1.0, 0.0),
            DVec3::new(0.0, 1.0, 1.0),
            DVec3::new(1.0, 0.0, -1.0),
            DVec3::new(0.3, 0.8, -0.4),
        ];
        let circle = |axis: DVec3, cos: f64, angle: f64| {
            let (u, v) = axis.normalize().any_orthonormal_pair();
            let sin = f64::sqrt(1.0 - cos * cos);
            (cos * axis.normalize() + sin * (angle.cos() * u + angle.sin() * v)).as_vec3()
        };
        // Great circles cross edges, corners, poles and the wrap; small ones go round corners and poles.
        for (axis, cos) in axes.map(|axis| (axis, 0.0)).into_iter().chain([(corner, 0.999), (DVec3::Y, 0.9999)]) {
            for level in [0.0, 0.5, 1.0, 2.3, 3.0] {
                let steps = 4000;
                let step_rad = TAU / f64::from(steps) * f64::sqrt(1.0 - cos * cos);
                let size = pyramid.face_size as f64 / f64::from(level).floor().exp2();
                // Neighbouring texels differ by at most 11 over an angle of at least 1 / size, twice that diagonally.
                let largest = 2.0 * 11.0 * step_rad * size * 3f64.sqrt() + 1e-5;
                for i in 0..steps {
                    let at = |i: i32| pyramid.lookup(circle(axis, cos, TAU * f64::from(i) / f64::from(steps)), level);
                    let change = (at(i + 1) - at(i)).farthest();
                    assert!(f64::from(change) < largest, "axis {axis}, step {i}, level {level}: {change} > {largest}");
                }
            }
        }
    }

    #[test]
    fn levels_and_solid_angles_are_inverse() {
        let pyramid = Pyramid::box_filtered(&environment(256, 128, |_, _| [1.0; 3]));
        assert_eq!((pyramid.face_size, pyramid.levels.len()), (128, 8));
        for direction in [Vec3::X, Vec3::new(0.6, -0.8, 0.0), Vec3::splat(-1.0).normalize()] {
            for level in 0..8 {
                let solid_angle = cube::texel_solid_angle(pyramid.size_of(level), direction.as_dvec3()) as f32;
                assert!((pyramid.level_of(solid_angle, direction) - level as f32).abs() < 1e-5);
            }
            assert_eq!(pyramid.level_of(0.0, direction), 0.0);
            assert_eq!(pyramid.level_of(12.6, direction), 7.0);
        }
    }

    #[test]
    fn half_floats_neither_overflow_nor_lose_light_that_is_all_dim() {
        for (value, scale, fits) in [
            (0.0, 1.0, true),
            (1e-30, 0.0, true),
            (1e-3, 0.0, true),
            (0.02, 1.0, true),
            (65504.0, 1.0, true),
            (65505.0, 2.0, true),
            (1e6, 16.0, true),
            (1e30, 0.0, false),
        ] {
            let pyramid = Pyramid::box_filtered(&environment(4, 2, |_, _| [value; 3]));
            assert_eq!(pyramid.fits_half(pyramid.radiance_scale()), fits);
            if scale > 0.0 {
                assert_eq!(pyramid.radiance_scale(), scale);
            }
            let encoded = pyramid.texels_rgba16f(0, pyramid.radiance_scale())[0];
            assert!(encoded[0].is_finite());
            let decoded = encoded[0].to_f32() * pyramid.radiance_scale();
            assert!((decoded - value).abs() <= value / 2048.0);
            assert_eq!(pyramid.texels_rgba32f(0, 1.0)[0], [value, value, value, 1.0]);
        }
        // The scale may be that of brighter light.
        let dim = Pyramid::box_filtered(&environment(4, 2, |_, _| [0.5; 3]));
        assert!(dim.fits_half(1.0) && dim.fits_half(32.0) && !dim.fits_half(64.0) && !dim.fits_half(16384.0));
    }
}
