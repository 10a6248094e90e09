//! Error and time of every method at every number of threads, over materials, environments and scenes.
use std::fmt;
use std::sync::Arc;

use image::RgbImage;
use serde::{Deserialize, Serialize};

use super::cases::{Cases, Place, Shard};
use super::expected::TrueSample;
use super::metrics::{Comparable, Metrics, check_comparable_size, compare};
use super::reference::{ReferenceImage, TOLERANCE};
use super::sheet::over_grey;
use crate::error::Result;
use crate::memo::{Memo, Round};
use crate::passes::View;
use crate::pipeline::Wanted;
use crate::prepare::Prepared;
use crate::progress::{Observer, Parts};
use crate::rendering::Rendering;
use crate::vulkan::Device;

/// What to measure, and how.
#[derive(Clone, Debug)]
pub struct Sweep {
    /// Each method at each count, for each material in each environment in each scene.
    pub cases: Cases,
    /// Times are medians over so many frames.
    pub repeat: u32,
    /// Count background pixels too. They are equal in all pictures, so that they only thin the error out.
    pub whole_picture: bool,
    /// Estimate errors from a few hundred pixels, too: see [`TrueSample`].
    pub expected: bool,
    /// Keep the pictures too, to look at.
    pub keep_pictures: bool,
}

/// One measurement: how far a picture is from the reference picture, and what it cost.
///
/// A list of these, as JSON, is what `threadlight bench error --json` writes: the fields have the names and the order here,
/// in all versions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Name of the method.
    pub method: String,
    /// Number of threads, or of samples of the other estimators.
    pub threads: u32,
    /// Name of the material.
    pub material: String,
    /// Name of the environment.
    pub environment: String,
    /// Name of the scene.
    pub scene: String,
    /// See [`Metrics::rms`].
    pub rms: f64,
    /// See [`Metrics::rms_linear`].
    pub rms_linear: f64,
    /// See [`Metrics::ssim`].
    pub ssim: f64,
    /// See [`Metrics::flip`].
    pub flip: f64,
    /// See [`Metrics::max`].
    pub max: f64,
    /// See [`Metrics::nan`].
    pub nan: u64,
    /// Time of the passes that make linear radiance, on the GPU: geometry cache, classification, shading and background, without copying
    /// the picture back; in milliseconds.
    pub gpu_ms: f64,
    /// From the start of recording until the GPU is done and has copied the picture back, in milliseconds.
    pub frame_ms: f64,
    /// Lookups in the environment that shading made.
    pub lookups: u64,
    /// Pixels that see a surface.
    pub covered_pixels: u64,
    /// What of `gpu_ms` is shading: the rest hardly depends on the method.
    pub shade_ms: f64,
    /// How it was measured.
    pub settings: Settings,
    /// Which part of a sweep it is of; a whole one is its only part, 1/1. None of what is in no sweep.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shard: Option<Shard>,
    /// How many combinations of materials and environments the whole sweep has; none where `shard` is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub combinations: Option<usize>,
    /// What `rms` was expected to be, where that was asked for: see [`TrueSample::expected_rms`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expected_rms: Option<f64>,
}

/// What measurements that are compared or averaged have in common.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Settings {
    /// Columns of the picture.
    pub width: u32,
    /// Rows of it.
    pub height: u32,
    /// Sub-pixels per axis.
    pub subpixels: u32,
    /// Of whatever is random.
    pub seed: u64,
    /// Times are medians over so many frames.
    pub repeat: u32,
    /// Whether background pixels count.
    pub whole_picture: bool,
}

impl fmt::Display for Settings {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { width, height, subpixels, seed, repeat, whole_picture } = self;
        let background = if *whole_picture { ", with background" } else { "" };
        write!(f, "{width}x{height} pixels of {subpixels} x {subpixels}, seed {seed}, {repeat} frames{background}")
    }
}

impl Row {
    /// Lookups in the environment for each pixel that sees a surface.
    pub fn lookups_a_pixel(&self) -> f64 {
        self.lookups as f64 / self.covered_pixels as f64
    }
}

/// All measurements.
#[derive(Clone, Debug, Default)]
pub struct Measured {
    /// By material, scene, environment, method and count, the last one changing fastest.
    pub rows: Vec<Row>,
    /// The picture of each row, if pictures are kept.
    pub pictures: Vec<RgbImage>,
    /// Material, environment, scene and reference picture of each place, if pictures are kept.
    pub references: Vec<([String; 3], RgbImage)>,
    /// The largest error that a reference picture estimates of itself, in display values.
    pub reference_error: f64,
}

