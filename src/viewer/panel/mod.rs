//! The panel: shows the scene that is asked for, and tells what the user would have changed. One file a group.
mod comparison;
mod display;
mod light;
mod material;
mod object;
mod plots;
mod save;
mod shading;
mod statistics;
mod threads;

use super::change::Change;
use super::input::Input;
use super::interaction::Viewer;
use super::loaded::Loaded;
use egui::{Align2, Color32, Context, Frame, RichText, ScrollArea, SidePanel, Ui};

/// Width of the panel in points.
pub const WIDTH: f32 = 300.0;

/// What the panel remembers between frames besides the scene.
#[derive(Default)]
pub struct Panel {
    material: material::State,
    plots: plots::State,
    light: light::State,
    object: object::State,
    save: save::State,
    comparison: comparison::State,
    threads: threads::State,
}

impl Panel {
    /// Lays the panel out at the right edge of the window; gives what the user did in it.
    pub fn show(&mut self, context: &Context, viewer: &mut Viewer) -> Vec<Input> {
        let mut inputs = Vec::new();
        SidePanel::right("panel").exact_width(WIDTH).resizable(false).show(context, |ui| {
            ui.add_space(4.0);
            ui.horizontal(|ui| {
                undo_and_redo(ui, viewer, &mut inputs);
                progress(ui, viewer);
            });
            ui.separator();
            ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
                ui.spacing_mut().slider_width = 120.0;
                self.material.show(ui, viewer, &mut inputs);
                let edited = self.material.edited(viewer.session.wanted()).map(str::to_owned);
                self.plots.show(ui, viewer, edited.as_deref());
                self.light.show(ui, viewer, &mut inputs);
                self.object.show(ui, viewer, &mut inputs);
                shading::show(ui, viewer, &mut inputs);
                display::show(ui, viewer, &mut inputs);
                self.comparison.show(ui, viewer, &mut inputs);
                self.threads.show(ui, viewer);
                self.save.show(ui, &mut inputs);
                statistics::show(ui, viewer);
            });
        });
        self.comparison.draw(context, viewer, &mut inputs);
        notice(context, viewer);
        inputs
    }
}

fn undo_and_redo(ui: &mut Ui, viewer: &Viewer, inputs: &mut Vec<Input>) {
    let [can_undo, can_redo] = viewer.history.has();
    for (name, input, can, tooltip) in [
        ("undo", Input::Undo, can_undo, "Takes back what was last set, from where the camera is, or opened. Ctrl+Z"),
        ("redo", Input::Redo, can_redo, "Does again what was taken back. Ctrl+Shift+Z or Ctrl+Y"),
    ] {
        if ui.add_enabled(can, egui::Button::new(name).small()).on_hover_text(tooltip).clicked() {
            inputs.push(input);
        }
    }
}

/// What is being loaded or made, above all else, always of the same height so that nothing jumps.
fn progress(ui: &mut Ui, viewer: &Viewer) {
    let (share, what) = match viewer.progress().filter(|_| viewer.is_loading()) {
        Some(progress) if progress.total > 0 => (progress.done as f32 / progress.total as f32, progress.what),
        Some(progress) => (0.0, progress.what),
        None => (0.0, if viewer.is_loading() { "loading" } else { "ready" }.to_owned()),
    };
    let is_draft = viewer.loaded().is_some_and(Loaded::is_draft);
    let what = if is_draft { format!("draft; {what}") } else { what };
    let bar = egui::ProgressBar::new(share).text(what).corner_radius(2.0).desired_height(16.0);
    ui.add(bar).on_hover_text(
        "What is made in the background: threads (one row for each view angle), uploads. The old picture, or a draft of the new one, stays until it is done.",
    );
}

/// What was last told, over the picture, until it is clicked away.
fn notice(context: &Context, viewer: &mut Viewer) {
    let Some(notice) = viewer.notice.clone() else { return };
    let fill = if notice.is_error { Color32::from_rgb(110, 20, 20) } else { Color32::from_rgb(30, 60, 30) };
    let area = egui::Area::new("notice".into()).anchor(Align2::LEFT_BOTTOM, [12.0, -12.0]).show(context, |ui| {
        Frame::popup(ui.style())
            .fill(fill)
            .show(ui, |ui| {
                ui.set_max_width((context.content_rect().width() - WIDTH - 48.0).max(160.0));
                ui.horizontal_wrapped(|ui| {
                    ui.label(RichText::new(&notice.text).color(Color32::WHITE));
                    ui.button("close").on_hover_text("Escape").clicked()
                })
                .inner
            })
            .inner
    });
    if area.inner {
        viewer.notice = None;
    }
}

/// A group of settings that can be folded away.
fn group(ui: &mut Ui, title: &str, show: impl FnOnce(&mut Ui)) {
    egui::CollapsingHeader::new(RichText::new(title).strong()).default_open(true).show(ui, show);
}

/// A choice among built-in names, and a field for the name of a file; gives what was chosen.
fn source(
    ui: &mut Ui,
    id: &str,
    current: &str,
    builtin: &[&str],
    path: &mut String,
    tooltip: &str,
    hint: &str,
) -> Option<String> {
    let mut chosen = None;
    let shown = std::path::Path::new(current).file_name().map_or(current.into(), |name| name.to_string_lossy());
    egui::ComboBox::from_id_salt(id)
        .width(ui.available_width() - 8.0)
        .selected_text(shown)
        .show_ui(ui, |ui| {
            for name in builtin {
                if ui.selectable_label(*name == current, *name).clicked() {
                    chosen = Some((*name).to_owned());
                }
            }
        })
        .response
        .on_hover_text(tooltip);
    let field = egui::TextEdit::singleline(path).hint_text(hint).desired_width(ui.available_width() - 8.0);
    let response = ui.add(field).on_hover_text("Name of a file, then Enter. Or drop the file on the window.");
    if response.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter)) && !path.is_empty() {
        chosen = Some(path.clone());
    }
    chosen
}

/// Adds the change that `response` says was made.
fn on_change(response: &egui::Response, inputs: &mut Vec<Input>, change: impl FnOnce() -> Change) {
    if response.changed() {
        inputs.push(Input::Set(change()));
    }
}
