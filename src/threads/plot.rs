//! Draws threads on the hemisphere, as the paper's figures 7 and 8 do.
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::path::Path;

use glam::{DVec2, DVec3, dvec2, dvec3};
use plotters::prelude::*;

use super::{Threads, theta_o};
use crate::error::{Error, Result};
use crate::files::write_whole;

/// Each view is a square of this side.
const VIEW_PX: u32 = 900;
/// Drawn this many times larger and averaged down: lines come out smooth.
const OVERSAMPLING: u32 = 3;

const BACKGROUND: RGBColor = RGBColor(250, 250, 248);
const GUIDE: RGBColor = RGBColor(205, 206, 210);
const OUTLINE: RGBColor = RGBColor(120, 122, 130);
const VIEW_ARC: RGBColor = RGBColor(20, 20, 24);

/// Parallel projection of the unit hemisphere into a square.
struct PlotView {
    right: DVec3,
    up: DVec3,
    centre_px: DVec2,
    scale_px: f64,
}

impl PlotView {
    /// As seen from `elevation` above the horizon and `azimuth` (radians) around the normal, in the `place`-th square.
    fn from(elevation: f64, azimuth: f64, place: u32) -> Self {
        let side = f64::from(VIEW_PX * OVERSAMPLING);
        let (sin_azimuth, cos_azimuth) = azimuth.sin_cos();
        let right = dvec3(-sin_azimuth, cos_azimuth, 0.0);
        let up = dvec3(-elevation.sin() * cos_azimuth, -elevation.sin() * sin_azimuth, elevation.cos());
        // Seen from the side the dome fills the upper half: move it down to the middle.
        let lift = 0.5 * (1.0 - elevation.sin());
        let centre_px = dvec2((f64::from(place) + 0.5) * side, (0.5 + 0.46 * lift) * side);
        Self { right, up, centre_px, scale_px: 0.46 * side }
    }

    fn project(&self, direction: DVec3) -> (i32, i32) {
        let x = self.centre_px.x + self.scale_px * self.right.dot(direction);
        let y = self.centre_px.y - self.scale_px * self.up.dot(direction);
        (x.round() as i32, y.round() as i32)
    }
}

/// Writes a PNG of `threads` to `path`: left from above (the light comes from the left, the eye moves to the right), right at a
/// slant. Each thread is a curve of its own hue over theta_o with a dot per row, small and pale at the normal, large and dark
/// at grazing view; grey circles are theta = 0, 15, 30 ... degrees; the black arc is w_o. Errors: `path` cannot be written.
pub fn plot(threads: &Threads, path: &Path) -> Result<()> {
    let unwritable = |cause: String| Error::unwritable(path, cause);
    let size = (2 * VIEW_PX * OVERSAMPLING, VIEW_PX * OVERSAMPLING);
    let mut pixels = vec![0; (3 * size.0 * size.1) as usize];
    {
        let area = BitMapBackend::with_buffer(&mut pixels, size).into_drawing_area();
        area.fill(&BACKGROUND).map_err(|error| unwritable(error.to_string()))?;
        // w_o moves along +x: seen from above it goes to the right, as seen from azimuth -90 degrees.
        for view in [PlotView::from(FRAC_PI_2, -FRAC_PI_2, 0), PlotView::from(0.5, -1.0, 1)] {
            draw(threads, &view, &area).map_err(|error| unwritable(error.to_string()))?;
        }
        area.present().map_err(|error| unwritable(error.to_string()))?;
    }
    let large = image::RgbImage::from_raw(size.0, size.1, pixels).expect("the buffer was made for this size");
    let filter = image::imageops::FilterType::Triangle;
    let small = image::imageops::resize(&large, size.0 / OVERSAMPLING, size.1 / OVERSAMPLING, filter);

    let mut png = std::io::Cursor::new(Vec::new());
    small.write_to(&mut png, image::ImageFormat::Png).map_err(|error| unwritable(error.to_string()))?;
    write_whole(path, &png.into_inner())
}

type Canvas<'a> = DrawingArea<BitMapBackend<'a>, plotters::coord::Shift>;

