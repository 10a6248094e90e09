//! Which material, and the parameters of a model.
use super::{group, on_change, source};
use crate::brdf::Brdf;
use crate::scene::{MaterialSettings, MaterialSource};
use crate::viewer::input::Input;
use crate::viewer::session::{Change, model_of};
use crate::viewer::viewer::Viewer;
use egui::Ui;

#[derive(Default)]
pub struct State {
    path: String,
    /// The material whose model was looked up last, since that may read a file.
    known: Option<(MaterialSettings, Option<(String, toml::Table)>)>,
}

impl State {
    pub fn show(&mut self, ui: &mut Ui, viewer: &Viewer, inputs: &mut Vec<Input>) {
        let scene = viewer.session.wanted();
        let Some(settings) = scene
            .objects
            .first()
            .and_then(|object| scene.materials.iter().find(|material| material.name == object.material))
        else {
            return;
        };
        group(ui, "Material", |ui| {
            let names: Vec<_> = Brdf::builtin_names().collect();
            let current = match &settings.source {
                MaterialSource::Builtin(name) => name.clone(),
                MaterialSource::File(path) => path.display().to_string(),
                MaterialSource::Model { model, .. } => format!("{} ({model})", settings.name),
            };
            let files = &Brdf::FILES;
            let tooltip = format!("The BRDF of all objects: built in, or {}.", files.names());
            let hint = format!("file: {}", files.extensions());
            let chosen = source(ui, "material", &current, &names, &mut self.path, &tooltip, &hint);
            if let Some(name) = chosen {
                inputs.push(Input::Set(Change::Material(MaterialSource::named(&name))));
            }
            if self.known.as_ref().is_none_or(|(known, _)| known != settings) {
                self.known = Some((settings.clone(), model_of(settings).ok()));
            }
            if let Some((_, Some((_, parameters)))) = &self.known {
                egui::Grid::new("parameters").num_columns(2).show(ui, |ui| {
                    for (key, value) in parameters {
                        parameter(ui, &settings.name, key, value, inputs);
                        ui.end_row();
                    }
                });
            }
        });
    }
}

/// What the parameters are, and their ranges where these are not those of a reflectance.
fn described(key: &str) -> (&'static str, std::ops::RangeInclusive<f64>, bool) {
    match key {
        "alpha" => {
            ("Roughness of the microfacets, used as it is, not squared: 0.01 is nearly a mirror.", 0.01..=1.0, true)
        }
        "exponent" => ("Exponent of Blinn and Phong's lobe: the larger, the narrower.", 1.0..=10_000.0, true),
        "ior" => ("Index of refraction of the coat, against air.", 1.0..=3.0, false),
        "eta" => ("Real part of the conductor's index of refraction, for red, green and blue.", 0.0..=10.0, false),
        "k" => (
            "Extinction: imaginary part of the conductor's index of refraction, for red, green and blue.",
            0.0..=15.0,
            false,
        ),
        "distribution" => ("Distribution of the microfacets' normals.", 0.0..=1.0, false),
        "diffuse" => ("Albedo of the diffuse part, linear Rec. 709.", 0.0..=1.0, false),
        "specular" => ("Albedo of the lobe, linear Rec. 709.", 0.0..=1.0, false),
        "reflectance" => ("Albedo, linear Rec. 709.", 0.0..=1.0, false),
        _ => ("Parameter of the model.", 0.0..=1.0, false),
    }
}

/// A row of the grid: the parameter's name, and what it is edited by.
fn parameter(ui: &mut Ui, material: &str, key: &str, value: &toml::Value, inputs: &mut Vec<Input>) {
    let (tooltip, range, is_logarithmic) = described(key);
    let set = |value: toml::Value| Change::Parameter { material: material.to_owned(), key: key.to_owned(), value };
    let number = |value: &toml::Value| value.as_float().or_else(|| value.as_integer().map(|value| value as f64));
    ui.label(key).on_hover_text(tooltip);
    if let Some(mut number) = number(value) {
        let slider = egui::Slider::new(&mut number, range).logarithmic(is_logarithmic).max_decimals(3);
        on_change(&ui.add(slider).on_hover_text(tooltip), inputs, || set(number.into()));
    } else if let Some([red, green, blue]) = value.as_array().map(Vec::as_slice) {
        let mut rgb = [red, green, blue].map(|value| number(value).unwrap_or_default());
        let array = |rgb: [f64; 3]| toml::Value::Array(rgb.map(Into::into).to_vec());
        ui.horizontal(|ui| {
            for channel in 0..3 {
                let drag = egui::DragValue::new(&mut rgb[channel]).range(range.clone()).speed(0.005).max_decimals(3);
                let response = ui.add_sized([44.0, 18.0], drag).on_hover_text(tooltip);
                on_change(&response, inputs, || set(array(rgb)));
            }
            if *range.end() == 1.0 {
                let mut color = rgb.map(|value| value as f32);
                let response = ui.color_edit_button_rgb(&mut color).on_hover_text(tooltip);
                on_change(&response, inputs, || set(array(color.map(|value| (f64::from(value) * 1e4).round() / 1e4))));
            }
        });
    } else if let Some(current) = value.as_str() {
        egui::ComboBox::from_id_salt(key)
            .selected_text(current)
            .show_ui(ui, |ui| {
                for name in ["ggx", "beckmann"] {
                    if ui.selectable_label(current == name, name).clicked() && current != name {
                        inputs.push(Input::Set(set(name.into())));
                    }
                }
            })
            .response
            .on_hover_text(tooltip);
    }
}
