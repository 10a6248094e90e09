//! A BRDF drawn: lobes in the plane of incidence, the image over half and difference angle, albedo by angle.
use std::error::Error as Cause;
use std::path::Path;

use glam::DVec3;
use plotters::coord::Shift;
use plotters::prelude::*;
use rayon::prelude::*;

use super::material_curves::{CELLS, CHANNELS, LIGHTS, Side, albedo_angles_deg, in_plane};
use super::plots::{GRID, TEXT, without_controls};
use crate::brdf::Brdf;
use crate::error::{Error, Result};

const SIDE_PX: u32 = 420;

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type Drawn = std::result::Result<(), Box<dyn Cause>>;

/// The picture of `brdf`, called `name`, as SVG: left the cube root of luminance times cosine in the plane of incidence, light from the right; in the
/// middle display values at phi_d = 90 degrees over theta_h (across) and theta_d (upwards), as BRDF Explorer has them; right albedo. Of an
/// anisotropic BRDF in two rows: seen along the tangent, which is azimuth 0, and across it.
///
/// # Errors
/// What cannot be drawn; `path` is what messages name.
pub fn svg(brdf: &Brdf, name: &str, path: &Path) -> Result<String> {
    let mut svg = String::new();
    {
        let sides = Side::of(brdf);
        let area = SVGBackend::with_string(&mut svg, (3 * SIDE_PX, sides.len() as u32 * SIDE_PX)).into_drawing_area();
        draw(&area, &sides, name).map_err(|cause| Error::unwritable(path, cause.to_string()))?;
    }
    Ok(without_controls(&svg))
}

/// What captions say of a side among `count`.
fn note(side: &Side, count: usize) -> String {
    if count > 1 { format!(", azimuth {}", side.azimuth_deg) } else { String::new() }
}

fn colour([red, green, blue]: [u8; 3]) -> RGBColor {
    RGBColor(red, green, blue)
}

fn draw(area: &Area, sides: &[Side], name: &str) -> Drawn {
    area.fill(&WHITE)?;
    for (side, panels) in sides.iter().zip(area.split_evenly((sides.len(), 3)).chunks(3)) {
        let note = note(side, sides.len());
        lobes(&panels[0], side, &format!("{name}: cube root of f cos theta_o{note}"))?;
        image(&panels[1], side, &format!("phi_d = 90 degrees, f^(1/2.2){note}"))?;
        albedo(&panels[2], side, &format!("albedo by view angle, degrees{note}"))?;
    }
    Ok(area.present()?)
}

/// A chart in `area`, with as much room in pixels for labels below and at the left.
fn panel<'a, 'b>(
    area: &'a Area<'b>,
    caption: &str,
    [below, left]: [u32; 2],
) -> ChartBuilder<'a, 'static, SVGBackend<'b>> {
    let mut chart = ChartBuilder::on(area);
    let font = ("sans-serif", 15).into_font().color(&TEXT);
    chart.caption(caption, font).margin(8).x_label_area_size(below).y_label_area_size(left);
    chart
}

fn lobes(area: &Area, side: &Side, caption: &str) -> Drawn {
    let drawn = LIGHTS.map(|(theta_i, rgb)| (theta_i, colour(rgb), side.lobe(theta_i)));
    let reach = drawn.iter().flat_map(|(_, _, points)| points).fold(1e-3, |reach: f64, [x, z]| reach.max(x.hypot(*z)));
    let mut chart = panel(area, caption, [22, 34]).build_cartesian_2d(-reach..reach, 0.0..1.7 * reach)?;
    chart.configure_mesh().light_line_style(WHITE).bold_line_style(GRID).x_labels(5).y_labels(5).draw()?;
    for (theta_i, colour, points) in drawn {
        let line =
            chart.draw_series(LineSeries::new(points.into_iter().map(<(f64, f64)>::from), colour.stroke_width(2)))?;
        line.label(format!("light at {theta_i} degrees"))
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], colour.stroke_width(2)));
        let w_i = in_plane(theta_i);
        chart.draw_series(LineSeries::new([(0.0, 0.0), (reach * w_i.x, reach * w_i.z)], colour.mix(0.35)))?;
    }
    chart.configure_series_labels().position(SeriesLabelPosition::UpperLeft).border_style(GRID).draw()?;
    Ok(())
}

fn image(area: &Area, side: &Side, caption: &str) -> Drawn {
    let mut chart = panel(area, caption, [32, 38]).build_cartesian_2d(0..CELLS, 0..CELLS)?;
    chart.configure_mesh().disable_mesh().x_desc("theta_h, degrees").y_desc("theta_d, degrees").draw()?;
    let cell = |(index, rgb): (usize, [u8; 3])| {
        let (h, d) = (index % CELLS, index / CELLS);
        Rectangle::new([(h, d), (h + 1, d + 1)], colour(rgb).filled())
    };
    chart.draw_series(side.image().into_iter().enumerate().map(cell))?;
    Ok(())
}

fn albedo(area: &Area, side: &Side, caption: &str) -> Drawn {
    let angles: Vec<f64> = albedo_angles_deg().collect();
    let albedos: Vec<DVec3> = angles.par_iter().map(|&angle| side.albedo(angle)).collect();
    let most = albedos.iter().fold(1.0, |most: f64, albedo| most.max(albedo.max_element()));
    let mut chart = panel(area, caption, [22, 34]).build_cartesian_2d(0.0..90.0, 0.0..1.02 * most)?;
    chart.configure_mesh().light_line_style(WHITE).bold_line_style(GRID).x_labels(10).y_labels(6).draw()?;
    for (channel, (name, rgb)) in CHANNELS.into_iter().enumerate() {
        let colour = colour(rgb);
        let points = angles.iter().zip(&albedos).map(|(angle, albedo)| (*angle, albedo[channel]));
        let line = chart.draw_series(LineSeries::new(points, colour.stroke_width(2)))?;
        line.label(name).legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], colour.stroke_width(2)));
    }
    chart.configure_series_labels().position(SeriesLabelPosition::UpperLeft).border_style(GRID).draw()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn materials_are_drawn_with_their_three_panels() {
        for name in ["gold", "clay"] {
            let drawn = svg(&Brdf::builtin(name).unwrap(), name, Path::new("x.svg")).unwrap();
            assert!(
                drawn.starts_with("<svg") && drawn.contains(name) && drawn.contains("light at 80 degrees"),
                "{name}"
            );
            assert!(drawn.matches("<rect").count() > 8100 && drawn.contains("albedo"), "{name}");
            assert!(!drawn.contains("azimuth"), "{name}");
        }
    }

    #[test]
    fn an_anisotropic_material_is_drawn_along_and_across_the_tangent() {
        let drawn = svg(&Brdf::builtin("brushed-steel").unwrap(), "steel", Path::new("x.svg")).unwrap();
        assert!(drawn.matches("azimuth 0").count() == 3 && drawn.matches("azimuth 90").count() == 3);
    }
}
