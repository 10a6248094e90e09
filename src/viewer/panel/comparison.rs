//! With what the picture is compared, by how much the two differ, and the other one right of a line that can be dragged.
use super::group;
use super::shading::what_is_counted;
use crate::evaluate::difference;
use crate::method::Method;
use crate::passes::Area;
use crate::scene::{Scene, ShadingSettings};
use crate::viewer::change::most_count;
use crate::viewer::comparison::{Compared, Other, Wipe};
use crate::viewer::input::Input;
use crate::viewer::interaction::Viewer;
use egui::{
    Align2, Color32, ColorImage, ComboBox, Context, CursorIcon, DragValue, FontId, Id, LayerId, Order, Painter,
    ProgressBar, Rect, Sense, Stroke, TextureHandle, TextureOptions, Ui, Vec2, pos2, vec2,
};
use std::sync::Arc;

/// Half the width of what takes hold of the line, in points.
const GRIP: f32 = 6.0;

/// What was compared when the pictures were last uploaded, the other picture, and the heat map.
#[derive(Default)]
pub struct State {
    uploaded: Option<(Arc<Compared>, [TextureHandle; 2])>,
}

impl State {
    /// The group of the panel.
    pub fn show(&self, ui: &mut Ui, viewer: &Viewer, inputs: &mut Vec<Input>) {
        group(ui, "Comparison", |ui| {
            let comparer = &viewer.comparer;
            ui.horizontal(|ui| choose(ui, comparer.other.as_ref(), viewer.session.wanted(), inputs));
            if comparer.other.is_none() {
                return;
            }
            let mut shows = comparer.shows_heat_map;
            let response = ui.checkbox(&mut shows, "heat map").on_hover_text(format!(
                "Right of the line: the largest difference of display values among the channels, by its logarithm: black at {:e} and below, over violet and orange to pale yellow at 1.",
                difference::SMALLEST
            ));
            if response.changed() {
                inputs.push(Input::HeatMap(shows));
            }
            match comparer.compared() {
                Some(compared) => metrics(ui, compared),
                None if comparer.is_busy() => drop(ui.weak("the other picture is being made")),
                None => drop(ui.weak("waits until the picture stands still")),
            }
            if let Some(progress) = comparer.progress().filter(|progress| progress.total > 0) {
                let part = progress.done as f32 / progress.total as f32;
                ui.add(ProgressBar::new(part).desired_height(6.0))
                    .on_hover_text("Rows of this stage of the other picture.");
            }
        });
    }

    /// The other picture over the right part of the picture, which is at `area`, and the line.
    pub fn draw(&mut self, context: &Context, viewer: &Viewer, inputs: &mut Vec<Input>) {
        let Some(compared) = viewer.comparer.compared() else {
            self.uploaded = None;
            return;
        };
        if self.uploaded.as_ref().is_none_or(|(uploaded, _)| !Arc::ptr_eq(uploaded, compared)) {
            self.uploaded = Some((compared.clone(), textures(context, compared)));
        }
        let Some((_, [other, heat_map])) = &self.uploaded else { return };
        let texture = if viewer.comparer.shows_heat_map { heat_map } else { other };
        let picture = on_screen(context, viewer.area);
        let part = viewer.comparer.wipe.part() as f32;
        let x = picture.left() + part * picture.width();
        let painter = context.layer_painter(LayerId::background()).with_clip_rect(picture);
        let place = Rect::from_min_max(pos2(x, picture.top()), picture.max);
        painter.image(texture.id(), place, Rect::from_min_max(pos2(part, 0.0), pos2(1.0, 1.0)), Color32::WHITE);
        painter.vline(x, picture.y_range(), Stroke::new(3.0, Color32::from_black_alpha(160)));
        painter.vline(x, picture.y_range(), Stroke::new(1.0, Color32::WHITE));
        let label = |text: &str, anchor: Align2, offset: f32| {
            let at = pos2(x + offset, picture.top() + 8.0);
            for (shift, colour) in [(1.0, Color32::BLACK), (0.0, Color32::WHITE)] {
                painter.text(at + vec2(shift, shift), anchor, text, FontId::proportional(14.0), colour);
            }
        };
        label(&compared.own_name, Align2::RIGHT_TOP, -8.0);
        let name = if viewer.comparer.shows_heat_map { "difference" } else { &compared.name };
        label(name, Align2::LEFT_TOP, 8.0);
        if viewer.comparer.shows_heat_map {
            draw_scale(&painter, picture, x);
        }
        inputs.extend(dragged_line(context, picture, x).map(Input::Wipe));
    }
}

