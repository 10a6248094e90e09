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
    /// What was asked for and is not shown yet.
    pending: Vec<Pending>,
}

/// What was asked for and is not shown yet.
#[derive(Clone, Debug, PartialEq)]
struct Pending {
    /// Grows from one to the next.
    number: u64,
    edit: Edit,
    /// Whether it is a scene with a camera or a display of its own. Until it is loaded, what is seen is looked at as before.
    has_own_view: bool,
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
        self.pending.iter().map(|pending| pending.edit.clone()).collect()
    }

    /// Whether something that is not shown yet names the file at `path`.
    pub fn asks_for(&self, path: &Path) -> bool {
        self.pending.iter().any(|Pending { edit, .. }| match edit {
            Edit::Change(change) => change.files().iter().any(|file| file == path),
            Edit::Scene(scene) => scene.files().iter().any(|file| file == path),
        })
    }

    /// Whether one camera suits what is wanted and what is seen: objects are where they were, and no scene is awaited that has a view of its own.
    pub fn shares_a_camera(&self) -> bool {
        let place = |object: &ObjectSettings| (object.mesh.clone(), object.transform());
        let are_there = self.wanted.objects.iter().map(place).eq(self.shown.objects.iter().map(place));
        are_there && self.awaited_view().is_none()
    }

    /// The number of the last scene with a view of its own that is not shown yet.
    fn awaited_view(&self) -> Option<u64> {
        self.pending.iter().rfind(|pending| pending.has_own_view).map(|pending| pending.number)
    }

    /// Makes a change, whose number is above that of all before.
    ///
    /// # Errors
    /// Those of [`Change::apply`]; nothing is changed then.
    pub fn change(&mut self, change: &Change, number: u64) -> Result<()> {
        change.apply(&mut self.wanted)?;
        if change.is_seen_at_once() {
            return change.apply(&mut self.shown);
        }
        // Of a slider that is dragged only the last value counts.
        if let Some(Pending { edit: Edit::Change(last), .. }) = self.pending.last()
            && last.is_undone_by(change)
        {
            self.pending.pop();
        }
        self.pending.push(Pending { number, edit: Edit::Change(change.clone()), has_own_view: false });
        Ok(())
    }

    /// The same for a whole other scene, such as one from a file.
    pub fn replace(&mut self, scene: Scene, number: u64) {
        let has_own_view = scene != scene.clone().with_frame_settings_of(&self.wanted);
        self.pending.push(Pending { number, edit: Edit::Scene(Box::new(scene.clone())), has_own_view });
        self.wanted = scene;
    }

    /// All that `scene` needs is there, which has all changes up to this number: it is shown.
    pub fn loaded(&mut self, scene: Scene, number: u64) {
        let brings_view = self.pending.iter().any(|pending| pending.number <= number && pending.has_own_view);
        self.pending.retain(|pending| pending.number > number);
        self.shown = match self.awaited_view() {
            None => scene.with_frame_settings_of(&self.wanted),
            Some(_) if brings_view => scene,
            Some(_) => scene.with_frame_settings_of(&self.shown),
        };
    }

    /// What was wanted cannot be: what is seen is wanted again, with the changes but those that `cannot_be`, or without any if there are none of
    /// these. The numbers of those that were taken back: none where others have taken the place of what was at fault.
    pub fn failed(&mut self, cannot_be: &[Edit]) -> Vec<u64> {
        let before: Vec<_> = self.pending.iter().map(|pending| pending.number).collect();
        let awaited = self.awaited_view();
        self.pending.retain(|pending| !cannot_be.contains(&pending.edit));
        if cannot_be.is_empty() {
            self.pending.clear();
        }
        let wanted_before = std::mem::replace(&mut self.wanted, self.shown.clone());
        let wanted = &mut self.wanted;
        self.pending.retain(|pending| pending.edit.apply(wanted).is_ok());
        // What was changed of the view since is of the scene that it is awaited with.
        if awaited.is_some() && awaited == self.awaited_view() {
            self.wanted = self.wanted.clone().with_frame_settings_of(&wanted_before);
        }
        before.into_iter().filter(|number| self.pending.iter().all(|left| left.number != *number)).collect()
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
    use crate::scene::{Background, Camera, MaterialSource, Source};

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

    /// A scene with a view of its own, with this mesh.
    fn opened(mesh: &str) -> Scene {
        let mut scene = Scene { camera: Some(Camera::framing(glam::DVec3::ONE, 3.0, 1.0)), ..Scene::default() };
        scene.objects[0].mesh = Source::File(mesh.into());
        (scene.image.exposure, scene.environment.rotation_deg) = (8.0, 90.0);
        scene
    }

    #[test]
    fn another_scene_is_looked_at_in_its_own_way_once_it_is_loaded() {
        let mut session = Session::new(Scene::default());
        session.replace(opened("a.obj"), 1);
        assert!(session.shown() == &Scene::default() && !session.shares_a_camera());
        // What is changed of the view meanwhile is seen, and stays.
        session.change(&Change::Gamma(1.5), 2).unwrap();
        assert_eq!((session.shown().image.gamma, session.shown().image.exposure), (1.5, 1.0));
        session.replace(opened("b.obj"), 3);
        // The first comes, although another is wanted by now.
        session.loaded(opened("a.obj"), 2);
        assert_eq!(session.shown(), &opened("a.obj"));
        session.change(&Change::Gamma(1.8), 4).unwrap();
        session.loaded(session.wanted().clone(), 4);
        let mut expected = opened("b.obj");
        expected.image.gamma = 1.8;
        assert!(session.shown() == &expected && session.wanted() == &expected && session.shares_a_camera());
        // One that is looked at as what is shown is, such as after an undo, holds nothing up.
        session.replace(Scene { materials: Scene::default().materials, ..expected }, 5);
        assert!(session.shares_a_camera());
    }

    #[test]
    fn another_scene_that_cannot_be_loaded_leaves_the_view_as_it_is() {
        let mut session = Session::new(Scene::default());
        session.change(&material("copper"), 1).unwrap();
        let [mut shown, mut expected] = [session.shown().clone(), session.wanted().clone()];
        session.replace(opened("broken.obj"), 2);
        session.change(&Change::Gamma(1.5), 3).unwrap();
        (shown.image.gamma, expected.image.gamma) = (1.5, 1.5);
        assert_eq!(session.failed(&[Edit::Scene(Box::new(opened("broken.obj")))]), [2]);
        assert_eq!((session.wanted(), session.shown()), (&expected, &shown));
        // One that is not at fault has what was changed of its view since.
        session.replace(opened("good.obj"), 4);
        session.change(&Change::Gamma(1.8), 5).unwrap();
        session.change(&broken_mesh(), 6).unwrap();
        assert_eq!(session.failed(&[Edit::Change(broken_mesh())]), [6]);
        let mut expected = opened("good.obj");
        expected.image.gamma = 1.8;
        assert_eq!(session.wanted(), &expected);
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
