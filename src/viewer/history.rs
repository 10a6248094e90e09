//! Undo and redo: the scenes that were asked for before, one for each thing that the user did.
//!
//! Camera and size of the picture are not among what is undone: who takes a material back wants to see it from where the other was seen. Only
//! where a whole scene is taken back does its camera go with it.
use super::change::Change;
use super::session::Edit;
use crate::scene::Scene;
use std::time::{Duration, Instant};

/// Changes of one setting that follow each other within this time are one, such as those of a key that is held down. While the pointer is
/// held down they are one whatever the time.
const ONE_MOTION: Duration = Duration::from_millis(500);
/// So many scenes are kept. Each is some hundred bytes, the tables that it names are elsewhere.
const KEPT: usize = 1000;

/// What was asked for before, and what was undone.
#[derive(Clone, Debug, Default)]
pub struct History {
    before: Vec<Moment>,
    undone: Vec<Moment>,
    /// When the last change was made; none if that goes on no more.
    last: Option<Instant>,
    /// Whether the pointer is held down.
    is_held: bool,
}

/// A scene as it was.
#[derive(Clone, Debug)]
struct Moment {
    scene: Scene,
    /// What was done then, or undone.
    edit: Edit,
    /// Its number: [`super::session::Session::change`].
    number: u64,
}

impl History {
    /// `edit` of this number is about to be made of the scene `before`, at the time `now`.
    pub fn record(&mut self, before: &Scene, edit: Edit, number: u64, now: Instant) {
        if matches!(edit, Edit::Change(Change::Camera(_) | Change::Size(..))) {
            return;
        }
        self.undone.clear();
        let last = self.last.replace(now);
        let last = last.filter(|last| self.is_held || now.saturating_duration_since(*last) < ONE_MOTION);
        if let (Some(_), Some(moment), Edit::Change(change)) = (last, self.before.last_mut(), &edit)
            && matches!(&moment.edit, Edit::Change(last) if last.is_undone_by(change))
        {
            (moment.edit, moment.number) = (edit, number);
            return;
        }
        if self.before.len() == KEPT {
            self.before.remove(0);
        }
        self.before.push(Moment { scene: before.clone(), edit, number });
    }

    /// The pointer is pressed, or released: either way what follows is another motion.
    pub fn hold(&mut self, is_held: bool) {
        if self.is_held != is_held {
            (self.is_held, self.last) = (is_held, None);
        }
    }

    /// The edits of these numbers could not be: as if they had never been made.
    pub fn forget(&mut self, numbers: &[u64]) {
        let Some(first) = self.before.iter().position(|moment| numbers.contains(&moment.number)) else { return };
        // It is from after them.
        self.undone.clear();
        let mut scene = self.before[first].scene.clone();
        for Moment { scene: was, edit, number } in self.before.split_off(first) {
            // The camera stays, as it does where edits are undone.
            let before = Scene { camera: was.camera, ..scene.clone() };
            if !numbers.contains(&number) && edit.apply(&mut scene).is_ok() {
                self.before.push(Moment { scene: before, edit, number });
            }
        }
    }

    /// The scene before the last thing that changed `wanted`, looked at as that is; none if nothing did.
    pub fn undo(&mut self, wanted: &Scene) -> Option<Scene> {
        step(&mut self.before, &mut self.undone, &mut self.last, wanted)
    }

    /// The scene before the last [`undo`](Self::undo), looked at as `wanted` is; none if something else was done since.
    pub fn redo(&mut self, wanted: &Scene) -> Option<Scene> {
        step(&mut self.undone, &mut self.before, &mut self.last, wanted)
    }

    /// Whether there is something to undo, and to redo.
    pub fn has(&self) -> [bool; 2] {
        [!self.before.is_empty(), !self.undone.is_empty()]
    }
}

