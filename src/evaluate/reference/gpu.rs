//! The reference on the GPU: means of frames that are shaded by method `mis`, each with other points.
use std::sync::Arc;
use std::time::Instant;

use glam::{DVec3, Vec4};

use super::{Display, ReferenceImage, rms};
use crate::Result;
use crate::memo::Round;
use crate::method::{Method, Pattern, Sampling};
use crate::pipeline::{DeviceScene, Wanted};
use crate::prepare::Prepared;
use crate::vulkan::Device;

/// Samples of a frame: with 4 x 4 sub-pixels half of the 65535 iterations after which lavapipe leaves loops. Points of one frame
/// fill the gaps between each other, those of several do not, so fewer would serve worse.
const FRAME_SAMPLES: u32 = 2048;
/// Frames at least: no picture has fewer than 4096 samples, and the spread over all of its pixels tells the error. And at most.
const FEWEST_FRAMES: u32 = 2;
const MOST_FRAMES: u32 = 1024;

/// The picture of `prepared` within `tolerance`: here the RMS over the picture, not the worst pixel. In single precision.
pub fn reference_on_gpu(
    prepared: &Prepared,
    device: &Arc<Device>,
    tolerance: f64,
    round: &Round,
) -> Result<ReferenceImage> {
    for material in prepared.materials.iter().filter(|material| material.brdf.has_table()) {
        tracing::warn!(
            "material \"{}\": shaders have a table of its BRDF, so the reference on the GPU errs by more than it estimates; the one on the CPU does not",
            material.name
        );
    }
    let start = Instant::now();
    let sampling = Sampling { count: FRAME_SAMPLES, seed: 0, pattern: Pattern::PerPixel };
    let objects = Prepared { method: Method::Mis, sampling, ..prepared.objects_alone() };
    let (mut renderer, observer) = (DeviceScene::new(device, &objects, round)?, round.observer());
    let display = Display::of(&prepared.view);
    let mut evaluations = 0;
    let mut sums: Vec<Sums> = Vec::new();
    let mut frame = 0;
    loop {
        observer.check()?;
        frame += 1;
        renderer.reseed(frame.into());
        let rendering = renderer.render(Wanted::RADIANCE, 1)?;
        evaluations += rendering.lookups;
        sums.resize(rendering.radiance.len(), Sums::default());
        sums.iter_mut().zip(&rendering.radiance).for_each(|(sums, &texel)| sums.add(texel.into()));
        if frame < FEWEST_FRAMES {
            continue;
        }
        let errors = sums.iter().filter(|sums| sums.coverage > 0.0).map(|sums| rms(sums.display_error(frame, display)));
        let (count, squares, most) =
            errors.fold((0, 0.0, 0.0_f64), |(n, sum, most), error| (n + 1, sum + error * error, most.max(error)));
        let error_estimate = (squares / f64::from(count.max(1))).sqrt();
        // Errors fall as 1 / sqrt(frames), which tells how many there will be.
        let expected = (f64::from(frame) * (error_estimate / tolerance).powi(2)).ceil();
        observer.progress(frame as usize, expected.clamp(frame.into(), MOST_FRAMES.into()) as usize);
        if error_estimate <= tolerance || frame >= MOST_FRAMES {
            return Ok(ReferenceImage {
                radiance: sums.iter().map(|sums| sums.mean(frame).as_vec3().extend(sums.coverage).to_array()).collect(),
                error_estimate,
                max_error_estimate: most,
                evaluations,
                covered_subpixels: rendering.counters.covered_subpixels.into(),
                seconds: start.elapsed().as_secs_f64(),
                cached: false,
            });
        }
    }
}

/// What is kept of a pixel's frames.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    radiance: DVec3,
    squares: DVec3,
    coverage: f32,
}

impl Sums {
    fn add(&mut self, texel: Vec4) {
        let radiance = texel.truncate().as_dvec3();
        self.radiance += radiance;
        self.squares += radiance * radiance;
        self.coverage = texel.w;
    }

    fn mean(&self, frames: u32) -> DVec3 {
        self.radiance / f64::from(frames)
    }

    /// The standard error of the mean, as display values show it (F38).
    fn display_error(&self, frames: u32, display: Display) -> DVec3 {
        let mean = self.mean(frames);
        // Rounding may make the variance of equal numbers negative.
        let variance = (self.squares / f64::from(frames) - mean * mean).max(DVec3::ZERO);
        let error = (variance / f64::from(frames - 1)).map(f64::sqrt);
        DVec3::from_array([0, 1, 2].map(|channel| display.error(mean[channel], error[channel])))
    }
}
