//! What drafts of threads are worth while a parameter is dragged, there and back: `threadlight bench live`.
use std::sync::Arc;
use std::time::Instant;

use super::metrics::{Differences, check_comparable_size};
use super::reference::{ReferenceSettings, reference};
use super::tables::{Section, Table};
use super::{Comparable, Display, compare};
use crate::error::{Error, Result};
use crate::memo::{Memo, Round, Step};
use crate::method::Method;
use crate::pipeline::{DeviceScene, Wanted};
use crate::prepare::{Prepared, prepare, prepare_draft};
use crate::progress::{Observer, OnlyCancels, Parts};
use crate::scene::{Background, Scene};
use crate::statistics::{largest, mean, median};
use crate::steps::FitThreads;
use crate::vulkan::Device;

/// A parameter that is dragged.
#[derive(Clone, Debug)]
pub struct Drag {
    /// What is looked at, by fitted threads.
    pub scene: Scene,
    /// Name of a material of it.
    pub material: String,
    /// Key of a parameter of that.
    pub key: String,
    /// Its values, at least two: from the first to the last and back.
    pub values: Vec<toml::Value>,
}

/// One value of a drag, on its way there or back. Errors are RMS of display values, over the pixels that see a surface.
#[derive(Clone, Debug, serde::Serialize)]
pub struct LiveStep {
    /// Of the parameter.
    pub value: toml::Value,
    /// From threads of the value before to those of this one.
    pub draft_ms: f64,
    /// From nothing to finished threads of the material, the scene read.
    pub fit_ms: f64,
    /// Of the draft's picture.
    pub draft_rms: f64,
    /// Of the finished picture.
    pub finished_rms: f64,
    /// Largest change of a display value from the draft before.
    pub draft_change: f64,
    /// That of the reference.
    pub reference_change: f64,
}

/// What a value of the parameter has, whichever way it is come to.
struct Truth {
    reference: Comparable,
    fit_ms: f64,
    finished_rms: f64,
}

/// Drags and measures; `found` has the steps until an error or an interruption. `memo` keeps references and filtered environments.
///
/// # Errors
/// A parameter or values that there are not, a scene that cannot be prepared, a method other than `fitted`, pictures too small to
/// compare, [`Error::Cancelled`].
pub fn run(
    drag: &Drag,
    settings: &ReferenceSettings,
    device: &Arc<Device>,
    memo: &Memo,
    observer: &dyn Observer,
    found: &mut Vec<LiveStep>,
) -> Result<()> {
    let image = &drag.scene.image;
    check_comparable_size(image.width as usize, image.height as usize)?;
    let method = drag.scene.shading.method;
    if !method.has_drafts() {
        let remedy = format!("use method {}", Method::Fitted.name());
        return Err(Error::input(format!("method \"{}\"", method.name()), "has no drafts", remedy));
    }
    let values = &drag.values;
    let pictures = Parts::new(3 * values.len() - 2, observer);
    let inner = OnlyCancels(observer);
    let mut truths = Vec::new();
    for value in values {
        truths.push(truth(drag, value, settings, device, &memo.round(&inner))?);
        pictures.advance()?;
    }
    // Threads are neither read from disk nor remembered: what is known needs no draft.
    let drafts = Memo::default();
    let start = prepare(&drag.scene_at(&values[0])?, &drafts.round(&inner))?;
    let start_picture = picture(&start, device, &memo.round(&inner))?;
    let mut shown = (start, start_picture);
    let there_and_back = (1..values.len()).chain((0..values.len() - 1).rev());
    let mut before = 0;
    for at in there_and_back {
        let round = drafts.round(&inner);
        let start = Instant::now();
        let scene = drag.scene_at(&values[at])?;
        // What changes no threads, as a rotation, needs no draft.
        let draft = match prepare_draft(&scene, &shown.0, &round)? {
            Some(draft) => draft,
            None => prepare(&scene, &round)?,
        };
        let draft_ms = start.elapsed().as_secs_f64() * 1e3;
        let picture = picture(&draft, device, &memo.round(&inner))?;
        let Truth { reference, fit_ms, finished_rms } = &truths[at];
        found.push(LiveStep {
            value: values[at].clone(),
            draft_ms,
            fit_ms: *fit_ms,
            draft_rms: compare(&picture, reference, true)?.rms,
            finished_rms: *finished_rms,
            draft_change: largest_change(&shown.1, &picture),
            reference_change: largest_change(&truths[before].reference, reference),
        });
        (shown, before) = ((draft, picture), at);
        pictures.advance()?;
    }
    Ok(())
}

