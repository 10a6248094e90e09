//! What the session asks for, made in the background: by drafts first where a parameter is dragged.
use super::change::Change;
use super::interaction::Viewer;
use super::latest_job::{Progress, Task};
use super::loaded::{Fault, Loaded, Made};
use super::session::Edit;
use crate::memo::Round;
use crate::pipeline::{DeviceScene, Wanted};
use crate::prepare::{Prepared, can_draft, key_of, may_be_drafted, prepare, prepare_draft};
#[cfg(feature = "hot-reload")]
use crate::progress::Observer;
use crate::steps::{LoadEnvironment, LoadMaterial, LoadMesh};
use crate::{Error, Result};
use std::time::{Duration, Instant};

/// Frames wait for a draft so long at most.
const DRAFT_PATIENCE: Duration = Duration::from_millis(100);
/// Threads are finished when nobody has asked for others for so long: what is dragged moves more often.
const BEFORE_FINISHING: Duration = Duration::from_millis(100);

/// Loads all files and names that `edit` brings in.
///
/// # Errors
/// The first that cannot be loaded; cancelled.
fn load_all_of(edit: &Edit, round: &Round) -> Result<()> {
    let environment = |source| round.ask(&LoadEnvironment(source)).map(drop);
    let material = |source| round.ask(&LoadMaterial(source)).map(drop);
    let mesh = |source| round.ask(&LoadMesh(source)).map(drop);
    match edit {
        Edit::Change(Change::Environment(source)) => environment(source),
        Edit::Change(Change::Material(source) | Change::OneMaterial { source, .. }) => material(source),
        Edit::Change(Change::Mesh(source)) => mesh(source),
        Edit::Change(_) => Ok(()),
        Edit::Scene(scene) => {
            environment(&scene.environment.source)?;
            scene.materials.iter().try_for_each(|settings| material(&settings.source))?;
            scene.objects.iter().try_for_each(|object| mesh(&object.mesh))
        }
    }
}

/// Which of the `edits` are at fault where all of them together fail with `error`.
fn faults(error: Error, mut edits: Vec<Edit>, round: &Round) -> Vec<Fault> {
    // One that is alone is taken back whatever is at fault.
    if edits.len() < 2 {
        return vec![Fault { error, edit: edits.pop() }];
    }
    let fault = |edit: Edit| load_all_of(&edit, round).err().map(|error| Fault { error, edit: Some(edit) });
    let faults: Vec<_> = edits.into_iter().filter_map(fault).collect();
    if faults.is_empty() { vec![Fault { error, edit: None }] } else { faults }
}

impl Viewer {
    /// How far the loading of what is wanted is.
    pub fn progress(&self) -> Option<Progress> {
        self.requests.loading.progress()
    }

    /// Whether something is being loaded or made that frames wait for.
    pub fn is_loading(&self) -> bool {
        self.requests.loading.is_busy()
    }

    /// Until when frames wait for the draft that is being made, if one is: where a slider is and what it asks for are shown together.
    pub fn draft_awaited_until(&self) -> Option<Instant> {
        self.requests.drafting_since.map(|since| since + DRAFT_PATIENCE)
    }

    /// A frame was drawn of what was loaded: what was wanted meanwhile is asked for.
    pub fn frame_was_drawn(&mut self) {
        if std::mem::take(&mut self.requests.request_after_frame) {
            self.request();
        }
    }

    /// Whether the next frame shows a draft that no frame has shown yet.
    pub fn has_new_draft(&self) -> bool {
        self.requests.request_after_frame
    }

    /// Whether anything is made in the background.
    pub fn is_busy(&self) -> bool {
        self.is_loading() || self.requests.getting_ready.is_busy() || self.comparer.is_busy() || self.plotter.is_busy()
    }

