//! The comparison in the window: begins anew when the view changes, waits while it moves, draws the other picture right of the line.
use std::path::Path;
use std::sync::Arc;

use egui::{
    Color32, ColorImage, ComboBox, Context, CursorIcon, DragValue, Id, LayerId, ProgressBar, Rect, Sense, Stroke,
    TextureHandle, TextureOptions, Ui, pos2, vec2,
};

use super::comparison::{Compared, Other, Wipe, compare_with};
use super::jobs::Newest;
use crate::method::Method;
use crate::prepare::{Prepared, view_of};
use crate::scene::{MAX_SAMPLES, Scene, ShadingSettings};
use crate::threads::Observer;
use crate::vulkan::Device;
use crate::{Error, Result};

/// Half the width of what takes hold of the line, in points.
const GRIP: f32 = 6.0;

/// What is compared, and what has come of it so far.
pub struct Comparer {
    other: Option<Other>,
    wipe: Wipe,
    shows_heat_map: bool,
    jobs: Newest<Compared>,
    /// What was compared last, or is.
    begun: Option<(Scene, Other)>,
    compared: Option<Compared>,
    /// Why it could not be.
    error: Option<String>,
    /// The other picture and the heat map, once they are drawn.
    textures: Option<[TextureHandle; 2]>,
}

impl Comparer {
    /// Nothing is compared yet. `wake` is called when there is something new to be drawn.
    pub fn new(wake: impl Fn() + Send + Sync + 'static) -> Self {
        Self {
            other: None,
            wipe: Wipe::default(),
            shows_heat_map: false,
            jobs: Newest::new("comparison", wake),
            begun: None,
            compared: None,
            error: None,
            textures: None,
        }
    }

    /// Compares with `other` from now on, or with nothing.
    pub fn compare(&mut self, other: Option<Other>) {
        self.other = other;
    }

    /// Moves the line.
    pub fn set_wipe(&mut self, wipe: Wipe) {
        self.wipe = wipe;
    }

    /// Shows the heat map in the place of the other picture, or no longer.
    pub fn show_heat_map(&mut self, shows: bool) {
        self.shows_heat_map = shows;
    }

    /// The latest result for what is shown.
    pub fn compared(&self) -> Option<&Compared> {
        self.compared.as_ref()
    }

    /// Whether more is to come.
    pub fn is_busy(&self) -> bool {
        self.jobs.is_busy()
    }

    /// Takes what has come, and begins anew if what is `shown` (all of which `prepared` has loaded) changed; waits while it `is_moving`.
    ///
    /// # Errors
    /// Objects that no camera can frame.
    pub fn update(
        &mut self,
        shown: &Scene,
        prepared: &Arc<Prepared>,
        device: &Arc<Device>,
        cache: Option<&Path>,
        is_moving: bool,
    ) -> Result<()> {
        let wanted = self.other.clone().map(|other| (shown.clone(), other));
        if self.begun.is_some() && (self.begun != wanted || is_moving) {
            self.jobs.cancel();
            (self.begun, self.compared, self.textures) = (None, None, None);
        }
        while let Some(result) = self.jobs.take() {
            match result {
                Ok(compared) => (self.compared, self.textures) = (Some(compared), None),
                Err(Error::Cancelled) => {}
                Err(error) => self.error = Some(error.to_string()),
            }
        }
        let Some((_, other)) = wanted.clone().filter(|_| self.begun.is_none() && !is_moving) else { return Ok(()) };
        let prepared = Prepared {
            scene: shown.clone(),
            view: view_of(shown, prepared.bounding_sphere())?,
            ..(**prepared).clone()
        };
        let (device, cache) = (device.clone(), cache.map(Path::to_owned));
        (self.begun, self.error) = (wanted, None);
        self.jobs.request(move |task| {
            task.begin("comparison");
            let mut last = None;
            compare_with(&prepared, &other, &device, cache.as_deref(), task, &mut |compared| {
                // The last one is what the work returns.
                if let Some(before) = last.replace(compared) {
                    task.publish(before);
                }
            })?;
            if task.cancelled() { Err(Error::Cancelled) } else { last.ok_or(Error::Cancelled) }
        });
        Ok(())
    }