/// Takes the last scene that is not `wanted` anyway, as what could not be loaded leaves, and puts `wanted` into its place.
fn step(from: &mut Vec<Moment>, to: &mut Vec<Moment>, last: &mut Option<Instant>, wanted: &Scene) -> Option<Scene> {
    *last = None;
    while let Some(Moment { mut scene, edit, number }) = from.pop() {
        // Another scene had another camera.
        if matches!(edit, Edit::Change(_)) {
            scene.camera = wanted.camera;
        }
        (scene.image.width, scene.image.height) = (wanted.image.width, wanted.image.height);
        if scene != *wanted {
            to.push(Moment { scene: wanted.clone(), edit, number });
            return Some(scene);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::MaterialSource;

    /// What a user does, one thing a second.
    struct User {
        history: History,
        scene: Scene,
        now: Instant,
        /// Of the last edit.
        number: u64,
    }

    impl User {
        fn new() -> Self {
            Self { history: History::default(), scene: Scene::default(), now: Instant::now(), number: 0 }
        }

        fn does_after(&mut self, change: &Change, wait: Duration) {
            self.now += wait;
            self.number += 1;
            self.history.record(&self.scene, Edit::Change(change.clone()), self.number, self.now);
            change.apply(&mut self.scene).unwrap();
        }

        fn does(&mut self, change: &Change) {
            self.does_after(change, Duration::from_secs(1));
        }

        fn undoes(&mut self) -> bool {
            let scene = self.history.undo(&self.scene);
            scene.map(|scene| self.scene = scene).is_some()
        }

        fn redoes(&mut self) -> bool {
            let scene = self.history.redo(&self.scene);
            scene.map(|scene| self.scene = scene).is_some()
        }
    }

    #[test]
    fn each_thing_done_is_undone_and_done_again_in_turn() {
        let mut user = User::new();
        assert!(!user.undoes() && !user.redoes() && user.history.has() == [false, false]);
        let mut scenes = vec![user.scene.clone()];
        for change in
            [Change::Exposure(2.0), Change::Material(MaterialSource::Builtin("silver".into())), Change::Gamma(1.5)]
        {
            user.does(&change);
            scenes.push(user.scene.clone());
        }
        for scene in scenes.iter().rev().skip(1) {
            assert!(user.undoes() && user.scene == *scene);
        }
        assert!(!user.undoes());
        for scene in &scenes[1..] {
            assert!(user.redoes() && user.scene == *scene);
        }
        assert!(!user.redoes());
        // What was undone is gone when something else is done.
        user.undoes();
        user.does(&Change::Gamma(2.0));
        assert!(user.history.has() == [true, false] && !user.redoes());
    }

    #[test]
    fn a_slider_that_is_dragged_is_one_thing() {
        let mut user = User::new();
        for step in 0..20 {
            user.does_after(&Change::Exposure(1.0 + f64::from(step)), Duration::from_millis(100));
        }
        // Another setting is another thing, and so is the same one later.
        user.does_after(&Change::Gamma(1.5), Duration::from_millis(100));
        user.does(&Change::Gamma(1.8));
        user.undoes();
        assert_eq!((user.scene.image.exposure, user.scene.image.gamma), (20.0, 1.5));
        user.undoes();
        assert_eq!((user.scene.image.exposure, user.scene.image.gamma), (20.0, 2.2));
        assert!(user.undoes() && user.scene == Scene::default());
    }

    #[test]
    fn what_is_dragged_is_one_thing_until_it_is_released_however_slowly() {
        let mut user = User::new();
        user.does(&Change::Exposure(1.5));
        user.history.hold(true);
        for exposure in [2.0, 3.0, 4.0] {
            user.does(&Change::Exposure(exposure));
            user.history.hold(true);
        }
        user.history.hold(false);
        user.does_after(&Change::Exposure(5.0), Duration::from_millis(100));
        for expected in [4.0, 1.5, 1.0] {
            assert!(user.undoes() && user.scene.image.exposure == expected, "{}", user.scene.image.exposure);
        }
        assert!(!user.undoes());
    }

    #[test]
    fn camera_and_size_stay_as_they_are() {
        let mut user = User::new();
        user.does(&Change::Exposure(2.0));
        let camera = crate::scene::Camera::framing(glam::DVec3::ONE, 3.0, 1.0);
        user.does(&Change::Camera(Some(camera)));
        user.does(&Change::Size(30, 20));
        assert!(user.undoes());
        assert_eq!((user.scene.image.exposure, user.scene.camera, user.scene.image.width), (1.0, Some(camera), 30));
        assert!(!user.undoes(), "moving the camera is nothing to undo");
        // Nor is it something else done.
        user.does(&Change::Camera(None));
        user.does(&Change::Size(60, 40));
        assert!(user.redoes() && user.scene.image.exposure == 2.0);
    }

    #[test]
    fn a_whole_scene_goes_with_its_camera() {
        let mut user = User::new();
        let camera = |x: f64| Some(crate::scene::Camera::framing(glam::DVec3::ONE, x, 1.0));
        user.does(&Change::Camera(camera(1.0)));
        let dropped = Scene { camera: camera(2.0), objects: Vec::new(), ..Scene::default() };
        user.history.record(&user.scene, Edit::Scene(Box::new(dropped.clone())), 9, user.now);
        let before = std::mem::replace(&mut user.scene, dropped.clone());
        assert!(user.undoes() && user.scene == before);
        assert!(user.redoes() && user.scene == dropped);
    }

    #[test]
    fn what_could_not_be_loaded_is_nothing_to_undo() {
        let mut user = User::new();
        let exposed = |exposure: f64, gamma: f64| {
            let mut scene = Scene::default();
            (scene.image.exposure, scene.image.gamma) = (exposure, gamma);
            scene
        };
        user.does(&Change::Exposure(2.0));
        user.does(&Change::Material(MaterialSource::File("broken.binary".into())));
        let broken = user.number;
        // It has not failed yet.
        user.does(&Change::Exposure(3.0));
        user.does(&Change::Gamma(1.5));
        user.history.forget(&[broken]);
        user.scene = exposed(3.0, 1.5);
        for expected in [exposed(3.0, 2.2), exposed(2.0, 2.2), Scene::default()] {
            assert!(user.undoes() && user.scene == expected, "{:?}", user.scene);
        }
        assert!(!user.undoes());
        for expected in [exposed(2.0, 2.2), exposed(3.0, 2.2), exposed(3.0, 1.5)] {
            assert!(user.redoes() && user.scene == expected, "{:?}", user.scene);
        }
        // What was undone meanwhile is after it.
        user.does(&Change::Material(MaterialSource::File("broken.binary".into())));
        user.does(&Change::Exposure(4.0));
        user.undoes();
        user.history.forget(&[user.number - 1]);
        user.scene = exposed(3.0, 1.5);
        assert!(!user.redoes() && user.undoes() && user.scene == exposed(3.0, 2.2));
    }
}