/// What the colours of the heat map right of `x` stand for, at its lower left, but within the `picture`.
fn draw_scale(painter: &Painter, picture: Rect, x: f32) {
    const BAR: Vec2 = vec2(192.0, 10.0);
    const STEPS: usize = 96;
    let left = x.min(picture.right() - BAR.x - 72.0).max(picture.left()) + 36.0;
    let bar = Rect::from_min_size(pos2(left, picture.bottom() - 16.0 - BAR.y), BAR);
    let colour = difference::scale();
    let decades = -difference::SMALLEST.log10();
    let at = |part: f32| bar.left() + part * BAR.x;
    painter.rect_filled(bar.expand2(vec2(24.0, 6.0)).with_min_y(bar.top() - 20.0), 3.0, Color32::from_black_alpha(160));
    for step in 0..STEPS {
        let [low, high] = [step, step + 1].map(|end| end as f32 / STEPS as f32);
        let [r, g, b] = colour(f64::from(low + high) / 2.0);
        let part = Rect::from_x_y_ranges(at(low)..=at(high), bar.y_range());
        painter.rect_filled(part, 0.0, Color32::from_rgb(r, g, b));
    }
    for decade in 0..=decades.round() as i32 {
        let part = decade as f32 / decades as f32;
        let text = format!("{}", 10_f64.powi(decade) * difference::SMALLEST);
        painter.text(
            pos2(at(part), bar.top() - 3.0),
            Align2::CENTER_BOTTOM,
            text,
            FontId::proportional(11.0),
            Color32::WHITE,
        );
    }
}

/// Lets the line at `x` be dragged: gives to which part of the width of `picture`, while it is.
fn dragged_line(context: &Context, picture: Rect, x: f32) -> Option<f64> {
    let grip = Rect::from_min_max(pos2(x - GRIP, picture.top()), pos2(x + GRIP, picture.bottom()));
    // Not of the background, so that the window knows that the camera is not meant.
    let area = egui::Area::new(Id::new("wipe")).fixed_pos(grip.min).constrain(false).order(Order::Middle);
    let response = area.show(context, |ui| ui.allocate_response(grip.size(), Sense::drag())).inner;
    let response = response.on_hover_and_drag_cursor(CursorIcon::ResizeHorizontal);
    let cursor = response.interact_pointer_pos().filter(|_| response.dragged())?;
    Some(Wipe::at(f64::from((cursor.x - picture.left()) / picture.width())).part())
}

/// Where the picture is on the screen, in points.
pub fn on_screen(context: &Context, area: Area) -> Rect {
    let [left, top, width, height] =
        [area.left, area.top, area.width, area.height].map(|pixels| pixels as f32 / context.pixels_per_point());
    Rect::from_min_size(pos2(left, top), vec2(width, height))
}

