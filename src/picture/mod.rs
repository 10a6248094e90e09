//! Pictures on the disk: PNG for looking, EXR for measuring; written whole or not at all, and read back.
use std::path::Path;

use crate::error::{Error, Result};
use crate::files;

mod exr_file;
mod png_file;
mod primaries;

pub(crate) use exr_file::parse_exr;
pub use exr_file::{ExrHeader, write_exr};
pub use png_file::{write_png, write_png_of_gamma};
pub(crate) use primaries::Primaries;

/// What deflate makes of a byte at most. A sample takes a byte or more, and so do most pixels: it bounds how many there are.
const DEFLATED: u64 = 1032;

/// The file formats of a picture, told apart by the extension of the file's name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// 8 bits a channel, tone mapped.
    Png,
    /// 32-bit float, linear radiance.
    Exr,
}

impl Format {
    /// The format that the name at `path` asks for; an error for any other extension.
    pub fn of(path: &Path) -> Result<Self> {
        match path.extension().map(|extension| extension.to_ascii_lowercase()) {
            Some(extension) if extension == "png" => Ok(Self::Png),
            Some(extension) if extension == "exr" => Ok(Self::Exr),
            _ => Err(Error::in_file(path, "is no known kind of picture", "end its name in .png or .exr")),
        }
    }
}

/// An error unless the name at `path` is that of a PNG.
pub fn check_png(path: &Path) -> Result<()> {
    match Format::of(path) {
        Ok(Format::Png) => Ok(()),
        _ => Err(Error::in_file(path, "is no PNG", "end its name in .png")),
    }
}

/// A picture as read from a file, row by row from the top left.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureFile {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// PNG: display values in [0, 1]. EXR: linear radiance. Alpha is 1 where the file has none.
    pub rgba: Vec<[f32; 4]>,
    /// Whether the file has an alpha channel. Colour is then as stored: straight in PNG, multiplied by alpha in EXR.
    pub alpha: bool,
    /// Which of the two.
    pub format: Format,
    /// Name and value of each text or number in an EXR's header that is not one of the format's own; empty for PNG.
    pub attributes: std::collections::BTreeMap<String, String>,
}

/// Reads the PNG or EXR at `path`. EXR may have R, G, B or only Y, with or without A.
pub fn read_image(path: &Path) -> Result<PictureFile> {
    Format::of(path)?;
    parse_image(path, &files::read(path)?)
}

/// The picture in the bytes of the PNG or EXR at `path`.
///
/// # Errors
/// An extension of neither; bytes that are no whole picture.
pub fn parse_image(path: &Path, bytes: &[u8]) -> Result<PictureFile> {
    match Format::of(path)? {
        Format::Png => png_file::parse(path, bytes),
        Format::Exr => parse_exr(path, bytes),
    }
}

/// Largest picture that is read.
pub(crate) const MAX_PIXELS: u64 = 1 << 28;

