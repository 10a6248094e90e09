//! What is rendered: image settings, camera, environment, materials and objects, as a scene file or flags name them.
use std::collections::HashSet;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use glam::{DQuat, EulerRot, Mat4, Quat, Vec3};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};

use crate::brdf::{Brdf, Custom, base_files, base_files_of};
use crate::environment::CustomEnvironment;
use crate::error::{Error, Result};
use crate::files::file_formats;
use crate::method::{Method, Pattern};

mod bounding_sphere;
pub mod camera;
mod custom_mesh;
mod drawing_order;
mod file;
pub mod mesh;
mod parameter;
mod polygon;
mod tangent_rule;
mod texture_tangents;
mod winding;

pub use bounding_sphere::BoundingSphere;
pub use camera::Camera;
pub use custom_mesh::CustomMesh;
pub use mesh::Mesh;
pub use obj_file::TexturedMesh;
pub use tangent_rule::TangentRule;

file_formats!(Mesh: obj_file);

/// A vector of three numbers, no fewer and no more: serde drops those after the third.
fn three_numbers<'de, T: Deserialize<'de>, V: From<[T; 3]>, D: Deserializer<'de>>(from: D) -> Result<V, D::Error> {
    let numbers = Vec::<T>::deserialize(from)?;
    let count = numbers.len();
    let three = <[T; 3]>::try_from(numbers).map_err(|_| D::Error::invalid_length(count, &"three numbers"))?;
    Ok(V::from(three))
}

/// The built-in material of an object that names none in a scene without materials.
pub const DEFAULT_MATERIAL: &str = "gold";
/// The built-in environment of a scene that names none.
pub const DEFAULT_ENVIRONMENT: &str = "studio";
/// The shading method of a scene that names none.
pub const DEFAULT_METHOD: Method = Method::Fitted;

/// Most columns and most rows of an image.
pub const MAX_SIZE_PX: u32 = 16384;
/// Most sub-pixels along an axis of a pixel.
pub const MAX_SUBPIXELS: u32 = 4;
/// Most samples of a pixel; methods that use threads have at most [`crate::threads::MAX_COUNT`].
pub const MAX_SAMPLES: u32 = 10_000;
/// What the exposure may be: shaders have it in single precision.
pub const EXPOSURE: RangeInclusive<f64> = 0.0..=f32::MAX as f64;
/// What the factor of the environment's radiance may be: shaders have it in single precision.
pub const INTENSITY: RangeInclusive<f64> = EXPOSURE;
/// Both in words.
pub const SINGLE_FACTOR: &str = "a finite number from 0 to 3.4e38";
/// What the gamma may be: shaders have it in single precision.
pub const GAMMA: RangeInclusive<f64> = f32::MIN_POSITIVE as f64..=f32::MAX as f64;
/// The same in words.
pub const POSITIVE_SINGLE: &str = "a finite number above 0: 1.2e-38 to 3.4e38";

/// A scene, as yet only named: meshes, materials and environment are not loaded.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Size and display of the image.
    pub image: ImageSettings,
    /// Where from; none frames the objects with [`Camera::framing`].
    pub camera: Option<Camera>,
    /// The light.
    pub environment: EnvironmentSettings,
    /// How to shade.
    pub shading: ShadingSettings,
    /// At least one; names are unique.
    pub materials: Vec<MaterialSettings>,
    /// At least one; each names one of `materials`.
    pub objects: Vec<ObjectSettings>,
}

/// `[image]`: size, sampling and display.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ImageSettings {
    /// Columns, 1 to 16384.
    #[serde(deserialize_with = "file::size_px")]
    pub width: u32,
    /// Rows, 1 to 16384.
    #[serde(deserialize_with = "file::size_px")]
    pub height: u32,
    /// Sub-pixels along each axis of a pixel, 1 to 4.
    #[serde(deserialize_with = "file::subpixels")]
    pub subpixels: u32,
    /// Display value = clamp(exposure L, 0, 1)^(1/gamma); not negative.
    #[serde(deserialize_with = "file::exposure")]
    pub exposure: f64,
    /// See `exposure`; positive.
    #[serde(deserialize_with = "file::gamma")]
    pub gamma: f64,
    /// What is seen past the objects.
    pub background: Background,
}

