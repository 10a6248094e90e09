//! The reference for somebody who watches: few pixels at first, then all of them, then all of them more exactly.
use rayon::prelude::*;

use super::{Integrator, rms};
use crate::error::Result;
use crate::passes::View;
use crate::prepare::Prepared;
use crate::progress::{Observer, Parts};

/// A step on the way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refinement {
    /// Every so many pixels along each axis are estimated, a power of two.
    pub step: usize,
    /// Largest estimated error of those, in display values: RMS over channels.
    pub tolerance: f64,
}

/// The first is there after a hundredth of the time that the last one takes, each of the next ones after four times as long; the
/// last has the tolerance of [`super::TOLERANCE`].
pub const STAGES: &[Refinement] = &[
    Refinement { step: 8, tolerance: 2e-3 },
    Refinement { step: 4, tolerance: 2e-3 },
    Refinement { step: 2, tolerance: 2e-3 },
    Refinement { step: 1, tolerance: 2e-3 },
    Refinement { step: 1, tolerance: super::TOLERANCE },
];

/// What is known of the reference picture after a stage.
#[derive(Clone, Debug)]
pub struct Estimate {
    /// The stage.
    pub stage: Refinement,
    /// Linear radiance times coverage, and coverage, row by row: pixels between estimated ones are like the one above and left of them.
    pub radiance: Vec<[f32; 4]>,
    /// RMS over channels and estimated pixels that see a surface of the estimated error of display values.
    pub error_estimate: f64,
}

/// Estimates the picture of `geometry` (texels as [`Rendering::geometry`](crate::rendering::Rendering::geometry) has them) stage by
/// stage, and hands each to `publish`. `observer` hears of rows of pixels.
///
/// # Errors
/// Cancelled.
pub fn progressive(
    prepared: &Prepared,
    geometry: &[[u32; 2]],
    stages: &[Refinement],
    observer: &dyn Observer,
    publish: &mut dyn FnMut(Estimate),
) -> Result<()> {
    let integrator = Integrator::of(prepared);
    let view = &prepared.view;
    let (width, height) = (view.width as usize, view.height as usize);
    // Radiance and squared error (none where no surface is seen) of the pixels so far.
    let mut known: Vec<Option<Pixel>> = vec![None; width * height];
    let mut known_tolerance = f64::INFINITY;
    for &stage in stages {
        let Refinement { step, tolerance } = stage;
        if tolerance < known_tolerance {
            known.fill(None);
            known_tolerance = tolerance;
        }
        let rows: Vec<usize> = (0..height).step_by(step).collect();
        let rows_done = Parts::new(rows.len(), observer);
        let of_row = |&y: &usize| -> Result<Vec<Pixel>> {
            let pixel = |x: usize| match known[y * width + x] {
                Some(pixel) => Ok(pixel),
                None => integrator.watched(view, geometry, [x, y], tolerance, observer),
            };
            let pixels = (0..width).step_by(step).map(pixel).collect::<Result<_>>()?;
            rows_done.advance()?;
            Ok(pixels)
        };
        let pixels = rows.par_iter().map(of_row).collect::<Result<Vec<_>>>()?;
        for (&y, row) in rows.iter().zip(&pixels) {
            for (x, pixel) in (0..width).step_by(step).zip(row) {
                known[y * width + x] = Some(*pixel);
            }
        }
        let errors = pixels.iter().flatten().filter_map(|pixel| pixel.squared_error);
        let (count, squares) = errors.fold((0, 0.0), |(count, sum), square| (count + 1, sum + square));
        let pixel = |i: usize| pixels[i / width / step][i % width / step].rgba;
        publish(Estimate {
            stage,
            radiance: (0..width * height).map(pixel).collect(),
            error_estimate: (squares / f64::from(count.max(1))).sqrt(),
        });
    }
    Ok(())
}

#[derive(Clone, Copy)]
struct Pixel {
    rgba: [f32; 4],
    /// Mean over channels; none where no surface is seen.
    squared_error: Option<f64>,
}

impl Integrator<'_> {
    fn watched(
        &self,
        view: &View,
        geometry: &[[u32; 2]],
        pixel: [usize; 2],
        tolerance: f64,
        observer: &dyn Observer,
    ) -> Result<Pixel> {
        Ok(match self.texel(view, geometry, pixel, tolerance, observer)? {
            Some(texel) => Pixel { rgba: texel.rgba, squared_error: Some(rms(texel.estimate.display_error).powi(2)) },
            None => Pixel { rgba: [0.0; 4], squared_error: None },
        })
    }
}
