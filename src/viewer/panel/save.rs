//! Saves the picture and the scene.
use super::group;
use crate::viewer::input::Input;
use egui::Ui;

pub struct State {
    picture: String,
    scene: String,
}

impl Default for State {
    fn default() -> Self {
        Self { picture: "threadlight.png".to_owned(), scene: "threadlight.toml".to_owned() }
    }
}

impl State {
    pub fn show(&mut self, ui: &mut Ui, inputs: &mut Vec<Input>) {
        group(ui, "Save", |ui| {
            let mut row = |path: &mut String, label: &str, tooltip: &str, input: fn(std::path::PathBuf) -> Input| {
                ui.horizontal(|ui| {
                    ui.add(egui::TextEdit::singleline(path).desired_width(170.0));
                    if ui.button(label).on_hover_text(tooltip).clicked() && !path.is_empty() {
                        inputs.push(input(path.as_str().into()));
                    }
                });
            };
            let tooltip =
                "The picture that is shown: .png (8 bit, display values) or .exr (32-bit float, linear radiance).";
            row(&mut self.picture, "picture", tooltip, Input::SavePicture);
            let tooltip = "The scene (.toml), which `threadlight render` makes the same picture of, to the bit.";
            row(&mut self.scene, "scene", tooltip, Input::SaveScene);
        });
    }
}