    /// Asks for what is wanted, if that is another than what was asked for last: for a draft of it first, where that can be.
    pub(super) fn request(&mut self) {
        let scene = self.session.wanted().clone();
        // Where a file cannot be read there is no key, and asking for it tells why.
        let key = key_of(&scene, &self.memo).ok();
        self.requests.wanted = key;
        if key.is_some() && self.requests.requested == key {
            // Files that were read for their key alone are not asked for.
            self.memo.let_go_of_files();
            if self.is_wanted(self.loaded.as_ref()) {
                self.session.loaded(scene, self.changes);
            }
            return;
        }
        let before = self.loaded.as_ref().map(|loaded| loaded.prepared.clone());
        let before = before.filter(|before| can_draft(&scene, before));
        if before.is_some() && (self.requests.drafting_since.is_some() || self.requests.request_after_frame) {
            // The draft that is being made is shown first: else one that moves would never be seen.
            return;
        }
        (self.requests.requested, self.requests.drafting_since) = (key, before.is_some().then(Instant::now));
        self.requests.getting_ready.cancel();
        let (device, memo) = (self.device.clone(), self.memo.clone());
        let (longest_side, change) = (self.longest_side, self.changes);
        self.load(move |task| {
            let loaded = |prepared, round: &Round| Loaded::new(&device, prepared, longest_side, round, key, change);
            if let Some(before) = before {
                let round = memo.round(task);
                if let Some(draft) = prepare_draft(&scene, &before, &round)? {
                    task.publish(Ok(loaded(draft, &round)?));
                    task.rest(BEFORE_FINISHING)?;
                }
            }
            let round = memo.round(task);
            loaded(prepare(&scene, &round)?, &round)
        });
    }

    /// Whether frames of what is `loaded` are of what is wanted.
    pub(super) fn is_wanted(&self, loaded: Option<&Loaded>) -> bool {
        loaded.is_some_and(|loaded| loaded.key.is_some() && loaded.key == self.requests.wanted)
    }

    /// Has `make` done in the background. Where that fails, so is finding out which edits are at fault: it may read large files again.
    fn load(&self, make: impl FnOnce(&Task<Made>) -> Result<Loaded> + Send + 'static) {
        let (memo, edits) = (self.memo.clone(), self.session.pending());
        self.requests
            .loading
            .request(move |task| Ok(make(task).map_err(|error| faults(error, edits, &memo.round(task)))));
    }

    /// Compiles the shaders anew, and everything that is made of them; if that fails, what is shown stays.
    #[cfg(feature = "hot-reload")]
    pub(super) fn reload_shaders(&mut self) {
        let scene = self.session.wanted().clone();
        let (key, change) = (key_of(&scene, &self.memo).ok(), self.changes);
        (self.requests.requested, self.requests.drafting_since) = (key, None);
        let (device, memo, longest_side) = (self.device.clone(), self.memo.clone(), self.longest_side);
        self.load(move |task| {
            Observer::begin(task, "shaders");
            let round = memo.round(task);
            let prepared = prepare(&scene, &round)?;
            crate::vulkan::hot_reload::reload(|| Loaded::new(&device, prepared, longest_side, &round, key, change))
        });
    }

    /// Begins to make what drafts of what is `loaded` look up and are shaded by, if there can be any: else the first one of a drag would wait
    /// for it.
    fn get_ready_for_drafts(&mut self, loaded: &Loaded) {
        self.requests.ready = None;
        if !may_be_drafted(&loaded.prepared) {
            return;
        }
        let view = loaded.prepared.view.clone().fit(self.longest_side);
        let draft = Prepared { is_draft: true, view, ..(*loaded.prepared).clone() };
        let (device, memo) = (self.device.clone(), self.memo.clone());
        self.requests.getting_ready.request(move |task| {
            let device_scene = DeviceScene::new(&device, &draft, &memo.round(task))?;
            // Drivers may compile a shader where it first runs, and for the sizes that it meets.
            device_scene.render(Wanted::default(), 1)?;
            Ok(device_scene)
        });
    }