impl Drag {
    fn scene_at(&self, value: &toml::Value) -> Result<Scene> {
        let mut scene = self.scene.clone();
        scene.image.background = Background::None;
        scene.set_parameter(&self.material, &self.key, value)?;
        Ok(scene)
    }
}

fn truth(
    drag: &Drag,
    value: &toml::Value,
    settings: &ReferenceSettings,
    device: &Arc<Device>,
    round: &Round,
) -> Result<Truth> {
    // Threads are made, whatever is on disk.
    let nothing = Memo::default();
    let fits = nothing.round(round.observer());
    let finished = prepare(&drag.scene_at(value)?, &fits)?;
    // Threads were asked for once a material. One that no object has is not among them.
    let asked = finished.materials.iter().zip(fits.asked(FitThreads::NAME));
    let of_dragged = asked.filter(|(material, _)| material.name == drag.material);
    let fit_ms = of_dragged.map(|(_, asked)| asked.time.as_secs_f64() * 1e3).sum();
    let truth = reference(&finished, device, settings, round)?;
    let reference = comparable(&finished, &truth.radiance);
    let finished_rms = compare(&picture(&finished, device, round)?, &reference, true)?.rms;
    Ok(Truth { reference, fit_ms, finished_rms })
}

fn picture(prepared: &Prepared, device: &Arc<Device>, round: &Round) -> Result<Comparable> {
    let renderer = DeviceScene::new(device, prepared, round)?;
    let rendering = renderer.render(Wanted::RADIANCE, 1)?;
    Ok(comparable(prepared, &rendering.radiance))
}

fn comparable(prepared: &Prepared, radiance: &[[f32; 4]]) -> Comparable {
    let view = &prepared.view;
    Comparable::from_radiance(view.width as usize, view.height as usize, radiance, true, Display::of(view))
}

fn largest_change(before: &Comparable, after: &Comparable) -> f64 {
    Differences::of_pictures(&before.display, &after.display).max
}

/// One row of medians and worst cases.
pub fn table(drag: &Drag, found: &[LiveStep]) -> Section {
    let of = |part: fn(&LiveStep) -> f64| found.iter().map(part);
    let ratio = |step: &LiveStep| step.draft_rms / step.finished_rms.max(f64::MIN_POSITIVE);
    let row = |name: &str, cells: [String; 2]| (name.to_owned(), cells.to_vec());
    let ms = |part: fn(&LiveStep) -> f64| [format!("{:.1}", median(of(part))), format!("{:.1}", largest(of(part)))];
    let error = |part: fn(&LiveStep) -> f64| [format!("{:.5}", mean(of(part))), format!("{:.5}", largest(of(part)))];
    let change = [of(|step| step.draft_change), of(|step| step.reference_change)].map(largest);
    Section {
        title: format!("{} of {}, {} steps there and back:", drag.key, drag.material, drag.values.len()),
        tables: vec![
            Table::new(
                "time, ms",
                ["median", "worst"],
                [row("draft", ms(|step| step.draft_ms)), row("fit", ms(|step| step.fit_ms))],
            ),
            Table::new(
                "RMS",
                ["mean", "worst"],
                [
                    row("drafts", error(|step| step.draft_rms)),
                    row("finished", error(|step| step.finished_rms)),
                    row("ratio", [mean(of(ratio)), largest(of(ratio))].map(|value| format!("{value:.2}"))),
                ],
            ),
            Table::new("change", ["drafts", "reference"], [row("largest", change.map(|value| format!("{value:.4}")))]),
        ],
    }
}