    /// The part of the panel: with what is compared, and by how much the two differ.
    pub fn show_panel(&mut self, ui: &mut Ui, shown: &Scene) {
        let name = match &self.other {
            None => "nothing",
            Some(Other::Reference) => Method::Reference.name(),
            Some(Other::Shading(shading)) => &shading.method,
        }
        .to_owned();
        ui.horizontal(|ui| {
            let mut chosen = None;
            ComboBox::from_id_salt("compared with").selected_text(&name).show_ui(ui, |ui| {
                if ui.selectable_label(self.other.is_none(), "nothing").clicked() {
                    chosen = Some(None);
                }
                for method in Method::ALL {
                    if ui.selectable_label(method.name() == name, method.name()).clicked() {
                        chosen = Some(Some(match method {
                            Method::Reference => Other::Reference,
                            method => Other::Shading(ShadingSettings {
                                method: method.name().into(),
                                threads: None,
                                seed: shown.shading.seed,
                            }),
                        }));
                    }
                }
            });
            if let Some(chosen) = chosen {
                self.other = chosen;
            }
            if let Some(Other::Shading(shading)) = &mut self.other {
                let usual = Method::from_name(&shading.method).map_or(1, Method::default_count);
                let mut count = shading.threads.unwrap_or(usual);
                let drag = DragValue::new(&mut count).range(1..=MAX_SAMPLES).suffix(" threads");
                if ui.add(drag).on_hover_text("Threads or samples a pixel of the other picture.").changed() {
                    shading.threads = Some(count);
                }
            }
        })
        .response
        .on_hover_text("What is right of the line: the same view by another method, or the reference, which is computed while the view is still.");
        if self.other.is_none() {
            return;
        }
        ui.checkbox(&mut self.shows_heat_map, "heat map").on_hover_text(
            "Right of the line: the largest difference of display values among the channels, by its logarithm: black at 1e-4 and below, \
             over violet and orange to pale yellow at 1.",
        );
        if let Some(error) = &self.error {
            ui.colored_label(ui.visuals().error_fg_color, error);
        }
        match &self.compared {
            Some(compared) => show_metrics(ui, compared),
            None => drop(ui.weak("…")),
        }
        if let Some(progress) = self.jobs.progress().filter(|progress| progress.total > 0) {
            let part = progress.done as f32 / progress.total as f32;
            ui.add(ProgressBar::new(part).desired_height(6.0)).on_hover_text("Rows of the picture at this stage.");
        }
    }

    /// Draws the other picture over the right part of the picture that is at `picture` on the screen, and the line, which can be dragged.
    pub fn draw(&mut self, context: &Context, picture: Rect) {
        let Some(compared) = &self.compared else { return };
        let [other, heat_map] = self.textures.get_or_insert_with(|| textures(context, compared));
        let texture = if self.shows_heat_map { heat_map } else { other };
        let part = self.wipe.part() as f32;
        let x = picture.left() + part * picture.width();
        let painter = context.layer_painter(LayerId::background()).with_clip_rect(picture);
        let place = Rect::from_min_max(pos2(x, picture.top()), picture.max);
        let shown = Rect::from_min_max(pos2(part, 0.0), pos2(1.0, 1.0));
        painter.image(texture.id(), place, shown, Color32::WHITE);
        painter.vline(x, picture.y_range(), Stroke::new(3.0, Color32::from_black_alpha(160)));
        painter.vline(x, picture.y_range(), Stroke::new(1.0, Color32::WHITE));
        let grip = Rect::from_min_max(pos2(x - GRIP, picture.top()), pos2(x + GRIP, picture.bottom()));
        let area = egui::Area::new(Id::new("wipe")).fixed_pos(grip.min).constrain(false).order(egui::Order::Background);
        let dragged = area.show(context, |ui| ui.allocate_response(grip.size(), Sense::drag())).inner;
        let dragged = dragged.on_hover_and_drag_cursor(CursorIcon::ResizeHorizontal);
        if let Some(cursor) = dragged.interact_pointer_pos().filter(|_| dragged.dragged()) {
            self.wipe = Wipe::at(f64::from((cursor.x - picture.left()) / picture.width()));
        }
        // Names at the top, on either side of the line.
        let label = |text: &str, anchor: egui::Align2, offset: f32| {
            let at = pos2(x + offset, picture.top() + 8.0);
            painter.text(at + vec2(1.0, 1.0), anchor, text, egui::FontId::proportional(13.0), Color32::BLACK);
            painter.text(at, anchor, text, egui::FontId::proportional(13.0), Color32::WHITE);
        };
        label(&compared.own_name, egui::Align2::RIGHT_TOP, -8.0);
        label(&compared.name, egui::Align2::LEFT_TOP, 8.0);
    }
}

