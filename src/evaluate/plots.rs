//! Measurements as curves: error over the number of samples (the paper's figure 12) and over time, time over the number of
//! threads beside its floor, and time as other things grow.
use std::ops::Range;
use std::path::{Path, PathBuf};

use plotters::coord::Shift;
use plotters::coord::combinators::IntoLogRange;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::Row;
use super::colours::{CURVES, GREY};
use super::speed::{Growth, TimedFrame, Timings};
use super::tables::{by_count, in_order};
use crate::error::{Error, Result};
use crate::files::{file_in, write_whole};
use crate::statistics::mean;

/// Width and least height of the plot, without the names at its right.
const PLOT_PX: (u32, u32) = (770, 600);
/// Where the first name of the legend is, what is before each, how far they are apart, and how wide a letter is.
const FIRST_NAME_PX: u32 = 60;
const BEFORE_NAME_PX: u32 = 44;
const LINE_PX: u32 = 26;
const LETTER_PX: u32 = 8;
pub(super) const TEXT: RGBColor = RGBColor(40, 42, 48);
pub(super) const GRID: RGBColor = RGBColor(222, 223, 226);
/// Outlines in pixels around the point. As many as colours, but for one: so curves with one colour differ in their markers.
const MARKERS: [&[(i32, i32)]; 7] = [
    &[(-2, -5), (2, -5), (5, -2), (5, 2), (2, 5), (-2, 5), (-5, 2), (-5, -2)],
    &[(-4, -4), (4, -4), (4, 4), (-4, 4)],
    &[(0, -6), (6, 5), (-6, 5)],
    &[(0, -7), (6, 0), (0, 7), (-6, 0)],
    &[(0, 6), (6, -5), (-6, -5)],
    &[(-2, -6), (2, -6), (2, -2), (6, -2), (6, 2), (2, 2), (2, 6), (-2, 6), (-2, 2), (-6, 2), (-6, -2), (-2, -2)],
    &[(-6, -3), (0, -6), (6, -3), (6, 3), (0, 6), (-6, 3)],
];

/// Curves over logarithmic axes.
#[derive(Clone, Debug)]
pub struct Chart {
    /// Name of its file, without extension.
    pub name: String,
    title: String,
    x: Axis,
    y: Axis,
    curves: Vec<Curve>,
}

/// An axis.
#[derive(Clone, Debug)]
struct Axis {
    label: String,
    /// Values to label; empty for round ones.
    ticks: Vec<f64>,
}

