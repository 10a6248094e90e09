//! What is looked at: the scene being edited, and for each change what has to be done again.
//!
//! The frame is a function of a [`Scene`] and nothing else, so changes are changes of a scene, and what has to be done again is what two
//! scenes differ in: [`Redo::between`]. Changes that need something loaded or made first wait for it; all others are seen
//! at once. What cannot be loaded changes nothing.
use serde::{Deserialize, Serialize};

use crate::brdf::Brdf;
use crate::error::{Error, Result};
use crate::method::Method;
use crate::prepare::check_count;
use crate::scene::{
    Background, Camera, EXPOSURE, GAMMA, INTENSITY, MAX_SAMPLES, MAX_SIZE_PX, MAX_SUBPIXELS, MaterialSettings,
    MaterialSource, ObjectSettings, Scene, Source,
};
use std::fmt::Display;
use std::ops::RangeInclusive;

/// A change of the scene, as the panel, a key or a dropped file makes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Change {
    /// The material of all objects.
    Material(MaterialSource),
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
    Environment(Source),
    /// Turn of the environment in degrees.
    Rotation(f64),
    /// Factor of its radiance.
    Intensity(f64),
    /// The mesh in place of all objects.
    Mesh(Source),
    /// Name of the shading method. The number of threads becomes what suits it.
    Method(String),
    /// Number of threads or samples; none for as many as suit the method.
    Threads(Option<u32>),
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
            Self::Parameter { material, key, value } => set_parameter(&mut changed, material, key, value)?,
            Self::Environment(source) => environment.source = source.clone(),
            Self::Rotation(degrees) => {
                environment.rotation_deg = within("rotation", *degrees, &(f64::MIN..=f64::MAX))?;
            }
            Self::Intensity(factor) => environment.intensity = within("intensity", *factor, &INTENSITY)?,
            Self::Mesh(source) => changed.use_mesh(source.clone()),
            Self::Method(name) => {
                Method::from_name(name)?;
                (shading.method, shading.threads) = (name.clone(), None);
            }
            Self::Threads(count) => {
                count.map(|count| within("threads", count, &(1..=MAX_SAMPLES))).transpose()?;
                shading.threads = *count;
            }
            Self::Seed(seed) => shading.seed = *seed,
            Self::Size(width, height) => {
                let side = |side| within("size", side, &(1..=MAX_SIZE_PX));
                (image.width, image.height) = (side(*width)?, side(*height)?);
            }
            Self::Subpixels(side) => image.subpixels = within("subpixels", *side, &(1..=MAX_SUBPIXELS))?,
            Self::Exposure(factor) => image.exposure = within("exposure", *factor, &EXPOSURE)?,
            Self::Gamma(gamma) => image.gamma = within("gamma", *gamma, &GAMMA)?,
            Self::Background(background) => image.background = *background,
            Self::Camera(camera) => {
                if let Some(camera) = camera {
                    camera.validate().map_err(|problem| Error::input("camera", problem, "move the camera"))?;
                }
                changed.camera = *camera;
            }
        }
        let (method, count) = sampling(&changed);
        if let Some(method) = method {
            check_count(method, count, changed.image.subpixels)?;
        }
        *scene = changed;
        Ok(())
    }
}

/// `value` if it is in `range`: no range holds NaN.
fn within<T: PartialOrd + Display + Copy>(name: &str, value: T, range: &RangeInclusive<T>) -> Result<T> {
    if range.contains(&value) {
        return Ok(value);
    }
    let remedy = format!("use a value from {} to {}", range.start(), range.end());
    Err(Error::input(name, format!("{value} is out of range"), remedy))
}

/// The method of `scene`, if there is one of that name, and its number of threads.
fn sampling(scene: &Scene) -> (Option<Method>, u32) {
    let method = Method::from_name(&scene.shading.method).ok();
    let default_count = method.map_or(0, Method::default_count);
    (method, scene.shading.threads.unwrap_or(default_count))
}