fn textures(context: &Context, compared: &Compared) -> [TextureHandle; 2] {
    let size = compared.size.map(|side| side as usize);
    [("compared picture", &compared.display), ("heat map", &compared.heat_map)].map(|(name, rgba)| {
        // Coarse stages are to be seen as what they are.
        context.load_texture(name, ColorImage::from_rgba_unmultiplied(size, rgba), TextureOptions::NEAREST)
    })
}

fn show_metrics(ui: &mut Ui, compared: &Compared) {
    match &compared.metrics {
        Some(metrics) => {
            egui::Grid::new("metrics").num_columns(2).show(ui, |ui| {
                let mut row = |name: &str, value: String, meaning: &str| {
                    ui.label(name).on_hover_text(meaning);
                    ui.monospace(value);
                    ui.end_row();
                };
                row(
                    "RMS",
                    format!("{:.5}", metrics.rms),
                    "Root of the mean squared difference of display values, which go from 0 to 1.",
                );
                if compared.part == 1.0 {
                    row(
                        "SSIM",
                        format!("{:.5}", metrics.ssim),
                        "Mean structural similarity of display values: 1 for equal pictures.",
                    );
                    row(
                        "FLIP",
                        format!("{:.5}", metrics.flip),
                        "Mean FLIP error, 0 to 1: the difference as it is seen when the two take turns.",
                    );
                }
                row("largest", format!("{:.4}", metrics.max), "Largest difference of a display value.");
            });
        }
        None => drop(ui.weak("too few pixels for figures")),
    }
    if let Some(estimate) = compared.error_estimate {
        let text = format!("reference: {:.0} % of pixels, within {estimate:.0e}", 100.0 * compared.part);
        ui.weak(text).on_hover_text(
            "The reference's estimate of its own error (RMS of display values), and of how many pixels it is.",
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn compared() -> Compared {
        Compared {
            own_name: "fitted, 16".into(),
            name: "paper, 100".into(),
            size: [2, 1],
            display: vec![255; 8],
            heat_map: vec![0; 8],
            metrics: None,
            part: 1.0,
            error_estimate: Some(1e-4),
        }
    }

    /// Runs a frame of egui with these events; returns how many shapes it drew.
    fn frame(comparer: &mut Comparer, context: &Context, events: Vec<egui::Event>) -> usize {
        let screen = Rect::from_min_size(pos2(0.0, 0.0), vec2(400.0, 300.0));
        let input = egui::RawInput { screen_rect: Some(screen), events, ..Default::default() };
        let output = context.run(input, |context| {
            egui::Window::new("panel").default_pos([0.0, 200.0]).show(context, |ui| {
                comparer.show_panel(ui, &Scene::default());
            });
            comparer.draw(context, Rect::from_min_size(pos2(100.0, 0.0), vec2(200.0, 150.0)));
        });
        output.shapes.len()
    }

    #[test]
    fn the_line_can_be_dragged() {
        let context = Context::default();
        let mut comparer = Comparer::new(|| ());
        frame(&mut comparer, &context, vec![]);
        let before = frame(&mut comparer, &context, vec![]);
        comparer.compare(Some(Other::Reference));
        comparer.compared = Some(compared());
        frame(&mut comparer, &context, vec![]);
        assert!(frame(&mut comparer, &context, vec![]) > before + 4);
        let button = |at, pressed| egui::Event::PointerButton {
            pos: at,
            button: egui::PointerButton::Primary,
            pressed,
            modifiers: Default::default(),
        };
        let (from, to) = (pos2(201.0, 50.0), pos2(150.0, 60.0));
        for events in [
            vec![egui::Event::PointerMoved(from)],
            vec![button(from, true)],
            vec![egui::Event::PointerMoved(to)],
            vec![],
            vec![button(to, false)],
        ] {
            frame(&mut comparer, &context, events);
        }
        assert!((comparer.wipe.part() - 0.25).abs() < 0.02, "{:?}", comparer.wipe);
    }
}