/// What is seen past the objects.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Background {
    /// The environment.
    #[default]
    Environment,
    /// Nothing: the image is transparent there.
    None,
}

/// A file, something of that name made by the program, or a `T` that a user of the crate makes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Source<T> {
    /// Read from the disk.
    File(PathBuf),
    /// Built in.
    Builtin(String),
    /// Given by a user of the crate; no file can have it.
    #[serde(skip)]
    Custom(T),
}

/// Where light comes from.
pub type EnvironmentSource = Source<CustomEnvironment>;
/// Where a mesh comes from.
pub type MeshSource = Source<CustomMesh>;

impl<T> Source<T> {
    /// What a flag names: one of `builtin_names`, or else a file.
    ///
    /// A file that is called like one of these is named by its path: `./sphere`.
    pub fn named(name: &str, builtin_names: &[&str]) -> Self {
        if builtin_names.contains(&name) { Self::Builtin(name.into()) } else { Self::File(name.into()) }
    }

    /// The file that it is read from, if it is.
    pub fn file(&self) -> Option<&PathBuf> {
        match self {
            Self::File(path) => Some(path),
            Self::Builtin(_) | Self::Custom(_) => None,
        }
    }
}

impl<T: std::fmt::Display> std::fmt::Display for Source<T> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter) -> std::fmt::Result {
        match self {
            // A bare name is that of a built-in.
            Self::File(path) if is_bare(path) => write!(formatter, "./{}", path.display()),
            Self::File(path) => path.display().fmt(formatter),
            Self::Builtin(name) => name.fmt(formatter),
            Self::Custom(custom) => custom.fmt(formatter),
        }
    }
}

/// Whether a path is a name alone, with neither a folder nor an extension.
fn is_bare(path: &Path) -> bool {
    path.extension().is_none() && path.parent().is_some_and(|folder| folder.as_os_str().is_empty())
}

/// `[environment]`: the light.
#[derive(Clone, Debug, PartialEq)]
pub struct EnvironmentSettings {
    /// Lat-long picture of a file or a program's own, or built-in.
    pub source: EnvironmentSource,
    /// Turn of the environment about +Y in degrees, counter-clockwise seen from above (it takes +Z towards +X).
    pub rotation_deg: f64,
    /// Factor of its radiance; not negative.
    pub intensity: f64,
}

/// `[shading]`: how to shade.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ShadingSettings {
    /// By which estimator.
    pub method: Method,
    /// Threads, or samples of methods that have none, 1 to [`MAX_SAMPLES`]; without it, as many as suit the method.
    #[serde(deserialize_with = "file::threads", skip_serializing_if = "Option::is_none")]
    pub threads: Option<u32>,
    /// Where methods that can choose draw their samples.
    pub pattern: Pattern,
    /// Seed of whatever is random.
    pub seed: u64,
}

/// `[[material]]`: a name for a BRDF.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialSettings {
    /// By which objects call it.
    pub name: String,
    /// Where it comes from.
    pub source: MaterialSource,
}

/// Where a BRDF comes from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum MaterialSource {
    /// Read from the disk: measured, or a model with its parameters.
    File(PathBuf),
    /// One that the program names.
    Builtin(String),
    /// An analytic model with its parameters, not yet checked.
    Model {
        /// Name of the model.
        model: String,
        /// The keys beside it.
        parameters: toml::Table,
    },
    /// One that a user of the crate defines; no file can have it.
    #[serde(skip)]
    Custom(Custom),
}

impl MaterialSource {
    /// What a flag names: built in, or a file (`./name` for one that is called like a built-in). A bare name that is neither is an unknown
    /// built-in rather than a missing file.
    pub fn named(text: &str) -> Self {
        let path = PathBuf::from(text);
        let is_builtin = Brdf::builtin_names().any(|name| name == text);
        if !is_builtin && (!is_bare(&path) || path.exists()) {
            Self::File(path)
        } else {
            Self::Builtin(text.to_owned())
        }
    }

