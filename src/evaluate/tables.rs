//! Measurements as tables, in the layout of the paper's: errors with a row for each method and a column for each count (tables 2
//! to 4), times with a row for each frame (table 1).
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use super::Row;
use super::speed::{TimedFrame, Timings};
use crate::method::Method;
use crate::passes::SHADE_PASS;
use crate::statistics::{largest, mean};

/// Tables under one heading.
#[derive(Clone, Debug, PartialEq)]
pub struct Section {
    /// What they are of.
    pub title: String,
    /// One below the other.
    pub tables: Vec<Table>,
}

/// Text in rows and columns.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// What is in it; or, above the first column, what the rows are.
    pub title: String,
    /// Above the other columns.
    pub head: Vec<String>,
    /// Label and cells of each row.
    pub rows: Vec<(String, Vec<String>)>,
}

impl fmt::Display for Section {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        writeln!(f, "{}", self.title)?;
        self.tables.iter().try_for_each(|table| table.fmt(f))
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let width = |index: usize| {
            let cells = self.rows.iter().filter_map(|(_, cells)| cells.get(index));
            cells.chain(self.head.get(index)).map(|cell| cell.chars().count() + 2).max().unwrap_or(0).max(10)
        };
        let labels = self.rows.iter().map(|(label, _)| label.chars().count());
        let longest = labels.max().unwrap_or(0).max(14);
        let mut line = |label: &str, cells: &[String]| {
            write!(f, "  {label:<longest$}")?;
            cells.iter().enumerate().try_for_each(|(index, cell)| write!(f, "{cell:>0$}", width(index)))?;
            writeln!(f)
        };
        line(&self.title, &self.head)?;
        self.rows.iter().try_for_each(|(label, cells)| line(label, cells))
    }
}

impl Table {
    /// A table of this title, with these heads above the columns.
    pub fn new(
        title: impl Into<String>,
        head: impl IntoIterator<Item: Into<String>>,
        rows: impl IntoIterator<Item = (String, Vec<String>)>,
    ) -> Self {
        let head = head.into_iter().map(Into::into).collect();
        Self { title: title.into(), head, rows: rows.into_iter().collect() }
    }
}

/// Sections as text, an empty line between them.
pub fn text(sections: &[Section]) -> String {
    sections.iter().map(Section::to_string).collect::<Vec<_>>().join("\n")
}

/// Tables for each material where there are several (the paper's tables 2 and 3), and over all of them (table 4).
///
/// Each has the mean RMS and SSIM over its environments and scenes; the last also FLIP, the largest RMS of any material,
/// environment and scene, lookups for each pixel that sees a surface, the mean time on the GPU, that of shading alone, that of other
/// methods at the error of fitted threads, and how good expectations were.
pub fn error_tables(rows: &[Row]) -> Vec<Section> {
    let materials = in_order(rows.iter().map(|row| &row.material));
    let places = in_order(rows.iter().map(|row| (&row.environment, &row.scene))).len();
    let over_places = if places == 1 { String::new() } else { format!(", mean over {places} lights and scenes") };
    let rms_and_ssim = |rows: &[&Row]| {
        vec![error_table("RMS", rows, mean, |row| row.rms, 5), error_table("SSIM", rows, mean, |row| row.ssim, 5)]
    };
    let mut sections = Vec::new();
    let title = match materials.as_slice() {
        [] => return sections,
        [only] => (*only).clone(),
        several => {
            for material in several {
                let rows: Vec<_> = rows.iter().filter(|row| row.material == **material).collect();
                sections.push(Section { title: format!("{material}{over_places}"), tables: rms_and_ssim(&rows) });
            }
            format!("mean of {} materials", several.len())
        }
    };
    let rows: Vec<_> = rows.iter().collect();
    let mut tables = rms_and_ssim(&rows);
    tables.push(error_table("FLIP", &rows, mean, |row| row.flip, 5));
    tables.push(error_table("RMS, worst", &rows, largest, |row| row.rms, 5));
    tables.push(error_table("lookups/pixel", &rows, mean, Row::lookups_a_pixel, 1));
    tables.push(error_table("GPU ms", &rows, mean, |row| row.gpu_ms, 3));
    tables.push(error_table("shade ms", &rows, mean, |row| row.shade_ms, 3));
    tables.extend(equal_error_table(&rows));
    tables.extend(expectation_table(&rows));
    sections.push(Section { title: format!("{title}{over_places}"), tables });
    sections
}

