//! Reads materials from TOML files: a model and its parameters.
use std::path::Path;

use crate::brdf::{Brdf, model_of, resolve_base_files};
use crate::error::{Error, Result};
use crate::files::{FileFormat, text};

pub(super) const FORMAT: FileFormat<Brdf> = FileFormat {
    extension: "toml",
    name: "a .toml with a model and its parameters",
    is_of_format: has_model,
    parse: |path, bytes, _| parse(path, bytes),
};

/// Whether `path` is called as a file of this format is.
pub(crate) fn is_model_file(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case(FORMAT.extension))
}

/// A material has a model at its top; a scene has nothing but sections there.
pub(crate) fn has_model(bytes: &[u8]) -> bool {
    let table = std::str::from_utf8(bytes).ok().and_then(|text| text.parse::<toml::Table>().ok());
    table.is_some_and(|table| table.contains_key("model"))
}

fn parse(path: &Path, bytes: &[u8]) -> Result<Brdf> {
    let (model, parameters) = parse_model(path, bytes)?;
    Brdf::from_parameters(&model, parameters).map_err(|error| error.within(path.display()))
}

/// The model that the file names, and its parameters, not yet checked. Files that it names are relative to its folder.
pub(crate) fn parse_model(path: &Path, bytes: &[u8]) -> Result<(String, toml::Table)> {
    let within = |error: Error| error.within(path.display());
    let (model, mut parameters) = model_of(text(path, bytes)?).map_err(within)?;
    resolve_base_files(&mut parameters, path.parent().unwrap_or(Path::new(""))).map_err(within)?;
    Ok((model, parameters))
}
