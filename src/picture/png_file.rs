//! Writes and reads PNG pictures, 8 bits a channel.
use std::io::Cursor;
use std::path::Path;

use image::codecs::png::PngDecoder;
use image::{DynamicImage, ImageDecoder};
use png::{BitDepth, ColorType, Compression, Encoder, ScaledFloat, SrgbRenderingIntent};

use super::{DEFLATED, Format, PictureFile, check_pixels};
use crate::error::{Error, Result};
use crate::files::write_whole;

/// Where the bits of a channel stand: behind the signature (8), the chunk's length and name (8), width and height (8).
const BITS: usize = 24;

/// The gamma of display values that sRGB is near to.
const SRGB_GAMMA: f64 = 2.2;

/// Writes a PNG of `width` x `height` pixels of sRGB, rows from the top, straight alpha; without `alpha` only RGB.
///
/// # Panics
/// If `rgba8` does not hold 4 bytes for each pixel.
pub fn write_png(path: &Path, width: u32, height: u32, rgba8: &[u8], alpha: bool) -> Result<()> {
    write_png_of_gamma(path, width, height, rgba8, alpha, SRGB_GAMMA)
}

/// The same of display values that are light to the power of 1 over `gamma`: the file says so, or that it is sRGB where that is near.
///
/// # Panics
/// If `rgba8` does not hold 4 bytes for each pixel.
pub fn write_png_of_gamma(path: &Path, width: u32, height: u32, rgba8: &[u8], alpha: bool, gamma: f64) -> Result<()> {
    assert_eq!(rgba8.len(), width as usize * height as usize * 4, "4 bytes a pixel");
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, width, height);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_compression(Compression::Fast);
    if gamma == SRGB_GAMMA {
        encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
    } else {
        encoder.set_source_gamma(ScaledFloat::from_scaled((1e5 / gamma).round() as u32));
    }
    let rgb8: Vec<u8>;
    let (color, data) = if alpha {
        (ColorType::Rgba, rgba8)
    } else {
        rgb8 = rgba8.chunks_exact(4).flat_map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
        (ColorType::Rgb, &rgb8[..])
    };
    encoder.set_color(color);
    let written = encoder.write_header().and_then(|mut writer| writer.write_image_data(data));
    written.map_err(|cause| Error::unwritable(path, cause))?;
    write_whole(path, &bytes)
}

/// Reads the bytes of the PNG at `path` as display values in [0, 1].
pub(super) fn parse(path: &Path, bytes: &[u8]) -> Result<PictureFile> {
    let broken = |cause: image::ImageError| {
        let cause = cause.to_string().replace('\n', " ");
        Error::in_file(path, format!("is not a whole PNG ({cause})"), "give another picture")
    };
    let decoder = PngDecoder::new(Cursor::new(bytes)).map_err(broken)?;
    let (width, height) = decoder.dimensions();
    let pixels_a_byte = bytes.get(BITS).map_or(1, |&bits| (8 / u64::from(bits.max(1))).max(1));
    let most = DEFLATED * pixels_a_byte;
    check_pixels(path, [u64::from(width) * u64::from(height)], bytes.len(), most)?;
    let decoded = DynamicImage::from_decoder(decoder).map_err(broken)?;
    Ok(PictureFile {
        width: decoded.width(),
        height: decoded.height(),
        alpha: decoded.color().has_alpha(),
        rgba: decoded.into_rgba32f().pixels().map(|pixel| pixel.0).collect(),
        format: Format::Png,
        attributes: Default::default(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The checksum of a chunk: CRC-32 of ISO 3309, bit by bit.
    fn crc(bytes: &[u8]) -> u32 {
        let step = |crc: u32| if crc & 1 == 1 { (crc >> 1) ^ 0xedb8_8320 } else { crc >> 1 };
        !bytes.iter().fold(u32::MAX, |crc, &byte| (0..8).fold(crc ^ u32::from(byte), |crc, _| step(crc)))
    }

    #[test]
    fn a_black_picture_of_one_bit_a_pixel_is_read() {
        // 640 x 480, as Pillow writes it.
        let file = [
            137, 80, 78, 71, 13, 10, 26, 10, 0, 0, 0, 13, 73, 72, 68, 82, 0, 0, 2, 128, 0, 0, 1, 224, 1, 0, 0, 0, 0,
            29, 170, 225, 73, 0, 0, 0, 61, 73, 68, 65, 84, 120, 218, 237, 193, 1, 13, 0, 0, 0, 194, 160, 247, 79, 109,
            14, 55, 160, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0,
            0, 0, 0, 0, 0, 0, 224, 207, 0, 151, 224, 0, 1, 75, 204, 27, 74, 0, 0, 0, 0, 73, 69, 78, 68, 174, 66, 96,
            130,
        ];
        let picture = parse(Path::new("black.png"), &file).unwrap();
        assert!((picture.width, picture.height) == (640, 480) && picture.rgba.iter().all(|texel| texel[0] == 0.0));
    }

    #[test]
    fn a_picture_is_marked_as_srgb_or_with_its_gamma() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("marked.png");
        let of_gamma = |gamma: f64| {
            write_png_of_gamma(&path, 2, 1, &[9; 8], true, gamma).unwrap();
            let file = std::io::BufReader::new(std::fs::File::open(&path).unwrap());
            let reader = png::Decoder::new(file).read_info().unwrap();
            (reader.info().srgb.is_some(), reader.info().gamma().map(|gamma| gamma.into_scaled()))
        };
        assert_eq!([2.2, 1.0, 1.8].map(of_gamma), [(true, Some(45455)), (false, Some(100_000)), (false, Some(55556))]);
    }

    #[test]
    fn a_picture_that_claims_more_pixels_than_its_bytes_can_hold_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("claims.png");
        write_png(&path, 4, 2, &[7; 32], false).unwrap();
        let mut bytes = std::fs::read(&path).unwrap();
        assert!(parse(&path, &bytes).is_ok());
        // Width and height stand behind the signature (8), the chunk's length (4) and its name (4), its checksum at its end.
        bytes[16..24].copy_from_slice(&[16000_u32; 2].map(u32::to_be_bytes).concat());
        let checksum = crc(&bytes[12..29]);
        bytes[29..33].copy_from_slice(&checksum.to_be_bytes());
        let error = parse(&path, &bytes).unwrap_err().to_string();
        assert!(error.contains("claims.png") && error.contains("more than 1032 pixels"), "{error}");
    }
}