/// A line for each method and a column for each count of `summary` of `value`.
fn error_table(
    title: &str,
    rows: &[&Row],
    summary: fn(Vec<f64>) -> f64,
    value: impl Fn(&Row) -> f64,
    decimals: usize,
) -> Table {
    let counts: BTreeSet<u32> = rows.iter().map(|row| row.threads).collect();
    let row = |method: &String| {
        let mut values = by_count(rows, method, &value);
        let cell =
            |count| values.remove(count).map_or("-".to_owned(), |values| format!("{:.decimals$}", summary(values)));
        (method.clone(), counts.iter().map(cell).collect())
    };
    let methods = in_order(rows.iter().map(|row| &row.method));
    Table::new(title, counts.iter().map(u32::to_string), methods.into_iter().map(row))
}

/// How many times as long as fitted threads the other methods shade for the same error: a column for each count of fitted threads, in
/// which time and RMS are means over all rows. Between the counts of a method, time is a power of the error. A method that is still
/// worse at the highest of its counts takes longer (`>`) than that does; one that is better with its lowest, less (`<`).
fn equal_error_table(rows: &[&Row]) -> Option<Table> {
    let curve = |method: &str| -> Vec<(u32, f64, f64)> {
        let (errors, times) = (by_count(rows, method, |row| row.rms), by_count(rows, method, |row| row.shade_ms));
        errors.into_iter().zip(times.into_values()).map(|((count, rms), ms)| (count, mean(rms), mean(ms))).collect()
    };
    let fitted = curve(Method::Fitted.name());
    let others =
        in_order(rows.iter().map(|row| &row.method)).into_iter().filter(|name| **name != Method::Fitted.name());
    let row = |method: &String| {
        let curve = curve(method);
        let cell = |&(_, rms, ms): &(u32, f64, f64)| {
            let (bound, time) = time_at(&curve, rms);
            format!("{bound}{:.1}", time / ms)
        };
        (method.clone(), fitted.iter().map(cell).collect())
    };
    let table = Table::new("time, same RMS", fitted.iter().map(|(count, ..)| count.to_string()), others.map(row));
    (!table.head.is_empty() && !table.rows.is_empty()).then_some(table)
}

/// The time at which `curve`, of counts, errors and times, comes down to `rms`; or a bound of it.
fn time_at(curve: &[(u32, f64, f64)], rms: f64) -> (&'static str, f64) {
    match curve.iter().position(|&(_, error, _)| error <= rms) {
        None => (">", curve.last().map_or(f64::NAN, |&(.., ms)| ms)),
        Some(0) => ("<", curve[0].2),
        Some(i) => {
            let ((_, error_0, ms_0), (_, error_1, ms_1)) = (curve[i - 1], curve[i]);
            let t = (error_0 / rms).ln() / (error_0 / error_1).ln();
            ("", ms_0 * (ms_1 / ms_0).powf(t))
        }
    }
}

/// The part of the pictures, in percent, whose RMS is within a factor of 2 of what was expected of it; none where nothing was.
fn expectation_table(rows: &[&Row]) -> Option<Table> {
    let expected: Vec<&Row> = rows.iter().copied().filter(|row| row.expected_rms.is_some()).collect();
    let within = |row: &Row| {
        let ratio = row.expected_rms.map_or(f64::NAN, |expected| expected / row.rms);
        // A picture without error, of which none was expected.
        let both_none = row.rms == 0.0 && row.expected_rms == Some(0.0);
        if both_none || (0.5..=2.0).contains(&ratio) { 100.0 } else { 0.0 }
    };
    (!expected.is_empty()).then(|| error_table("expected, %", &expected, mean, within, 1))
}

/// The paper's table 1 for each method in each place, with the floor: times in milliseconds.
pub fn frame_tables(timings: &Timings) -> Vec<Section> {
    let places = in_order(timings.frames.iter().map(place));
    let section = |of: (&String, String)| {
        let frames: Vec<_> = timings.frames.iter().filter(|frame| place(frame) == of).collect();
        let row = |frame: &&TimedFrame| {
            let shade_ms = frame.pass_ms(SHADE_PASS);
            let floor = [format!("{:.2}", frame.floor_ms), format!("{:.2}", shade_ms / frame.floor_ms)];
            (frame.threads.to_string(), costs(frame).into_iter().chain(floor).collect())
        };
        let head = cost_heads(&frames).chain(["floor", "shade/floor"]);
        let table = Table::new("threads", head, frames.iter().map(row));
        let TimedFrame { width, height, subpixels, triangles, .. } = frames[0];
        let size = format!("{width} x {height} pixels, {subpixels} x {subpixels} sub-pixels, {triangles} triangles");
        Section { title: format!("{}, {}: {size}; times in ms", of.0, of.1), tables: vec![table] }
    };
    places.into_iter().map(section).collect()
}

