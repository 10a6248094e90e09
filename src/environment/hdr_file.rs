//! Reads environments from Radiance HDR files.
use std::io::Cursor;
use std::path::Path;

use image::codecs::hdr::{HdrDecoder, HdrMetadata};
use image::{DynamicImage, ImageDecoder};

use super::Environment;
use crate::error::{Error, Result};
use crate::file_format::FileFormat;
use crate::output::{self, Primaries};

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
    let metadata = decoder.metadata();
    let picture = DynamicImage::from_decoder(decoder).map_err(broken)?.into_rgb32f();
    let mut texels: Vec<_> = picture.pixels().map(|pixel| pixel.0).collect();
    if let Some(primaries) = primaries(&metadata) {
        primaries.convert(path, &mut texels);
    }
    if let Some(exposure) = metadata.exposure.filter(|exposure| *exposure != 1.0) {
        tracing::warn!("{}: its EXPOSURE of {exposure} is not divided out; intensity can do that", path.display());
    }
    Environment::of_file(path, width as usize, height as usize, texels)
}

/// What the header says of primaries; none where it says nothing. Some programs write zeros for that.
fn primaries(metadata: &HdrMetadata) -> Option<Primaries> {
    let (_, text) = metadata.custom_attributes.iter().rfind(|(name, _)| name == "PRIMARIES")?;
    let numbers: Vec<f32> = text.split_whitespace().map_while(|number| number.parse().ok()).collect();
    let &[r_x, r_y, g_x, g_y, b_x, b_y, w_x, w_y] = numbers.as_slice() else { return None };
    let is_told = numbers.iter().any(|number| *number != 0.0);
    let primaries = Primaries { red: [r_x, r_y], green: [g_x, g_y], blue: [b_x, b_y], white: [w_x, w_y] };
    is_told.then_some(primaries)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first pixel of a map of one colour, mantissas 200, 100 and 50 of 256 x 2, whose header has this line.
    fn read(line: &str) -> [f32; 3] {
        let mut bytes = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n{line}\n\n-Y 1 +X 2\n").into_bytes();
        bytes.extend([200, 100, 50, 129].repeat(2));
        parse(Path::new("test.hdr"), &bytes).unwrap().texels[0]
    }

    #[test]
    fn primaries_of_the_header_count_where_it_names_any() {
        let plain = read("GAMMA=1");
        for line in [
            "PRIMARIES=0 0 0 0 0 0 0 0",
            "PRIMARIES=0.64 0.33",
            "PRIMARIES=a b",
            "PRIMARIES=.64 .33 .3 .6 .15 .06 .3127 .329",
        ] {
            assert_eq!(read(line), plain, "{line}");
        }
        // Those of Rec. 2020, and its published matrix to Rec. 709 (ITU-R BT.2087-0), which have the same white.
        let converted = read("PRIMARIES=0.708 0.292 0.170 0.797 0.131 0.046 0.3127 0.3290");
        let rows = [[1.6605, -0.5876, -0.0728], [-0.1246, 1.1329, -0.0083], [-0.0182, -0.1006, 1.1187]];
        for (row, found) in rows.iter().zip(converted) {
            let expected: f32 = row.iter().zip(plain).map(|(factor, value)| factor * value).sum();
            assert!((found - expected).abs() < 1e-3, "{converted:?} of {plain:?}");
        }
    }
}
