//! What lies under a coat: a built-in material, a file, or a model with its parameters in a table of its own.
use std::convert::Infallible;
use std::path::{Path, PathBuf};

use glam::DVec3;
use toml::{Table, Value};

use crate::brdf::files::parse_model;
use crate::brdf::{Brdf, Domain, Lambert, Parameters};
use crate::error::{Error, Result};
use crate::files::read as read_file;

const KEY: &str = "base";

/// Layers of files, one under the other: more are a file that lies under itself.
const MAX_LAYERS: usize = 8;

/// Reads the key `base`. A name with an extension is a file's.
pub(super) fn read(parameters: &mut Parameters) -> Result<Brdf> {
    let what = "the name of a built-in material, a file, or { model = \"...\", ... }";
    if parameters.is_table(KEY) {
        return parameters.table(KEY, what, |inner| Brdf::read_model(&inner.model()?, inner));
    }
    let names = Domain::Choice(Brdf::builtin_names().map(str::to_owned).collect());
    let value = parameters.take(KEY, what, names, "What is under the coat.")?;
    match value.as_str() {
        // Any base will do for what is thrown away.
        Some(text) if is_file(text) && parameters.only_checks() => {
            Ok(Brdf::Lambert(Lambert { reflectance: DVec3::ZERO }))
        }
        Some(text) if is_file(text) => load_file(Path::new(text)).map_err(|error| error.within(KEY)),
        Some(name) => Brdf::builtin(name).ok_or_else(|| {
            let remedy = Brdf::FILES.remedy_for(name);
            Error::input(KEY, format!("\"{name}\" is neither built in nor a file"), remedy)
        }),
        None => Err(Error::input(KEY, format!("is {value}"), format!("give {what}"))),
    }
}

fn load_file(path: &Path) -> Result<Brdf> {
    if base_files_of(path).len() >= MAX_LAYERS {
        let problem = format!("lies over {MAX_LAYERS} files or more, or over itself");
        return Err(Error::in_file(path, problem, "name a base that is no coat"));
    }
    Brdf::load(path)
}

fn is_file(text: &str) -> bool {
    Path::new(text).extension().is_some()
}

/// Calls `change` with the path of each file that the parameters name as a base, also below other bases.
///
/// # Errors
/// Those of `change`.
pub fn change_base_files(parameters: &mut Table, change: &dyn Fn(&Path) -> Result<Value>) -> Result<()> {
    match parameters.get_mut(KEY) {
        Some(Value::Table(inner)) => change_base_files(inner, change),
        Some(Value::String(text)) if is_file(text) => {
            let changed = change(Path::new(text))?;
            parameters.insert(KEY.into(), changed);
            Ok(())
        }
        _ => Ok(()),
    }
}

/// Takes files that are named as bases to be in `folder`, unless their paths are absolute.
///
/// # Errors
/// A folder whose name is not UTF-8.
pub fn resolve_base_files(parameters: &mut Table, folder: &Path) -> Result<()> {
    change_base_files(parameters, &|path| {
        let path = folder.join(path);
        let text = path.to_str().map(Value::from);
        text.ok_or_else(|| Error::in_file(&path, "has a name that is not UTF-8", "rename its folder"))
    })
}

/// The file that the parameters name as a base, also below tables.
pub fn base_file(parameters: &Table) -> Option<PathBuf> {
    match parameters.get(KEY)? {
        Value::Table(inner) => base_file(inner),
        Value::String(text) if is_file(text) => Some(text.into()),
        _ => None,
    }
}

/// The file that a material's file at `path`, of these contents, names as a base: none of a measured one. What cannot be read has none, too; whoever
/// loads it will say why.
pub fn base_file_in(path: &Path, bytes: &[u8]) -> Option<PathBuf> {
    base_file(&parse_model(path, bytes).ok()?.1)
}

/// `first` and the files below it, by what each names as its base, as far as there may be layers.
///
/// # Errors
/// Those of `base_of`.
pub fn base_files_from<E>(
    first: Option<PathBuf>,
    base_of: impl Fn(&Path) -> Result<Option<PathBuf>, E>,
) -> Result<Vec<PathBuf>, E> {
    let (mut files, mut next) = (Vec::new(), first);
    while let Some(file) = next.take().filter(|_| files.len() < MAX_LAYERS) {
        next = base_of(&file)?;
        files.push(file);
    }
    Ok(files)
}

/// The files that the parameters name as bases, and those that these name in turn, as they are on disk.
pub fn base_files(parameters: &Table) -> Vec<PathBuf> {
    on_disk_from(base_file(parameters))
}

/// The files that a material's file names as bases, and those that these name in turn, as they are on disk.
pub fn base_files_of(path: &Path) -> Vec<PathBuf> {
    on_disk_from(base_file_of(path))
}

fn on_disk_from(first: Option<PathBuf>) -> Vec<PathBuf> {
    let Ok(files) = base_files_from(first, |path| Ok::<_, Infallible>(base_file_of(path)));
    files
}

fn base_file_of(path: &Path) -> Option<PathBuf> {
    Brdf::is_model_file(path).then(|| read_file(path).ok()).flatten().and_then(|bytes| base_file_in(path, &bytes))
}
