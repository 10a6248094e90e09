//! The scene file: TOML to and from [`Scene`], with errors that name file, line and key.
use std::collections::HashSet;
use std::fmt;
use std::ops::{RangeBounds, RangeInclusive};
use std::path::{Path, PathBuf};

use serde::de::{Deserializer, Error as _, Visitor};
use serde::{Deserialize, Serialize};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::{
    Camera, DEFAULT_MATERIAL, EXPOSURE, EnvironmentSettings, GAMMA, INTENSITY, ImageSettings, MAX_SAMPLES, MAX_SIZE_PX,
    MAX_SUBPIXELS, MaterialSettings, MaterialSource, Mesh, ObjectSettings, POSITIVE_SINGLE, SINGLE_FACTOR, Scene,
    ShadingSettings, Source, TangentRule, mesh, three_numbers,
};
use crate::brdf::{Brdf, change_base_files, has_model, resolve_base_files};
use crate::environment::{self, Environment};
use crate::error::{Error, Result};
use crate::files::{self, FileFormat, FileKind, quote_line, text, toml_problem, write_whole};

/// A whole scene file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SceneFile {
    #[serde(default)]
    image: ImageSettings,
    camera: Option<Camera>,
    #[serde(default)]
    environment: EnvironmentKeys,
    #[serde(default)]
    shading: ShadingSettings,
    #[serde(default)]
    material: Vec<Spanned<toml::Table>>,
    #[serde(default)]
    object: Vec<Spanned<ObjectKeys>>,
}

/// `[environment]`.
#[derive(Default, Deserialize)]
#[serde(try_from = "RawEnvironmentKeys")]
struct EnvironmentKeys(EnvironmentSettings);

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawEnvironmentKeys {
    file: Option<PathBuf>,
    builtin: Option<String>,
    #[serde(default, deserialize_with = "finite")]
    rotation_deg: f64,
    #[serde(default = "one", deserialize_with = "intensity")]
    intensity: f64,
}

/// `[[object]]`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ObjectKeys {
    mesh: Option<PathBuf>,
    builtin: Option<String>,
    material: Option<String>,
    #[serde(default, deserialize_with = "finite_vector")]
    translate: [f32; 3],
    #[serde(default, deserialize_with = "finite_vector")]
    rotate_deg: [f32; 3],
    #[serde(default = "one_f32", deserialize_with = "scale")]
    scale: f32,
    #[serde(default, deserialize_with = "tangent")]
    tangent: Option<TangentRule>,
}

impl TryFrom<RawEnvironmentKeys> for EnvironmentKeys {
    type Error = String;

    fn try_from(keys: RawEnvironmentKeys) -> Result<Self, String> {
        let source = match (keys.file, keys.builtin) {
            (Some(file), None) => Source::File(file),
            (None, Some(name)) => Source::Builtin(builtin("environment", name, environment::builtin_names())?),
            (None, None) => EnvironmentSettings::default().source,
            (Some(_), Some(_)) => return Err("[environment] takes `file` or `builtin`, not both".into()),
        };
        Ok(Self(EnvironmentSettings { source, rotation_deg: keys.rotation_deg, intensity: keys.intensity }))
    }
}

impl Scene {
    /// Reads a scene file. Paths in it are relative to its folder. Without objects the scene is the built-in sphere; an object
    /// that names no material is of the first one, or of the default one in a scene without any.
    pub fn load(path: &Path) -> Result<Self> {
        match other_kind(path) {
            Some(error) => Err(error),
            None => parse_file(path, &files::read(path)?),
        }
    }

    /// The formats of scene files.
    pub const FILES: FileKind<Self> = FileKind { what: "scene", formats: &[FORMAT], builtin_names: Vec::new };

    /// A scene from the text of a file whose relative paths start at `base_dir`; see [`Self::load`].
    pub fn parse(text: &str, base_dir: &Path) -> Result<Self> {
        parse(text, base_dir).map_err(|problem| Error::input("scene", problem, REMEDY))
    }

    /// Writes a scene file that [`Self::load`] reads as this scene: `render` makes the same picture of it, to the bit. Paths of files in
    /// the folder of `path` and below are relative to it, so that the folder can be moved; others are absolute.
    ///
    /// # Errors
    /// `path` cannot be written; what [`Self::to_toml`] says.
    pub fn save(&self, path: &Path) -> Result<()> {
        let folder = std::path::absolute(path).ok().and_then(|path| path.parent().map(Path::to_owned));
        let text = self.to_toml(folder.as_deref())?;
        write_whole(path, text.as_bytes())
    }