    /// The files that it is read from, those of bases under coats included.
    pub fn files(&self) -> Vec<PathBuf> {
        match self {
            Self::File(path) => [vec![path.clone()], base_files_of(path)].concat(),
            Self::Model { parameters, .. } => base_files(parameters),
            Self::Builtin(_) | Self::Custom(_) => Vec::new(),
        }
    }
}

/// `[[object]]`: a mesh at its place, of one material.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectSettings {
    /// OBJ file, built-in, or a program's own.
    pub mesh: MeshSource,
    /// Name of its material.
    pub material: String,
    /// Displacement, after rotation and scale.
    pub translate: Vec3,
    /// Turns about the fixed axes x, y and z in degrees: first about z, then x, then y (R = Ry Rx Rz).
    pub rotate_deg: Vec3,
    /// Uniform, not zero; negative mirrors through the origin.
    pub scale: f32,
    /// Which way an anisotropic material goes on it; without it, as [`TangentRule::DEFAULT`].
    pub tangent: Option<TangentRule>,
}

impl Default for Scene {
    /// The built-in sphere of the default material in the default environment.
    fn default() -> Self {
        let material = MaterialSettings {
            name: DEFAULT_MATERIAL.into(),
            source: MaterialSource::Builtin(DEFAULT_MATERIAL.into()),
        };
        Self {
            image: ImageSettings::default(),
            camera: None,
            environment: EnvironmentSettings::default(),
            shading: ShadingSettings::default(),
            objects: vec![ObjectSettings::new(Source::Builtin("sphere".into()), &material.name)],
            materials: vec![material],
        }
    }
}

impl Scene {
    /// Makes `source`, called `name`, the material of every object, and the only one.
    pub fn use_material(&mut self, name: &str, source: MaterialSource) {
        self.materials = vec![MaterialSettings { name: name.into(), source }];
        self.objects.iter_mut().for_each(|object| name.clone_into(&mut object.material));
    }

    /// Puts `mesh`, of the first object's material, in the place of all objects.
    pub fn use_mesh(&mut self, mesh: MeshSource) {
        let material = self.objects.first().map(|object| object.material.clone()).unwrap_or_default();
        self.objects = vec![ObjectSettings::new(mesh, &material)];
    }

    /// The same with what each frame is given anew as `other` has it: camera, size, exposure, gamma, and the turn and intensity of the light.
    /// Nothing is loaded or made for these.
    #[must_use]
    pub fn with_frame_settings_of(self, other: &Self) -> Self {
        let ImageSettings { width, height, exposure, gamma, .. } = other.image;
        let EnvironmentSettings { rotation_deg, intensity, .. } = other.environment;
        Self {
            image: ImageSettings { width, height, exposure, gamma, ..self.image },
            environment: EnvironmentSettings { rotation_deg, intensity, ..self.environment },
            camera: other.camera,
            ..self
        }
    }

    /// The files that it names: of its environment, its meshes and its materials, with those under their coats.
    pub fn files(&self) -> Vec<PathBuf> {
        let of_meshes = self.objects.iter().filter_map(|object| object.mesh.file());
        let of_materials = self.materials.iter().flat_map(|material| material.source.files());
        self.environment.source.file().into_iter().chain(of_meshes).cloned().chain(of_materials).collect()
    }

    /// Names of the materials that objects have, each once, in the order in which objects name them first.
    pub fn used_materials(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        for object in &self.objects {
            if !names.contains(&object.material.as_str()) {
                names.push(&object.material);
            }
        }
        names
    }

    /// The material of this name, if there is one.
    pub fn material(&self, name: &str) -> Option<&MaterialSettings> {
        self.materials.iter().find(|material| material.name == name)
    }