    /// Shows what has been loaded meanwhile; gives whether there is anything new.
    ///
    /// # Errors
    /// The scene that the viewer was started with cannot be loaded.
    pub fn take_loaded(&mut self) -> Result<bool> {
        #[cfg(feature = "hot-reload")]
        if self.shaders.take() {
            self.reload_shaders();
        }
        if let Some(ready) = self.requests.getting_ready.take() {
            // Where it cannot be made, drafts will tell.
            self.requests.ready = ready.ok();
        }
        let mut is_new = self.comparer.take().unwrap_or_else(|error| {
            self.tell_error(&error);
            true
        });
        while let Some(result) = self.requests.loading.take() {
            is_new = true;
            let was_drafting = self.requests.drafting_since.take().is_some();
            match result.unwrap_or_else(|error| Err(vec![Fault { error, edit: None }])) {
                Ok(loaded) => {
                    // What was wanted since may be the same, from files of other names.
                    match self.is_wanted(Some(&loaded)) {
                        true => self.session.loaded(self.session.wanted().clone(), self.changes),
                        false => self.session.loaded(loaded.prepared.scene.clone(), loaded.change),
                    }
                    self.forget_errors(loaded.change);
                    let before = self.loaded.replace(loaded.clone());
                    self.is_compiled &=
                        before.is_some_and(|before| before.device_scene.shades_as(&loaded.device_scene));
                    self.requests.request_after_frame |= was_drafting;
                    self.motion.loaded(loaded.is_draft());
                    if !loaded.is_draft() {
                        self.get_ready_for_drafts(&loaded);
                        self.save_finished(true);
                    }
                }
                Err(faults) if faults.iter().any(|fault| matches!(fault.error, Error::Cancelled)) => {}
                Err(faults) => self.take_back(faults)?,
            }
        }
        Ok(is_new)
    }

    /// What was asked for failed with these `faults`: their edits are taken back, or all if they have none.
    fn take_back(&mut self, faults: Vec<Fault>) -> Result<()> {
        let (errors, edits): (Vec<_>, Vec<_>) = faults.into_iter().map(|Fault { error, edit }| (error, edit)).unzip();
        let cannot_be: Vec<_> = edits.into_iter().flatten().collect();
        let taken_back = self.session.failed(&cannot_be);
        // Else what failed is what is wanted still, and would fail again.
        let is_another_wanted = !(taken_back.is_empty() && cannot_be.is_empty());
        if self.loaded.is_none() && !is_another_wanted {
            return errors.into_iter().next().map_or(Ok(()), Err);
        }
        self.history.forget(&taken_back);
        self.latency.failed();
        self.memo.let_go_of_files();
        if is_another_wanted {
            self.go_back();
        }
        self.save_finished(is_another_wanted);
        self.tell_errors(&errors);
        Ok(())
    }

