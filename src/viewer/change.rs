//! What the viewer can change of a scene, as data. Each change is checked as it is made.
use serde::{Deserialize, Serialize};

use crate::error::Result;
use crate::method::{Method, Pattern};
use crate::prepare::check_count;
use crate::scene::{
    Background, Camera, EnvironmentSource, MAX_SAMPLES, MAX_SIZE_PX, MaterialSource, MeshSource, Scene, Source, within,
};
use std::path::PathBuf;

/// A change of the scene, as the panel, a key or a dropped file makes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Change {
    /// The material of all objects.
    Material(MaterialSource),
    /// What one of the scene's materials is. It keeps its name.
    OneMaterial {
        /// Name of the material in the scene.
        material: String,
        /// What it becomes.
        source: MaterialSource,
    },
    /// A parameter of one of the scene's materials, which becomes a model with parameters of its own if it is none yet. Measured
    /// tables have no parameters.
    Parameter {
        /// Name of the material in the scene.
        material: String,
        /// Key of the parameter.
        key: String,
        /// As it would stand in the scene file.
        value: toml::Value,
    },
    /// The light.
    Environment(EnvironmentSource),
    /// Turn of the environment in degrees.
    Rotation(f64),
    /// Factor of its radiance.
    Intensity(f64),
    /// The mesh in place of all objects.
    Mesh(MeshSource),
    /// Name of the shading method. The number of threads becomes what suits it.
    Method(Method),
    /// Number of threads or samples; none for as many as suit the method.
    Threads(Option<u32>),
    /// Where methods that can choose draw their samples.
    Pattern(Pattern),
    /// Seed of whatever is random.
    Seed(u64),
    /// Columns and rows of the image.
    Size(u32, u32),
    /// Sub-pixels along each axis of a pixel.
    Subpixels(u32),
    /// Factor on radiance before display.
    Exposure(f64),
    /// Exponent of the display.
    Gamma(f64),
    /// What is seen past the objects.
    Background(Background),
    /// Where from; none frames the objects.
    Camera(Option<Camera>),
}

impl Change {
    /// The files that it names, and those that they name: their contents may be others than when they were last named.
    pub fn files(&self) -> Vec<PathBuf> {
        match self {
            Self::Material(source) | Self::OneMaterial { source, .. } => source.files(),
            Self::Environment(Source::File(path)) | Self::Mesh(Source::File(path)) => vec![path.clone()],
            _ => Vec::new(),
        }
    }

    /// Whether it is of what frames are given anew ([`Scene::with_frame_settings_of`]): then they show it without anything being loaded or made.
    pub fn is_seen_at_once(&self) -> bool {
        matches!(
            self,
            Self::Rotation(_)
                | Self::Intensity(_)
                | Self::Size(..)
                | Self::Exposure(_)
                | Self::Gamma(_)
                | Self::Camera(_)
        )
    }

    /// Whether nothing is left of it once `later` is made.
    pub fn is_undone_by(&self, later: &Self) -> bool {
        match (self, later) {
            (Self::Parameter { material, key, .. }, Self::Parameter { material: later, key: later_key, .. }) => {
                (material, key) == (later, later_key)
            }
            (Self::OneMaterial { material, .. }, Self::OneMaterial { material: later, .. }) => material == later,
            _ => std::mem::discriminant(self) == std::mem::discriminant(later),
        }
    }

    /// Makes the change in `scene`.
    ///
    /// # Errors
    /// A value that is out of range, a name that is not known, a parameter of a material that has none; then `scene` is as it was.
    pub fn apply(&self, scene: &mut Scene) -> Result<()> {
        let mut changed = scene.clone();
        let Scene { image, environment, shading, .. } = &mut changed;
        match self {
            Self::Material(source) => {
                let name = match source {
                    MaterialSource::File(path) => path.display().to_string(),
                    MaterialSource::Builtin(name) => name.clone(),
                    MaterialSource::Model { model, .. } => model.clone(),
                    MaterialSource::Custom(custom) => custom.name().to_owned(),
                };
                changed.use_material(&name, source.clone());
            }
            Self::OneMaterial { material, source } => changed.material_mut(material)?.source = source.clone(),
            Self::Parameter { material, key, value } => changed.set_parameter(material, key, value)?,
            Self::Environment(source) => environment.source = source.clone(),
            Self::Rotation(degrees) => environment.rotation_deg = *degrees,
            Self::Intensity(factor) => environment.intensity = *factor,
            Self::Mesh(source) => changed.use_mesh(source.clone()),
            Self::Method(method) => (shading.method, shading.threads) = (*method, None),
            Self::Threads(count) => shading.threads = *count,
            Self::Pattern(pattern) => shading.pattern = *pattern,
            Self::Seed(seed) => shading.seed = *seed,
            Self::Size(width, height) => {
                check_picture_size([*width, *height])?;
                (image.width, image.height) = (*width, *height);
            }
            Self::Subpixels(side) => image.subpixels = *side,
            Self::Exposure(factor) => image.exposure = *factor,
            Self::Gamma(gamma) => image.gamma = *gamma,
            Self::Background(background) => image.background = *background,
            Self::Camera(camera) => changed.camera = *camera,
        }
        changed.check()?;
        check_count(changed.shading.method, changed.shading.count(), changed.image.subpixels)?;
        *scene = changed;
        Ok(())
    }
}

/// The largest number of threads or samples that `method` can have in `scene`.
pub fn most_count(method: Method, scene: &Scene) -> u32 {
    method.max_count(scene.image.subpixels).min(MAX_SAMPLES)
}

