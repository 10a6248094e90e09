//! Reads environments from files of any format and repairs pixels that are no radiance.
use std::path::Path;

use super::{Environment, FORMATS, RepairCounts, procedural, weight_solid_angle};
use crate::error::{Error, Result};
use crate::files::FileKind;

/// The most radiance that a pixel of an environment has: sums over all pixels of a map, and BRDFs of up to 1e8 times it, are then numbers
/// of single precision.
const MOST_RADIANCE: f32 = 1e30;

impl Environment {
    /// The formats of environment files.
    pub const FILES: FileKind<Self> =
        FileKind { what: "environment", formats: FORMATS, builtin_names: || procedural::builtin_names().to_vec() };

    /// Reads a lat-long picture of any size: see [`Self::FILES`]. Pixels that are NaN, infinite, above 1e30 or negative are repaired and
    /// reported as a warning.
    ///
    /// # Errors
    /// What cannot be read or is no picture.
    pub fn load(path: &Path) -> Result<Self> {
        Self::FILES.load(path)
    }

    /// The environment of this name, of pixels that may hold anything.
    pub(super) fn of_pixels(name: impl ToString, width: usize, height: usize, texels: Vec<[f32; 3]>) -> Result<Self> {
        if texels.is_empty() {
            return Err(Error::input(name, "has no pixels", "give a lat-long picture of at least 1x1"));
        }
        Ok(Self::repaired(name.to_string(), width, height, texels))
    }

    /// An environment of pixels that may hold anything.
    fn repaired(name: String, width: usize, height: usize, mut texels: Vec<[f32; 3]>) -> Self {
        let repaired = repair(width, height, &mut texels);
        if repaired != RepairCounts::default() {
            let RepairCounts { nan, infinite, negative } = repaired;
            tracing::warn!(
                "{name}: repaired pixels: {nan} NaN, {infinite} infinite or above {MOST_RADIANCE:e}, {negative} negative"
            );
        }
        Self::new(name, width, height, texels, repaired)
    }
}

/// Makes every value finite and not negative; counts the pixels by what was wrong.
fn repair(width: usize, height: usize, texels: &mut [[f32; 3]]) -> RepairCounts {
    let mut counts = RepairCounts::default();
    let largest = texels.iter().flatten().copied().filter(|value| value.is_finite()).fold(0.0, f32::max);
    let largest = largest.min(MOST_RADIANCE);
    let mut holes = Vec::new();
    let mut deficits = Vec::new();
    for (index, texel) in texels.iter_mut().enumerate() {
        if texel.iter().any(|value| value.is_nan()) {
            counts.nan += 1;
            holes.push(index);
            continue;
        }
        // Minus infinity counts as infinite, and is then as black as any negative value.
        let is_infinite = texel.iter().any(|value| value.is_infinite() || *value > MOST_RADIANCE);
        counts.infinite += usize::from(is_infinite);
        if texel.iter().all(|value| value.is_finite()) && texel.iter().any(|&value| value < 0.0) {
            counts.negative += usize::from(!is_infinite);
            deficits.extend((0..3).filter(|&channel| texel[channel] < 0.0).map(|c| (index, c, -f64::from(texel[c]))));
        }
        *texel = texel.map(|value| value.clamp(0.0, largest));
    }
    let filled: Vec<[f32; 3]> = holes.iter().map(|&hole| neighbours_mean(width, height, texels, hole)).collect();
    for (hole, value) in holes.into_iter().zip(filled) {
        texels[hole] = value;
    }
    for (index, channel, deficit) in deficits {
        take_from_surroundings(width, height, texels, index, channel, deficit);
    }
    counts
}

