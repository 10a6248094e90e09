//! Which environment, its turn and its intensity. Sliders as in display.rs.
use super::{group, on_change, source};
use crate::environment::{self, Environment};
use crate::scene::Source;
use crate::viewer::change::Change;
use crate::viewer::input::Input;
use crate::viewer::interaction::Viewer;
use egui::{SliderClamping, Ui};

#[derive(Default)]
pub struct State {
    path: String,
}

impl State {
    pub fn show(&mut self, ui: &mut Ui, viewer: &Viewer, inputs: &mut Vec<Input>) {
        let settings = &viewer.session.wanted().environment;
        group(ui, "Light", |ui| {
            let (current, names) = (settings.source.to_string(), environment::builtin_names());
            let files = &Environment::FILES;
            let tooltip =
                format!("Distant light from all directions: built in, or {}, latitude-longitude.", files.names());
            let hint = format!("file: {}", files.extensions());
            let chosen = source(ui, "environment", &current, names, &mut self.path, &tooltip, &hint);
            if let Some(name) = chosen {
                inputs.push(Input::Set(Change::Environment(Source::named(&name, names))));
            }
            let mut turn = settings.rotation_deg;
            let slider = egui::Slider::new(&mut turn, 0.0..=360.0)
                .update_while_editing(false)
                .clamping(SliderClamping::Never)
                .suffix("°")
                .max_decimals(1)
                .text("turn");
            let tooltip =
                "Turn of the environment about the vertical axis, counter-clockwise seen from above. Ctrl and drag.";
            on_change(&ui.add(slider).on_hover_text(tooltip), inputs, || Change::Rotation(turn));
            let mut intensity = settings.intensity;
            let slider = egui::Slider::new(&mut intensity, 0.01..=100.0)
                .update_while_editing(false)
                .clamping(SliderClamping::Never)
                .logarithmic(true)
                .text("intensity");
            let tooltip = "Factor on the environment's radiance.";
            on_change(&ui.add(slider).on_hover_text(tooltip), inputs, || Change::Intensity(intensity));
        });
    }
}