/// What growing numbers of pixels, sub-pixels, threads and triangles cost, for each method in each place.
pub fn growth_tables(timings: &Timings) -> Vec<Section> {
    let places = in_order(timings.growths.iter().map(|growth| place(&growth.frame)));
    let section = |of: (&String, String)| {
        let here: Vec<_> = timings.growths.iter().filter(|growth| place(&growth.frame) == of).collect();
        let frames: Vec<_> = here.iter().map(|growth| &growth.frame).collect();
        let table = |what: &String| {
            let row = |growth: &&&super::speed::Growth| {
                let ratio = growth.ratio.map_or("-".to_owned(), |ratio| format!("{ratio:.2}"));
                (growth.quantity.to_string(), costs(&growth.frame).into_iter().chain([ratio]).collect())
            };
            let of_what = here.iter().filter(|growth| growth.what == *what);
            Table::new(what, cost_heads(&frames).chain(["ratio"]), of_what.map(|growth| row(&growth)))
        };
        let tables = in_order(here.iter().map(|growth| &growth.what)).into_iter().map(table).collect();
        Section { title: format!("{}, {}: cost as one thing grows; times in ms", of.0, of.1), tables }
    };
    places.into_iter().map(section).collect()
}

/// Method; material, environment and scene.
fn place(frame: &TimedFrame) -> (&String, String) {
    (&frame.method, format!("{}, {}, {}", frame.material, frame.environment, frame.scene))
}

/// Passes that are worth a column: not those that only set counters to zero.
fn pass_names<'a>(frames: &[&'a TimedFrame]) -> Vec<&'a str> {
    let all = in_order(frames.iter().flat_map(|frame| frame.passes.iter().map(|pass| pass.name.as_str())));
    all.into_iter().filter(|name| !name.starts_with("clear_")).collect()
}

fn cost_heads<'a>(frames: &[&'a TimedFrame]) -> impl Iterator<Item = &'a str> {
    ["lookups/pixel", "ns/lookup"].into_iter().chain(pass_names(frames)).chain(["all passes"])
}

/// A cell for each of `cost_heads`.
fn costs(frame: &TimedFrame) -> Vec<String> {
    let lookups_a_pixel = frame.lookups as f64 / frame.covered_pixels as f64;
    let mut cells = vec![format!("{lookups_a_pixel:.1}"), format!("{:.2}", frame.ns_per_lookup)];
    cells.extend(pass_names(&[frame]).into_iter().map(|name| format!("{:.2}", frame.pass_ms(name))));
    cells.push(format!("{:.2}", frame.gpu_ms));
    cells
}

/// `value` of the rows of `method`, for each of its counts.
pub(super) fn by_count(rows: &[&Row], method: &str, value: impl Fn(&Row) -> f64) -> BTreeMap<u32, Vec<f64>> {
    let mut values: BTreeMap<u32, Vec<f64>> = BTreeMap::new();
    for row in rows.iter().filter(|row| row.method == method) {
        values.entry(row.threads).or_default().push(value(row));
    }
    values
}