/// Takes `deficit`, the amount that a channel of pixel `index` was below 0, from the pixels around it, in proportion to what they
/// have. Negative pixels mostly ring about a small sun and belong to its energy: cutting them off would make it brighter, by
/// a tenth or more. What nothing within three pixels can give is left out.
fn take_from_surroundings(
    width: usize,
    height: usize,
    texels: &mut [[f32; 3]],
    index: usize,
    channel: usize,
    deficit: f64,
) {
    let (column, row) = (index % width, index / width);
    let solid_angle = |row: usize| weight_solid_angle(width, height, row);
    let mut missing = deficit * solid_angle(row);
    for radius in 1..=3 {
        let rows = row.saturating_sub(radius)..(row + radius + 1).min(height);
        // All columns once where the picture is narrower than the square.
        let columns = 0..(2 * radius + 1).min(width);
        let around = |row: usize| {
            let left = column + width * radius - radius;
            columns.clone().map(move |offset| row * width + (left + offset) % width)
        };
        let energy = |texels: &[[f32; 3]], row: usize| {
            around(row).map(|pixel| f64::from(texels[pixel][channel])).sum::<f64>() * solid_angle(row)
        };
        let available: f64 = rows.clone().map(|row| energy(texels, row)).sum();
        let share = if available > missing { missing / available } else { 1.0 };
        for pixel in rows.flat_map(around) {
            texels[pixel][channel] *= 1.0 - share as f32;
        }
        missing -= share * available;
        if share < 1.0 {
            return;
        }
    }
}

