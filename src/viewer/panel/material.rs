//! Which material, and the parameters of a model.
use super::{group, on_change, source};
use crate::brdf::{self, Brdf, Domain, Parameter, Scale, Spacing, as_number, channels};
use crate::scene::{MaterialSettings, MaterialSource, Scene};
use crate::viewer::change::Change;
use crate::viewer::input::Input;
use crate::viewer::interaction::Viewer;
use egui::{Label, RichText, SliderClamping, Ui};
use std::ops::RangeInclusive;

/// Width of the names of parameters, in points.
const NAME_WIDTH: f32 = 88.0;
/// Names of more letters are small.
const LONG_NAME: usize = 12;

#[derive(Default)]
pub struct State {
    path: String,
    /// Which of the scene's materials is edited, by its name; the first object's if there is no such.
    chosen: String,
    /// The material whose parameters were looked up last, since that may read a file, and these.
    known: Option<(MaterialSettings, Vec<(Parameter, toml::Value)>)>,
}

impl State {
    /// The name of the material of `scene` that is edited; none if there are no objects.
    pub fn edited<'s>(&self, scene: &'s Scene) -> Option<&'s str> {
        let used = scene.used_materials();
        used.iter().find(|name| **name == self.chosen).or(used.first()).copied()
    }

    pub fn show(&mut self, ui: &mut Ui, viewer: &Viewer, inputs: &mut Vec<Input>) {
        let scene = viewer.session.wanted();
        let Some(settings) = self.edited(scene).and_then(|name| scene.material(name)) else { return };
        let used = scene.used_materials();
        group(ui, "Material", |ui| {
            if used.len() > 1 {
                let list = egui::ComboBox::from_id_salt("which material")
                    .width(ui.available_width() - 8.0)
                    .selected_text(&settings.name)
                    .show_ui(ui, |ui| {
                        for name in &used {
                            if ui.selectable_label(*name == settings.name, *name).clicked() {
                                self.chosen = (*name).to_owned();
                            }
                        }
                    });
                list.response.on_hover_text("Which of the scene's materials is edited.");
            }
            let names: Vec<_> = Brdf::builtin_names().collect();
            let current = match &settings.source {
                MaterialSource::Builtin(name) => name.clone(),
                MaterialSource::File(path) => path.display().to_string(),
                MaterialSource::Model { model, .. } => format!("{} ({model})", settings.name),
                MaterialSource::Custom(custom) => custom.name().to_owned(),
            };
            let files = &Brdf::FILES;
            let whose = if used.len() > 1 { "this material" } else { "all objects" };
            let tooltip = format!("The BRDF of {whose}: built in, or {}.", files.names());
            let hint = format!("file: {}", files.extensions());
            let chosen = source(ui, "material", &current, &names, &mut self.path, &tooltip, &hint);
            if let Some(name) = chosen {
                let source = MaterialSource::named(&name);
                inputs.push(Input::Set(match used.len() {
                    1 => Change::Material(source),
                    _ => Change::OneMaterial { material: settings.name.clone(), source },
                }));
            }
            if self.known.as_ref().is_none_or(|(known, _)| known != settings) {
                self.known = Some((settings.clone(), parameters_of(settings).unwrap_or_default()));
            }
            if let Some((_, parameters)) = &self.known {
                ui.spacing_mut().slider_width = 108.0;
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

/// Which decimal the third digit of a number above 0 is; below 0 where that is before the point.
fn third_digit(size: f64) -> f64 {
    2.0 - size.log10().floor()
}

/// Decimals that a number is set to: three digits of what goes by factors.
fn decimals(number: f64, scale: &Scale) -> usize {
    match scale.spacing {
        Spacing::Linear => 3,
        Spacing::Logarithmic => third_digit(number.abs().max(*scale.range.start())).max(3.0) as usize,
    }
}

/// A number in as few characters as three digits of it take.
fn shown(number: f64, decimals: RangeInclusive<usize>, scale: &Scale) -> String {
    let size = number.abs();
    match scale.spacing {
        Spacing::Logarithmic if size > 0.0 && !(0.01..1e5).contains(&size) => format!("{number:.2e}"),
        Spacing::Logarithmic if size > 0.0 => format!("{number:.*}", third_digit(size).clamp(0.0, 4.0) as usize),
        _ => egui::emath::format_with_decimals_in_range(number, decimals),
    }
}

/// A row of the grid: the parameter's name, and what it is edited by.
fn row(ui: &mut Ui, material: &str, parameter: &Parameter, value: &toml::Value, inputs: &mut Vec<Input>) {
    let Parameter { key, help, domain, .. } = parameter;
    let set = |value: toml::Value| Change::Parameter { material: material.to_owned(), key: key.to_owned(), value };
    ui.scope(|ui| {
        // Rows that are wider than the panel would cut all groups off.
        ui.set_width(NAME_WIDTH);
        let name = RichText::new(key);
        let name = if key.len() > LONG_NAME { name.small() } else { name };
        ui.add(Label::new(name).truncate()).on_hover_text(format!("{key}: {help}"));
    });
    match domain {
        Domain::Number(range, scale) => {
            let mut number = as_number(value);
            let slider = egui::Slider::new(&mut number, range.clone())
                .update_while_editing(false)
                .logarithmic(scale.spacing == Spacing::Logarithmic)
                // A scale of factors has no 0.
                .smallest_positive(*scale.range.start())
                .clamping(SliderClamping::Edits)
                .max_decimals(decimals(as_number(value), scale))
                .custom_formatter(|number, decimals| shown(number, decimals, scale));
            on_change(&ui.add(slider).on_hover_text(*help), inputs, || set(number.into()));
        }
        Domain::Colour(range, scale) => {
            let mut rgb = channels(value).unwrap_or_default();
            let array = |rgb: [f64; 3]| toml::Value::Array(rgb.map(Into::into).to_vec());
            ui.horizontal(|ui| {
                // Else it is wider than the panel.
                ui.spacing_mut().item_spacing.x = 4.0;
                ui.spacing_mut().interact_size.x = 28.0;
                for channel in 0..3 {
                    let speed = match scale.spacing {
                        Spacing::Linear => 0.005,
                        Spacing::Logarithmic => 0.01 * rgb[channel].abs().max(*scale.range.start()),
                    };
                    let decimals = decimals(rgb[channel], scale);
                    let drag = egui::DragValue::new(&mut rgb[channel])
                        .update_while_editing(false)
                        .range(range.clone())
                        .speed(speed)
                        .max_decimals(decimals)
                        .custom_formatter(|number, decimals| shown(number, decimals, scale));
                    let response = ui.add_sized([34.0, 18.0], drag).on_hover_text(*help);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_digits_of_a_number_are_shown_whatever_its_size() {
        let factors = Scale::logarithmic(1e-8..=1e6);
        let texts = [9.64e-8, 0.0228, 0.15, 1.5, 30.0, 4021.24, 2.66e8, 0.0].map(|number| {
            let decimals = decimals(number, &factors);
            shown(number, 0..=decimals, &factors)
        });
        assert_eq!(texts, ["9.64e-8", "0.0228", "0.150", "1.50", "30.0", "4021", "2.66e8", "0"]);
        assert_eq!(shown(-0.5, 0..=3, &Scale::linear(-1.0..=1.0)), "-0.5");
        // What is shown is what is read again.
        assert_eq!(texts[0].parse(), Ok(9.64e-8));
    }
}
