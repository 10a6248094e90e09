//! Which method, how many threads, how many sub-pixels.
use super::{group, on_change};
use crate::method::{Method, Pattern};
use crate::scene::MAX_SUBPIXELS;
use crate::viewer::change::{Change, most_count};
use crate::viewer::input::Input;
use crate::viewer::interaction::Viewer;
use egui::Ui;

/// What each pattern means, in the order of [`Pattern::ALL`].
const PATTERN_TOOLTIPS: [&str; 2] = [
    "Samples at random numbers of each pixel's own: noise.",
    "Samples at one set of points for all pixels: no noise, but bias.",
];

/// What the number of a method is of.
pub fn what_is_counted(method: Method) -> &'static str {
    if method.threads().is_some() { "threads" } else { "samples" }
}

pub fn show(ui: &mut Ui, viewer: &Viewer, inputs: &mut Vec<Input>) {
    let scene = viewer.session.wanted();
    let method = scene.shading.method;
    group(ui, "Shading", |ui| {
        egui::ComboBox::from_id_salt("method")
            .selected_text(method.name())
            .width(160.0)
            .show_ui(ui, |ui| {
                for other in Method::on_gpu() {
                    let label = ui.selectable_label(other == method, other.name()).on_hover_text(other.summary());
                    if label.clicked() && other != method {
                        inputs.push(Input::Set(Change::Method(other)));
                    }
                }
            })
            .response
            .on_hover_text(method.summary());
        if method.has_pattern() {
            ui.horizontal(|ui| {
                for (pattern, tooltip) in Pattern::ALL.into_iter().zip(PATTERN_TOOLTIPS) {
                    let is_chosen = scene.shading.pattern == pattern;
                    let label = ui.selectable_label(is_chosen, pattern.name()).on_hover_text(tooltip);
                    if label.clicked() && !is_chosen {
                        inputs.push(Input::Set(Change::Pattern(pattern)));
                    }
                }
            });
        }
        let tooltip = match method.threads() {
            Some(_) => {
                "Sample threads: lookups in the filtered environment for each pixel. Other numbers are made in the background."
            }
            None => "Samples of the Monte Carlo estimate for each pixel.",
        };
        let most = most_count(method, scene);
        let mut count = scene.shading.count();
        // The split sum has no choice.
        if most > 1 {
            let slider = egui::Slider::new(&mut count, 1..=most)
                .update_while_editing(false)
                .logarithmic(true)
                .text(what_is_counted(method));
            let tooltip = format!("{tooltip} [ and ] halve and double.");
            on_change(&ui.add(slider).on_hover_text(tooltip), inputs, || Change::Threads(Some(count)));
        }
        let mut subpixels = scene.image.subpixels;
        let slider =
            egui::Slider::new(&mut subpixels, 1..=MAX_SUBPIXELS).update_while_editing(false).text("sub-pixels");
        let tooltip =
            "Sub-pixels along each axis of a pixel: resolution of the geometry cache, and how smooth edges are.";
        on_change(&ui.add(slider).on_hover_text(tooltip), inputs, || Change::Subpixels(subpixels));
    });
}