    /// An error where a program has set what no scene file can say.
    ///
    /// # Errors
    /// The first setting that cannot be used.
    pub fn check(&self) -> Result<()> {
        let Self { image, environment, shading, .. } = self;
        within("width", image.width, &(1..=MAX_SIZE_PX))?;
        within("height", image.height, &(1..=MAX_SIZE_PX))?;
        within("subpixels", image.subpixels, &(1..=MAX_SUBPIXELS))?;
        within("exposure", image.exposure, &EXPOSURE)?;
        within("gamma", image.gamma, &GAMMA)?;
        within("rotation_deg", environment.rotation_deg, &(f64::MIN..=f64::MAX))?;
        within("intensity", environment.intensity, &INTENSITY)?;
        within("threads", shading.threads.unwrap_or(1), &(1..=MAX_SAMPLES))?;
        if let Some(problem) = self.camera.and_then(|camera| camera.validate().err()) {
            return Err(Error::input("camera", problem, "choose another, or none"));
        }
        if self.objects.is_empty() {
            return Err(Error::input("scene", "has no objects", "give it one at least"));
        }
        let mut names = HashSet::new();
        if let Some(twice) = self.materials.iter().find(|material| !names.insert(material.name.as_str())) {
            let problem = "is the name of two materials";
            return Err(Error::input(format!("\"{}\"", twice.name), problem, "give each a name of its own"));
        }
        for object in &self.objects {
            let wrong = |name: &str, value: &dyn std::fmt::Display, remedy: &str| {
                Err(Error::input(format!("{name} of {}", object.mesh), format!("is {value}"), remedy))
            };
            for (name, vector) in [("translate", object.translate), ("rotate_deg", object.rotate_deg)] {
                if !vector.is_finite() {
                    return wrong(name, &vector, "use three finite numbers");
                }
            }
            if !object.scale.is_finite() || object.scale == 0.0 {
                return wrong("scale", &object.scale, "use a finite number that is not 0");
            }
            if let Some(TangentRule::Around(axis) | TangentRule::Along(axis)) = object.tangent
                && !(axis.length() > 0.0 && axis.is_finite())
            {
                let problem = format!("goes by the axis {axis}, which has no direction");
                return Err(Error::input(format!("tangent of {}", object.mesh), problem, "give it another"));
            }
        }
        match self.objects.iter().find(|object| !names.contains(object.material.as_str())) {
            None => Ok(()),
            Some(object) => {
                let problem = format!("is of the material \"{}\", which the scene has not", object.material);
                Err(Error::input(format!("object {}", object.mesh), problem, "add it to `materials`"))
            }
        }
    }
}

/// `value` if it is in `range`: no range holds NaN.
pub(crate) fn within<T: PartialOrd + std::fmt::Debug + Copy>(
    name: &str,
    value: T,
    range: &RangeInclusive<T>,
) -> Result<T> {
    if range.contains(&value) {
        return Ok(value);
    }
    // Debug's form of large and small numbers has an exponent.
    let remedy = format!("use a value from {:?} to {:?}", range.start(), range.end());
    Err(Error::input(name, format!("{value:?} is out of range"), remedy))
}

impl Default for ImageSettings {
    fn default() -> Self {
        Self { width: 640, height: 480, subpixels: 2, exposure: 1.0, gamma: 2.2, background: Background::Environment }
    }
}

impl ImageSettings {
    /// Width over height.
    pub fn aspect(&self) -> f64 {
        f64::from(self.width) / f64::from(self.height)
    }

    /// Whether files of the picture have an alpha channel: nothing is behind the objects.
    pub fn has_alpha(&self) -> bool {
        self.background == Background::None
    }
}

impl Default for EnvironmentSettings {
    fn default() -> Self {
        Self { source: Source::Builtin(DEFAULT_ENVIRONMENT.into()), rotation_deg: 0.0, intensity: 1.0 }
    }
}

impl Default for ShadingSettings {
    fn default() -> Self {
        Self { method: DEFAULT_METHOD, threads: None, pattern: Pattern::default(), seed: 0 }
    }
}

impl ShadingSettings {
    /// How many threads or samples: as many as are asked for, or as suit the method.
    pub fn count(&self) -> u32 {
        self.threads.unwrap_or(self.method.default_count())
    }
}

impl ObjectSettings {
    /// A mesh of a material, where it is.
    pub fn new(mesh: MeshSource, material: &str) -> Self {
        Self {
            mesh,
            material: material.into(),
            translate: Vec3::ZERO,
            rotate_deg: Vec3::ZERO,
            scale: 1.0,
            tangent: None,
        }
    }

