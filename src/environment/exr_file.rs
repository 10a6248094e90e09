//! Reads environments from OpenEXR files.
use std::path::Path;

use super::Environment;
use crate::error::Result;
use crate::files::FileFormat;
use crate::picture;

pub(super) const FORMAT: FileFormat<Environment> = FileFormat {
    extension: "exr",
    name: "an OpenEXR .exr",
    is_of_format: |_| true,
    parse: |path, bytes, _| parse(path, bytes),
};

/// EXR needs channels R, G, B or only Y; alpha is ignored.
fn parse(path: &Path, bytes: &[u8]) -> Result<Environment> {
    let picture = picture::parse_exr(path, bytes)?;
    let texels = picture.rgba.iter().map(|&[r, g, b, _]| [r, g, b]).collect();
    Environment::of_pixels(path.display(), picture.width as usize, picture.height as usize, texels)
}
