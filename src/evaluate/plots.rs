//! Measurements as curves, one a method: the paper's figure 12 (error over the number of samples) and error over time.
use std::ops::Range;
use std::path::{Path, PathBuf};

use plotters::coord::combinators::IntoLogRange;
use plotters::prelude::*;

use super::Row;
use super::tables::{in_order, mean};
use crate::error::{Error, Result};
use crate::output::write_whole;

const SIZE_PX: (u32, u32) = (900, 620);
const TEXT: RGBColor = RGBColor(40, 42, 48);
const GRID: RGBColor = RGBColor(222, 223, 226);
/// Distinguishable with any kind of colour vision (Okabe and Ito 2008), with grey for their yellow, which is too pale for lines.
const COLOURS: [RGBColor; 8] = [
    RGBColor(213, 94, 0),
    RGBColor(0, 114, 178),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(0, 0, 0),
    RGBColor(128, 130, 136),
];

/// One method's curve.
struct Curve {
    method: String,
    points: Vec<(f64, f64)>,
}

/// The axis from left to right.
struct Axis {
    label: &'static str,
    /// Values to label; empty for round ones.
    ticks: Vec<f64>,
    value: fn(&Row) -> f64,
}

/// Draws into `folder`, which is made if it is not there, as SVG: `rms_over_threads.svg` and `rms_over_gpu_ms.svg` for the
/// mean over all rows, and where there are several materials, the same for each, its name in front. Axes are logarithmic; what is
/// 0 is not drawn. Returns what it wrote.
///
/// # Errors
/// A file cannot be written.
pub fn draw(rows: &[Row], folder: &Path) -> Result<Vec<PathBuf>> {
    std::fs::create_dir_all(folder).map_err(|cause| Error::unwritable(folder, cause))?;
    let materials = in_order(rows.iter().map(|row| &row.material));
    let mut subjects = vec![(String::new(), "all materials".to_owned(), rows.iter().collect::<Vec<_>>())];
    if let [only] = materials.as_slice() {
        subjects[0].1 = (*only).clone();
    } else {
        for material in materials {
            let rows = rows.iter().filter(|row| row.material == *material).collect();
            subjects.push((format!("{material}_"), material.clone(), rows));
        }
    }
    let mut counts = in_order(rows.iter().map(|row| f64::from(row.threads)));
    counts.sort_by(f64::total_cmp);
    let axes = [
        ("rms_over_threads", Axis { label: "threads or samples", ticks: counts, value: |row| f64::from(row.threads) }),
        ("rms_over_gpu_ms", Axis { label: "time on the GPU, ms", ticks: Vec::new(), value: |row| row.gpu_ms }),
    ];
    let mut written = Vec::new();
    for (prefix, subject, rows) in subjects {
        for (name, axis) in &axes {
            let path = folder.join(format!("{prefix}{name}.svg"));
            let svg =
                chart(&subject, axis, &curves(&rows, axis.value)).map_err(|cause| Error::unwritable(&path, cause))?;
            write_whole(&path, svg.as_bytes())?;
            written.push(path);
        }
    }
    Ok(written)
}

/// Mean RMS over mean `x` of each method, a point for each count.
fn curves(rows: &[&Row], x: fn(&Row) -> f64) -> Vec<Curve> {
    let curve = |method: &String| {
        let rows: Vec<_> = rows.iter().filter(|row| row.method == *method).collect();
        let mut counts = in_order(rows.iter().map(|row| row.threads));
        counts.sort_unstable();
        let point = |count: &u32| {
            let here = || rows.iter().filter(|row| row.threads == *count);
            let mean = |value: fn(&Row) -> f64| mean(&here().map(|row| value(row)).collect::<Vec<_>>());
            (mean(x), mean(|row| row.rms))
        };
        let points = counts.iter().map(point).filter(|(x, y)| *x > 0.0 && *y > 0.0);
        Curve { method: method.clone(), points: points.collect() }
    };
    in_order(rows.iter().map(|row| &row.method)).into_iter().map(curve).collect()
}

/// The chart as SVG; the error is the reason why not.
fn chart(subject: &str, axis: &Axis, curves: &[Curve]) -> Result<String, String> {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, SIZE_PX).into_drawing_area();
        draw_chart(&area, subject, axis, curves).map_err(|cause| cause.to_string())?;
    }
    Ok(svg)
}

type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