    /// The scene as the text of a file: paths in `folder` and below are relative to it, others are absolute.
    ///
    /// # Errors
    /// A path that is not UTF-8, a material that a program defines, and what [`Self::parse`] would refuse: what [`Self::check`] says, a
    /// built-in that there is not, parameters that their model does not have.
    pub fn to_toml(&self, folder: Option<&Path>) -> Result<String> {
        self.check()?;
        let text = toml::to_string_pretty(&SceneText::new(self, folder)?).map_err(|cause| {
            Error::input("scene", format!("cannot be written as TOML ({cause})"), "use numbers that are finite")
        })?;
        // Names and parameters are checked by who reads them.
        match parse(&text, folder.unwrap_or(Path::new(""))) {
            Ok(_) => Ok(text),
            Err(problem) => {
                Err(Error::input("scene", format!("could not be read again: {problem}"), "change it before saving"))
            }
        }
    }
}

/// Of a scene that cannot be used.
const REMEDY: &str = "the guide shows a scene file with every key, in src/guide/usage.md";

const FORMAT: FileFormat<Scene> = FileFormat {
    extension: "toml",
    name: "a scene .toml",
    is_of_format: |bytes| !has_model(bytes),
    parse: |path, bytes, _| parse_file(path, bytes),
};

/// An error if `path` is called as files of another kind are, and not as scenes are.
fn other_kind(path: &Path) -> Option<Error> {
    let kinds = [
        ("a material", "material", Brdf::FILES.format_of(path).is_ok()),
        ("a mesh", "mesh", Mesh::FILES.format_of(path).is_ok()),
        ("an environment", "environment", Environment::FILES.format_of(path).is_ok()),
    ];
    let (what, key, _) = kinds.into_iter().find(|(.., is_of_kind)| *is_of_kind)?;
    Scene::FILES.format_of(path).is_err().then(|| not_a_scene(path, what, key))
}

/// The error that the file at `path` is `what`, which a scene has by this `key`.
fn not_a_scene(path: &Path, what: &str, key: &str) -> Error {
    Error::in_file(path, format!("is {what}, not a scene"), format!("give it with --{key}, or as the {key} in a scene"))
}

fn parse_file(path: &Path, bytes: &[u8]) -> Result<Scene> {
    if has_model(bytes) {
        return Err(not_a_scene(path, "a material", "material"));
    }
    parse(text(path, bytes)?, path.parent().unwrap_or(Path::new("")))
        .map_err(|problem| Error::in_file(path, problem, REMEDY))
}

/// Parses and checks a scene; an error is one line that names line and key.
fn parse(text: &str, base_dir: &Path) -> Result<Scene, String> {
    let root = DeTable::parse(text).map_err(|error| toml_problem(text, &error))?;
    check_tables(root.get_ref()).map_err(|(position, problem)| in_line(text, position)(problem))?;
    let file = SceneFile::deserialize(toml::Deserializer::from(root)).map_err(|error| toml_problem(text, &error))?;
    let mut scene = Scene {
        image: file.image,
        camera: file.camera,
        environment: file.environment.0,
        shading: file.shading,
        materials: Vec::new(),
        objects: Vec::new(),
    };
    let mut names = HashSet::new();
    for table in file.material {
        let in_line = in_line(text, table.span().start);
        let material = material(table.into_inner()).map_err(&in_line)?;
        // Here, too, as one that no object has is not loaded.
        if let MaterialSource::Model { model, parameters } = &material.source {
            Brdf::check_parameters(model, parameters.clone())
                .map_err(|error| in_line(error.within(format!("material \"{}\"", material.name)).to_string()))?;
        }
        if !names.insert(material.name.clone()) {
            return Err(in_line(format!("there are two materials with `name` \"{}\"", material.name)));
        }
        scene.materials.push(material);
    }
    if scene.materials.is_empty() {
        scene.materials = Scene::default().materials;
        names.extend(scene.materials.iter().map(|material| material.name.clone()));
    }
    let first_material = scene.materials.first().map_or(DEFAULT_MATERIAL, |material| &material.name).to_owned();
    for keys in file.object {
        let in_line = in_line(text, keys.span().start);
        let object = object(keys.into_inner(), &first_material).map_err(&in_line)?;
        if !names.contains(&object.material) {
            let names: Vec<_> = scene.materials.iter().map(|material| material.name.as_str()).collect();
            return Err(in_line(format!(
                "the object's `material` \"{}\" is not among the scene's: {}",
                object.material,
                names.join(", ")
            )));
        }
        scene.objects.push(object);
    }
    if scene.objects.is_empty() {
        scene.objects = vec![ObjectSettings::new(Source::Builtin("sphere".into()), &first_material)];
    }
    resolve_paths(&mut scene, base_dir)?;
    Ok(scene)
}