/// The model and the parameters of a material.
///
/// # Errors
/// A file that cannot be read; a measured table, which has no parameters.
pub fn model_of(material: &MaterialSettings) -> Result<(String, toml::Table)> {
    let none = || Error::input(&material.name, "has no parameters", "choose a material that is a model");
    match &material.source {
        MaterialSource::Model { model, parameters } => Ok((model.clone(), parameters.clone())),
        MaterialSource::Builtin(name) => Brdf::builtin_model(name).ok_or_else(none),
        MaterialSource::File(path) if path.extension().is_some_and(|extension| extension == "toml") => {
            Brdf::load_model(path)
        }
        MaterialSource::File(_) | MaterialSource::Custom(_) => Err(none()),
    }
}

fn set_parameter(scene: &mut Scene, name: &str, key: &str, value: &toml::Value) -> Result<()> {
    let names: Vec<_> = scene.materials.iter().map(|material| material.name.clone()).collect();
    let material = scene.materials.iter_mut().find(|material| material.name == name).ok_or_else(|| {
        let remedy = format!("name one of {}", names.join(", "));
        Error::input(format!("material \"{name}\""), "is not in the scene", remedy)
    })?;
    let (model, mut parameters) = model_of(material)?;
    parameters.insert(key.into(), value.clone());
    Brdf::from_parameters(&model, parameters.clone()).map_err(|error| error.within(format!("material \"{name}\"")))?;
    material.source = MaterialSource::Model { model, parameters };
    Ok(())
}

/// What has to be done again: what has to be loaded or made (in the background), and which passes then have to run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Redo {
    /// Objects: their meshes are read, and where they are and which material they have is uploaded.
    pub objects: bool,
    /// BRDFs are read and uploaded.
    pub materials: bool,
    /// Threads are made.
    pub threads: bool,
    /// The environment is read, blurred and uploaded.
    pub environment: bool,
    /// The shading shader, and the forms of the environment that it reads.
    pub method: bool,
    /// Images, as their size changes.
    pub images: bool,
    /// Pass `geometry_cache`, and `classify` with it.
    pub geometry: bool,
    /// Pass `shade`.
    pub shading: bool,
    /// Pass `background`.
    pub background: bool,
    /// Pass `tone_map`.
    pub display: bool,
}

impl Redo {
    /// What has to be done so that what was made for `before` shows `after`.
    pub fn between(before: &Scene, after: &Scene) -> Self {
        let differs = |part: fn(&Scene) -> f64| part(before).to_bits() != part(after).to_bits();
        let size = |scene: &Scene| (scene.image.width, scene.image.height, scene.image.subpixels);
        let uses_threads = sampling(after).0.and_then(Method::threads).is_some();

        let objects = placed_objects(before) != placed_objects(after);
        let materials = used_materials(before).map(|m| &m.source).ne(used_materials(after).map(|m| &m.source));
        let method = before.shading.method != after.shading.method;
        let sampled = (sampling(before), before.shading.seed) != (sampling(after), after.shading.seed);
        let threads = uses_threads && (materials || sampled);
        let environment = before.environment.source != after.environment.source;
        let light = environment
            || differs(|scene| scene.environment.rotation_deg)
            || differs(|scene| scene.environment.intensity);
        let images = size(before) != size(after);
        // Where neither has a camera, both frame the objects by the image's shape.
        let geometry = objects || images || before.camera != after.camera;
        let shading = geometry || materials || method || sampled || light;
        let background = before.image.background != after.image.background
            || (after.image.background == Background::Environment && (geometry || light));
        let shown = differs(|scene| scene.image.exposure) || differs(|scene| scene.image.gamma);
        Self {
            objects,
            materials,
            threads,
            environment,
            method,
            images,
            geometry,
            shading,
            background,
            display: shading || background || shown,
        }
    }

    /// Whether something has to be loaded or made first, which may take long or fail.
    pub fn loads(self) -> bool {
        self.objects || self.materials || self.threads || self.environment || self.method
    }

    /// Whether nothing has to be done.
    pub fn is_nothing(self) -> bool {
        self == Self::default()
    }
}

/// The materials that objects have, in the order in which they name them first: as in [`Prepared`](crate::prepare::Prepared).
fn used_materials(scene: &Scene) -> impl Iterator<Item = &MaterialSettings> {
    let mut names: Vec<&str> = Vec::new();
    for object in &scene.objects {
        if !names.contains(&object.material.as_str()) {
            names.push(&object.material);
        }
    }
    names.into_iter().filter_map(|name| scene.materials.iter().find(|material| material.name == name))
}

