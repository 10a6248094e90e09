//! What is looked at: the scene that is asked for, and the one that is seen until what the first needs is there.
//!
//! A frame is a function of a [`Scene`] and nothing else, so changes are changes of a scene. Camera, turn of the light, size and display
//! are given to each frame anew, and seen at once; all else is asked of the memo first, in the background. What cannot be loaded changes
//! nothing, and leaves other changes as they are.
use super::change::Change;
use crate::error::Result;
use crate::scene::{ObjectSettings, Scene};
use std::path::Path;

/// The scene that is asked for, and the one that is seen.
#[derive(Clone, Debug, PartialEq)]
pub struct Session {
    wanted: Scene,
    shown: Scene,
    /// What was asked for and is not shown yet, with its numbers, which grow.
    pending: Vec<(u64, Edit)>,
}

/// What was asked for.
#[derive(Clone, Debug, PartialEq)]
pub enum Edit {
    /// A change of the scene.
    Change(Change),
    /// Another scene.
    Scene(Box<Scene>),
}

impl Session {
    /// Both are `scene`.
    pub fn new(scene: Scene) -> Self {
        Self { shown: scene.clone(), wanted: scene, pending: Vec::new() }
    }

    /// What is asked for: what the panel shows and what is saved.
    pub fn wanted(&self) -> &Scene {
        &self.wanted
    }

    /// What frames show: all of it has been loaded.
    pub fn shown(&self) -> &Scene {
        &self.shown
    }

    /// What was asked for and is not shown yet.
    pub fn pending(&self) -> Vec<Edit> {
        self.pending.iter().map(|(_, edit)| edit.clone()).collect()
    }

    /// Whether something that is not shown yet names the file at `path`.
    pub fn asks_for(&self, path: &Path) -> bool {
        self.pending.iter().any(|(_, edit)| match edit {
            Edit::Change(change) => change.files().iter().any(|file| file == path),
            Edit::Scene(scene) => scene.files().iter().any(|file| file == path),
        })
    }

    /// Whether the objects that are wanted are where those are that are seen: else no camera suits both.
    pub fn shows_wanted_objects(&self) -> bool {
        let place = |object: &ObjectSettings| (object.mesh.clone(), object.transform());
        self.wanted.objects.iter().map(place).eq(self.shown.objects.iter().map(place))
    }

    /// Makes a change, whose number is above that of all before.
    ///
    /// # Errors
    /// Those of [`Change::apply`]; nothing is changed then.
    pub fn change(&mut self, change: &Change, number: u64) -> Result<()> {
        change.apply(&mut self.wanted)?;
        if !change.is_seen_at_once() {
            // Of a slider that is dragged only the last value counts.
            if let Some((_, Edit::Change(last))) = self.pending.last()
                && last.is_undone_by(change)
            {
                self.pending.pop();
            }
            self.pending.push((number, Edit::Change(change.clone())));
        }
        self.show(self.shown.clone());
        Ok(())
    }

    /// The same for a whole other scene, such as one from a file.
    pub fn replace(&mut self, scene: Scene, number: u64) {
        self.pending.push((number, Edit::Scene(Box::new(scene.clone()))));
        self.wanted = scene;
        self.show(self.shown.clone());
    }

    /// All that `scene` needs is there, which has all changes up to this number: it is shown.
    pub fn loaded(&mut self, scene: Scene, number: u64) {
        self.pending.retain(|(pending, _)| *pending > number);
        self.show(scene);
    }

    /// Shows `scene`, in the way that is wanted by now.
    fn show(&mut self, scene: Scene) {
        self.shown = scene.with_frame_settings_of(&self.wanted);
    }

    /// What was wanted cannot be: what is seen is wanted again, with the changes but those that `cannot_be`, or without any if there are none of
    /// these. The numbers of those that were taken back: none where others have taken the place of what was at fault.
    pub fn failed(&mut self, cannot_be: &[Edit]) -> Vec<u64> {
        let before: Vec<_> = self.pending.iter().map(|(number, _)| *number).collect();
        self.pending.retain(|(_, edit)| !cannot_be.contains(edit));
        if cannot_be.is_empty() {
            self.pending.clear();
        }
        self.wanted = self.shown.clone();
        let wanted = &mut self.wanted;
        self.pending.retain(|(_, edit)| edit.apply(wanted).is_ok());
        before.into_iter().filter(|number| self.pending.iter().all(|(left, _)| left != number)).collect()
    }
}