/// An error for columns and rows that no picture has.
pub(super) fn check_picture_size(size: [u32; 2]) -> Result<()> {
    size.into_iter().try_for_each(|side| within("size", side, &(1..=MAX_SIZE_PX)).map(drop))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::memo::Memo;
    use crate::prepare::key_of;
    use crate::scene::MaterialSettings;

    #[test]
    fn what_is_seen_at_once_is_what_frames_are_given_anew_and_is_not_in_the_key_of_a_scene() {
        let mut before = Scene::default();
        before.shading.method = Method::Importance;
        let torus = MeshSource::Builtin("torus".into());
        let roughness = Change::Parameter { material: "gold".into(), key: "alpha".into(), value: 0.3.into() };
        let silver = MaterialSource::Builtin("silver".into());
        let changes = [
            Change::Material(silver.clone()),
            Change::OneMaterial { material: "gold".into(), source: silver },
            roughness,
            Change::Environment(EnvironmentSource::Builtin("sky".into())),
            Change::Rotation(20.0),
            Change::Intensity(2.0),
            Change::Mesh(torus),
            Change::Method(Method::Fitted),
            Change::Threads(Some(5)),
            Change::Pattern(Pattern::Fixed),
            Change::Seed(3),
            Change::Size(20, 30),
            Change::Subpixels(1),
            Change::Exposure(2.0),
            Change::Gamma(1.5),
            Change::Background(Background::None),
            Change::Camera(Some(Camera::framing(glam::DVec3::ZERO, 2.0, 1.0))),
        ];
        let memo = Memo::default();
        let key = |scene: &Scene| key_of(scene, &memo).unwrap();
        for change in changes {
            let mut after = before.clone();
            change.apply(&mut after).unwrap();
            assert_ne!(after, before, "{change:?}");
            let seen_at_once = before.clone().with_frame_settings_of(&after) == after;
            assert_eq!(change.is_seen_at_once(), seen_at_once, "{change:?}");
            assert_eq!(key(&after) == key(&before), seen_at_once, "{change:?}");
        }
    }

    #[test]
    fn a_parameter_turns_a_builtin_into_a_model() {
        let mut scene = Scene::default();
        let parameter =
            |key: &str, value: toml::Value| Change::Parameter { material: "gold".into(), key: key.into(), value };
        parameter("alpha", 0.3.into()).apply(&mut scene).unwrap();
        let MaterialSource::Model { model, parameters } = &scene.materials[0].source else { panic!("no model") };
        assert_eq!((model.as_str(), parameters["alpha"].as_float()), ("conductor", Some(0.3)));

        for (change, what) in [
            (parameter("alpha", 7.0.into()), "alpha"),
            (parameter("alfa", 0.3.into()), "alfa"),
            (Change::Parameter { material: "tin".into(), key: "alpha".into(), value: 0.1.into() }, "tin"),
        ] {
            let before = scene.clone();
            let error = change.apply(&mut scene).unwrap_err().to_string();
            assert!(error.contains(what), "{error}");
            assert_eq!(scene, before);
        }
        Change::Material(MaterialSource::File("x.binary".into())).apply(&mut scene).unwrap();
        let change = Change::Parameter { material: "x.binary".into(), key: "alpha".into(), value: 0.1.into() };
        assert!(change.apply(&mut scene).unwrap_err().to_string().contains("no parameters"));
    }

    #[test]
    fn values_out_of_range_are_errors_and_change_nothing() {
        for (change, what) in [
            (Change::Exposure(-1.0), "exposure"),
            (Change::Exposure(f64::NAN), "exposure"),
            (Change::Gamma(0.0), "gamma"),
            (Change::Rotation(f64::INFINITY), "rotation"),
            (Change::Intensity(-1.0), "intensity"),
            (Change::Size(0, 480), "size"),
            (Change::Size(640, 100_000), "size"),
            (Change::Subpixels(5), "subpixels"),
            (Change::Threads(Some(0)), "threads"),
            (Change::Threads(Some(129)), "threads"),
            (Change::Camera(Some(Camera { fov_y_deg: 0.0, ..Camera::framing(glam::DVec3::ZERO, 1.0, 1.0) })), "fov"),
        ] {
            let mut scene = Scene::default();
            let error = change.apply(&mut scene).unwrap_err().to_string();
            assert!(error.contains(what) && !error.contains('\n'), "{error}");
            assert_eq!(scene, Scene::default());
        }
    }

    #[test]
    fn one_material_of_several_is_another_and_keeps_its_name() {
        let mut scene = Scene::default();
        scene.materials.push(MaterialSettings { name: "other".into(), source: MaterialSource::Builtin("clay".into()) });
        let before = scene.clone();
        let change = |material: &str| Change::OneMaterial {
            material: material.into(),
            source: MaterialSource::Builtin("silver".into()),
        };
        change("other").apply(&mut scene).unwrap();
        assert_eq!((&scene.materials[0], &scene.objects), (&before.materials[0], &before.objects));
        let MaterialSettings { name, source } = &scene.materials[1];
        assert_eq!((name.as_str(), source), ("other", &MaterialSource::Builtin("silver".into())));
        assert!(change("absent").apply(&mut scene).unwrap_err().to_string().contains("absent"));
    }

    #[test]
    fn another_method_has_as_many_threads_as_suit_it() {
        let mut scene = Scene::default();
        Change::Method(Method::Paper).apply(&mut scene).unwrap();
        Change::Threads(Some(1000)).apply(&mut scene).unwrap();
        Change::Method(Method::Fitted).apply(&mut scene).unwrap();
        assert_eq!(scene.shading.threads, None);
    }
}
