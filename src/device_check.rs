//! A device is checked before it is trusted: what it answers is compared with what Vulkan promises, within the precision that it states.
//!
//! Twin of glsl/device_check.comp.
use crate::Result;
use crate::environment::{Pyramid, cube};
use crate::error::Error;
use crate::passes::{Answers, Questions, Volume, WayAround, ask};
use crate::vulkan::{Device, PipelineCache, VulkanError};
use glam::{Vec3, Vec4};
use half::f16;
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::sync::Arc;

/// What was found out about a device.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Verdict {
    /// It does what Vulkan promises.
    Right,
    /// It does, with this.
    RightBy(WayAround),
    /// It does not; this is wrong.
    Wrong(String),
}

impl Verdict {
    /// The verdict in the bytes of the cache's file at `path`.
    ///
    /// # Errors
    /// They are no verdict.
    pub fn parse(path: &Path, bytes: &[u8]) -> Result<Self> {
        serde_json::from_slice(bytes)
            .map_err(|cause| Error::in_file(path, format!("is damaged ({cause})"), "the device is checked again"))
    }

    /// How the device is used; an error for one that cannot be.
    ///
    /// # Errors
    /// What is wrong with `device`.
    pub fn way_around(&self, device: &Device) -> Result<Option<WayAround>> {
        match self {
            Self::Right => Ok(None),
            Self::RightBy(way_around) => Ok(Some(*way_around)),
            Self::Wrong(fault) => {
                let device = device.description().name.clone();
                Err(VulkanError::Faulty { device, fault: fault.to_string() }.into())
            }
        }
    }
}

/// Asks `device`, and once more with the way around if something is wrong.
///
/// # Errors
/// Whatever Vulkan refuses.
pub fn check(device: &Arc<Device>, cache: &PipelineCache) -> Result<Verdict> {
    let Some(first) = fault_by(None, device, cache)? else { return Ok(Verdict::Right) };
    tracing::debug!("{}: {first}", device.description().name);
    let way_around = WayAround::DrawWithCubeMaps;
    Ok(match fault_by(Some(way_around), device, cache)? {
        None => Verdict::RightBy(way_around),
        Some(fault) => Verdict::Wrong(fault),
    })
}

/// What is wrong, if anything is, with what `device` answers when it is used by `way_around`.
///
/// # Errors
/// Whatever Vulkan refuses.
pub fn fault_by(way_around: Option<WayAround>, device: &Arc<Device>, cache: &PipelineCache) -> Result<Option<String>> {
    let questions = questions();
    Ok(fault(&questions, &ask(device, cache, &questions, way_around)?, &Precision::of(device)))
}

/// How finely a device divides texels and levels: what it states, at least 4 bits each.
#[derive(Clone, Copy, Debug)]
struct Precision {
    texel: f32,
    level: f32,
}

impl Precision {
    fn of(device: &Device) -> Self {
        let step = |bits: u32| (-(bits as f32)).exp2();
        let limits = device.limits();
        Self { texel: step(limits.sub_texel_precision_bits), level: step(limits.mipmap_precision_bits) }
    }
}

/// Sizes that hold all cases: level 0 has texels inside, level 1 only at edges and corners, and so on.
const FACE_SIZE: usize = 8;
const VOLUME: [u32; 3] = [4, 3, 5];
/// More than half floats hold: those of the wide cube map are of single precision, where the device filters that.
const WIDE: f32 = 8_388_608.0;

/// A number in [0, 1), different for each index.
fn noise(i: usize) -> f32 {
    // Bits of a product by the golden ratio, as 2^32 has it.
    ((i as u32).wrapping_mul(2_654_435_769) >> 8) as f32 / 16_777_216.0
}

fn questions() -> Questions {
    let cube = cube_of_noise(1.0);
    let texel = |i: usize| Vec4::new(noise(4 * i), noise(4 * i + 1), noise(4 * i + 2), noise(4 * i + 3));
    let volume = Volume { extent: VOLUME, texels: (0..VOLUME.iter().product::<u32>() as usize).map(texel).collect() };
    // From beyond one edge to beyond the other.
    let place = |i: usize| 1.6 * Vec3::new(noise(3 * i), noise(3 * i + 1), noise(3 * i + 2)) - 0.3;
    let halves = [[0.0, 1.0, -1.0, 65504.0], [6.103_515_6e-5, 0.1, -3.3, 1000.0]].map(|four| four.map(f16::from_f32));
    Questions {
        cube,
        wide_cube: cube_of_noise(WIDE),
        volume,
        directions: directions(),
        places: (0..200).map(|i| place(i).extend(0.0)).collect(),
        halves: halves.to_vec(),
    }
}

