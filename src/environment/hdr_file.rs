//! Reads environments from Radiance HDR files, by the rules of Radiance itself (`header.c`, `resolu.c` and `color.c` in its `src/common`), but
//! that a value is its mantissa's, without the half step that `color.c` adds, and that a file without `PRIMARIES` has those of Rec. 709, as other
//! programs write it, not Radiance's own.
use std::borrow::Cow;
use std::path::Path;

use super::Environment;
use crate::error::{Error, Result};
use crate::files::FileFormat;
use crate::picture::{self, Primaries};

pub(super) const FORMAT: FileFormat<Environment> = FileFormat {
    extension: "hdr",
    name: "a Radiance .hdr",
    is_of_format: |_| true,
    parse: |path, bytes, _| parse(path, bytes),
};

/// A run of each of four channels takes two bytes and is of 127 pixels at most. Runs of the older form may be longer, so old files of nearly one
/// colour are refused: what a few bytes may ask for has to end somewhere.
const MAX_PIXELS_PER_BYTE: u64 = 16;

const SIGNATURES: [&str; 2] = ["#?RADIANCE", "#?RGBE"];

fn parse(path: &Path, bytes: &[u8]) -> Result<Environment> {
    let broken =
        |what: &str| Error::in_file(path, format!("is not a whole Radiance HDR: {what}"), "fetch or save it again");
    let mut rest = bytes;
    if !take_line(&mut rest).is_some_and(|line| SIGNATURES.iter().any(|signature| line.starts_with(signature))) {
        return Err(broken(&format!("it does not begin with {}", SIGNATURES.join(" or "))));
    }
    let header = Header::take(&mut rest).map_err(broken)?;
    let size = take_line(&mut rest).and_then(|line| axes(&line));
    let axes = size.ok_or_else(|| broken("it has no size such as -Y 512 +X 1024"))?;
    let [lines, columns] = axes.map(|axis| axis.count);
    picture::check_pixels(path, [lines as u64 * columns as u64], bytes.len(), MAX_PIXELS_PER_BYTE)?;

    let mut pixels = vec![[0; 4]; lines * columns];
    for (line, scanline) in pixels.chunks_exact_mut(columns.max(1)).enumerate() {
        let problem = || broken(&format!("scanline {} of {lines} ends too early or too late", line + 1));
        take_scanline(&mut rest, scanline).ok_or_else(problem)?;
    }
    let (width, height, mut texels) = upright(&pixels, axes);
    if let Some(primaries) = header.primaries {
        primaries.convert(path, &mut texels);
    }
    if header.exposure != 1.0 {
        let exposure = header.exposure;
        tracing::warn!("{}: its EXPOSURE of {exposure} is not divided out; intensity can do that", path.display());
    }
    if header.colour_correction != [1.0; 3] {
        let [r, g, b] = header.colour_correction;
        tracing::warn!("{}: its COLORCORR of {r} {g} {b} is not divided out", path.display());
    }
    Environment::of_pixels(path.display(), width, height, texels)
}

/// Takes the next line off `bytes`; some programs end it by CR LF. None if it has no end.
fn take_line<'a>(bytes: &mut &'a [u8]) -> Option<Cow<'a, str>> {
    let length = bytes.iter().position(|&byte| byte == b'\n')?;
    let line = &bytes[..length];
    *bytes = &bytes[length + 1..];
    Some(String::from_utf8_lossy(line.strip_suffix(b"\r").unwrap_or(line)))
}

/// What a header says of the radiance of pixels.
struct Header {
    /// None where it says nothing.
    primaries: Option<Primaries>,
    /// Of all its lines, multiplied.
    exposure: f32,
    /// The same.
    colour_correction: [f32; 3],
}

