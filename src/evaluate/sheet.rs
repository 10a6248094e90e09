//! Pictures in a grid with headings, labels and captions: contact sheets and rows of comparisons.
use embedded_graphics::Drawable;
use embedded_graphics::draw_target::DrawTarget;
use embedded_graphics::geometry::{OriginDimensions, Point, Size};
use embedded_graphics::mono_font::iso_8859_1::{FONT_7X13, FONT_10X20};
use embedded_graphics::mono_font::{MonoFont, MonoTextStyle};
use embedded_graphics::pixelcolor::{Rgb888, RgbColor};
use embedded_graphics::text::{Alignment, Baseline, Text, TextStyleBuilder};
use image::{Rgb, RgbImage};
use std::convert::Infallible;

use super::metrics::Display;

const PAPER: Rgb<u8> = Rgb([255, 255, 255]);
/// Behind surfaces: neither white, as highlights are, nor dark.
const GREY: u8 = 216;
const INK: Rgb888 = Rgb888::new(40, 42, 48);
/// Around everything, and between pictures.
const MARGIN_PX: u32 = 16;
const GAP_PX: u32 = 10;
/// Pictures from this width on have large text.
const LARGE_PX: u32 = 240;

/// A grid of pictures; without headings or labels there is no room for them.
#[derive(Clone, Debug, Default)]
pub struct Sheet {
    /// Above the columns.
    pub headings: Vec<String>,
    /// Label at the left, and a cell for each column: none stays empty.
    pub rows: Vec<(String, Vec<Option<Tile>>)>,
}

/// A picture with what is written below it.
#[derive(Clone, Debug)]
pub struct Tile {
    /// What to show, pixel by pixel.
    pub picture: RgbImage,
    /// One line; empty for none.
    pub caption: String,
}

impl Sheet {
    /// `tiles` in rows of `columns`, without headings or labels.
    pub fn of(tiles: Vec<Tile>, columns: usize) -> Self {
        let mut tiles = tiles.into_iter().map(Some).peekable();
        let mut rows = Vec::new();
        while tiles.peek().is_some() {
            rows.push((String::new(), tiles.by_ref().take(columns.max(1)).collect()));
        }
        Self { headings: Vec::new(), rows }
    }

    /// The whole as one picture.
    pub fn draw(&self) -> RgbImage {
        let tiles = || self.rows.iter().flat_map(|(_, cells)| cells.iter().flatten());
        let widest = tiles().map(|tile| tile.picture.width()).max().unwrap_or(0);
        let highest = tiles().map(|tile| tile.picture.height()).max().unwrap_or(0);
        let font = if widest < LARGE_PX { &FONT_7X13 } else { &FONT_10X20 };
        let (line_px, width_of) = (font.character_size.height, |text: &str| text_width(font, text));
        let captioned = tiles().any(|tile| !tile.caption.is_empty());

        // Room for the longest of each kind of text.
        let texts = self.headings.iter().chain(tiles().map(|tile| &tile.caption));
        let cell_width = texts.map(|text| width_of(text)).max().unwrap_or(0).max(widest);
        let cell_height = highest + if captioned { line_px + 4 } else { 0 };
        let label_width = self.rows.iter().map(|(label, _)| width_of(label)).max().unwrap_or(0);
        let left = MARGIN_PX + if label_width > 0 { label_width + GAP_PX } else { 0 };
        let top = MARGIN_PX + if self.headings.is_empty() { 0 } else { line_px + GAP_PX };
        let columns = self.rows.iter().map(|(_, cells)| cells.len()).max().unwrap_or(0).max(self.headings.len()) as u32;
        let extent =
            |start: u32, count: u32, cell: u32| start + (count * (cell + GAP_PX)).saturating_sub(GAP_PX) + MARGIN_PX;
        let (width, height) = (extent(left, columns, cell_width), extent(top, self.rows.len() as u32, cell_height));

        let mut canvas = Canvas(RgbImage::from_pixel(width, height, PAPER));
        let column_left = |column: usize| left + column as u32 * (cell_width + GAP_PX);
        for (column, heading) in self.headings.iter().enumerate() {
            let middle = column_left(column) + cell_width / 2;
            canvas.write(heading, [middle, MARGIN_PX], font, Alignment::Center, Baseline::Top);
        }
        for (row, (label, cells)) in self.rows.iter().enumerate() {
            let y = top + row as u32 * (cell_height + GAP_PX);
            canvas.write(label, [left - GAP_PX, y + highest / 2], font, Alignment::Right, Baseline::Middle);
            for (column, tile) in cells.iter().enumerate() {
                let Some(Tile { picture, caption }) = tile else { continue };
                let x = column_left(column) + (cell_width - picture.width()) / 2;
                image::imageops::replace(&mut canvas.0, picture, i64::from(x), i64::from(y));
                let middle = column_left(column) + cell_width / 2;
                canvas.write(caption, [middle, y + picture.height() + 4], font, Alignment::Center, Baseline::Top);
            }
        }
        canvas.0
    }
}

fn text_width(font: &MonoFont, text: &str) -> u32 {
    text.chars().count() as u32 * (font.character_size.width + font.character_spacing)
}

/// What text is drawn into.
struct Canvas(RgbImage);

