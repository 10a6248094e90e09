//! The error that a picture is to be expected to have, from a few hundred of its pixels, and the fewest threads that stay within one.
use std::sync::Arc;

use rayon::prelude::*;

use super::metrics::{Comparable, Differences, Display};
use super::reference::{Integrator, TOLERANCE};
use crate::error::{Error, Result};
use crate::memo::Round;
use crate::pipeline::{DeviceScene, Wanted, render_geometry};
use crate::prepare::{Prepared, check_count, prepare};
use crate::scene::{MAX_SAMPLES, Scene};
use crate::vulkan::Device;

/// Pixels that are looked at. Errors gather in a part of a picture, at rims and highlights, say a tenth of it: of 50 normal numbers
/// the mean square has a standard deviation of sqrt(2 / 50) of it, so the RMS one of a tenth.
pub(super) const PIXELS: usize = 512;

/// The truth at some of the pixels that see a surface, spread evenly over a picture.
pub struct TrueSample {
    /// Indices of the pixels, row by row.
    pixels: Vec<usize>,
    truth: Comparable,
    display: Display,
    covered_part: f64,
}

impl TrueSample {
    /// The reference at a few hundred pixels of `prepared`, whatever its method and threads, to this tolerance; as `device` rasterises them.
    ///
    /// # Errors
    /// Whatever Vulkan refuses, or cancelled.
    pub fn new(prepared: &Prepared, device: &Arc<Device>, tolerance: f64, round: &Round) -> Result<Self> {
        let view = &prepared.view;
        let geometry = render_geometry(device, prepared, round)?;
        let observer = round.observer();
        let integrator = Integrator::of(prepared);
        let place = |pixel: usize| [pixel % view.width as usize, pixel / view.width as usize];
        let is_covered = |pixel: &usize| {
            let [x, y] = place(*pixel);
            !integrator.points(view, &geometry, x, y).is_empty()
        };
        let covered: Vec<_> = (0..(view.width * view.height) as usize).filter(is_covered).collect();
        let pixels = spread(&covered, PIXELS);
        let radiance = |&pixel: &usize| {
            let texel = integrator.texel(view, &geometry, place(pixel), tolerance, observer)?;
            Ok(texel.map_or([0.0; 4], |texel| texel.rgba))
        };
        let radiance = pixels.par_iter().map(radiance).collect::<Result<Vec<_>>>()?;
        let display = Display::of(view);
        let truth = Comparable::from_radiance(pixels.len(), 1, &radiance, true, display);
        let covered_part = covered.len() as f64 / (f64::from(view.width) * f64::from(view.height));
        Ok(Self { truth, pixels, display, covered_part })
    }

    /// The part of the picture that sees a surface.
    pub fn covered_part(&self) -> f64 {
        self.covered_part
    }

    /// The RMS of display values to be expected of a picture: that of the pixels that were looked at (F39). 0 where no surface is seen.
    /// `radiance` is as [`Rendering::radiance`](crate::rendering::Rendering::radiance) has it, without the environment behind.
    pub fn expected_rms(&self, radiance: &[[f32; 4]]) -> f64 {
        let here: Vec<_> = self.pixels.iter().map(|&pixel| radiance[pixel]).collect();
        let here = Comparable::from_radiance(here.len(), 1, &here, true, self.display);
        Differences::of_pictures(&here.display, &self.truth.display).rms(self.pixels.len().max(1) as u64)
    }
}

/// `count` of `all`, or all if there are no more: one of each of so many stretches of equal length, always the same.
fn spread(all: &[usize], count: usize) -> Vec<usize> {
    let count = count.min(all.len());
    // Multiples of the golden ratio keep clear of whatever period the rows of a picture have.
    let within = |i: usize| (i as f64 * 0.618_034).fract();
    (0..count).map(|i| all[((i as f64 + within(i)) * all.len() as f64 / count as f64) as usize]).collect()
}

/// Prepares `scene` with the fewest threads (or samples) of 1, 2, 3, 4, 6, 8, 12, 16, ... by which the expected RMS of display values is
/// at most `most`; with that RMS. All attempts are of one `round`, so that what they have in common is made once.
///
/// # Errors
/// As for [`prepare`]; whatever Vulkan refuses; as many as there can be are not enough.
pub fn prepare_within(scene: &Scene, most: f64, device: &Arc<Device>, round: &Round) -> Result<(Prepared, f64)> {
    let method = scene.shading.method;
    let mut scene = scene.clone();
    let subpixels = scene.image.subpixels;
    let mut sample = None;
    let mut reached = (0, f64::INFINITY);
    for count in counts().take_while(|&count| check_count(method, count, subpixels).is_ok()) {
        scene.shading.threads = Some(count);
        let prepared = prepare(&scene, round)?;
        // Only surfaces are looked at.
        let alone = prepared.objects_alone();
        let renderer = DeviceScene::new(device, &alone, round)?;
        let sample = match &sample {
            Some(sample) => sample,
            // What it is off by itself is not to decide.
            None => sample.insert(TrueSample::new(&alone, device, TOLERANCE.min(0.25 * most), round)?),
        };
        let rendering = renderer.render(Wanted::RADIANCE, 1)?;
        let rms = sample.expected_rms(&rendering.radiance);
        tracing::info!("{count} threads or samples: expected RMS {rms:.2e}");
        if rms <= most {
            return Ok((prepared, rms));
        }
        reached = (count, rms);
    }
    let (count, rms) = reached;
    let problem =
        format!("{most:e} is not reached: {count} threads or samples of \"{}\" have {rms:.1e}", method.name());
    Err(Error::input("--error", problem, "allow a larger error, or use --method reference, which has --tolerance"))
}

/// Powers of two and half as much again.
fn counts() -> impl Iterator<Item = u32> {
    std::iter::once(1)
        .chain((1..=MAX_SAMPLES.ilog2()).flat_map(|power| [1 << power, 3 << (power - 1)]))
        .filter(|count| *count <= MAX_SAMPLES)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_rise_to_the_most_that_any_method_has() {
        let counts: Vec<_> = counts().collect();
        assert_eq!(counts[..9], [1, 2, 3, 4, 6, 8, 12, 16, 24]);
        assert!(counts.windows(2).all(|pair| pair[0] < pair[1]) && counts.last() == Some(&8192));
    }

    #[test]
    fn pixels_are_spread_over_all() {
        let all: Vec<_> = (0..1000).map(|i| 3 * i).collect();
        assert_eq!(spread(&all[..7], 10), all[..7]);
        assert!(spread(&[], 10).is_empty());
        let some = spread(&all, 100);
        assert!(some.iter().enumerate().all(|(i, pixel)| (30 * i..30 * (i + 1)).contains(pixel)), "{some:?}");
    }
}