#[derive(Clone, Debug, PartialEq)]
struct Curve {
    name: String,
    /// What is not above 0 is not drawn.
    points: Vec<(f64, f64)>,
    /// Which colour and marker.
    style: usize,
    drawn: Drawn,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Drawn {
    /// A line with markers.
    Line,
    /// Dashed and without markers: a bound rather than a measurement of the method.
    Dashed,
    /// Markers alone.
    Points,
}

/// RMS over the number of threads, `rms_over_threads`, and over the time of shading, `rms_over_shade_ms`: a line a method, means over
/// all rows; and where there are several materials, the same for each, its name in front.
pub fn error_charts(rows: &[Row]) -> Vec<Chart> {
    let materials = in_order(rows.iter().map(|row| &row.material));
    let all = format!("mean of {} materials", materials.len());
    let mut subjects = vec![(String::new(), all, rows.iter().collect::<Vec<_>>())];
    if let [only] = materials.as_slice() {
        subjects[0].1 = (*only).clone();
    } else {
        for material in materials {
            let rows = rows.iter().filter(|row| row.material == *material).collect();
            subjects.push((format!("{material}_"), material.clone(), rows));
        }
    }
    let threads = Axis { label: "threads or samples".to_owned(), ticks: counts(rows.iter().map(|row| row.threads)) };
    let time = Axis { label: "time of shading, ms".to_owned(), ticks: Vec::new() };
    let over_threads: fn(&Row) -> f64 = |row| f64::from(row.threads);
    let over_time: fn(&Row) -> f64 = |row| row.shade_ms;
    let axes = [("rms_over_threads", threads, over_threads), ("rms_over_shade_ms", time, over_time)];
    let mut charts = Vec::new();
    for (prefix, subject, rows) in subjects {
        for (name, axis, value) in &axes {
            charts.push(Chart {
                name: format!("{prefix}{name}"),
                title: format!("RMS of display values, {subject}"),
                x: axis.clone(),
                y: Axis { label: "RMS".to_owned(), ticks: Vec::new() },
                curves: error_curves(&rows, *value),
            });
        }
    }
    charts
}

/// The RMS that was expected of each row over what it is, `expected_over_measured`, with the bounds of a factor of 2; none where nothing
/// was expected.
pub fn expectation_chart(rows: &[Row]) -> Option<Chart> {
    let points = |method: &String| -> Vec<(f64, f64)> {
        let here = rows.iter().filter(|row| row.method == *method);
        here.filter_map(|row| row.expected_rms.map(|expected| (row.rms, expected))).collect()
    };
    let methods = in_order(rows.iter().filter(|row| row.expected_rms.is_some()).map(|row| &row.method));
    let of_method = |(style, method): (usize, &String)| Curve {
        name: method.clone(),
        points: points(method),
        style,
        drawn: Drawn::Points,
    };
    let mut curves: Vec<_> = methods.into_iter().enumerate().map(of_method).collect();
    let measured = || curves.iter().flat_map(|curve| &curve.points).map(|point| point.0).filter(|rms| *rms > 0.0);
    let ends = [measured().fold(f64::INFINITY, f64::min), measured().fold(0.0, f64::max)];
    if ends[1] == 0.0 {
        return None;
    }
    for (name, factor) in [("twice", 2.0), ("equal", 1.0), ("half", 0.5)] {
        let points = ends.map(|rms| (rms, factor * rms)).to_vec();
        curves.push(Curve { name: name.to_owned(), points, style: GREY, drawn: Drawn::Dashed });
    }
    let axis = |label: &str| Axis { label: label.to_owned(), ticks: Vec::new() };
    Some(Chart {
        name: "expected_over_measured".to_owned(),
        title: "RMS of display values, expected from some pixels and measured over all".to_owned(),
        x: axis("measured"),
        y: axis("expected"),
        curves,
    })
}

/// Mean RMS over mean `x` of each method, a point for each count.
fn error_curves(rows: &[&Row], x: fn(&Row) -> f64) -> Vec<Curve> {
    let curve = |(style, method): (usize, &String)| {
        let (x, errors) = (by_count(rows, method, x), by_count(rows, method, |row| row.rms));
        let points = x.into_values().zip(errors.into_values()).map(|(x, rms)| (mean(x), mean(rms))).collect();
        Curve { name: method.clone(), points, style, drawn: Drawn::Line }
    };
    in_order(rows.iter().map(|row| &row.method)).into_iter().enumerate().map(curve).collect()
}

/// Time over the number of threads with the floor of each method dashed, `frame_over_threads`, and for each method the cost as
/// other things grow, `METHOD_cost_over_growth`: means over materials, environments and scenes.
pub fn speed_charts(timings: &Timings) -> Vec<Chart> {
    let mut curves = Vec::new();
    for (style, method) in in_order(timings.frames.iter().map(|frame| &frame.method)).into_iter().enumerate() {
        let frames: Vec<_> = timings.frames.iter().filter(|frame| frame.method == *method).collect();
        let points = |value: fn(&TimedFrame) -> f64| {
            let point = |count: f64| {
                let here = frames.iter().filter(|frame| f64::from(frame.threads) == count);
                (count, mean(here.map(|frame| value(frame))))
            };
            counts(frames.iter().map(|frame| frame.threads)).into_iter().map(point).collect()
        };
        let (all, floor) = (points(|frame| frame.gpu_ms), points(|frame| frame.floor_ms));
        curves.push(Curve { name: method.clone(), points: all, style, drawn: Drawn::Line });
        curves.push(Curve { name: format!("{method}, floor"), points: floor, style, drawn: Drawn::Dashed });
    }
    let mut charts = vec![Chart {
        name: "frame_over_threads".to_owned(),
        title: "Time of a frame, and of its lookups alone".to_owned(),
        x: Axis {
            label: "threads or samples".to_owned(),
            ticks: counts(timings.frames.iter().map(|frame| frame.threads)),
        },
        y: Axis { label: "time on the device, ms".to_owned(), ticks: Vec::new() },
        curves,
    }];
    let times = |label: &str| Axis { label: label.to_owned(), ticks: (0..8).map(|power| 2_f64.powi(power)).collect() };
    for method in in_order(timings.growths.iter().map(|growth| &growth.frame.method)) {
        let growths: Vec<_> = timings.growths.iter().filter(|growth| growth.frame.method == *method).collect();
        charts.push(Chart {
            name: format!("{method}_cost_over_growth"),
            title: format!("Cost of a frame as one thing grows, {method}"),
            x: times("how many times as much"),
            y: times("how many times the time"),
            curves: growth_curves(&growths),
        });
    }
    charts
}

/// Relative time over relative quantity, a curve for each thing that grows, and what would be in proportion.
fn growth_curves(growths: &[&Growth]) -> Vec<Curve> {
    let curve = |(style, what): (usize, &String)| {
        let growths: Vec<_> = growths.iter().copied().filter(|growth| growth.what == *what).collect();
        Curve { name: what.clone(), points: mean_growth(&growths), style, drawn: Drawn::Line }
    };
    let mut curves: Vec<_> =
        in_order(growths.iter().map(|growth| &growth.what)).into_iter().enumerate().map(curve).collect();
    let last = curves.iter().flat_map(|curve| &curve.points).map(|point| point.0).fold(1.0, f64::max);
    let points = vec![(1.0, 1.0), (last, last)];
    curves.push(Curve { name: "in proportion".to_owned(), points, style: GREY, drawn: Drawn::Dashed });
    curves
}

/// How many times as much there is and how many times the time it takes, step by step, of each place by what its series begins with; means over
/// the places that have the step.
fn mean_growth(growths: &[&Growth]) -> Vec<(f64, f64)> {
    let place = |growth: &Growth| {
        let TimedFrame { material, environment, scene, .. } = &growth.frame;
        [material, environment, scene].map(String::clone)
    };
    let mut steps: Vec<(Vec<f64>, Vec<f64>)> = Vec::new();
    for here in in_order(growths.iter().map(|growth| place(growth))) {
        let series: Vec<_> = growths.iter().filter(|growth| place(growth) == here).collect();
        let first = series[0];
        steps.resize(steps.len().max(series.len()), Default::default());
        for (growth, (quantities, times)) in series.iter().zip(&mut steps) {
            quantities.push(growth.quantity as f64 / first.quantity as f64);
            times.push(growth.frame.gpu_ms / first.frame.gpu_ms);
        }
    }
    steps.into_iter().map(|(quantities, times)| (mean(quantities), mean(times))).collect()
}

/// Each number once, in rising order.
fn counts(all: impl Iterator<Item = u32>) -> Vec<f64> {
    let mut counts = in_order(all.map(f64::from));
    counts.sort_by(f64::total_cmp);
    counts
}

/// Writes each of `charts` as SVG into `folder`, which is made if it is not there. Returns what it wrote.
///
/// # Errors
/// A file cannot be written.
pub fn write(charts: &[Chart], folder: &Path) -> Result<Vec<PathBuf>> {
    std::fs::create_dir_all(folder).map_err(|cause| Error::unwritable(folder, cause))?;
    let write = |chart: &Chart| {
        let path = file_in(folder, &chart.name, "svg");
        let svg = chart.svg().map_err(|cause| Error::unwritable(&path, cause))?;
        write_whole(&path, svg.as_bytes())?;
        Ok(path)
    };
    charts.iter().map(write).collect()
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

impl Chart {
    /// The chart as SVG.
    ///
    /// # Errors
    /// Why it cannot be drawn.
    pub fn svg(&self) -> Result<String, String> {
        let mut svg = String::new();
        {
            let area = SVGBackend::with_string(&mut svg, self.size_px()).into_drawing_area();
            self.draw(&area).map_err(|cause| cause.to_string())?;
        }
        Ok(without_controls(&svg))
    }

    /// Width and height, with room for all names.
    fn size_px(&self) -> (u32, u32) {
        let letters = self.curves.iter().map(|curve| curve.name.chars().count()).max().unwrap_or(0) as u32;
        let names = FIRST_NAME_PX + LINE_PX * self.curves.len() as u32;
        (PLOT_PX.0 + BEFORE_NAME_PX + LETTER_PX * (letters + 1), PLOT_PX.1.max(names))
    }

    fn draw(&self, area: &Area) -> Result<(), Box<dyn std::error::Error>> {
        let font = |size: u32| ("sans-serif", size).into_font().color(&TEXT);
        let drawn = |curve: &Curve| -> Vec<(f64, f64)> {
            curve.points.iter().copied().filter(|(x, y)| *x > 0.0 && *y > 0.0).collect()
        };
        let points: Vec<_> = self.curves.iter().flat_map(drawn).collect();
        let (x, y) = (around(points.iter().map(|point| point.0)), around(points.iter().map(|point| point.1)));
        let ticks_of = |axis: &Axis, range: &Range<f64>| match axis.ticks.as_slice() {
            [] => ticks(range),
            ticks => apart(ticks, range),
        };
        let (x_ticks, y_ticks) = (ticks_of(&self.x, &x), ticks_of(&self.y, &y));
        area.fill(&WHITE)?;
        let (plot, legend) = area.split_horizontally(PLOT_PX.0);
        let mut chart = ChartBuilder::on(&plot)
            .caption(&self.title, font(22))
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
            .x_desc(&self.x.label)
            .y_desc(&self.y.label)
            .x_label_formatter(&|value| short(*value))
            .y_label_formatter(&|value| short(*value))
            .draw()?;
        for (index, curve) in self.curves.iter().enumerate() {
            let marker = MARKERS[curve.style % MARKERS.len()].to_vec();
            let [r, g, b] = CURVES[curve.style % CURVES.len()];
            let colour = RGBColor(r, g, b);
            let line = colour.stroke_width(2);
            let points = drawn(curve);
            let legend_y = FIRST_NAME_PX as i32 + LINE_PX as i32 * index as i32;
            let legend_line = [(4, legend_y), (36, legend_y)];
            if curve.drawn == Drawn::Dashed {
                chart.draw_series(DashedLineSeries::new(points, 6, 5, line))?;
                legend.draw(&plotters::element::DashedPathElement::new(legend_line, 6, 5, line))?;
            } else {
                if curve.drawn == Drawn::Line {
                    chart.draw_series(LineSeries::new(points.iter().copied(), line))?;
                    legend.draw(&PathElement::new(legend_line, line))?;
                }
                let at = |point| EmptyElement::at(point) + Polygon::new(marker.clone(), colour.filled());
                chart.draw_series(points.iter().map(|point| at(*point)))?;
                legend.draw(&(EmptyElement::at((20, legend_y)) + Polygon::new(marker.clone(), colour.filled())))?;
            }
            let style = font(16).pos(Pos::new(HPos::Left, VPos::Center));
            legend.draw(&Text::new(curve.name.clone(), (BEFORE_NAME_PX as i32, legend_y), style))?;
        }
        area.present()?;
        Ok(())
    }
}

/// `svg` without the control characters that names may have and XML may not.
pub(super) fn without_controls(svg: &str) -> String {
    svg.chars().map(|c| if c.is_control() && !c.is_whitespace() { char::REPLACEMENT_CHARACTER } else { c }).collect()
}

/// Those of `ticks` in `range` that are far enough from the one before for both to be labelled.
fn apart(ticks: &[f64], range: &Range<f64>) -> Vec<f64> {
    // About the width of four digits.
    let least = (range.end / range.start).powf(0.05);
    let mut kept: Vec<f64> = Vec::new();
    for &tick in ticks.iter().filter(|tick| range.contains(tick)) {
        if kept.last().is_none_or(|last| tick / last >= least) {
            kept.push(tick);
        }
    }
    kept
}

/// A range around positive `values` with a little room on both sides.
fn around(values: impl Iterator<Item = f64>) -> Range<f64> {
    let (low, high) = values.fold((f64::INFINITY, 0.0_f64), |(low, high), value| (low.min(value), high.max(value)));
    // Nothing to draw: any range will do. One value: still a range.
    if low > high { 0.1..10.0 } else { low / 1.25..high * 1.25 }
}

/// Round numbers in `range`, not too many for labels: powers of ten, or 1, 2 and 5 times these, or where there are less than two of those, more.
fn ticks(range: &Range<f64>) -> Vec<f64> {
    let decades = range.start.log10().floor() as i32..=range.end.log10().ceil() as i32;
    let by = |tenths: &[u32]| -> Vec<f64> {
        let steps = |decade| tenths.iter().map(move |tenths| f64::from(*tenths) * 10_f64.powi(decade) / 10.0);
        decades.clone().flat_map(steps).filter(|tick| range.contains(tick)).collect()
    };
    if (range.end / range.start).log10() >= 3.5 {
        return by(&[10]);
    }
    let finer = [vec![10, 20, 50], (10..100).step_by(10).collect(), (10..100).collect()];
    finer.iter().map(|tenths| by(tenths)).find(|ticks| ticks.len() > 1).unwrap_or_default()
}

/// A tick's number without digits that say nothing.
fn short(value: f64) -> String {
    let decimals = (1.0 - value.log10().floor()).max(0.0) as usize;
    let text = format!("{value:.decimals$}");
    if decimals == 0 { text } else { text.trim_end_matches('0').trim_end_matches('.').to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::tables::tests::rows;

    #[test]
    fn curves_are_means_by_count_in_rising_order() {
        let rows = rows();
        let curves = error_curves(&rows.iter().rev().collect::<Vec<_>>(), |row| row.shade_ms);
        let paper = curves.iter().find(|curve| curve.name == "paper").unwrap();
        let expected = [(0.22, 0.3), (1.87, 0.3 * 16_f64.powf(-0.7)), (11.11, 0.3 * 100_f64.powf(-0.7))];
        for ((x, y), (expected_x, expected_y)) in paper.points.iter().zip(expected) {
            assert!((x - expected_x).abs() < 1e-9 && (y - expected_y).abs() < 1e-9, "{:?}", paper.points);
        }
    }

    #[test]
    fn a_chart_for_all_and_one_for_each_material_name_their_methods() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path().join("made/on/demand");
        let written = write(&error_charts(&rows()), &folder).unwrap();
        assert_eq!(written.len(), 6);
        for path in written {
            let svg = std::fs::read_to_string(&path).unwrap();
            let svg: String = svg.split_whitespace().collect();
            for text in ["paper", "uniform", "RMSofdisplayvalues", ">0.1<"] {
                assert!(svg.contains(text), "{} lacks {text}", path.display());
            }
        }
        assert!(folder.join("shiny_rms_over_shade_ms.svg").exists());
    }

    #[test]
    fn charts_of_nothing_of_one_point_and_of_zeros_are_charts() {
        let folder = tempfile::tempdir().unwrap();
        let one = rows().remove(0);
        let zero = Row { rms: 0.0, shade_ms: 0.0, ..one.clone() };
        for rows in [vec![], vec![one], vec![zero]] {
            write(&error_charts(&rows), folder.path()).unwrap();
        }
    }

    #[test]
    fn names_with_control_characters_are_xml() {
        assert_eq!(without_controls("a\u{1}b\u{1b}\n<text>"), "a\u{fffd}b\u{fffd}\n<text>");
    }

    #[test]
    fn labels_keep_a_distance() {
        assert_eq!(apart(&[16.0, 32.0, 64.0, 100.0, 104.0, 512.0], &(10.0..600.0)), [16.0, 32.0, 64.0, 100.0, 512.0]);
        assert_eq!(apart(&[1.0, 50.0], &(10.0..600.0)), [50.0]);
    }

    #[test]
    fn speed_has_a_floor_for_each_method_and_a_chart_of_growth() {
        let frame = |threads: u32| TimedFrame {
            method: "paper".into(),
            threads,
            material: "m".into(),
            environment: "e".into(),
            scene: "s".into(),
            width: 40,
            height: 30,
            subpixels: 2,
            triangles: 12,
            lookups: 1000,
            covered_pixels: 100,
            passes: Vec::new(),
            gpu_ms: f64::from(threads),
            frame_ms: f64::from(threads),
            floor_ms: 0.5 * f64::from(threads),
            ns_per_lookup: 1.0,
        };
        let growth = |threads: u32, ratio| Growth {
            what: "threads".into(),
            quantity: threads.into(),
            ratio,
            frame: frame(threads),
        };
        let timings =
            Timings { frames: vec![frame(16), frame(64)], growths: vec![growth(10, None), growth(20, Some(2.0))] };
        let charts = speed_charts(&timings);
        assert_eq!(charts[0].curves[1].points, [(16.0, 8.0), (64.0, 32.0)]);
        assert!(charts[0].curves[1].drawn == Drawn::Dashed && charts[0].curves[1].style == charts[0].curves[0].style);
        assert_eq!(charts[1].curves[0].points, [(1.0, 1.0), (2.0, 2.0)]);
        assert!(charts.iter().all(|chart| chart.svg().is_ok()));
        assert!(speed_charts(&Timings::default()).iter().all(|chart| chart.svg().is_ok()));
    }

    #[test]
    fn ticks_are_round_and_short() {
        let text = |range: Range<f64>| ticks(&range).into_iter().map(short).collect::<Vec<_>>().join(" ");
        assert_eq!(text(0.8..640.0), "1 2 5 10 20 50 100 200 500");
        assert_eq!(text(0.0004..0.03), "0.0005 0.001 0.002 0.005 0.01 0.02");
        assert_eq!(text(2e-5..1.0), "0.0001 0.001 0.01 0.1");
        assert_eq!(
            text(0.0024..0.00375),
            "0.0024 0.0025 0.0026 0.0027 0.0028 0.0029 0.003 0.0031 0.0032 0.0033 0.0034 0.0035 0.0036 0.0037"
        );
        assert_eq!(text(8.0..12.5), "8 9 10");
    }
}
