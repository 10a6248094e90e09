//! Which material, and the parameters of a model.
use super::{group, on_change, source};
use crate::brdf::{self, Brdf, Domain, Parameter, Spacing, as_number, channels};
use crate::scene::{MaterialSettings, MaterialSource};
use crate::viewer::change::Change;
use crate::viewer::input::Input;
use crate::viewer::interaction::Viewer;
use egui::{RichText, SliderClamping, Ui};

#[derive(Default)]
pub struct State {
    path: String,
    /// The material whose parameters were looked up last, since that may read a file, and these.
    known: Option<(MaterialSettings, Vec<(Parameter, toml::Value)>)>,
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
                MaterialSource::Custom(custom) => custom.name().to_owned(),
            };
            let files = &Brdf::FILES;
            let tooltip = format!("The BRDF of all objects: built in, or {}.", files.names());
            let hint = format!("file: {}", files.extensions());
            let chosen = source(ui, "material", &current, &names, &mut self.path, &tooltip, &hint);
            if let Some(name) = chosen {
                inputs.push(Input::Set(Change::Material(MaterialSource::named(&name))));
            }
            if self.known.as_ref().is_none_or(|(known, _)| known != settings) {
                self.known = Some((settings.clone(), parameters_of(settings).unwrap_or_default()));
            }
            if let Some((_, parameters)) = &self.known {
                egui::Grid::new("parameters").num_columns(2).show(ui, |ui| {
                    for (parameter, value) in parameters {
                        row(ui, &settings.name, parameter, value, inputs);
                        ui.end_row();
                    }
                });
            }
        });
    }
}

/// The parameters of a material with their values; none if it has no model.
fn parameters_of(settings: &MaterialSettings) -> Option<Vec<(Parameter, toml::Value)>> {
    let (model, table) = settings.model().ok()?;
    let parameters = Brdf::parameters(&model, &table).ok()?;
    let with_value = |parameter: Parameter| {
        let value = brdf::parameter(&table, &parameter.key).cloned().or(parameter.default.map(Into::into))?;
        Some((parameter, value))
    };
    Some(parameters.into_iter().filter_map(with_value).collect())
}

/// A row of the grid: the parameter's name, and what it is edited by.
fn row(ui: &mut Ui, material: &str, parameter: &Parameter, value: &toml::Value, inputs: &mut Vec<Input>) {
    let Parameter { key, help, domain, .. } = parameter;
    let set = |value: toml::Value| Change::Parameter { material: material.to_owned(), key: key.to_owned(), value };
    // Names of inner tables are long, and rows that are wider than the panel would cut all groups off.
    let name = RichText::new(key);
    ui.label(if key.contains('.') { name.small() } else { name }).on_hover_text(*help);
    match domain {
        Domain::Number(range, spacing) => {
            let mut number = as_number(value);
            let is_logarithmic = *spacing == Spacing::Logarithmic;
            // A scale of factors has no 0: it starts a hundred thousandth of the way.
            let smallest = if *range.start() > 0.0 { *range.start() } else { 1e-5 * range.end() };
            let slider = egui::Slider::new(&mut number, range.clone())
                .logarithmic(is_logarithmic)
                .smallest_positive(smallest)
                .clamping(SliderClamping::Edits)
                .max_decimals(3);
            on_change(&ui.add(slider).on_hover_text(*help), inputs, || set(number.into()));
        }
        Domain::Colour(range) => {
            let mut rgb = channels(value).unwrap_or_default();
            let array = |rgb: [f64; 3]| toml::Value::Array(rgb.map(Into::into).to_vec());
            ui.horizontal(|ui| {
                for channel in 0..3 {
                    let drag =
                        egui::DragValue::new(&mut rgb[channel]).range(range.clone()).speed(0.005).max_decimals(3);
                    let response = ui.add_sized([40.0, 18.0], drag).on_hover_text(*help);
                    on_change(&response, inputs, || set(array(rgb)));
                }
                if *range == (0.0..=1.0) {
                    let mut color = rgb.map(|value| value as f32);
                    let response = ui.color_edit_button_rgb(&mut color).on_hover_text(*help);
                    on_change(&response, inputs, || {
                        set(array(color.map(|value| (f64::from(value) * 1e4).round() / 1e4)))
                    });
                }
            });
        }
        Domain::Choice(words) => {
            let current = value.as_str().unwrap_or_default();
            let show = |ui: &mut Ui| {
                for word in words {
                    if ui.selectable_label(current == word, word).clicked() && current != word {
                        inputs.push(Input::Set(set(word.as_str().into())));
                    }
                }
            };
            let response = egui::ComboBox::from_id_salt(key).selected_text(current).show_ui(ui, show).response;
            response.on_hover_text(*help);
        }
    }
}
