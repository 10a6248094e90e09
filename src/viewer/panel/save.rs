//! Saves the picture and the scene, and opens scenes.
use super::group;
use crate::viewer::input::Input;
use egui::Ui;

pub struct State {
    picture: String,
    scene: String,
    opened: String,
}

impl Default for State {
    fn default() -> Self {
        Self { picture: "threadlight.png".to_owned(), scene: "threadlight.toml".to_owned(), opened: String::new() }
    }
}

impl State {
    pub fn show(&mut self, ui: &mut Ui, inputs: &mut Vec<Input>) {
        group(ui, "Files", |ui| {
            let mut row = |path: &mut String, label: &str, tooltip: &str, input: fn(std::path::PathBuf) -> Input| {
                ui.horizontal(|ui| {
                    let field = ui.add(egui::TextEdit::singleline(path).desired_width(140.0));
                    let is_entered = field.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
                    let is_clicked = ui.button(label).on_hover_text(tooltip).clicked();
                    if (is_entered || is_clicked) && !path.is_empty() {
                        inputs.push(input(path.as_str().into()));
                    }
                });
            };
            let tooltip =
                "The picture that is shown: .png (8 bit, display values) or .exr (32-bit float, linear radiance).";
            row(&mut self.picture, "save picture", tooltip, Input::SavePicture);
            let tooltip = "The scene (.toml), which `threadlight render` makes the same picture of, to the bit.";
            row(&mut self.scene, "save scene", tooltip, Input::SaveScene);
            let tooltip =
                "Opens a scene (.toml), or a material, a light or a mesh, as if its file were dropped on the window.";
            row(&mut self.opened, "open", tooltip, Input::Drop);
        });
    }
}
