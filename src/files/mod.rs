//! Files of any content: which formats there are, how bytes are read, written whole or not at all, and kept.
mod cache_file;
mod format;
mod quote;
mod read;
mod seal;
#[cfg(test)]
mod test_data;
mod values;
mod whole_file;

pub(crate) use cache_file::keep_file;
pub use format::{FileFormat, FileKind};
pub(crate) use format::{file_formats, is_misspelt};
pub(crate) use quote::{quote_line, toml_problem};
pub use read::{read, text};
pub(crate) use seal::{sealed, unsealed};
#[cfg(test)]
pub(crate) use test_data::measured;
pub(crate) use values::ValuesFormat;
pub use whole_file::{check_all_writable, check_not_read, check_writable, file_in, file_name, write_whole};
