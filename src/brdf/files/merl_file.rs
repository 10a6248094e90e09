//! Reads measured materials from MERL's `.binary` files.
use std::path::Path;

use crate::brdf::{Brdf, MerlTable};
use crate::error::{Error, Result};
use crate::files::FileFormat;

pub(super) const FORMAT: FileFormat<Brdf> = FileFormat {
    extension: "binary",
    name: "a MERL .binary",
    is_of_format: |_| true,
    parse: |path, bytes, _| parse(path, bytes),
};

fn parse(path: &Path, bytes: &[u8]) -> Result<Brdf> {
    MerlTable::from_bytes(bytes).map(Brdf::MerlTable).map_err(|problem| {
        Error::in_file(path, problem, "fetch or write the file again; a MERL table is 90 x 90 x 180 cells")
    })
}