fn draw<'a>(threads: &Threads, view: &PlotView, canvas: &Canvas<'a>) -> Result<(), Box<dyn std::error::Error + 'a>> {
    // Segment by segment: a thick path grows spikes where it turns back.
    let line = |points: &mut dyn Iterator<Item = DVec3>, style: ShapeStyle| {
        let points: Vec<_> = points.map(|point| view.project(point)).collect();
        points.windows(2).try_for_each(|pair| canvas.draw(&PathElement::new(pair.to_vec(), style)))
    };
    let px = OVERSAMPLING;

    for theta_deg in (15..=90).step_by(15) {
        let (sin_theta, cos_theta) = f64::from(theta_deg).to_radians().sin_cos();
        let circle = &mut (0..=180)
            .map(|step| TAU * f64::from(step) / 180.0)
            .map(|phi| dvec3(sin_theta * phi.cos(), sin_theta * phi.sin(), cos_theta));
        let style = if theta_deg == 90 { OUTLINE.stroke_width(2 * px) } else { GUIDE.stroke_width(px) };
        line(circle, style)?;
    }
    for phi_deg in (0..180).step_by(30) {
        let axis = DVec2::from_angle(f64::from(phi_deg).to_radians());
        let meridian = &mut (0..=90)
            .map(|step| PI * f64::from(step) / 90.0 - FRAC_PI_2)
            .map(|theta| (axis * theta.sin()).extend(theta.cos()));
        line(meridian, GUIDE.stroke_width(px))?;
    }

    // Width of a curve so that many threads do not bury each other.
    let [rows, count] = threads.size();
    let crowd = (count as f64 / 32.0).sqrt().max(1.0);
    for thread in 0..count {
        let directions: Vec<DVec3> = (0..rows).map(|row| threads.direction(row, thread)).collect();
        let hue = thread as f64 / count as f64;
        let colour = HSLColor(hue, 0.72, 0.45);
        let width = (f64::from(px) * 2.2 / crowd).max(2.0);
        line(&mut directions.iter().copied(), colour.stroke_width(width.round() as u32))?;
        for (row, &direction) in directions.iter().enumerate() {
            let progress = row as f64 / rows as f64;
            let radius = (f64::from(px) * (1.2 + 2.4 * progress) / crowd).max(2.0).round() as i32;
            let shade = HSLColor(hue, 0.72, 0.66 - 0.34 * progress);
            canvas.draw(&Circle::new(view.project(direction), radius, shade.filled()))?;
        }
    }

    let arc: Vec<DVec3> =
        (0..rows).map(|row| theta_o(row, rows)).map(|theta_o| dvec3(theta_o.sin(), 0.0, theta_o.cos())).collect();
    line(&mut arc.iter().copied(), VIEW_ARC.stroke_width(2 * px))?;
    for &w_o in arc.iter().step_by((rows / 9).max(1)) {
        canvas.draw(&Circle::new(view.project(w_o), 4 * px as i32, VIEW_ARC.filled()))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::Brdf;
    use crate::threads::{ThreadKind, ThreadSettings, generate};

    #[test]
    fn a_picture_of_both_views_is_written_whole_or_not_at_all() {
        let table = generate(
            &Brdf::builtin("gold").unwrap(),
            &ThreadSettings { kind: ThreadKind::Paper, count: 3, rows: 6, ..ThreadSettings::default() },
            &(),
        )
        .unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("threads.png");
        plot(&table, &path).unwrap();
        let picture = image::open(&path).unwrap().into_rgb8();
        assert_eq!(picture.dimensions(), (2 * VIEW_PX, VIEW_PX));
        // Coloured curves in both halves.
        for place in 0..2 {
            let half = picture.enumerate_pixels().filter(|(x, _, _)| x / VIEW_PX == place);
            let coloured =
                half.filter(|(_, _, pixel)| pixel.0.iter().max().unwrap() - pixel.0.iter().min().unwrap() > 60);
            assert!(coloured.count() > 200);
        }
        assert!(plot(&table, &folder.path().join("absent/threads.png")).is_err());
    }
}