    /// Object space to world space: scaled, then rotated, then translated.
    pub fn transform(&self) -> Mat4 {
        let [x, y, z] = self.rotate_deg.as_dvec3().to_array().map(f64::to_radians);
        let rotation: Quat = DQuat::from_euler(EulerRot::YXZ, y, x, z).as_quat();
        Mat4::from_scale_rotation_translation(Vec3::splat(self.scale), rotation, self.translate)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn a_file_called_like_a_built_in_is_never_taken_for_it() {
        let builtin = MeshSource::named("sphere", mesh::builtin_names());
        assert_eq!(builtin, Source::Builtin("sphere".into()));
        for name in ["./sphere", "sphere.obj", "meshes/sphere", "/sphere"] {
            let file = MeshSource::named(name, mesh::builtin_names());
            assert_eq!((&file, file.to_string().as_str()), (&Source::File(name.into()), name));
        }
        // As a scene file in the folder where the program runs names it.
        let file = MeshSource::File("sphere".into());
        assert_ne!(file.to_string(), builtin.to_string());
        assert_eq!(MeshSource::named(&file.to_string(), mesh::builtin_names()), Source::File("./sphere".into()));
        assert_eq!(MaterialSource::named("gold"), MaterialSource::Builtin("gold".into()));
        assert_eq!(MaterialSource::named("./gold"), MaterialSource::File("./gold".into()));
    }

    #[test]
    fn what_no_scene_file_can_say_no_program_can_set() {
        assert!(Scene::default().check().is_ok());
        type Set = fn(&mut Scene);
        let wrong: [(&str, Set); 20] = [
            ("width", |scene| scene.image.width = 0),
            ("height", |scene| scene.image.height = MAX_SIZE_PX + 1),
            ("subpixels", |scene| scene.image.subpixels = 0),
            ("exposure", |scene| scene.image.exposure = f64::NAN),
            ("gamma", |scene| scene.image.gamma = 0.0),
            ("rotation_deg", |scene| scene.environment.rotation_deg = f64::INFINITY),
            ("intensity", |scene| scene.environment.intensity = -1.0),
            ("threads", |scene| scene.shading.threads = Some(0)),
            ("`up`", |scene| scene.camera = Some(Camera { up: DVec3::ZERO, ..Camera::framing(DVec3::ZERO, 1.0, 1.0) })),
            ("no objects", |scene| scene.objects.clear()),
            ("\"gold\"", |scene| scene.materials.clear()),
            ("\"x\"", |scene| scene.objects[0].material = "x".into()),
            ("\"gold\"", |scene| scene.materials.push(scene.materials[0].clone())),
            ("tangent", |scene| scene.objects[0].tangent = Some(TangentRule::Around(Vec3::ZERO))),
            ("tangent", |scene| scene.objects[0].tangent = Some(TangentRule::Along(Vec3::NAN))),
            ("translate of sphere", |scene| scene.objects[0].translate.y = f32::NAN),
            ("rotate_deg of sphere", |scene| scene.objects[0].rotate_deg.z = f32::INFINITY),
            ("scale of sphere", |scene| scene.objects[0].scale = 0.0),
            ("scale of sphere", |scene| scene.objects[0].scale = f32::NAN),
            ("scale of sphere", |scene| scene.objects[0].scale = f32::INFINITY),
        ];
        for (name, set) in wrong {
            let mut scene = Scene::default();
            set(&mut scene);
            let error = scene.check().unwrap_err().to_string();
            assert!(error.contains(name), "{error}");
        }
    }

    #[test]
    fn an_object_is_scaled_then_turned_about_z_x_y_then_moved() {
        let mut object = ObjectSettings::new(Source::Builtin("sphere".into()), "m");
        assert_eq!(object.transform(), Mat4::IDENTITY);
        object.rotate_deg = Vec3::new(90.0, 90.0, 90.0);
        (object.scale, object.translate) = (2.0, Vec3::new(10.0, 0.0, 0.0));
        // x: about z to y, about x to z, about y to x.
        assert!(object.transform().transform_point3(Vec3::X).distance(Vec3::new(12.0, 0.0, 0.0)) < 1e-5);
        // y: about z to -x, which x leaves, about y to z.
        assert!(object.transform().transform_point3(Vec3::Y).distance(Vec3::new(10.0, 0.0, 2.0)) < 1e-5);
    }
}
