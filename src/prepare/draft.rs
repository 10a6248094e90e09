//! Prepares a scene with threads that are drafted from those of the one before, while a parameter is dragged.
use super::{Prepared, PreparedMaterial, ask_threads, prepare_by, thread_settings};
use crate::Result;
use crate::brdf::Brdf;
use crate::memo::Round;
use crate::scene::{MaterialSource, Scene};
use crate::steps::{DraftThreads, FitThreads};
use crate::threads::Threads;
use crate::threads::azimuths::azimuth_count;
use std::cell::Cell;

/// Whether threads of `scene` can be drafted from those of `before`: fitted ones, as many, of models whose parameters were changed.
pub fn can_draft(scene: &Scene, before: &Prepared) -> bool {
    let method = scene.shading.method;
    fn source<'s>(scene: &'s Scene, name: &str) -> Option<&'s MaterialSource> {
        scene.material(name).map(|material| &material.source)
    }
    let was_edited = |name: &str| match source(scene, name) {
        Some(MaterialSource::Model { .. }) => before.materials.iter().any(|material| material.name == name),
        other => other == source(&before.scene, name),
    };
    method.has_drafts()
        && before.method == method
        && before.sampling.count == scene.shading.count()
        && before.view.subpixels == scene.image.subpixels
        && scene.used_materials().into_iter().all(was_edited)
}

/// Whether parameters of `prepared` can be changed such that threads are drafted: [`can_draft`].
pub fn may_be_drafted(prepared: &Prepared) -> bool {
    let with_parameters = Brdf::models_with_parameters();
    prepared.method.has_drafts()
        && prepared.materials.iter().any(|material| with_parameters.contains(&material.brdf.model()))
}

/// As [`prepare`](super::prepare), but threads that are not known yet are drafted from those of `before`; none where that cannot be ([`can_draft`]) or
/// nothing has to be.
///
/// # Errors
/// Those of [`prepare`](super::prepare).
pub fn prepare_draft(scene: &Scene, before: &Prepared, round: &Round) -> Result<Option<Prepared>> {
    if !can_draft(scene, before) {
        return Ok(None);
    }
    let is_draft = Cell::new(false);
    let subpixels = scene.image.subpixels;
    let ask = |method, material: &PreparedMaterial, sampling| {
        let PreparedMaterial { name, brdf, lobe, .. } = material;
        let Some(settings) = thread_settings(method, lobe, sampling, subpixels) else { return Ok(None) };
        if let Some(finished) = round.known(&FitThreads { brdf, settings })? {
            return Ok(Some(finished));
        }
        let is_shown = |shown: &&PreparedMaterial| shown.name == *name && shown.brdf.model() == brdf.model();
        let mut shown = before.materials.iter().filter(is_shown);
        let has_same_azimuths = |threads: &Threads| {
            let azimuths = threads.fitted().map_or(1, |table| table.azimuths);
            // Finding those of an anisotropic BRDF takes a millisecond.
            if lobe.is_isotropic { azimuths == 1 } else { azimuths == azimuth_count(brdf) }
        };
        let drafted = shown.find_map(|shown| Some((shown, shown.threads.as_ref()?)));
        let Some((shown, threads)) = drafted.filter(|(_, threads)| has_same_azimuths(threads)) else {
            return ask_threads(round, method, material, sampling, subpixels);
        };
        is_draft.set(true);
        // While another material is edited, this one's draft serves on.
        let serves_on = shown.brdf.key == brdf.key;
        if serves_on {
            return Ok(Some(threads.clone()));
        }
        round.ask(&DraftThreads { brdf, before: threads }).map(Some)
    };
    let prepared = prepare_by(scene, round, &ask)?;
    Ok(is_draft.get().then_some(Prepared { is_draft: true, ..prepared }))
}