impl Header {
    /// Takes the lines after the signature off `bytes`, up to the empty one. Indented lines are of the pictures that this one was made from.
    /// The error is what is wrong.
    fn take(bytes: &mut &[u8]) -> Result<Self, &'static str> {
        let mut header = Self { primaries: None, exposure: 1.0, colour_correction: [1.0; 3] };
        let mut is_xyz = false;
        loop {
            let line = take_line(bytes).ok_or("its header has no end")?;
            if line.is_empty() {
                break;
            }
            let Some((name, value)) = line.split_once('=') else { continue };
            let numbers = || value.split_whitespace().map_while(|number| number.parse().ok()).collect::<Vec<f32>>();
            match name.trim_end() {
                "FORMAT" => {
                    is_xyz = match value.trim() {
                        "32-bit_rle_rgbe" => false,
                        "32-bit_rle_xyze" => true,
                        _ => return Err("its FORMAT is neither 32-bit_rle_rgbe nor 32-bit_rle_xyze"),
                    }
                }
                "EXPOSURE" => header.exposure *= numbers().first().unwrap_or(&1.0),
                "COLORCORR" => {
                    let factors = header.colour_correction.iter_mut().zip(numbers());
                    factors.for_each(|(product, factor)| *product *= factor);
                }
                "PRIMARIES" => header.primaries = primaries(&numbers()),
                _ => {}
            }
        }
        if is_xyz {
            header.primaries = Some(Primaries::XYZ);
        }
        Ok(header)
    }
}

/// What these numbers of a header say; none where they say nothing. Some programs write zeros for that.
fn primaries(numbers: &[f32]) -> Option<Primaries> {
    let &[r_x, r_y, g_x, g_y, b_x, b_y, w_x, w_y] = numbers else { return None };
    let is_told = numbers.iter().any(|number| *number != 0.0);
    let primaries = Primaries { red: [r_x, r_y], green: [g_x, g_y], blue: [b_x, b_y], white: [w_x, w_y] };
    is_told.then_some(primaries)
}

/// One half of a size: `+X 1024`.
#[derive(Clone, Copy)]
struct Axis {
    is_x: bool,
    /// From the right to the left or from the bottom to the top.
    is_backward: bool,
    count: usize,
}

/// What a size says: that of scanlines, then that of the pixels in each. None if it is none.
fn axes(line: &str) -> Option<[Axis; 2]> {
    let axis = |name, count: &str| {
        let (is_x, is_backward) = match name {
            "+X" => (true, false),
            "-X" => (true, true),
            "-Y" => (false, false),
            "+Y" => (false, true),
            _ => return None,
        };
        Some(Axis { is_x, is_backward, count: count.parse::<u32>().ok()? as usize })
    };
    let words: Vec<&str> = line.split_whitespace().collect();
    let &[first, lines, second, columns] = words.as_slice() else { return None };
    let axes = [axis(first, lines)?, axis(second, columns)?];
    (axes[0].is_x != axes[1].is_x).then_some(axes)
}

/// Takes one scanline off `bytes`, compressed in the way that it is; none if it is not of this length.
fn take_scanline(bytes: &mut &[u8], scanline: &mut [[u8; 4]]) -> Option<()> {
    // Of other lengths there are no runs of channels, so the same bytes are a pixel.
    let marker = match **bytes {
        [2, 2, high @ ..128, low, ..] if (8..0x8000).contains(&scanline.len()) => u16::from_be_bytes([high, low]),
        _ => return take_pixels(bytes, scanline),
    };
    if usize::from(marker) != scanline.len() {
        return None;
    }
    *bytes = &bytes[4..];
    for channel in 0..4 {
        let mut place = 0;
        while place < scanline.len() {
            let (&code, rest) = bytes.split_first()?;
            // Above 128 a run of one value, else so many values.
            let (count, stored) = if code > 128 { (code - 128, 1) } else { (code, code) };
            let (values, rest) = rest.split_at_checked(stored.into())?;
            let run = scanline.get_mut(place..place + usize::from(count))?;
            run.iter_mut().zip(values.iter().cycle()).for_each(|(pixel, value)| pixel[channel] = *value);
            place += usize::from(count);
            *bytes = rest;
        }
    }
    Some(())
}

