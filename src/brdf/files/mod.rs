//! Files of materials: a reader for each format, and who writes MERL's.
use super::Brdf;
use crate::files::file_formats;

mod merl_export;
mod spectrum;
mod tensor_file;

file_formats!(pub(super) Brdf: merl_file, rgl_file, mit_file, utia_file, toml_file);
pub use merl_export::{merl_bytes, merl_bytes_of_stored, merl_bytes_of_values};
pub(crate) use toml_file::has_model;
pub(super) use toml_file::{is_model_file, parse_model};