/// Checks that there are tables where they belong, one or a list of them. Serde would say it in its own words, and take a list of values for
/// a table. The error has the position of what is wrong in the text.
fn check_tables(root: &DeTable) -> Result<(), (usize, String)> {
    for (key, value) in root {
        let name = key.get_ref();
        let problem = match (&**name, value.get_ref()) {
            ("material" | "object", DeValue::Array(list)) => {
                if list.iter().all(|element| element.get_ref().is_table()) {
                    continue;
                }
                format!("`{name}` is a list of tables: write [[{name}]] before each")
            }
            ("material" | "object", _) => {
                format!("there may be several of `{name}`: write [[{name}]], with two brackets")
            }
            ("image" | "camera" | "environment" | "shading", DeValue::Table(_)) => continue,
            ("image" | "camera" | "environment" | "shading", _) => {
                format!("there is one `{name}`, a table: write [{name}], with one bracket")
            }
            // Serde tells of a key that is not known, with those that are.
            _ => continue,
        };
        return Err((key.span().start, problem));
    }
    Ok(())
}

/// Puts `folder` in front of the relative paths of `scene`.
fn resolve_paths(scene: &mut Scene, folder: &Path) -> Result<(), String> {
    let resolve = |path: &mut PathBuf| *path = folder.join(&*path);
    if let Source::File(path) = &mut scene.environment.source {
        resolve(path);
    }
    for material in &mut scene.materials {
        match &mut material.source {
            MaterialSource::File(path) => resolve(path),
            MaterialSource::Model { parameters, .. } => {
                resolve_base_files(parameters, folder)
                    .map_err(|error| error.within(format!("material \"{}\"", material.name)).to_string())?;
            }
            MaterialSource::Builtin(_) | MaterialSource::Custom(_) => {}
        }
    }
    for object in &mut scene.objects {
        if let Source::File(path) = &mut object.mesh {
            resolve(path);
        }
    }
    Ok(())
}

/// Says of a problem in which line of `text` it is, that of the byte at `position`. Lines are counted for errors only: a scene may have tens of
/// thousands of tables.
fn in_line(text: &str, position: usize) -> impl Fn(String) -> String {
    move |problem| format!("{}: {problem}", quote_line(text, position))
}

/// A `[[material]]`: its name, and one of `file`, `builtin` and `model`, of which `builtin` may be the name itself; with `model` come
/// parameters.
fn material(mut table: toml::Table) -> Result<MaterialSettings, String> {
    let mut take = |key: &str| match table.remove(key) {
        None => Ok(None),
        Some(toml::Value::String(text)) => Ok(Some(text)),
        Some(other) => Err(format!("`{key}` must be a string, not {}", other.type_str())),
    };
    let (name, file, named, model) = (take("name")?, take("file")?, take("builtin")?, take("model")?);
    let name = name.ok_or("a [[material]] needs a `name`")?;
    let source = match (file, named, model) {
        (Some(file), None, None) => MaterialSource::File(file.into()),
        (None, Some(name), None) => {
            MaterialSource::Builtin(builtin("material", name, &Brdf::builtin_names().collect::<Vec<_>>())?)
        }
        (None, None, Some(model)) => MaterialSource::Model { model, parameters: std::mem::take(&mut table) },
        (None, None, None) if Brdf::builtin_names().any(|known| known == name) => MaterialSource::Builtin(name.clone()),
        (None, None, None) => {
            let known = Brdf::builtin_names().collect::<Vec<_>>().join(", ");
            return Err(format!(
                "material \"{name}\" needs a `file`, `builtin` or `model`, or as its name one of {known}"
            ));
        }
        _ => return Err(format!("material \"{name}\" needs no more than one of `file`, `builtin` and `model`")),
    };
    match table.keys().next() {
        Some(key) => Err(format!("unknown field `{key}` in material \"{name}\", only a `model` has parameters")),
        None => Ok(MaterialSettings { name, source }),
    }
}

/// An `[[object]]`.
fn object(keys: ObjectKeys, first_material: &str) -> Result<ObjectSettings, String> {
    let mesh = match (keys.mesh, keys.builtin) {
        (Some(file), None) => Source::File(file),
        (None, Some(name)) => Source::Builtin(builtin("mesh", name, mesh::builtin_names())?),
        _ => return Err("an [[object]] needs exactly one of `mesh` and `builtin`".into()),
    };
    Ok(ObjectSettings {
        mesh,
        material: keys.material.unwrap_or(first_material.into()),
        translate: keys.translate.into(),
        rotate_deg: keys.rotate_deg.into(),
        scale: keys.scale,
        tangent: keys.tangent,
    })
}