/// The objects, each with the place of its material among the used ones: of the name alone no pass knows.
fn placed_objects(scene: &Scene) -> Vec<(Option<usize>, ObjectSettings)> {
    let place = |object: &ObjectSettings| used_materials(scene).position(|material| material.name == object.material);
    let nameless = |object: &ObjectSettings| ObjectSettings { material: String::new(), ..object.clone() };
    scene.objects.iter().map(|object| (place(object), nameless(object))).collect()
}

/// The scene that is asked for, and the one that is seen until what it needs is there.
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

    /// What frames are made of: all of it has been loaded.
    pub fn shown(&self) -> &Scene {
        &self.shown
    }

    /// Whether something is still being loaded or made.
    pub fn is_waiting(&self) -> bool {
        Redo::between(&self.shown, &self.wanted).loads()
    }

    /// Makes a change. If what it asks for [loads](Redo::loads), [`Self::wanted`] is to be prepared, and [`Self::prepared`] or
    /// [`Self::failed`] called; anything else is in [`Self::shown`] at once.
    ///
    /// # Errors
    /// Those of [`Change::apply`]; nothing is changed then.
    pub fn change(&mut self, change: &Change) -> Result<Redo> {
        let mut wanted = self.wanted.clone();
        change.apply(&mut wanted)?;
        Ok(self.replace(wanted))
    }

    /// The same for a whole other scene, such as one from a file.
    pub fn replace(&mut self, scene: Scene) -> Redo {
        let redo = Redo::between(&self.wanted, &scene);
        self.wanted = scene;
        self.show(self.shown.clone());
        redo
    }

    /// `scene`, which was wanted when its preparation began, is there: gives what of it has to be uploaded and run. What has been changed
    /// since and needs no loading holds.
    pub fn prepared(&mut self, scene: &Scene) -> Redo {
        let before = self.shown.clone();
        self.show(scene.clone());
        Redo::between(&before, &self.shown)
    }

    /// What was wanted cannot be: what is seen is wanted again.
    pub fn failed(&mut self) {
        // Whatever needs no loading is in both.
        self.wanted = self.shown.clone();
    }

    /// Shows `loaded`, but for what of [`Self::wanted`] needs no loading.
    fn show(&mut self, loaded: Scene) {
        let Scene { image, camera, environment, .. } = &self.wanted;
        if Redo::between(&loaded, &self.wanted).loads() {
            self.shown = Scene { image: image.clone(), camera: *camera, ..loaded };
            self.shown.environment.rotation_deg = environment.rotation_deg;
            self.shown.environment.intensity = environment.intensity;
        } else {
            self.shown = self.wanted.clone();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn builtin(name: &str) -> MaterialSource {
        MaterialSource::Builtin(name.into())
    }

    /// What a change of the built-in scene asks for.
    fn redo(change: Change) -> Redo {
        let mut scene = Scene::default();
        change.apply(&mut scene).unwrap();
        Redo::between(&Scene::default(), &scene)
    }

    #[test]
    fn each_change_asks_for_what_it_needs_and_nothing_else() {
        let nothing = Redo::default();
        let display = Redo { display: true, ..nothing };
        let shading = Redo { shading: true, ..display };
        let light = Redo { background: true, ..shading };
        let camera = Redo { geometry: true, ..light };
        let images = Redo { images: true, ..camera };
        let threads = Redo { threads: true, ..shading };
        let view = Camera::framing(glam::DVec3::ZERO, 2.0, 1.0);
        for (change, expected) in [
            (Change::Exposure(2.0), display),
            (Change::Gamma(1.8), display),
            (Change::Background(Background::None), Redo { background: true, ..display }),
            (Change::Rotation(10.0), light),
            (Change::Intensity(2.0), light),
            (Change::Camera(Some(view)), camera),
            (Change::Size(100, 50), images),
            (Change::Subpixels(1), images),
            (Change::Environment(Source::Builtin("sky".into())), Redo { environment: true, ..light }),
            (Change::Mesh(Source::File("x.obj".into())), Redo { objects: true, ..camera }),
            (Change::Threads(Some(8)), threads),
            (Change::Seed(3), threads),
            (Change::Method("paper".into()), Redo { method: true, ..threads }),
            (Change::Method("uniform".into()), Redo { method: true, ..shading }),
            (Change::Material(builtin("silver")), Redo { materials: true, ..threads }),
        ] {
            assert_eq!(redo(change.clone()), expected, "{change:?}");
        }
        for change in [
            Change::Exposure(1.0),
            Change::Camera(None),
            Change::Size(640, 480),
            Change::Method("fitted".into()),
            Change::Threads(Some(16)),
            Change::Material(builtin("gold")),
        ] {
            assert!(redo(change.clone()).is_nothing(), "{change:?}");
        }
    }

    #[test]
    fn a_parameter_turns_a_builtin_into_a_model_and_asks_for_threads() {
        let mut scene = Scene::default();
        let parameter =
            |key: &str, value: toml::Value| Change::Parameter { material: "gold".into(), key: key.into(), value };
        parameter("alpha", 0.3.into()).apply(&mut scene).unwrap();
        let MaterialSource::Model { model, parameters } = &scene.materials[0].source else { panic!("no model") };
        assert_eq!((model.as_str(), parameters["alpha"].as_float()), ("conductor", Some(0.3)));
        let redo = Redo::between(&Scene::default(), &scene);
        assert!(redo.materials && redo.threads && redo.shading && !redo.geometry && !redo.objects);

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
            (Change::Method("magic".into()), "magic"),
            (Change::Camera(Some(Camera { fov_y_deg: 0.0, ..Camera::framing(glam::DVec3::ZERO, 1.0, 1.0) })), "fov"),
        ] {
            let mut scene = Scene::default();
            let error = change.apply(&mut scene).unwrap_err().to_string();
            assert!(error.contains(what) && !error.contains('\n'), "{error}");
            assert_eq!(scene, Scene::default());
        }
    }

    #[test]
    fn another_method_has_as_many_threads_as_suit_it() {
        let mut scene = Scene::default();
        Change::Method("paper".into()).apply(&mut scene).unwrap();
        Change::Threads(Some(1000)).apply(&mut scene).unwrap();
        Change::Method("fitted".into()).apply(&mut scene).unwrap();
        assert_eq!(scene.shading.threads, None);
    }

    #[test]
    fn unused_materials_and_names_of_objects_do_not_count() {
        let before = Scene::default();
        let mut after = before.clone();
        after.materials.push(MaterialSettings { name: "unused".into(), source: builtin("clay") });
        assert!(Redo::between(&before, &after).is_nothing());
        after.objects.push(ObjectSettings::new(Source::Builtin("sphere".into()), "unused"));
        let redo = Redo::between(&before, &after);
        assert!(redo.objects && redo.materials && redo.geometry);
    }

    #[test]
    fn what_loads_waits_and_all_else_is_shown_at_once() {
        let mut session = Session::new(Scene::default());
        let silver = session.change(&Change::Material(builtin("silver"))).unwrap();
        assert!(silver.loads() && session.is_waiting());
        assert_eq!(session.shown().materials[0].name, "gold");
        let preparing = session.wanted().clone();
        assert!(!session.change(&Change::Exposure(2.0)).unwrap().loads());
        assert_eq!((session.shown().image.exposure, session.shown().materials[0].name.as_str()), (2.0, "gold"));
        // What comes back has the exposure of before.
        let redo = session.prepared(&preparing);
        assert!(redo.materials && redo.threads && !session.is_waiting());
        assert_eq!((session.shown(), session.shown().image.exposure), (session.wanted(), 2.0));
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

    #[test]
    fn a_change_of_what_is_being_loaded_asks_for_all_of_it() {
        let mut session = Session::new(Scene::default());
        session.change(&Change::Material(builtin("silver"))).unwrap();
        session.change(&Change::Material(builtin("copper"))).unwrap();
        let copper = session.wanted().clone();
        assert!(session.prepared(&copper).materials);
        // And back again to what is shown: nothing to wait for.
        session.change(&Change::Material(builtin("clay"))).unwrap();
        session.change(&Change::Material(builtin("copper"))).unwrap();
        assert!(!session.is_waiting());
    }
}
