//! How radiance becomes display values, and what is seen behind the objects.
//!
//! Sliders span what is mostly wanted. Numbers beyond can be typed, and those of the scene stay: the change says what is possible.
use super::{group, on_change};
use crate::scene::Background;
use crate::viewer::change::Change;
use crate::viewer::input::Input;
use crate::viewer::interaction::Viewer;
use egui::{SliderClamping, Ui};

pub fn show(ui: &mut Ui, viewer: &Viewer, inputs: &mut Vec<Input>) {
    let image = &viewer.session.wanted().image;
    group(ui, "Display", |ui| {
        let mut stops = image.exposure.max(1e-6).log2();
        let slider = egui::Slider::new(&mut stops, -8.0..=8.0)
            .clamping(SliderClamping::Never)
            .suffix(" EV")
            .fixed_decimals(2)
            .update_while_editing(false)
            .text("exposure");
        let tooltip = "Factor on radiance before display, in stops: display value = clamp(2^EV L, 0, 1)^(1/gamma). + and - are thirds of a stop, 0 is none.";
        on_change(&ui.add(slider).on_hover_text(tooltip), inputs, || Change::Exposure(stops.exp2()));
        let mut gamma = image.gamma;
        let slider = egui::Slider::new(&mut gamma, 1.0..=3.0)
            .clamping(SliderClamping::Never)
            .fixed_decimals(2)
            .update_while_editing(false)
            .text("gamma");
        let tooltip = "Display values are radiance to the power of 1/gamma; 2.2 is that of most displays.";
        on_change(&ui.add(slider).on_hover_text(tooltip), inputs, || Change::Gamma(gamma));
        let mut shown = image.background == Background::Environment;
        let response = ui.checkbox(&mut shown, "environment behind the objects").on_hover_text("B");
        on_change(&response, inputs, || {
            Change::Background(if shown { Background::Environment } else { Background::None })
        });
    });
}