/// Each value once, in the order in which they first come.
pub(super) fn in_order<T: PartialEq>(values: impl Iterator<Item = T>) -> Vec<T> {
    let mut seen = Vec::new();
    for value in values {
        if !seen.contains(&value) {
            seen.push(value);
        }
    }
    seen
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::evaluate::sweep::Settings;

    /// Made-up measurements of two methods, three counts, two materials and two environments.
    pub(in super::super) fn rows() -> Vec<Row> {
        let settings = Settings { width: 40, height: 30, subpixels: 2, seed: 0, repeat: 3, whole_picture: false };
        let mut rows = Vec::new();
        for (material, harder) in [("matt", 1.0), ("shiny", 3.0)] {
            for (environment, brighter) in [("sky", 1.0), ("sun", 2.0)] {
                for (method, power, cost) in [("paper", -0.7, 0.11), ("uniform", -0.5, 0.07)] {
                    for threads in [1, 16, 100] {
                        let rms = 0.1 * harder * brighter * f64::from(threads).powf(power);
                        rows.push(Row {
                            method: method.into(),
                            threads,
                            material: material.into(),
                            environment: environment.into(),
                            scene: "sphere".into(),
                            rms,
                            rms_linear: 2.0 * rms,
                            ssim: 1.0 - rms,
                            flip: 1.5 * rms,
                            max: 4.0 * rms,
                            nan: 0,
                            gpu_ms: 0.5 + cost * f64::from(threads),
                            frame_ms: 1.0 + cost * f64::from(threads),
                            lookups: u64::from(threads) * 1000,
                            covered_pixels: 800,
                            shade_ms: 0.11 + cost * f64::from(threads),
                            settings: settings.clone(),
                            shard: None,
                            combinations: None,
                            expected_rms: None,
                        });
                    }
                }
            }
        }
        rows
    }

    #[test]
    fn tables_have_the_means_by_method_and_count() {
        let text = text(&error_tables(&rows()));
        let expected = "\
matt, mean over 2 lights and scenes
  RMS                    1        16       100
  paper            0.15000   0.02154   0.00597
  uniform          0.15000   0.03750   0.01500
  SSIM                   1        16       100
  paper            0.85000   0.97846   0.99403
  uniform          0.85000   0.96250   0.98500

shiny";
        assert!(text.starts_with(expected), "{text}");
        let expected = "
mean of 2 materials, mean over 2 lights and scenes
  RMS                    1        16       100
  paper            0.30000   0.04308   0.01194
  uniform          0.30000   0.07500   0.03000
";
        assert!(text.contains(expected), "{text}");
        let expected = "
  RMS, worst             1        16       100
  paper            0.60000   0.08615   0.02389
  uniform          0.60000   0.15000   0.06000
  lookups/pixel          1        16       100
  paper                1.2      20.0     125.0
  uniform              1.2      20.0     125.0
  GPU ms                 1        16       100
  paper              0.610     2.260    11.500
  uniform            0.570     1.620     7.500
  shade ms               1        16       100
  paper              0.220     1.870    11.110
  uniform            0.180     1.230     7.110
";
        assert!(text.ends_with(expected), "{text}");
    }

    #[test]
    fn times_are_compared_at_equal_error() {
        let row = |method: &str, threads: u32, rms: f64, shade_ms: f64| Row {
            method: method.into(),
            threads,
            rms,
            shade_ms,
            ..rows()[0].clone()
        };
        let rows = [
            row("fitted", 1, 0.2, 1.0),
            row("fitted", 4, 0.02, 2.0),
            row("fitted", 16, 0.0001, 4.0),
            row("paper", 1, 0.1, 3.0),
            row("paper", 100, 0.01, 300.0),
        ];
        let text = text(&error_tables(&rows));
        // Between its counts: 3 * 100^log10(0.1 / 0.02) = 75 ms, against 2.
        assert!(
            text.contains(
                "time, same RMS         1         4        16\n  paper               <3.0      37.5     >75.0\n"
            ),
            "{text}"
        );
        assert!(!text.contains("expected"), "{text}");
    }

    #[test]
    fn expectations_are_good_within_a_factor_of_two() {
        let mut rows = rows();
        for (i, row) in rows.iter_mut().enumerate() {
            row.expected_rms = Some(row.rms * if i % 24 < 6 { 2.1 } else { 0.6 });
        }
        let text = text(&error_tables(&rows));
        assert!(
            text.contains(
                "expected, %            1        16       100\n  paper               75.0      75.0      75.0\n"
            ),
            "{text}"
        );
    }

    #[test]
    fn what_was_not_measured_is_a_dash() {
        let rows: Vec<_> = rows().into_iter().filter(|row| row.method != "paper" || row.threads != 16).collect();
        assert!(text(&error_tables(&rows)).contains("  paper            0.15000         -   0.00597\n"));
        assert_eq!(text(&error_tables(&[])), "");
    }

    #[test]
    fn a_single_material_has_one_table() {
        let rows: Vec<_> =
            rows().into_iter().filter(|row| row.material == "shiny" && row.environment == "sun").collect();
        let text = text(&error_tables(&rows));
        assert!(text.starts_with("shiny\n  RMS  ") && text.matches("  RMS  ").count() == 1, "{text}");
    }

    #[test]
    fn the_json_of_a_row_has_exactly_the_documented_fields() {
        let json = serde_json::to_string(&rows()[0]).unwrap();
        let names = [
            "method",
            "threads",
            "material",
            "environment",
            "scene",
            "rms",
            "rms_linear",
            "ssim",
            "flip",
            "max",
            "nan",
            "gpu_ms",
            "frame_ms",
            "lookups",
            "covered_pixels",
            "shade_ms",
            "settings",
            "width",
            "height",
            "subpixels",
            "seed",
            "repeat",
            "whole_picture",
        ];
        let places: Vec<_> = names.iter().map(|name| json.find(&format!("\"{name}\":")).unwrap()).collect();
        assert!(places.is_sorted(), "{json}");
        assert_eq!(json.matches("\":").count(), names.len(), "{json}");
        assert_eq!(serde_json::from_str::<Row>(&json).unwrap(), rows()[0]);
    }
}