impl Edit {
    /// Makes it in `scene`.
    ///
    /// # Errors
    /// Those of [`Change::apply`]; then `scene` is as it was.
    pub fn apply(&self, scene: &mut Scene) -> Result<()> {
        match self {
            Self::Change(change) => change.apply(scene),
            Self::Scene(other) => {
                scene.clone_from(other);
                Ok(())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::method::Method;
    use crate::scene::{Background, MaterialSource, Source};

    fn material(name: &str) -> Change {
        Change::Material(MaterialSource::Builtin(name.into()))
    }

    #[test]
    fn what_has_to_be_made_waits_and_all_else_is_shown_at_once() {
        let mut session = Session::new(Scene::default());
        session.change(&material("silver"), 1).unwrap();
        assert_eq!(session.shown().materials[0].name, "gold");
        let preparing = session.wanted().clone();
        for change in [Change::Exposure(2.0), Change::Rotation(20.0), Change::Size(100, 50), Change::Subpixels(1)] {
            session.change(&change, 2).unwrap();
        }
        session.change(&Change::Background(Background::None), 3).unwrap();
        let Scene { image, environment, .. } = session.shown();
        assert_eq!((image.exposure, image.width, environment.rotation_deg), (2.0, 100, 20.0));
        assert_eq!((image.subpixels, image.background), (2, Background::Environment));
        // What comes back has the exposure of before.
        session.loaded(preparing, 1);
        assert_eq!((session.shown().materials[0].name.as_str(), session.shown().image.exposure), ("silver", 2.0));
        session.loaded(session.wanted().clone(), 3);
        assert_eq!(session.shown(), session.wanted());
    }

    fn broken_mesh() -> Change {
        Change::Mesh(Source::File("broken.obj".into()))
    }

    #[test]
    fn what_cannot_be_loaded_changes_nothing() {
        let mut session = Session::new(Scene::default());
        session.change(&broken_mesh(), 1).unwrap();
        session.change(&Change::Gamma(1.5), 2).unwrap();
        assert_eq!(session.failed(&[Edit::Change(broken_mesh())]), [1]);
        let mut expected = Scene::default();
        expected.image.gamma = 1.5;
        assert_eq!((session.shown(), session.wanted()), (&expected, &expected));
        assert!(session.change(&Change::Exposure(f64::NAN), 3).is_err());
        assert_eq!((session.shown(), session.wanted()), (&expected, &expected));
        assert!(session.failed(&[Edit::Change(broken_mesh())]).is_empty(), "there is nothing to take back");
    }

    #[test]
    fn what_cannot_be_loaded_leaves_other_changes_as_they_are() {
        let mut session = Session::new(Scene::default());
        session.change(&material("copper"), 1).unwrap();
        session.change(&Change::Environment(Source::Builtin("sky".into())), 2).unwrap();
        let mut expected = session.wanted().clone();
        session.change(&broken_mesh(), 3).unwrap();
        session.change(&Change::Method(Method::Paper), 4).unwrap();
        expected.shading.method = Method::Paper;
        assert_eq!(session.failed(&[Edit::Change(broken_mesh())]), [3]);
        assert_eq!(session.wanted(), &expected);
        // Nor those before another scene, which is broken.
        let mut broken = Scene::default();
        broken.objects[0].mesh = Source::File("broken.obj".into());
        session.replace(broken.clone(), 5);
        assert_eq!(session.failed(&[Edit::Scene(Box::new(broken))]), [5]);
        assert_eq!(session.wanted(), &expected);
        // One that has taken the place of what was at fault stays.
        session.change(&material("gold"), 6).unwrap();
        assert!(session.failed(&[Edit::Change(broken_mesh())]).is_empty());
        assert_eq!(session.wanted().materials[0].name, "gold");
        // Where none of them is at fault, what is shown is wanted.
        assert_eq!(session.failed(&[]), [1, 2, 4, 6]);
        assert_eq!(session.wanted(), session.shown());
    }
}
