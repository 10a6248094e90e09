//! Everything measured on one HTML page that needs nothing else: tables 1 to 4 and figures 10 to 13 of the paper.
use std::io::Cursor;

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use image::{ImageFormat, RgbImage};
use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::Row;
use super::expected::PIXELS;
use super::gallery::Named;
use super::plots::{Chart, error_charts, expectation_chart, speed_charts};
use super::speed::Timings;
use super::tables::{Section, error_tables, frame_tables, growth_tables, in_order};
use crate::error::{Error, Result};

/// What is on the page.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// Name and value of what is to be known of the measurements: machine, device, versions, command.
    pub facts: Vec<(String, String)>,
    /// Errors.
    pub rows: Vec<Row>,
    /// The largest error that a reference picture estimates of itself, in display values, where it is known.
    pub reference_error: Option<f64>,
    /// Times.
    pub timings: Timings,
    /// Methods by counts, with captions: see [`comparison_sheets`](super::gallery::comparison_sheets).
    pub comparisons: Vec<Named>,
    /// Contact sheets, with captions: see [`material_sheets`](super::gallery::material_sheets).
    pub materials: Vec<Named>,
}

const STYLE: &str = "
:root { color-scheme: light dark; --ink: #22242a; --paper: #fff; --rule: #d4d6da; --faint: #63666e; }
@media (prefers-color-scheme: dark) { :root { --ink: #dcdee2; --paper: #17181b; --rule: #3c3f45; --faint: #9a9da5; } }
body { font: 15px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--paper); max-width: 62rem; margin: 2.5rem auto; padding: 0 1.2rem; }
h1 { font-size: 1.6rem; margin: 0 0 1rem; }
h2 { font-size: 1.2rem; margin: 2.6rem 0 .6rem; padding-bottom: .2rem; border-bottom: 1px solid var(--rule); }
h3 { font-size: 1rem; margin: 1.4rem 0 .4rem; }
h2, h3 { break-after: avoid; }
p { margin: .4rem 0; }
.tables { display: flex; flex-wrap: wrap; gap: 0 2.5rem; }
.tables > div { overflow-x: auto; max-width: 100%; }
table { border-collapse: collapse; margin: .5rem 0 1.1rem; font-variant-numeric: tabular-nums; font-size: .9rem; break-inside: avoid; }
th, td { padding: .14rem .75rem; text-align: right; white-space: nowrap; }
th:first-child, td:first-child { text-align: left; padding-left: 0; min-width: 6.5rem; font-weight: 600; }
thead th { border-bottom: 1px solid var(--rule); font-weight: 600; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: .1rem 1.2rem; margin: 0; }
dt { color: var(--faint); } dd { margin: 0; overflow-wrap: anywhere; }
figure { margin: 1rem 0 1.6rem; break-inside: avoid; }
figure img, figure svg { display: block; max-width: min(100%, 50rem); height: auto; background: #fff; border: 1px solid var(--rule); }
figcaption { color: var(--faint); font-size: .9rem; margin-top: .35rem; }
summary { cursor: pointer; }
@media print { body { margin: 0; max-width: none; font-size: 11px; } .folded { display: none; } .tables > div { overflow: visible; } }
";

impl Report {
    /// The page.
    ///
    /// # Errors
    /// A picture or a chart that cannot be encoded.
    pub fn html(&self) -> Result<String> {
        let materials =
            self.materials.iter().map(|(name, picture)| figure(picture, name)).collect::<Result<Vec<_>>>()?;
        let comparisons =
            self.comparisons.iter().map(|(name, picture)| figure(picture, name)).collect::<Result<Vec<_>>>()?;
        let speed = charts(&speed_charts(&self.timings))?;
        let errors = charts(&error_charts(&self.rows))?;
        let expectation = charts(expectation_chart(&self.rows).as_slice())?;
        let page = html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    title { "Threadlight: measurements" }
                    style { (PreEscaped(STYLE)) }
                }
                body {
                    h1 { "Threadlight: measurements" }
                    dl { @for (name, value) in &self.facts { dt { (name) } dd { (value) } } }
                    @if !self.timings.frames.is_empty() {
                        h2 { "Time of a frame (table 1)" }
                        p {
                            "Time on the GPU by number of threads. The floor is a compute pass that makes as many trilinear \
                             lookups in the same environment, and nothing else. What is compared took turns, frame by frame; \
                             times are medians."
                        }
                        (sections(&frame_tables(&self.timings)))
                        (speed.first().cloned().unwrap_or_default())
                        h2 { "What doubling costs" }
                        p { "Ratios are to the line above." }
                        (sections(&growth_tables(&self.timings)))
                        @for chart in speed.iter().skip(1) { (chart) }
                    }
                    @if !self.rows.is_empty() {
                        h2 { "Error (tables 2 to 4)" }
                        p {
                            "Differences of display values from the reference picture of the same material, environment and scene, "
                            @if self.rows.iter().any(|row| row.settings.whole_picture) { "over the whole picture. " }
                            @else { "over the pixels that see a surface. " }
                            @if let Some(error) = self.reference_error {
                                "The reference is within " (format!("{error:.1e}")) " by its own estimate."
                            }
                        }
                        (sections(&error_tables(&self.rows)))
                        h2 { "Error over samples and over time (figure 12)" }
                        @for chart in &errors { (chart) }
                        @for chart in &expectation {
                            h2 { "Error expected and measured" }
                            p {
                                "What " code { "render --error" } " goes by: the RMS at " (PIXELS) " pixels at most, where the reference is \
                                 computed, against that over the whole picture."
                            }
                            (chart)
                        }
                    }
                    @if !comparisons.is_empty() {
                        h2 { "Methods by number of samples (figures 10 and 11)" }
                        @for comparison in &comparisons { (comparison) }
                    }
                    @if !materials.is_empty() {
                        h2 { "Materials (figure 13)" }
                        @for sheet in &materials { (sheet) }
                    }
                    @if !self.rows.is_empty() {
                        div.folded {
                            h2 { "All measurements" }
                            (all_rows(&self.rows))
                        }
                    }
                }
            }
        };
        Ok(page.into_string())
    }
}