fn draw_chart(area: &Area, subject: &str, axis: &Axis, curves: &[Curve]) -> Result<(), Box<dyn std::error::Error>> {
    let font = |size: u32| ("sans-serif", size).into_font().color(&TEXT);
    let points = || curves.iter().flat_map(|curve| &curve.points);
    let (x, y) = (around(points().map(|point| point.0)), around(points().map(|point| point.1)));
    let x_ticks = if axis.ticks.is_empty() { ticks(&x) } else { axis.ticks.clone() };
    let y_ticks = ticks(&y);
    area.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(area)
        .caption(format!("RMS of display values, {subject}"), font(22))
        .margin(16)
        .x_label_area_size(52)
        .y_label_area_size(76)
        .build_cartesian_2d(x.log_scale().with_key_points(x_ticks), y.log_scale().with_key_points(y_ticks))?;
    chart
        .configure_mesh()
        .max_light_lines(0)
        .bold_line_style(GRID)
        .axis_style(TEXT)
        .label_style(font(16))
        .axis_desc_style(font(17))
        .x_desc(axis.label)
        .y_desc("RMS")
        .x_label_formatter(&|value| short(*value))
        .y_label_formatter(&|value| short(*value))
        .draw()?;
    for (Curve { method, points }, colour) in curves.iter().zip(COLOURS.iter().cycle()) {
        let line = colour.stroke_width(2);
        chart
            .draw_series(LineSeries::new(points.iter().copied(), line))?
            .label(method)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 24, y)], line));
        chart.draw_series(points.iter().map(|point| Circle::new(*point, 4, colour.filled())))?;
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::LowerLeft)
        .legend_area_size(34)
        .margin(12)
        .label_font(font(16))
        .background_style(WHITE)
        .border_style(GRID)
        .draw()?;
    area.present()?;
    Ok(())
}

/// A range around positive `values` with a little room on both sides.
fn around(values: impl Iterator<Item = f64>) -> Range<f64> {
    let (low, high) = values.fold((f64::INFINITY, 0.0_f64), |(low, high), value| (low.min(value), high.max(value)));
    // Nothing to draw: any range will do. One value: still a range.
    if low > high { 0.1..10.0 } else { low / 1.25..high * 1.25 }
}

/// Round numbers in `range`, not too many for labels: 1, 2, 5 times powers of ten, or only the powers.
fn ticks(range: &Range<f64>) -> Vec<f64> {
    let decades = range.start.log10().floor() as i32..=range.end.log10().ceil() as i32;
    let steps: &[f64] = if (range.end / range.start).log10() < 3.5 { &[1.0, 2.0, 5.0] } else { &[1.0] };
    let all = decades.flat_map(|decade| steps.iter().map(move |step| step * 10_f64.powi(decade)));
    all.filter(|tick| range.contains(tick)).collect()
}

/// A tick's number without digits that say nothing.
fn short(value: f64) -> String {
    let decimals = (-value.log10().floor()).max(0.0) as usize;
    format!("{value:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::tables::tests::rows;

    #[test]
    fn curves_are_means_by_count_in_rising_order() {
        let rows = rows();
        let curves = curves(&rows.iter().rev().collect::<Vec<_>>(), |row| row.gpu_ms);
        let paper = curves.iter().find(|curve| curve.method == "paper").unwrap();
        let expected = [(0.61, 0.3), (2.26, 0.3 * 16_f64.powf(-0.7)), (11.5, 0.3 * 100_f64.powf(-0.7))];
        for ((x, y), (expected_x, expected_y)) in paper.points.iter().zip(expected) {
            assert!((x - expected_x).abs() < 1e-9 && (y - expected_y).abs() < 1e-9, "{:?}", paper.points);
        }
    }

    #[test]
    fn a_chart_for_all_and_one_for_each_material_name_their_methods() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path().join("made/on/demand");
        let written = draw(&rows(), &folder).unwrap();
        assert_eq!(written.len(), 6);
        for path in written {
            let svg = std::fs::read_to_string(&path).unwrap();
            let svg: String = svg.split_whitespace().collect();
            for text in ["paper", "uniform", "RMSofdisplayvalues", ">0.1<"] {
                assert!(svg.contains(text), "{} lacks {text}", path.display());
            }
        }
        assert!(folder.join("shiny_rms_over_gpu_ms.svg").exists());
    }

    #[test]
    fn charts_of_nothing_of_one_point_and_of_zeros_are_charts() {
        let folder = tempfile::tempdir().unwrap();
        let one = rows().remove(0);
        let zero = Row { rms: 0.0, gpu_ms: 0.0, ..one.clone() };
        for rows in [vec![], vec![one], vec![zero]] {
            draw(&rows, folder.path()).unwrap();
        }
    }

    #[test]
    fn ticks_are_round_and_short() {
        let text = |range: Range<f64>| ticks(&range).into_iter().map(short).collect::<Vec<_>>().join(" ");
        assert_eq!(text(0.8..640.0), "1 2 5 10 20 50 100 200 500");
        assert_eq!(text(0.0004..0.03), "0.0005 0.001 0.002 0.005 0.01 0.02");
        assert_eq!(text(2e-5..1.0), "0.0001 0.001 0.01 0.1");
    }
}