fn choose(ui: &mut Ui, other: Option<&Other>, scene: &Scene, inputs: &mut Vec<Input>) {
    let name = match other {
        None => "nothing",
        Some(Other::Reference) => Method::Reference.name(),
        Some(Other::Shading(shading)) => shading.method.name(),
    };
    let list = ComboBox::from_id_salt("compared with").selected_text(name).show_ui(ui, |ui| {
        if ui.selectable_label(other.is_none(), "nothing").clicked() {
            inputs.push(Input::Compare(None));
        }
        for &method in Method::ALL {
            if ui.selectable_label(method.name() == name, method.name()).clicked() {
                inputs.push(Input::Compare(Some(match method {
                    Method::Reference => Other::Reference,
                    _ => Other::Shading(ShadingSettings {
                        method,
                        seed: scene.shading.seed,
                        ..ShadingSettings::default()
                    }),
                })));
            }
        }
    });
    list.response.on_hover_text("What is right of the line: the same view by another method or number of threads, or the reference, which goes on while the picture stands still.");
    if let Some(Other::Shading(shading)) = other {
        let method = shading.method;
        let most = most_count(method, scene);
        let mut count = shading.count();
        if most == 1 {
            return;
        }
        let drag = DragValue::new(&mut count)
            .update_while_editing(false)
            .range(1..=most)
            .suffix(format!(" {}", what_is_counted(method)));
        if ui.add(drag).on_hover_text("Threads or samples a pixel of the other picture.").changed() {
            inputs.push(Input::Compare(Some(Other::Shading(ShadingSettings {
                threads: Some(count),
                ..shading.clone()
            }))));
        }
    }
}

fn textures(context: &Context, compared: &Compared) -> [TextureHandle; 2] {
    let size = compared.size.map(|side| side as usize);
    [("compared picture", &compared.display), ("heat map", &compared.heat_map)].map(|(name, rgba)| {
        // Coarse stages are to be seen as what they are.
        context.load_texture(name, ColorImage::from_rgba_unmultiplied(size, rgba), TextureOptions::NEAREST)
    })
}

fn metrics(ui: &mut Ui, compared: &Compared) {
    match &compared.metrics {
        Some(metrics) => {
            egui::Grid::new("metrics").num_columns(2).show(ui, |ui| {
                let mut row = |name: &str, value: f64, meaning: &str| {
                    ui.label(name).on_hover_text(meaning);
                    ui.monospace(format!("{value:.5}"));
                    ui.end_row();
                };
                row("RMS", metrics.rms, "Root of the mean squared difference of display values, which go from 0 to 1.");
                // Those of a picture with gaps would be of another picture.
                if compared.part == 1.0 {
                    row("SSIM", metrics.ssim, "Mean structural similarity of display values: 1 for equal pictures.");
                    row(
                        "FLIP",
                        metrics.flip,
                        "Mean FLIP error, 0 to 1: the difference as it is seen when the two take turns.",
                    );
                }
                row("largest", metrics.max, "Largest difference of a display value.");
            });
        }
        None => drop(ui.weak("too few pixels for figures")),
    }
    if let Some(estimate) = compared.error_estimate {
        let text = format!("reference: {:.0} % of the pixels, within {estimate:.0e}", 100.0 * compared.part);
        ui.weak(text).on_hover_text(
            "How many of its pixels are computed so far, and its estimate of its own error (RMS of display values).",
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::{Event, PointerButton, RawInput};

    #[test]
    fn the_line_follows_the_cursor_that_took_hold_of_it() {
        let context = Context::default();
        let picture = Rect::from_min_size(pos2(100.0, 0.0), vec2(200.0, 150.0));
        let mut part = 0.5;
        let mut frame = |events: Vec<Event>| {
            let screen = Rect::from_min_size(pos2(0.0, 0.0), vec2(400.0, 300.0));
            let input = RawInput { screen_rect: Some(screen), events, ..RawInput::default() };
            let _ = context.run(input, |context| {
                let x = picture.left() + part as f32 * picture.width();
                part = dragged_line(context, picture, x).unwrap_or(part);
            });
            (part, context.wants_pointer_input())
        };
        let button = |pos, pressed| {
            vec![Event::PointerButton { pos, button: PointerButton::Primary, pressed, modifiers: Default::default() }]
        };
        let (beside, on_line, to) = (pos2(250.0, 50.0), pos2(202.0, 50.0), pos2(150.0, 60.0));
        frame(vec![]);
        assert_eq!(frame(vec![Event::PointerMoved(beside)]), (0.5, false));
        frame(vec![Event::PointerMoved(on_line)]);
        assert_eq!(frame(vec![]), (0.5, true));
        frame(button(on_line, true));
        frame(vec![Event::PointerMoved(to)]);
        frame(vec![]);
        frame(button(to, false));
        assert!((part - 0.25).abs() < 0.02, "{part}");
    }
}