fn sections(sections: &[Section]) -> Markup {
    html! {
        @for Section { title, tables } in sections {
            h3 { (title) }
            div.tables { @for table in tables {
                div { table {
                    thead { tr { th { (table.title) } @for head in &table.head { th { (head) } } } }
                    tbody { @for (label, cells) in &table.rows {
                        tr { td { (label) } @for cell in cells { td { (cell) } } }
                    } }
                } }
            } }
        }
    }
}

/// Every row, folded away for each material.
fn all_rows(rows: &[Row]) -> Markup {
    html! {
        @for material in in_order(rows.iter().map(|row| &row.material)) {
            details {
                summary { (material) }
                div.tables { div { table {
                    thead { tr {
                        @for head in [
                            "method", "threads", "environment", "scene", "rms", "rms linear", "ssim", "flip", "max", "nan",
                            "gpu ms", "shade ms", "frame ms", "lookups", "a pixel",
                        ] { th { (head) } }
                    } }
                    tbody { @for row in rows.iter().filter(|row| row.material == *material) { tr {
                        td { (row.method) } td { (row.threads) } td { (row.environment) } td { (row.scene) }
                        @for value in [row.rms, row.rms_linear, row.ssim, row.flip, row.max] { td { (format!("{value:.5}")) } }
                        td { (row.nan) }
                        @for ms in [row.gpu_ms, row.shade_ms, row.frame_ms] { td { (format!("{ms:.3}")) } }
                        td { (row.lookups) } td { (format!("{:.1}", row.lookups_a_pixel())) }
                    } } }
                } } }
            }
        }
    }
}

fn charts(charts: &[Chart]) -> Result<Vec<Markup>> {
    let chart = |chart: &Chart| {
        let svg = chart.svg().map_err(|cause| Error::input(&chart.name, cause, "leave it out"))?;
        Ok(html! { figure { (PreEscaped(svg)) } })
    };
    charts.iter().map(chart).collect()
}

/// The picture as a data URI in PNG.
fn figure(picture: &RgbImage, caption: &str) -> Result<Markup> {
    let mut png = Cursor::new(Vec::new());
    picture
        .write_to(&mut png, ImageFormat::Png)
        .map_err(|cause| Error::input(caption, format!("cannot be encoded ({cause})"), "use a smaller size"))?;
    let source = format!("data:image/png;base64,{}", BASE64_STANDARD.encode(png.into_inner()));
    Ok(html! { figure { img src=(source) alt=(caption) width=(picture.width()); figcaption { (caption) } } })
}