/// Checks a picture's size before anything is allocated for it: a header of some bytes can claim any number of pixels, but compression
/// makes only so many, `most`, of a byte of the file. `pixels` are those of each layer and channel.
pub(crate) fn check_pixels(
    path: &Path,
    pixels: impl IntoIterator<Item = u64>,
    file_bytes: usize,
    most: u64,
) -> Result<()> {
    let mut sum = 0_u64;
    for pixels in pixels {
        if pixels > MAX_PIXELS {
            return Err(Error::in_file(path, "says that it has more than 2^28 pixels", "make it smaller"));
        }
        sum += pixels;
        if sum > most.saturating_mul(file_bytes as u64) {
            let problem = format!("says that it has more than {most} pixels for each of its {file_bytes} bytes");
            return Err(Error::in_file(path, problem, "fetch or save it again"));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::check_writable;

    const GRADIENT: [[f32; 4]; 6] = [
        [0.0, 0.5, 1.0, 1.0],
        [1e-3, 1e6, 3.25, 0.5],
        [1.0, 1.0, 1.0, 0.0],
        [0.1, 0.2, 0.3, 1.0],
        [65504.0, 1e-30, 0.0, 1.0],
        [7.0, 8.0, 9.0, 1.0],
    ];

    #[test]
    fn an_exr_reads_back_to_the_bit_with_its_header() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture.exr");
        let header = ExrHeader {
            method: "paper".into(),
            threads: 100,
            material: "é.toml".into(),
            environment: "日本.hdr".into(),
            device: "a device".into(),
            seconds: 0.25,
            more: vec![("größe".into(), "½".into())],
            ..ExrHeader::default()
        };
        write_exr(&path, 3, 2, &GRADIENT, true, &header).unwrap();
        // Other programs read UTF-8.
        let has = |text: &str| std::fs::read(&path).unwrap().windows(text.len()).any(|bytes| bytes == text.as_bytes());
        assert!(has("é.toml") && has("日本.hdr") && has("größe"));
        let picture = read_image(&path).unwrap();
        assert_eq!((picture.width, picture.height, picture.alpha), (3, 2, true));
        assert_eq!(picture.rgba, GRADIENT);
        for (name, value) in [
            ("method", "paper"),
            ("threads", "100"),
            ("material", "é.toml"),
            ("environment", "日本.hdr"),
            ("device", "a device"),
            ("seconds", "0.25"),
            ("größe", "½"),
            ("threadlight_version", env!("CARGO_PKG_VERSION")),
        ] {
            assert_eq!(picture.attributes[name], value, "{name}");
        }

        write_exr(&path, 3, 2, &GRADIENT, false, &header).unwrap();
        let picture = read_image(&path).unwrap();
        assert!(!picture.alpha);
        assert!(
            picture.rgba.iter().zip(GRADIENT).all(|(read, written)| *read == [written[0], written[1], written[2], 1.0])
        );
    }

    #[test]
    fn the_same_exr_twice_has_the_same_bytes() {
        let folder = tempfile::tempdir().unwrap();
        let pixels: Vec<[f32; 4]> = (0..200 * 300).map(|i| [i as f32, (i as f32).sin(), 0.5, 1.0]).collect();
        let bytes = ["a.exr", "b.exr"].map(|name| {
            let path = folder.path().join(name);
            write_exr(&path, 300, 200, &pixels, false, &ExrHeader::default()).unwrap();
            std::fs::read(path).unwrap()
        });
        assert!(bytes[0] == bytes[1]);
    }

    #[test]
    fn a_png_reads_back_and_says_that_it_is_srgb() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture.PNG");
        let rgba8: Vec<u8> = (0..24).map(|i| i * 10).collect();
        for alpha in [true, false] {
            write_png(&path, 3, 2, &rgba8, alpha).unwrap();
            assert!(std::fs::read(&path).unwrap().windows(4).any(|bytes| bytes == b"sRGB"));
            let picture = read_image(&path).unwrap();
            assert_eq!((picture.width, picture.height, picture.alpha, picture.format), (3, 2, alpha, Format::Png));
            for (pixel, bytes) in picture.rgba.iter().zip(rgba8.chunks(4)) {
                for channel in 0..if alpha { 4 } else { 3 } {
                    assert_eq!(pixel[channel], f32::from(bytes[channel]) / 255.0);
                }
            }
        }
    }

    #[test]
    fn an_unwritable_path_is_an_error_and_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let missing = folder.path().join("missing/picture.png");
        let occupied = folder.path().join("folder.exr");
        std::fs::create_dir_all(occupied.join("inside")).unwrap();
        assert!(write_png(&missing, 1, 1, &[0; 4], true).unwrap_err().to_string().contains("picture.png"));
        assert!(write_exr(&occupied, 1, 1, &[[0.0; 4]], true, &ExrHeader::default()).is_err());
        assert!(check_writable(&missing).is_err() && check_writable(&occupied).is_err());
        assert!(check_writable(&folder.path().join("new.png")).is_ok());
        let left: Vec<_> = std::fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        assert_eq!(left, ["folder.exr"]);
    }

    #[test]
    fn an_unknown_extension_is_an_error_that_names_the_known_ones() {
        for name in ["picture.jpg", "picture", "png"] {
            let error = Format::of(Path::new(name)).unwrap_err().to_string();
            assert!(error.contains(name) && error.contains(".png") && error.contains(".exr"), "{error}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_picture_is_as_readable_as_any_other_file() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let (picture, other) = (folder.path().join("picture.png"), folder.path().join("other"));
        write_png(&picture, 1, 1, &[255; 4], true).unwrap();
        std::fs::write(&other, b"x").unwrap();
        let mode = |path: &Path| std::fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&picture), mode(&other));
    }

    #[test]
    fn broken_pictures_are_errors_that_name_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let whole = folder.path().join("whole.exr");
        let pixels = vec![[0.5; 4]; 64 * 64];
        write_exr(&whole, 64, 64, &pixels, false, &ExrHeader::default()).unwrap();
        let exr = std::fs::read(&whole).unwrap();
        let png = folder.path().join("whole.png");
        write_png(&png, 64, 64, &[9; 64 * 64 * 4], false).unwrap();
        let png = std::fs::read(&png).unwrap();
        for (name, bytes) in [
            ("cut.exr", &exr[..exr.len() / 2]),
            ("header.exr", &exr[..100]),
            ("empty.exr", &[]),
            ("text.exr", b"hello"),
            ("cut.png", &png[..png.len() / 2]),
            ("empty.png", &[]),
        ] {
            let path = folder.path().join(name);
            std::fs::write(&path, bytes).unwrap();
            let error = read_image(&path).unwrap_err().to_string();
            assert!(error.contains(name) && !error.contains('\n'), "{error}");
        }
        assert!(read_image(&folder.path().join("missing.exr")).unwrap_err().to_string().contains("missing.exr"));
    }
}