/// The mean of the neighbours (wrapped in u, cut off at the poles) without a NaN; black where there are none.
fn neighbours_mean(width: usize, height: usize, texels: &[[f32; 3]], index: usize) -> [f32; 3] {
    let (column, row) = (index % width, index / width);
    let (mut sum, mut count) = ([0.0; 3], 0.0);
    for row in row.saturating_sub(1)..(row + 2).min(height) {
        for column in [column + width - 1, column, column + 1] {
            let texel = texels[row * width + column % width];
            if texel.iter().all(|value| !value.is_nan()) {
                sum = std::array::from_fn(|channel| sum[channel] + f64::from(texel[channel]));
                count += 1.0;
            }
        }
    }
    sum.map(|channel| if count > 0.0 { (channel / count) as f32 } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::{ExrHeader, write_exr};

    /// A Radiance file of flat pixels: mantissas and shared exponent as given.
    fn hdr(width: usize, height: usize, rgbe: [u8; 4]) -> Vec<u8> {
        let mut bytes = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n").into_bytes();
        bytes.extend(rgbe.repeat(width * height));
        bytes
    }

    #[test]
    fn an_hdr_of_any_size_reads() {
        let folder = tempfile::tempdir().unwrap();
        for (width, height) in [(1, 1), (3, 2), (7, 5)] {
            let path = folder.path().join("small.HDR");
            std::fs::write(&path, hdr(width, height, [128, 64, 32, 129])).unwrap();
            let environment = Environment::load(&path).unwrap();
            assert_eq!((environment.width, environment.height), (width, height));
            assert!(environment.texels.iter().all(|texel| *texel == [1.0, 0.5, 0.25]));
            assert_eq!(environment.repaired, RepairCounts::default());
        }
    }

    #[test]
    fn pixels_that_are_no_radiance_are_repaired_and_counted() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("sick.exr");
        let mut pixels = vec![[2.0, 4.0, 6.0, 1.0]; 7 * 5];
        pixels[0] = [f32::NAN, 1.0, f32::INFINITY, 1.0];
        pixels[8] = [f32::INFINITY, 1.0, -1.0, 1.0];
        pixels[30] = [-3.0, 1.0, 1.0, 1.0];
        pixels[17] = [f32::NEG_INFINITY, 50.0, 1.0, 1.0];
        write_exr(&path, 7, 5, &pixels, false, &ExrHeader::default()).unwrap();
        let environment = Environment::load(&path).unwrap();
        assert_eq!(environment.repaired, RepairCounts { nan: 1, infinite: 2, negative: 1 });
        // Neighbours of (0, 0): three with [2, 4, 6] twice over the wrap, and the repaired infinite one.
        assert_eq!(environment.texels[0], [(4.0 * 2.0 + 50.0) / 5.0, (4.0 * 4.0 + 1.0) / 5.0, 4.0 * 6.0 / 5.0]);
        assert_eq!(environment.texels[8], [50.0, 1.0, 0.0]);
        assert_eq!(environment.texels[30], [0.0, 1.0, 1.0]);
        assert_eq!(environment.texels[17], [0.0, 50.0, 1.0]);
    }

    #[test]
    fn light_is_not_brighter_than_sums_of_it_can_be() {
        let environment =
            Environment::repaired(String::new(), 2, 1, vec![[f32::MAX, 1.0, 0.0], [f32::INFINITY, 1.0, 0.0]]);
        assert_eq!(*environment.texels, [[MOST_RADIANCE, 1.0, 0.0]; 2]);
        assert_eq!(environment.repaired, RepairCounts { infinite: 2, ..RepairCounts::default() });
    }

    #[test]
    fn ringing_around_a_sun_is_cut_off_without_changing_the_light_as_a_whole() {
        // At the top left corner, over the wrap, and with more to take than the nearest neighbours have.
        for (width, height, sun, index, deficit) in [(9, 6, 31, 32, 80.0), (9, 6, 8, 0, 99.0), (9, 6, 31, 13, 12.0)] {
            let mut texels = vec![[1.0, 2.0, 3.0]; width * height];
            texels[sun][0] = 100.0;
            texels[index][0] = -deficit;
            let map = |texels| Environment::new(String::new(), width, height, texels, Default::default());
            let before = map(texels.clone()).mean_radiance().x;
            let repaired = Environment::repaired(String::new(), width, height, texels);
            assert_eq!(repaired.repaired.negative, 1);
            let after = repaired.mean_radiance().x;
            assert!((after / before - 1.0).abs() < 1e-6, "{index}: {before} became {after}");
            assert!(repaired.texels.iter().all(|texel| texel[0] >= 0.0 && texel[1..] == [2.0, 3.0]));
        }
        // All around give alike.
        let mut even = vec![[1.0; 3]; 25];
        even[12][0] = -1.0;
        repair(5, 5, &mut even);
        let reds: Vec<f32> = [6, 7, 8, 11, 13, 16, 17, 18].map(|neighbour| even[neighbour][0]).to_vec();
        assert!(reds[0] < 1.0 && reds.iter().all(|red| *red == reds[0]), "{reds:?}");
        // Where nothing is to be had the pixel is merely black.
        let mut alone = vec![[-1.0, 0.0, 0.0]];
        assert_eq!(repair(1, 1, &mut alone).negative, 1);
        assert_eq!(alone, [[0.0; 3]]);
    }

    #[test]
    fn a_file_of_nothing_but_nan_is_black() {
        let mut texels = vec![[f32::NAN; 3]; 6];
        assert_eq!(repair(3, 2, &mut texels).nan, 6);
        assert_eq!(texels, [[0.0; 3]; 6]);
    }

    #[test]
    fn broken_files_are_errors_that_name_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let whole = hdr(16, 8, [1, 2, 3, 128]);
        for (name, bytes) in [
            ("cut.hdr", &whole[..whole.len() - 9]),
            ("header.hdr", &whole[..20]),
            ("empty.hdr", &[]),
            ("text.hdr", b"hello\n"),
            ("huge.hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1000000 +X 1000000\n"),
            ("none.hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 0 +X 0\n"),
            ("text.exr", b"hello\n"),
            ("picture.jpg", b"hello\n"),
        ] {
            let path = folder.path().join(name);
            std::fs::write(&path, bytes).unwrap();
            let error = Environment::load(&path).unwrap_err().to_string();
            assert!(error.contains(name) && !error.contains('\n'), "{error}");
        }
        for name in ["missing.hdr", "missing.exr"] {
            assert!(Environment::load(&folder.path().join(name)).unwrap_err().to_string().contains(name));
        }
    }

    #[test]
    fn an_exr_without_colour_is_an_error_that_lists_its_channels() {
        use exr::prelude::*;
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, names: &[&str]| {
            let path = folder.path().join(name);
            let channels =
                names.iter().map(|&name| AnyChannel::new(name, FlatSamples::F16(vec![f16::ONE; 4]))).collect();
            let layer =
                Layer::new((2, 2), LayerAttributes::default(), Encoding::default(), AnyChannels::sort(channels));
            Image::from_layer(layer).write().to_file(&path).unwrap();
            Environment::load(&path)
        };
        let error = write("depth.exr", &["Z", "N.X"]).unwrap_err().to_string();
        assert!(error.contains("depth.exr") && error.contains("N.X, Z"), "{error}");
        for names in [&["R", "G", "B"][..], &["A", "R", "G", "B"], &["Y"], &["view.R", "view.G", "view.B", "view.Z"]] {
            assert_eq!(*write("colour.exr", names).unwrap().texels, [[1.0; 3]; 4], "{names:?}");
        }
    }
}