/// Takes one scanline of whole pixels off `bytes`. Mantissas of 1 say how often to repeat the pixel before; of several in turn, each one's
/// number counts 256 times as much as that of the one before.
fn take_pixels(bytes: &mut &[u8], scanline: &mut [[u8; 4]]) -> Option<()> {
    let (mut place, mut unit) = (0, 1_usize);
    while place < scanline.len() {
        let (&pixel, rest) = bytes.split_first_chunk()?;
        *bytes = rest;
        if let [1, 1, 1, number] = pixel {
            let repeated = scanline[place.checked_sub(1)?];
            let end = place.saturating_add(unit.saturating_mul(number.into()));
            scanline.get_mut(place..end)?.fill(repeated);
            (place, unit) = (end, unit.saturating_mul(256));
        } else {
            scanline[place] = pixel;
            (place, unit) = (place + 1, 1);
        }
    }
    Some(())
}

/// Width, height and radiance of `pixels`, row by row from the top left, whichever way the file goes through them.
fn upright(pixels: &[[u8; 4]], axes: [Axis; 2]) -> (usize, usize, Vec<[f32; 3]>) {
    let [lines, columns] = axes;
    let (width, height) = if lines.is_x { (lines.count, columns.count) } else { (columns.count, lines.count) };
    let along = |axis: Axis, place: usize| if axis.is_backward { axis.count - 1 - place } else { place };
    let mut texels = Vec::with_capacity(pixels.len());
    for y in 0..height {
        texels.extend((0..width).map(|x| {
            let (line, column) = if lines.is_x { (x, y) } else { (y, x) };
            radiance(pixels[along(lines, line) * columns.count + along(columns, column)])
        }));
    }
    (width, height, texels)
}