    /// Asks for what is left to be loaded after something was taken back.
    fn go_back(&mut self) {
        if let Some(loaded) = &self.loaded {
            // What is shown is of files as they were, which may have been edited and opened in vain since.
            for (path, key) in loaded.files.iter().filter(|(path, _)| !self.session.asks_for(path)) {
                self.memo.set_file_key(path, *key);
            }
        }
        // A draft is still to be finished.
        let finished = self.loaded.as_ref().filter(|loaded| !loaded.is_draft());
        self.requests.requested = finished.and_then(|loaded| loaded.key);
        self.request();
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        // All work is told to end before the first is waited for.
        self.requests.close();
        self.comparer.close();
        self.plotter.close();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::memo::Memo;
    use crate::method::Method;
    use crate::scene::{MaterialSource, Scene, Source};
    use crate::vulkan::test_device;
    use std::sync::Arc;

    /// Waits until nothing is being loaded.
    fn wait(viewer: &mut Viewer) {
        let start = Instant::now();
        while viewer.is_loading() {
            viewer.take_loaded().expect("something to show");
            assert!(start.elapsed() < Duration::from_secs(60), "it is loaded over and over: {:?}", viewer.failures);
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    /// A viewer that shows a small sphere of this material.
    fn viewer(material: MaterialSource) -> Viewer {
        let mut scene = Scene::default();
        scene.materials[0].source = material;
        scene.environment.source = Source::Builtin("white".to_owned());
        scene.shading.threads = Some(1);
        (scene.image.width, scene.image.height) = (32, 24);
        let mut viewer = Viewer::new(scene, &test_device::open(), Memo::default(), || ());
        wait(&mut viewer);
        viewer
    }

    #[test]
    fn a_draft_that_stands_still_is_sharp_before_it_is_finished() {
        let mut viewer = viewer(MaterialSource::Builtin("gold".to_owned()));
        viewer.change(&Change::Parameter { material: "gold".into(), key: "alpha".into(), value: 0.3.into() }).unwrap();
        let start = Instant::now();
        while !viewer.loaded().is_some_and(Loaded::is_draft) {
            assert!(start.elapsed() < Duration::from_secs(60), "no draft");
            viewer.take_loaded().expect("a draft");
        }
        assert!(viewer.motion.is_moving(false) && viewer.motion.next_frame().is_some());
        std::thread::sleep(Duration::from_millis(200));
        assert!(!viewer.motion.is_moving(false) && viewer.motion.next_frame().is_none());
    }

    #[test]
    fn what_cannot_be_loaded_is_known_when_a_failure_is_taken_whatever_becomes_of_the_files() {
        let mut viewer = viewer(MaterialSource::Builtin("gold".to_owned()));
        let folder = tempfile::tempdir().unwrap();
        let [mesh, material] = ["good.obj", "broken.toml"].map(|name| folder.path().join(name));
        std::fs::write(&mesh, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
        std::fs::write(&material, "model = 'lambert'\nreflectance = 7").unwrap();
        let mesh = Source::File(mesh);
        viewer.change(&Change::Mesh(mesh.clone())).unwrap();
        viewer.change(&Change::Material(MaterialSource::File(material))).unwrap();
        let start = Instant::now();
        let made = loop {
            if let Some(made) = viewer.requests.loading.take() {
                break made.unwrap();
            }
            assert!(start.elapsed() < Duration::from_secs(60), "it has not failed");
            std::thread::sleep(Duration::from_millis(1));
        };
        drop(folder);
        let Err(faults) = made else { panic!("it was loaded") };
        viewer.take_back(faults).unwrap();
        let wanted = viewer.session.wanted();
        assert_eq!((&wanted.objects[0].mesh, wanted.materials[0].name.as_str()), (&mesh, "gold"));
        assert!(viewer.failures.len() == 1 && viewer.failures[0].contains("broken.toml"), "{:?}", viewer.failures);
    }

    #[test]
    fn of_all_that_cannot_be_loaded_it_is_told_why() {
        let mut viewer = viewer(MaterialSource::Builtin("gold".to_owned()));
        viewer.change(&Change::Mesh(Source::File("missing.obj".into()))).unwrap();
        viewer.change(&Change::Environment(Source::File("missing.hdr".into()))).unwrap();
        viewer.change(&Change::Method(Method::Paper)).unwrap();
        viewer.change(&Change::Material(MaterialSource::File("missing.toml".into()))).unwrap();
        wait(&mut viewer);
        let missing = ["missing.obj", "missing.hdr", "missing.toml"];
        let are_told = |told: &[String]| missing.iter().zip(told).all(|(name, told)| told.contains(name));
        assert!(viewer.failures.len() == 3 && are_told(&viewer.failures), "{:?}", viewer.failures);
        let notice = viewer.notice.clone().map(|notice| notice.text).unwrap_or_default();
        assert!(missing.iter().all(|name| notice.contains(name)), "{notice}");
        assert_eq!(viewer.session.wanted().shading.method, Method::Paper);
    }

    #[test]
    fn what_has_taken_the_place_of_what_could_not_be_loaded_is_loaded() {
        let mut viewer = viewer(MaterialSource::Builtin("gold".to_owned()));
        let clay = MaterialSource::Builtin("clay".to_owned());
        viewer.change(&Change::Material(clay)).unwrap();
        let broken = Edit::Change(Change::Material(MaterialSource::File("broken.toml".into())));
        let error = Error::input("broken.toml", "is broken", "mend it");
        viewer.take_back(vec![Fault { error, edit: Some(broken) }]).unwrap();
        assert_eq!(viewer.session.wanted().materials[0].name, "clay");
        wait(&mut viewer);
        assert_eq!(viewer.session.shown().materials[0].name, "clay");
    }

    #[test]
    fn the_camera_moves_before_a_mesh_of_the_same_bytes_under_another_name() {
        let folder = tempfile::tempdir().unwrap();
        let [a, b] = ["a.obj", "b.obj"].map(|name| folder.path().join(name));
        std::fs::write(&a, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
        std::fs::copy(&a, &b).unwrap();
        let mut viewer = viewer(MaterialSource::Builtin("clay".to_owned()));
        viewer.change(&Change::Mesh(Source::File(a))).unwrap();
        // When that is loaded, and while it is.
        for is_loaded in [true, false] {
            if is_loaded {
                wait(&mut viewer);
            } else {
                viewer.frame_was_drawn();
                viewer.change(&Change::Mesh(Source::Builtin("sphere".to_owned()))).unwrap();
                wait(&mut viewer);
                viewer.frame_was_drawn();
                viewer.change(&Change::Mesh(Source::File(b.with_file_name("a.obj")))).unwrap();
                assert!(viewer.is_loading());
            }
            viewer.change(&Change::Mesh(Source::File(b.clone()))).unwrap();
            wait(&mut viewer);
            assert!(viewer.session.pending().is_empty(), "{is_loaded}");
            let before = viewer.session.wanted().camera;
            viewer.move_camera(|orbit| orbit.turn(glam::dvec2(30.0, 0.0), 24.0)).unwrap();
            let after = viewer.session.wanted().camera;
            assert!(after.is_some() && after != before, "{is_loaded}");
        }
    }

    #[test]
    fn what_a_file_is_over_is_read_again_with_it() {
        let folder = tempfile::tempdir().unwrap();
        let [base, coat] = ["base.toml", "coat.toml"].map(|name| folder.path().join(name));
        let write_base = |reflectance: f64| {
            std::fs::write(&base, format!("model = 'lambert'\nreflectance = {reflectance}")).unwrap();
        };
        write_base(0.2);
        std::fs::write(&coat, "model = 'layered'\nbase = 'base.toml'\ncoat = { alpha = 0.3, ior = 1.5 }").unwrap();
        let mut viewer = viewer(MaterialSource::File(coat.clone()));
        let seen =
            |viewer: &Viewer| viewer.loaded.as_ref().expect("a picture").prepared.materials[0].brdf.fingerprint();
        let before = seen(&viewer);
        write_base(0.6);
        viewer.change(&Change::Material(MaterialSource::File(coat))).unwrap();
        wait(&mut viewer);
        assert_ne!(seen(&viewer), before);
    }

    #[test]
    fn a_draft_that_cannot_be_finished_is_told_once_and_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("m.toml");
        std::fs::write(&path, "model = 'lambert'\nreflectance = 0.5").unwrap();
        let mut viewer = viewer(MaterialSource::File(path.clone()));
        // As if what is shown were a draft of what cannot be made.
        let loaded = viewer.loaded.take().expect("a picture");
        let prepared = Arc::new(Prepared { is_draft: true, ..(*loaded.prepared).clone() });
        viewer.loaded = Some(Loaded { prepared, ..loaded });
        std::fs::write(&path, "model = 'lambert'\nreflectance = 7").unwrap();
        viewer.memo.look_again(&path);
        for _ in 0..3 {
            viewer.request();
            wait(&mut viewer);
            assert_eq!(viewer.failures.len(), 1, "{:?}", viewer.failures);
        }
        assert!(viewer.loaded().is_some_and(Loaded::is_draft));
    }
}