/// A cube map of numbers up to `most`. The three texels at a corner of the cube are equal: elsewhere Vulkan does not say what is between
/// them ("Cube Map Corner Handling": should be the mean of the three).
fn cube_of_noise(most: f32) -> Pyramid {
    let level = |size: usize| -> Vec<[f32; 3]> {
        let texel = |i: usize| {
            let (face, row, column) = (i / size / size, i / size % size, i % size);
            let centre = |index: usize| (index as f64 + 0.5) / size as f64;
            let direction = cube::direction_of(face, centre(column), centre(row));
            let is_corner = [row, column].iter().all(|index| *index == 0 || *index == size - 1);
            // A level of one texel a face has all its corners in each of them.
            let octant =
                if size == 1 { 0 } else { direction.to_array().iter().fold(0, |at, x| 2 * at + usize::from(*x > 0.0)) };
            let seed = if is_corner { 8 * size + octant } else { 1000 * size + i };
            [0, 1, 2].map(|channel| most * noise(3 * seed + channel))
        };
        (0..6 * size * size).map(texel).collect()
    };
    let levels = (0..=FACE_SIZE.ilog2()).map(|finer| level(FACE_SIZE >> finer)).collect();
    Pyramid { face_size: FACE_SIZE, levels }
}

/// Directions to the inside, the edges and the corners of each face, of different lengths, at whole levels and between them.
fn directions() -> Vec<Vec4> {
    const PLACES: [f64; 7] = [0.001, 0.06, 0.21, 0.5, 0.83, 0.97, 0.999];
    const LEVELS: [f32; 7] = [0.0, 0.3, 1.0, 1.5, 2.0, 2.75, 3.0];
    let of_face = |face| PLACES.into_iter().flat_map(move |s| PLACES.map(|t| cube::direction_of(face, s, t).as_vec3()));
    let all = (0..6).flat_map(of_face).flat_map(|direction| LEVELS.map(|level| (direction, level)));
    all.enumerate().map(|(i, (direction, level))| ((0.5 + noise(i)) * direction).extend(level)).collect()
}

/// What is wrong with `answers`, first of all, if anything is.
fn fault(questions: &Questions, answers: &Answers, precision: &Precision) -> Option<String> {
    let cube_error = |cube: &Pyramid, answers: &[Vec4], most: f32| {
        let expected = questions.directions.iter().map(|asked| cube.lookup(asked.truncate(), asked.w));
        largest(
            answers.iter().zip(expected).map(|(answer, expected)| (answer.with_w(0.0) - expected.extend(0.0)) / most),
        )
    };
    let places = questions.places.iter().map(|place| volume_texel(&questions.volume, place.truncate()));
    // Texels differ by 1 at most: a step along each axis, and one between levels. Half floats have 11 bits.
    let of_cube = 2.0 * precision.texel + precision.level + 1e-3;
    let of_volume = 3.0 * precision.texel + 1e-3;
    let errors = [
        ("lookups in cube maps", cube_error(&questions.cube, &answers.cube, 1.0), of_cube),
        ("lookups in cube maps of large numbers", cube_error(&questions.wide_cube, &answers.wide_cube, WIDE), of_cube),
        (
            "lookups in tables",
            largest(answers.volume.iter().zip(places).map(|(answer, place)| answer - place)),
            of_volume,
        ),
    ];
    tracing::debug!("device check: {errors:?}");
    let wrong = errors.into_iter().find(|(_, error, most)| error.is_nan() || error > most);
    if let Some((what, error, most)) = wrong {
        return Some(format!("{what} are off by {error:.2} of the largest texel, where {most:.3} is allowed"));
    }
    let halves = questions.halves.iter().map(|four| Vec4::from(four.map(f16::to_f32)));
    if !answers.halves.iter().copied().eq(halves) {
        return Some("half floats are not unpacked exactly".to_owned());
    }
    let count = answers.order.len() as u32;
    let mut order = answers.order.clone();
    order.sort_unstable();
    let are_counted =
        order.into_iter().eq(0..count) && answers.largest == count && answers.total == count * (count + 1) / 2;
    (!are_counted).then(|| "atomics lose counts".to_owned())
}

