//! Comparison: another picture of the same view behind a line that can be dragged, where the two differ, and by how much.
//!
//! The other picture is made in the background, so that the frame stays what it is: by another method or number of threads, or as the
//! reference, stage by stage.
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use crate::error::Result;
use crate::evaluate::difference::heat_map;
use crate::evaluate::reference::{Estimate, ReferenceImage, STAGES, progressive, tone_map};
use crate::evaluate::{Comparable, Display, Metrics, compare};
use crate::memo::{Memo, Round};
use crate::method::Method;
use crate::pipeline::{DeviceScene, Wanted, render_geometry};
use crate::prepare::{Prepared, check_count, prepare};
use crate::progress::Observer;
use crate::scene::{Scene, ShadingSettings};
use crate::vulkan::Device;

/// Where the line between two pictures is: to its left the one, to its right the other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wipe(f64);

impl Default for Wipe {
    /// In the middle.
    fn default() -> Self {
        Self(0.5)
    }
}

impl Wipe {
    /// At this part of the width, put within 0 to 1; in the middle for NaN.
    pub fn at(part: f64) -> Self {
        if part.is_nan() { Self::default() } else { Self(part.clamp(0.0, 1.0)) }
    }

    /// Its part of the width, 0 to 1.
    pub fn part(self) -> f64 {
        self.0
    }
}

/// What the picture is compared with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Other {
    /// The same scene shaded so.
    Shading(ShadingSettings),
    /// The reference, computed for as long as the view stands still.
    Reference,
}

impl Other {
    /// Whether a picture of `scene` can be compared with it.
    ///
    /// # Errors
    /// More threads or samples than its method can have.
    pub fn check(&self, scene: &Scene) -> Result<()> {
        let Self::Shading(shading) = self else { return Ok(()) };
        check_count(shading.method, shading.count(), scene.image.subpixels)
    }
}

/// Two pictures of one view, and how they differ.
#[derive(Clone, Debug)]
pub struct Compared {
    /// What the picture is, for people.
    pub own_name: String,
    /// What the other picture is, for people.
    pub name: String,
    /// Columns and rows of all pictures here.
    pub size: [u32; 2],
    /// The other picture as a display shows it, RGBA.
    pub display: Vec<u8>,
    /// Where the two differ, RGBA: see [`heat_map`].
    pub heat_map: Vec<u8>,
    /// By how much, over the pixels that see a surface: the picture's error if the other one is the reference. None where there are too
    /// few of them.
    pub metrics: Option<Metrics>,
    /// Part of the pixels that the other picture has; between them `display` repeats its neighbours, and SSIM and FLIP are of a picture
    /// so much smaller.
    pub part: f64,
    /// Estimated error of the reference itself, RMS of display values.
    pub error_estimate: Option<f64>,
}

/// Compares the picture of `prepared` with the `other`, and hands the result to `publish`: once, or for the reference after every stage.
///
/// # Errors
/// Settings that cannot be, whatever Vulkan refuses, cancelled.
pub fn compare_with(
    prepared: &Prepared,
    other: &Other,
    device: &Arc<Device>,
    memo: &Memo,
    observer: &dyn Observer,
    publish: &mut dyn FnMut(Compared),
) -> Result<()> {
    let round = &memo.round(observer);
    let own = render(prepared, device, round)?;
    match other {
        Other::Shading(shading) => {
            let scene = Scene { shading: shading.clone(), ..prepared.scene.clone() };
            let other = prepare(&scene, round)?;
            let radiance = render(&other, device, round)?;
            let name = name_of(&other);
            publish(compared(prepared, name, &own, radiance, 1, None));
        }
        Other::Reference => {
            let geometry = render_geometry(device, prepared, round)?;
            progressive(prepared, &geometry, STAGES, observer, &mut |estimate| {
                let Estimate { stage, radiance, error_estimate } = estimate;
                let name = Method::Reference.name().to_owned();
                publish(compared(prepared, name, &own, radiance, stage.step, Some(error_estimate)));
            })?;
        }
    }
    Ok(())
}

/// Linear radiance times coverage of the objects alone, and coverage.
fn render(prepared: &Prepared, device: &Arc<Device>, round: &Round) -> Result<Vec<[f32; 4]>> {
    let device_scene = DeviceScene::new(device, &prepared.objects_alone(), round)?;
    Ok(device_scene.render(Wanted::RADIANCE, 1)?.radiance)
}

fn name_of(prepared: &Prepared) -> String {
    format!("{}, {}", prepared.variant().name(), prepared.sampling.count)
}

/// Compares `own` with `other`, of which every `step`-th pixel along each axis counts.
fn compared(
    prepared: &Prepared,
    name: String,
    own: &[[f32; 4]],
    other: Vec<[f32; 4]>,
    step: usize,
    error_estimate: Option<f64>,
) -> Compared {
    let view = &prepared.view;
    let (width, height) = (view.width as usize, view.height as usize);
    let shown = Display::of(view);
    let comparable = |radiance: &[[f32; 4]], step: usize| {
        let rows = (0..height).step_by(step);
        let pixels: Vec<_> =
            rows.flat_map(|y| (0..width).step_by(step).map(move |x| radiance[y * width + x])).collect();
        Comparable::from_radiance(width.div_ceil(step), height.div_ceil(step), &pixels, true, shown)
    };
    let metrics = compare(&comparable(own, step), &comparable(&other, step), true).ok();
    let heat_map = heat_map(&comparable(own, 1), &comparable(&other, 1), true);
    let image = ReferenceImage { radiance: other, ..ReferenceImage::default() };
    Compared {
        own_name: name_of(prepared),
        name,
        size: [view.width, view.height],
        display: tone_map(&image.over_background(prepared), view),
        heat_map,
        metrics,
        part: 1.0 / (step * step) as f64,
        error_estimate,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_picture_can_be_compared_with_is_an_error() {
        let shading =
            |method, threads| Other::Shading(ShadingSettings { method, threads, ..ShadingSettings::default() });
        let check = |other: Other| other.check(&Scene::default());
        for (method, threads) in [(Method::Fitted, 500), (Method::Paper, 5000)] {
            let error = check(shading(method, Some(threads))).unwrap_err().to_string();
            assert!(error.contains("threads") && error.contains(&threads.to_string()), "{error}");
            check(shading(method, Some(64))).unwrap();
            check(shading(method, None)).unwrap();
        }
        check(Other::Reference).unwrap();
    }

    #[test]
    fn the_line_stays_in_the_picture() {
        for (part, expected) in [(0.25, 0.25), (-1.0, 0.0), (7.0, 1.0), (f64::NAN, 0.5), (f64::INFINITY, 1.0)] {
            assert_eq!(Wipe::at(part).part(), expected);
        }
    }
}
