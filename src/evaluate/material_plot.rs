//! A BRDF drawn: lobes in the plane of incidence, the image over half and difference angle, albedo by angle.
use std::error::Error as Cause;
use std::f64::consts::FRAC_PI_2;
use std::path::Path;

use glam::{DMat3, DVec3, dvec3};
use plotters::coord::Shift;
use plotters::prelude::*;

use crate::brdf::{Brdf, luminance};
use crate::error::{Error, Result};

const SIDE_PX: u32 = 420;
const TEXT: RGBColor = RGBColor(40, 42, 48);
const GRID: RGBColor = RGBColor(222, 223, 226);
/// Angles of the light whose lobes are drawn, and their colours (Okabe and Ito 2008).
const LIGHTS: [(f64, RGBColor); 4] = [
    (0.0, RGBColor(213, 94, 0)),
    (30.0, RGBColor(0, 114, 178)),
    (60.0, RGBColor(0, 158, 115)),
    (80.0, RGBColor(204, 121, 167)),
];
const CHANNELS: [(&str, RGBColor); 3] =
    [("red", RGBColor(200, 30, 30)), ("green", RGBColor(20, 140, 40)), ("blue", RGBColor(40, 70, 200))];

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
        draw(&area, &sides, name).map_err(|cause| Error::unwritable(path, cause))?;
    }
    Ok(svg)
}

/// A BRDF seen from one azimuth, which panels have as the plane of incidence or that of the half vector.
struct Side<'a> {
    brdf: &'a Brdf,
    azimuth_deg: f64,
    /// What captions say of it.
    note: String,
}

impl<'a> Side<'a> {
    /// Those to draw.
    fn of(brdf: &'a Brdf) -> Vec<Self> {
        if brdf.is_isotropic() {
            return vec![Self { brdf, azimuth_deg: 0.0, note: String::new() }];
        }
        let side = |azimuth_deg| Self { brdf, azimuth_deg, note: format!(", azimuth {azimuth_deg}") };
        [0.0, 90.0].map(side).into()
    }

    /// f for directions whose azimuths count from that of the side.
    fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
        let turn = DMat3::from_rotation_z(self.azimuth_deg.to_radians());
        self.brdf.evaluate(turn * w_i, turn * w_o)
    }
}

fn draw(area: &Area, sides: &[Side], name: &str) -> Drawn {
    area.fill(&WHITE)?;
    for (side, panels) in sides.iter().zip(area.split_evenly((sides.len(), 3)).chunks(3)) {
        lobes(&panels[0], side, name)?;
        image(&panels[1], side)?;
        albedo(&panels[2], side)?;
    }
    Ok(area.present()?)
}

/// The direction at `theta` degrees from the normal in the plane of incidence.
fn in_plane(theta_deg: f64) -> DVec3 {
    let (sin, cos) = theta_deg.to_radians().sin_cos();
    dvec3(sin, 0.0, cos)
}

fn lobes(area: &Area, side: &Side, name: &str) -> Drawn {
    let lobe = |theta_i: f64| -> Vec<(f64, f64)> {
        let point = |i: i32| {
            // Steps of an eighth of a degree, so that narrow lobes have a tip.
            let theta_o = f64::from(i) / 8.0;
            let w_o = in_plane(theta_o);
            let radius = (luminance(side.evaluate(in_plane(theta_i), w_o)) * w_o.z).max(0.0).cbrt();
            (radius * w_o.x, radius * w_o.z)
        };
        (-719..720).map(point).collect()
    };
    let drawn = LIGHTS.map(|(theta_i, colour)| (theta_i, colour, lobe(theta_i)));
    let reach = drawn.iter().flat_map(|(_, _, points)| points).fold(1e-3, |reach: f64, (x, z)| reach.max(x.hypot(*z)));
    let mut chart = ChartBuilder::on(area)
        .caption(
            format!("{name}: cube root of f cos theta_o{}", side.note),
            ("sans-serif", 15).into_font().color(&TEXT),
        )
        .margin(8)
        .x_label_area_size(22)
        .y_label_area_size(34)
        .build_cartesian_2d(-reach..reach, 0.0..1.7 * reach)?;
    chart.configure_mesh().light_line_style(WHITE).bold_line_style(GRID).x_labels(5).y_labels(5).draw()?;
    for (theta_i, colour, points) in drawn {
        let line = chart.draw_series(LineSeries::new(points, colour.stroke_width(2)))?;
        line.label(format!("light at {theta_i} degrees"))
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], colour.stroke_width(2)));
        let w_i = in_plane(theta_i);
        chart.draw_series(LineSeries::new([(0.0, 0.0), (reach * w_i.x, reach * w_i.z)], colour.mix(0.35)))?;
    }
    chart.configure_series_labels().position(SeriesLabelPosition::UpperLeft).border_style(GRID).draw()?;
    Ok(())
}

fn image(area: &Area, side: &Side) -> Drawn {
    const CELLS: i32 = 90;
    let mut chart = ChartBuilder::on(area)
        .caption(format!("phi_d = 90 degrees, f^(1/2.2){}", side.note), ("sans-serif", 15).into_font().color(&TEXT))
        .margin(8)
        .x_label_area_size(32)
        .y_label_area_size(38)
        .build_cartesian_2d(0..CELLS, 0..CELLS)?;
    chart.configure_mesh().disable_mesh().x_desc("theta_h, degrees").y_desc("theta_d, degrees").draw()?;
    let cell = |index: i32| {
        let (h, d) = (index % CELLS, index / CELLS);
        let [theta_h, theta_d] = [h, d].map(|cell| (f64::from(cell) + 0.5) / f64::from(CELLS) * FRAC_PI_2);
        let along = theta_d.cos() * theta_h.sin();
        let [w_i, w_o] = [1.0, -1.0].map(|sign| dvec3(along, sign * theta_d.sin(), theta_d.cos() * theta_h.cos()));
        let shown =
            side.evaluate(w_i, w_o).to_array().map(|f| (255.0 * f.clamp(0.0, 1.0).powf(1.0 / 2.2)).round() as u8);
        Rectangle::new([(h, d), (h + 1, d + 1)], RGBColor(shown[0], shown[1], shown[2]).filled())
    };
    chart.draw_series((0..CELLS * CELLS).map(cell))?;
    Ok(())
}

fn albedo(area: &Area, side: &Side) -> Drawn {
    // Every third degree, and where it changes most.
    let angles: Vec<f64> = (0..29).map(|i| 3.0 * f64::from(i)).chain([86.0, 87.5, 89.0]).collect();
    let phi_o = side.azimuth_deg.to_radians();
    let albedos: Vec<DVec3> = angles.iter().map(|angle| side.brdf.albedo_from(angle.to_radians(), phi_o)).collect();
    let most = albedos.iter().fold(1.0, |most: f64, albedo| most.max(albedo.max_element()));
    let mut chart = ChartBuilder::on(area)
        .caption(format!("albedo by view angle, degrees{}", side.note), ("sans-serif", 15).into_font().color(&TEXT))
        .margin(8)
        .x_label_area_size(22)
        .y_label_area_size(34)
        .build_cartesian_2d(0.0..90.0, 0.0..1.02 * most)?;
    chart.configure_mesh().light_line_style(WHITE).bold_line_style(GRID).x_labels(10).y_labels(6).draw()?;
    for (channel, (name, colour)) in CHANNELS.into_iter().enumerate() {
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
    fn every_builtin_material_is_drawn_with_its_three_panels() {
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