/// The measurements of `sweep` on `device`, one after another into `measured`, so that those made before an error are not lost.
///
/// `reference` makes the true picture of what it is given, whatever method and threads are in there: once for each material,
/// environment and scene. `observer` sees finished rows.
///
/// # Errors
/// The first material, environment or scene that cannot be used; whatever Vulkan refuses; `reference`'s; cancelled.
pub fn run(
    sweep: &Sweep,
    device: &Arc<Device>,
    memo: &Memo,
    reference: &dyn Fn(&Prepared, &Round) -> Result<ReferenceImage>,
    observer: &dyn Observer,
    measured: &mut Measured,
) -> Result<()> {
    for (_, scene) in &sweep.cases.scenes {
        check_comparable_size(scene.image.width as usize, scene.image.height as usize)?;
    }
    let rows = Parts::new(sweep.row_count(), observer);
    sweep.cases.for_each_place(memo, observer, &mut |place| {
        let (width, height, display) = (place.prepared.view.width, place.prepared.view.height, place.display());
        let comparable =
            |radiance: &[[f32; 4]]| Comparable::from_radiance(width as usize, height as usize, radiance, true, display);
        let truth = reference(place.prepared, &place.round())?;
        measured.reference_error = measured.reference_error.max(truth.error_estimate);
        if sweep.keep_pictures {
            let names = [place.material, place.environment, place.scene].map(str::to_owned);
            measured.references.push((names, over_grey(&truth.radiance, width, height, display)));
        }
        let truth = comparable(&truth.radiance);
        let sample = || TrueSample::new(place.prepared, device, TOLERANCE, &place.round());
        let sample = sweep.expected.then(sample).transpose()?;
        for estimator in sweep.cases.estimators() {
            place.choose(estimator)?;
            let renderer = place.renderer(device)?;
            // A frame that does not count: drivers compile then.
            renderer.render(Wanted::RADIANCE, 1)?;
            let rendering = renderer.render(Wanted::RADIANCE, sweep.repeat)?;
            let metrics = compare(&comparable(&rendering.radiance), &truth, !sweep.whole_picture)
                .map_err(|error| error.within(format!("{} on {}", place.material, place.scene)))?;
            // Beyond surfaces there is no error.
            let part = |sample: &TrueSample| if sweep.whole_picture { sample.covered_part() } else { 1.0 };
            let expected_rms =
                sample.as_ref().map(|sample| part(sample).sqrt() * sample.expected_rms(&rendering.radiance));
            let (shard, combinations) = (Some(sweep.cases.shard), Some(sweep.cases.combination_count()));
            let row = row(place, sweep.settings(place.prepared), &metrics, &rendering);
            measured.rows.push(Row { shard, combinations, expected_rms, ..row });
            if sweep.keep_pictures {
                measured.pictures.push(over_grey(&rendering.radiance, width, height, display));
            }
            rows.advance()?;
        }
        Ok(())
    })
}

impl Sweep {
    /// How many measurements this is.
    pub fn row_count(&self) -> usize {
        self.cases.estimators().len() * self.cases.place_count()
    }

    fn settings(&self, prepared: &Prepared) -> Settings {
        let &View { width, height, subpixels, .. } = &prepared.view;
        let &Self { repeat, whole_picture, .. } = self;
        Settings { width, height, subpixels, seed: self.cases.seed, repeat, whole_picture }
    }
}

fn row(place: &Place, settings: Settings, metrics: &Metrics, rendering: &Rendering) -> Row {
    let &Metrics { rms, rms_linear, max, ssim, flip, nan, .. } = metrics;
    Row {
        method: place.prepared.variant().name(),
        threads: place.prepared.sampling.count,
        material: place.material.to_owned(),
        environment: place.environment.to_owned(),
        scene: place.scene.to_owned(),
        rms,
        rms_linear,
        ssim,
        flip,
        max,
        nan,
        gpu_ms: rendering.gpu_ms(),
        frame_ms: rendering.frame_ms,
        lookups: rendering.lookups,
        covered_pixels: rendering.counters.covered_pixels(),
        shade_ms: rendering.shade_ms(),
        settings,
        shard: None,
        combinations: None,
        expected_rms: None,
    }
}