/// `name`, if a `what` of that name is built in: one of the `known`.
fn builtin(what: &str, name: String, known: &[&str]) -> Result<String, String> {
    match known.contains(&name.as_str()) {
        true => Ok(name),
        false => Err(format!("no {what} `{name}` is built in; these are: {}", known.join(", "))),
    }
}

fn one() -> f64 {
    1.0
}

fn one_f32() -> f32 {
    1.0
}

/// A number in `range`, or the error that it must be `what`.
fn checked<'de, D, T>(deserializer: D, range: impl RangeBounds<T>, what: &str) -> Result<T, D::Error>
where
    D: Deserializer<'de>,
    T: Deserialize<'de> + PartialOrd + std::fmt::Debug,
{
    let value = T::deserialize(deserializer)?;
    // No range holds NaN.
    if range.contains(&value) { Ok(value) } else { Err(D::Error::custom(format!("{value:?} must be {what}"))) }
}

/// An integer in `range`: -1, 10^12 and 10^30 get the same message as 0.
fn integer<'de, D: Deserializer<'de>>(deserializer: D, range: RangeInclusive<u32>) -> Result<u32, D::Error> {
    deserializer.deserialize_any(IntegerIn(range))
}

struct IntegerIn(RangeInclusive<u32>);

impl Visitor<'_> for IntegerIn {
    type Value = u32;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "a whole number from {} to {}", self.0.start(), self.0.end())
    }

    fn visit_i64<E: serde::de::Error>(self, value: i64) -> Result<u32, E> {
        self.visit_i128(value.into())
    }

    fn visit_u64<E: serde::de::Error>(self, value: u64) -> Result<u32, E> {
        self.visit_i128(value.into())
    }

    fn visit_i128<E: serde::de::Error>(self, value: i128) -> Result<u32, E> {
        let of_range = u32::try_from(value).ok().filter(|value| self.0.contains(value));
        of_range.ok_or_else(|| E::custom(format!("{value} must be {} to {}", self.0.start(), self.0.end())))
    }
}

/// Width or height of an image.
pub(super) fn size_px<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
    integer(deserializer, 1..=MAX_SIZE_PX)
}

/// Sub-pixels along an axis.
pub(super) fn subpixels<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
    integer(deserializer, 1..=MAX_SUBPIXELS)
}

/// Number of threads or samples.
pub(super) fn threads<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<u32>, D::Error> {
    integer(deserializer, 1..=MAX_SAMPLES).map(Some)
}

/// Factor of radiance before display.
pub(super) fn exposure<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    checked(deserializer, EXPOSURE, SINGLE_FACTOR)
}

/// Exponent of the display.
pub(super) fn gamma<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    checked(deserializer, GAMMA, POSITIVE_SINGLE)
}

/// Factor of the environment's radiance.
fn intensity<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    checked(deserializer, INTENSITY, SINGLE_FACTOR)
}

fn finite<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    checked(deserializer, f64::MIN..=f64::MAX, "finite")
}

/// `value` in single precision, unless that cannot hold it: read so, what it is would be lost.
fn single(value: f64) -> Result<f32, String> {
    let single = value as f32;
    if single.is_finite() { Ok(single) } else { Err(format!("{value:?} must be finite, from -3.4e38 to 3.4e38")) }
}

fn scale<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f32, D::Error> {
    let scale = single(f64::deserialize(deserializer)?).map_err(D::Error::custom)?;
    if scale == 0.0 { Err(D::Error::custom("0 must not be the scale")) } else { Ok(scale) }
}

/// A rule of tangents: of its table there is one key.
fn tangent<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<TangentRule>, D::Error> {
    let rule = toml::Value::deserialize(deserializer)?;
    if !(rule.is_str() || rule.is_table()) {
        return Err(D::Error::custom("give \"uv\", { around = [x, y, z] } or { along = [x, y, z] }"));
    }
    if rule.as_table().is_some_and(|table| table.len() != 1) {
        return Err(D::Error::custom("give `around` or `along`"));
    }
    TangentRule::deserialize(rule).map(Some).map_err(|error| D::Error::custom(error.message()))
}

fn finite_vector<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[f32; 3], D::Error> {
    let [x, y, z] = three_numbers::<f64, [_; 3], D>(deserializer)?;
    let single = |value| single(value).map_err(D::Error::custom);
    Ok([single(x)?, single(y)?, single(z)?])
}

