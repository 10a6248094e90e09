//! What is looked at: the scene that is asked for, and the one that is seen until what the first needs is there.
//!
//! A frame is a function of a [`Scene`] and nothing else, so changes are changes of a scene. Camera, turn of the light, size and display
//! are given to each frame anew, and seen at once; all else is asked of the memo first, in the background. What cannot be loaded changes
//! nothing.
use super::change::Change;
use crate::error::Result;
use crate::scene::{ImageSettings, Scene};

/// The scene that is asked for, and the one that is seen.
#[derive(Clone, Debug, PartialEq)]
pub struct Session {
    wanted: Scene,
    shown: Scene,
}

impl Session {
    /// Both are `scene`.
    pub fn new(scene: Scene) -> Self {
        Self { shown: scene.clone(), wanted: scene }
    }

    /// What is asked for: what the panel shows and what is saved.
    pub fn wanted(&self) -> &Scene {
        &self.wanted
    }

    /// What frames show: all of it has been loaded.
    pub fn shown(&self) -> &Scene {
        &self.shown
    }

    /// Makes a change.
    ///
    /// # Errors
    /// Those of [`Change::apply`]; nothing is changed then.
    pub fn change(&mut self, change: &Change) -> Result<()> {
        change.apply(&mut self.wanted)?;
        self.loaded(self.shown.clone());
        Ok(())
    }

    /// The same for a whole other scene, such as one from a file.
    pub fn replace(&mut self, scene: Scene) {
        self.wanted = scene;
        self.loaded(self.shown.clone());
    }

    /// All that `scene` needs is there: it is shown, in the way that is wanted by now.
    pub fn loaded(&mut self, scene: Scene) {
        let Scene { image, camera, environment, .. } = &self.wanted;
        // Sub-pixels and background are compiled and uploaded.
        let ImageSettings { subpixels, background, .. } = scene.image;
        self.shown =
            Scene { image: ImageSettings { subpixels, background, ..image.clone() }, camera: *camera, ..scene };
        self.shown.environment.rotation_deg = environment.rotation_deg;
        self.shown.environment.intensity = environment.intensity;
    }

    /// What was wanted cannot be: what is seen is wanted again.
    pub fn failed(&mut self) {
        self.wanted = self.shown.clone();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Background, MaterialSource, Source};

    fn material(name: &str) -> Change {
        Change::Material(MaterialSource::Builtin(name.into()))
    }

    #[test]
    fn what_has_to_be_made_waits_and_all_else_is_shown_at_once() {
        let mut session = Session::new(Scene::default());
        session.change(&material("silver")).unwrap();
        assert_eq!(session.shown().materials[0].name, "gold");
        let preparing = session.wanted().clone();
        for change in [Change::Exposure(2.0), Change::Rotation(20.0), Change::Size(100, 50), Change::Subpixels(1)] {
            session.change(&change).unwrap();
        }
        session.change(&Change::Background(Background::None)).unwrap();
        let Scene { image, environment, .. } = session.shown();
        assert_eq!((image.exposure, image.width, environment.rotation_deg), (2.0, 100, 20.0));
        assert_eq!((image.subpixels, image.background), (2, Background::Environment));
        // What comes back has the exposure of before.
        session.loaded(preparing);
        assert_eq!((session.shown().materials[0].name.as_str(), session.shown().image.exposure), ("silver", 2.0));
        session.loaded(session.wanted().clone());
        assert_eq!(session.shown(), session.wanted());
    }

    #[test]
    fn what_cannot_be_loaded_changes_nothing() {
        let mut session = Session::new(Scene::default());
        session.change(&Change::Mesh(Source::File("broken.obj".into()))).unwrap();
        session.change(&Change::Gamma(1.5)).unwrap();
        session.failed();
        let mut expected = Scene::default();
        expected.image.gamma = 1.5;
        assert_eq!((session.shown(), session.wanted()), (&expected, &expected));
        assert!(session.change(&Change::Exposure(f64::NAN)).is_err());
        assert_eq!((session.shown(), session.wanted()), (&expected, &expected));
    }
}