/// The largest component; NaN if any is.
fn largest(errors: impl Iterator<Item = Vec4>) -> f32 {
    let numbers = errors.flat_map(|error| error.abs().to_array());
    numbers.fold(0.0, |most: f32, number| if number > most || number.is_nan() { number } else { most })
}

/// Trilinear, wrapped along x and clamped along y and z.
fn volume_texel(volume: &Volume, place: Vec3) -> Vec4 {
    let position = [0, 1, 2].map(|axis| place[axis] * volume.extent[axis] as f32 - 0.5);
    let mut sum = Vec4::ZERO;
    for corner in 0..8 {
        let (mut weight, mut at) = (1.0, [0; 3]);
        for axis in 0..3 {
            let (floor, next) = (position[axis].floor(), (corner >> axis) & 1);
            let fraction = position[axis] - floor;
            weight *= if next == 1 { fraction } else { 1.0 - fraction };
            let (index, size) = (floor as i64 + next, i64::from(volume.extent[axis]));
            at[axis] = if axis == 0 { index.rem_euclid(size) } else { index.clamp(0, size - 1) } as usize;
        }
        let [width, height, _] = volume.extent.map(|size| size as usize);
        sum += weight * volume.texels[(at[2] * height + at[1]) * width + at[0]];
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    const PRECISION: Precision = Precision { texel: 1.0 / 256.0, level: 1.0 / 256.0 };

    /// What a device without a fault answers.
    fn right(questions: &Questions) -> Answers {
        let of = |cube: &Pyramid| {
            questions.directions.iter().map(|asked| cube.lookup(asked.truncate(), asked.w).extend(1.0)).collect()
        };
        let count = (2 * questions.directions.len() + questions.places.len() + questions.halves.len()) as u32;
        Answers {
            cube: of(&questions.cube),
            wide_cube: of(&questions.wide_cube),
            volume: questions.places.iter().map(|place| volume_texel(&questions.volume, place.truncate())).collect(),
            halves: questions.halves.iter().map(|four| Vec4::from(four.map(f16::to_f32))).collect(),
            total: count * (count + 1) / 2,
            largest: count,
            order: (0..count).rev().collect(),
        }
    }

    #[test]
    fn whatever_is_wrong_is_named() {
        let questions = questions();
        let right = right(&questions);
        assert_eq!(fault(&questions, &right, &PRECISION), None);
        type Plant = fn(&mut Answers);
        let faults: [(&str, Plant); 9] = [
            ("cube maps are off by 0.02", |answers| answers.cube[7].y += 0.02),
            ("cube maps are off by NaN", |answers| answers.cube[70].x = f32::NAN),
            ("cube maps of large numbers are off by 0.02", |answers| answers.wide_cube[9].z -= 0.02 * WIDE),
            ("tables are off by 0.03", |answers| answers.volume[3].w += 0.03),
            ("half floats", |answers| answers.halves[1].x = 0.0),
            ("atomics", |answers| answers.total -= 1),
            ("atomics", |answers| answers.largest += 1),
            ("atomics", |answers| answers.order[5] = answers.order[6]),
            ("cube maps are off by inf", |answers| answers.cube[71].x = f32::INFINITY),
        ];
        for (named, plant) in faults {
            let mut answers = right.clone();
            plant(&mut answers);
            let fault = fault(&questions, &answers, &PRECISION).expect(named);
            assert!(fault.contains(named), "{fault}");
        }
    }

    #[test]
    fn texels_beyond_an_edge_matter() {
        // What SwiftShader does without the way around: of the neighbours' texels there is nothing.
        let questions = questions();
        let mut answers = right(&questions);
        let mut dark = questions.cube.clone();
        for level in &mut dark.levels {
            let face = level.len() / 6;
            level[face..].fill([0.0; 3]);
        }
        for (answer, asked) in answers.cube.iter_mut().zip(&questions.directions) {
            if cube::face_of(asked.truncate().as_dvec3()).0 == 0 {
                *answer = dark.lookup(asked.truncate(), asked.w).extend(1.0);
            }
        }
        assert!(fault(&questions, &answers, &PRECISION).is_some_and(|fault| fault.contains("cube maps")));
    }
}
