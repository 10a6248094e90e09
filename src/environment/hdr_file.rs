//! Reads environments from Radiance HDR files.
use std::io::Cursor;
use std::path::Path;

use image::codecs::hdr::HdrDecoder;
use image::{DynamicImage, ImageDecoder};

use super::Environment;
use crate::error::{Error, Result};
use crate::file_format::FileFormat;
use crate::output;

pub(super) const FORMAT: FileFormat<Environment> =
    FileFormat { extension: "hdr", name: "a Radiance .hdr", is_of_format: |_| true, parse };

/// A run of each of four channels takes two bytes and is of 127 pixels at most.
const MAX_PIXELS_PER_BYTE: u64 = 16;

fn parse(path: &Path, bytes: &[u8]) -> Result<Environment> {
    let broken = |cause: image::ImageError| {
        let cause = cause.to_string().replace('\n', " ");
        Error::in_file(path, format!("is not a whole Radiance HDR ({cause})"), "fetch or save it again")
    };
    let decoder = HdrDecoder::new(Cursor::new(bytes)).map_err(broken)?;
    let (width, height) = decoder.dimensions();
    output::check_pixels(path, [u64::from(width) * u64::from(height)], bytes.len(), MAX_PIXELS_PER_BYTE)?;
    let picture = DynamicImage::from_decoder(decoder).map_err(broken)?.into_rgb32f();
    let texels = picture.pixels().map(|pixel| pixel.0).collect();
    Environment::of_file(path, width as usize, height as usize, texels)
}