/// Three mantissas of 8 bits, with a common exponent of which 128 stands for 0.
fn radiance([r, g, b, exponent]: [u8; 4]) -> [f32; 3] {
    let unit = if exponent == 0 { 0.0 } else { libm::ldexpf(1.0, i32::from(exponent) - 128 - 8) };
    [r, g, b].map(|mantissa| unit * f32::from(mantissa))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn environment(bytes: &[u8]) -> Environment {
        parse(Path::new("test.hdr"), bytes).unwrap()
    }

    /// The first pixel of a map of one colour, mantissas 200, 100 and 50 of 256 x 2, whose header has this line.
    fn read(line: &str) -> [f32; 3] {
        let mut bytes = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n{line}\n\n-Y 1 +X 2\n").into_bytes();
        bytes.extend([200, 100, 50, 129].repeat(2));
        environment(&bytes).texels[0]
    }

    /// The red of a map of this size and these pixels, by rows.
    fn reds(size: &str, pixels: &[u8]) -> Vec<Vec<f32>> {
        let environment = environment(&[format!("#?RADIANCE\n\n{size}\n").as_bytes(), pixels].concat());
        environment.texels.chunks(environment.width).map(|row| row.iter().map(|texel| texel[0]).collect()).collect()
    }

    #[test]
    fn either_signature_and_either_end_of_lines_is_read() {
        let plain = read("GAMMA=1");
        assert_eq!(plain, [200.0, 100.0, 50.0].map(|mantissa| mantissa / 128.0));
        for header in ["#?RGBE\nFORMAT=32-bit_rle_rgbe\n\n", "#?RADIANCE\r\n# x\r\nFORMAT=32-bit_rle_rgbe\r\n\r\n"] {
            let end = if header.contains('\r') { "\r\n" } else { "\n" };
            let bytes = [format!("{header}-Y 1 +X 1{end}").as_bytes(), &[200, 100, 50, 129]].concat();
            assert_eq!(*environment(&bytes).texels, [plain], "{header}");
        }
    }

    #[test]
    fn a_picture_is_upright_from_any_corner_by_rows_and_by_columns() {
        let upright = vec![vec![1.0, 2.0, 3.0], vec![4.0, 5.0, 6.0]];
        for (size, order) in [
            ("-Y 2 +X 3", [1, 2, 3, 4, 5, 6]),
            ("-Y 2 -X 3", [3, 2, 1, 6, 5, 4]),
            ("+Y 2 +X 3", [4, 5, 6, 1, 2, 3]),
            ("+Y 2 -X 3", [6, 5, 4, 3, 2, 1]),
            ("+X 3 -Y 2", [1, 4, 2, 5, 3, 6]),
            ("-X 3 -Y 2", [3, 6, 2, 5, 1, 4]),
            ("+X 3 +Y 2", [4, 1, 5, 2, 6, 3]),
            ("-X 3 +Y 2", [6, 3, 5, 2, 4, 1]),
        ] {
            let pixels: Vec<u8> = order.into_iter().flat_map(|red| [red, 0, 0, 136]).collect();
            assert_eq!(reds(size, &pixels), upright, "{size}");
        }
    }

    #[test]
    fn pixels_that_look_like_the_marker_of_runs_are_pixels_where_a_scanline_is_too_short_or_long_for_runs() {
        assert_eq!(reds("-Y 1 +X 2", &[2, 2, 0, 136, 3, 0, 0, 136]), [[2.0, 3.0]]);
        // The same bytes are the marker of a scanline of eight: a run of each channel.
        let runs = [2, 2, 0, 8, 136, 5, 136, 0, 136, 0, 136, 136];
        assert_eq!(reds("-Y 1 +X 8", &runs), [[5.0; 8]]);
        // One that is of another length is damaged.
        let damaged = [b"#?RADIANCE\n\n-Y 1 +X 9\n", &runs[..]].concat();
        assert!(parse(Path::new("test.hdr"), &damaged).unwrap_err().to_string().contains("scanline 1 of 1"));
        // From 32768 pixels on a marker has no room for the length.
        let long = [2, 2, 0, 136].repeat(32768);
        assert_eq!(reds("-Y 1 +X 32768", &long), [vec![2.0; 32768]]);
    }

    #[test]
    fn runs_of_whole_pixels_are_read_and_their_lengths_add_up() {
        assert_eq!(reds("-Y 1 +X 4", &[7, 0, 0, 136, 1, 1, 1, 2, 9, 0, 0, 136]), [[7.0, 7.0, 7.0, 9.0]]);
        // 1 + 3 + 2 x 256.
        let long = [&[7, 0, 0, 136, 1, 1, 1, 3, 1, 1, 1, 2][..], &[1, 1, 1, 0].repeat(60)].concat();
        let pixels = [long, [8, 0, 0, 136].to_vec()].concat();
        assert_eq!(reds("-Y 1 +X 517", &pixels), [[vec![7.0; 516], vec![8.0]].concat()]);
        // Nothing to repeat, and more than there is room for.
        for pixels in [[1, 1, 1, 2, 1, 1, 1, 2], [7, 0, 0, 136, 1, 1, 1, 2]] {
            let bytes = [b"#?RADIANCE\n\n-Y 1 +X 2\n", &pixels[..]].concat();
            assert!(parse(Path::new("test.hdr"), &bytes).is_err(), "{pixels:?}");
        }
    }

    #[test]
    fn x_y_and_z_become_rec_709_with_white_as_white() {
        let read = |colour: [u8; 3]| {
            let header = b"#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 1\n";
            environment(&[&header[..], &colour, &[136]].concat()).texels[0]
        };
        let white = read([100; 3]);
        assert!(white.iter().all(|value| (value - 100.0).abs() < 0.01), "{white:?}");
        // 500 times those of Rec. 709's red under D65 (0.4124, 0.2126, 0.0193), adapted to white of equal parts by Bradford's matrix.
        let red = read([219, 111, 9]);
        assert!((red[0] - 500.0).abs() < 5.0 && red[1].max(red[2]) < 5.0, "{red:?}");
    }

    #[test]
    fn exposure_and_colour_correction_change_nothing_and_what_a_picture_was_made_from_says_nothing() {
        let plain = read("GAMMA=1");
        let of_another = ["\tFORMAT=x", "\tPRIMARIES=1 0 0 1 0 0 .3 .3"];
        for line in ["EXPOSURE=2", "EXPOSURE=x", "COLORCORR=2 3 4", "COLORCORR=2"].into_iter().chain(of_another) {
            assert_eq!(read(line), plain, "{line}");
        }
        let said = |lines: &str| Header::take(&mut format!("{lines}\n\n").as_bytes()).unwrap();
        let header = said("EXPOSURE= 2\nCOLORCORR=1 2 3\n\tEXPOSURE=5\nEXPOSURE=3\nCOLORCORR=2 1 1");
        assert_eq!((header.exposure, header.colour_correction), (6.0, [2.0, 2.0, 3.0]));
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