impl Canvas {
    fn write(&mut self, text: &str, [x, y]: [u32; 2], font: &MonoFont, alignment: Alignment, baseline: Baseline) {
        let style = TextStyleBuilder::new().alignment(alignment).baseline(baseline).build();
        let text = Text::with_text_style(text, Point::new(x as i32, y as i32), MonoTextStyle::new(font, INK), style);
        let Ok(_) = text.draw(self);
    }
}

impl OriginDimensions for Canvas {
    fn size(&self) -> Size {
        Size::new(self.0.width(), self.0.height())
    }
}

impl DrawTarget for Canvas {
    type Color = Rgb888;
    type Error = Infallible;

    fn draw_iter<I>(&mut self, pixels: I) -> Result<(), Infallible>
    where
        I: IntoIterator<Item = embedded_graphics::Pixel<Rgb888>>,
    {
        for embedded_graphics::Pixel(point, colour) in pixels {
            if let (Ok(x), Ok(y)) = (u32::try_from(point.x), u32::try_from(point.y))
                && let Some(pixel) = self.0.get_pixel_mut_checked(x, y)
            {
                *pixel = Rgb([colour.r(), colour.g(), colour.b()]);
            }
        }
        Ok(())
    }
}

/// Linear radiance times coverage, and coverage, as display values in 8 bits, laid over light grey. Values that are not
/// finite are black.
///
/// # Panics
/// If there are not `width` x `height` pixels.
pub fn over_grey(radiance: &[[f32; 4]], width: u32, height: u32, display: Display) -> RgbImage {
    assert_eq!(radiance.len(), width as usize * height as usize, "one value a pixel");
    RgbImage::from_fn(width, height, |x, y| {
        let [r, g, b, coverage] = radiance[(y * width + x) as usize];
        let coverage = f64::from(coverage);
        Rgb([r, g, b].map(|value| {
            let surface = if coverage > 0.0 && value.is_finite() { f64::from(value) / coverage } else { 0.0 };
            (255.0 * coverage * display.value(surface) + f64::from(GREY) * (1.0 - coverage)).round() as u8
        }))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tile(colour: [u8; 3], caption: &str) -> Option<Tile> {
        Some(Tile { picture: RgbImage::from_pixel(80, 60, Rgb(colour)), caption: caption.to_owned() })
    }

    #[test]
    fn pictures_are_shown_as_they_are_in_their_places_and_texts_do_not_touch_them() {
        let sheet = Sheet {
            headings: vec!["1".into(), "16".into()],
            rows: vec![
                ("paper".into(), vec![tile([250, 0, 0], "RMS 0.1"), tile([0, 250, 0], "RMS 0.01")]),
                ("the truth".into(), vec![None, tile([0, 0, 250], "a caption that is wider than its picture")]),
            ],
        };
        let picture = sheet.draw();
        for (colour, pixels) in [([250, 0, 0], 4800), ([0, 250, 0], 4800), ([0, 0, 250], 4800)] {
            assert_eq!(picture.pixels().filter(|pixel| pixel.0 == colour).count(), pixels);
        }
        let ink = picture.pixels().filter(|pixel| pixel.0 == [40, 42, 48]).count();
        assert!(ink > 300, "{ink}");
        // Nothing reaches the margin.
        let (width, height) = picture.dimensions();
        let inside = |x: u32, y: u32| x >= 8 && y >= 8 && x < width - 8 && y < height - 8;
        assert!(picture.enumerate_pixels().all(|(x, y, pixel)| inside(x, y) || *pixel == PAPER));
    }

    #[test]
    fn a_sheet_of_tiles_has_full_rows_and_a_rest_and_an_empty_one_is_a_picture() {
        let tiles = (0..5).map(|_| tile([9, 9, 9], "").unwrap()).collect();
        let sheet = Sheet::of(tiles, 3);
        assert_eq!(sheet.rows.iter().map(|(_, cells)| cells.len()).collect::<Vec<_>>(), [3, 2]);
        assert_eq!(sheet.draw().dimensions(), (2 * 16 + 3 * 80 + 2 * 10, 2 * 16 + 2 * 60 + 10));
        assert!(Sheet::default().draw().width() > 0);
    }

    #[test]
    fn radiance_is_displayed_over_grey() {
        let pixels =
            [[0.0; 4], [0.5, 0.25, 0.0, 0.5], [2.0, 0.5, f32::NAN, 1.0], [f32::INFINITY, f32::NEG_INFINITY, 0.5, 1.0]];
        let picture = over_grey(&pixels, 4, 1, Display::default());
        assert_eq!(picture.get_pixel(0, 0).0, [GREY; 3]);
        // Half covered: the mean of grey, and of 1, a half and 0 in display values.
        let half = 255.0 * 0.5_f64.powf(1.0 / 2.2);
        let mean = |displayed: f64| ((displayed + f64::from(GREY)) / 2.0).round() as u8;
        assert_eq!(picture.get_pixel(1, 0).0, [mean(255.0), mean(half), mean(0.0)]);
        assert_eq!(picture.get_pixel(2, 0).0, [255, half.round() as u8, 0]);
        assert_eq!(picture.get_pixel(3, 0).0, [0, 0, half.round() as u8]);
    }
}