/// What [`Scene::to_toml`] writes.
#[derive(Serialize)]
struct SceneText<'a> {
    image: &'a ImageSettings,
    #[serde(skip_serializing_if = "Option::is_none")]
    camera: Option<Camera>,
    environment: toml::Table,
    shading: &'a ShadingSettings,
    material: Vec<toml::Table>,
    object: Vec<toml::Table>,
}

impl<'a> SceneText<'a> {
    fn new(scene: &'a Scene, folder: Option<&Path>) -> Result<Self> {
        let environment = &scene.environment;
        Ok(Self {
            image: &scene.image,
            camera: scene.camera,
            environment: toml::Table::from_iter([
                source_entry("environment", &environment.source, "file", folder)?,
                ("rotation_deg".into(), environment.rotation_deg.into()),
                ("intensity".into(), environment.intensity.into()),
            ]),
            shading: &scene.shading,
            material: scene.materials.iter().map(|material| material_table(material, folder)).collect::<Result<_>>()?,
            object: scene.objects.iter().map(|object| object_table(object, folder)).collect::<Result<_>>()?,
        })
    }
}

fn material_table(material: &MaterialSettings, folder: Option<&Path>) -> Result<toml::Table> {
    let mut table = toml::Table::from_iter([("name".into(), material.name.clone().into())]);
    match &material.source {
        MaterialSource::File(path) => table.extend([("file".into(), path_value(path, folder)?)]),
        MaterialSource::Builtin(name) => table.extend([("builtin".into(), name.clone().into())]),
        MaterialSource::Model { model, parameters } => {
            let mut parameters = parameters.clone();
            change_base_files(&mut parameters, &|path| path_value(path, folder))?;
            table.extend([("model".into(), model.clone().into())]);
            table.extend(parameters);
        }
        MaterialSource::Custom(_) => {
            let subject = format!("material \"{}\"", material.name);
            return Err(Error::input(subject, "is defined by a program", "choose a model or a file before saving"));
        }
    }
    Ok(table)
}

fn object_table(object: &ObjectSettings, folder: Option<&Path>) -> Result<toml::Table> {
    // Through the shortest decimal, so that 0.1 does not become 0.10000000149011612.
    let number = |value: f32| toml::Value::Float(value.to_string().parse().unwrap_or(f64::from(value)));
    let vector = |values: [f32; 3]| toml::Value::Array(values.map(number).to_vec());
    let rule = |rule| {
        let by = |key: &str, axis: glam::Vec3| toml::Table::from_iter([(key.into(), vector(axis.to_array()))]).into();
        let value: toml::Value = match rule {
            TangentRule::Around(axis) => by("around", axis),
            TangentRule::Along(axis) => by("along", axis),
            TangentRule::Uv => "uv".into(),
        };
        ("tangent".into(), value)
    };
    let entries = [
        source_entry("mesh", &object.mesh, "mesh", folder)?,
        ("material".into(), object.material.clone().into()),
        ("translate".into(), vector(object.translate.to_array())),
        ("rotate_deg".into(), vector(object.rotate_deg.to_array())),
        ("scale".into(), number(object.scale)),
    ];
    Ok(entries.into_iter().chain(object.tangent.map(rule)).collect())
}

/// The key and value of the source of `what`; `file_key` is the key of files.
fn source_entry<T: std::fmt::Display>(
    what: &str,
    source: &Source<T>,
    file_key: &str,
    folder: Option<&Path>,
) -> Result<(String, toml::Value)> {
    Ok(match source {
        Source::File(path) => (file_key.into(), path_value(path, folder)?),
        Source::Builtin(name) => ("builtin".into(), name.clone().into()),
        Source::Custom(custom) => {
            let subject = format!("{what} \"{custom}\"");
            return Err(Error::input(subject, "is defined by a program", "choose a file or a built-in before saving"));
        }
    })
}

/// The path as it is seen from `folder` if it lies there, else the absolute one.
fn path_value(path: &Path, folder: Option<&Path>) -> Result<toml::Value> {
    let absolute = std::path::absolute(path).unwrap_or(path.into());
    let relative = folder.and_then(|folder| absolute.strip_prefix(folder).ok()).unwrap_or(&absolute);
    match relative.to_str() {
        Some(text) => Ok(text.into()),
        None => Err(Error::in_file(path, "has a name that no scene file can hold", "rename it to UTF-8")),
    }
}

#[cfg(test)]
#[path = "file_tests.rs"]
mod tests;
