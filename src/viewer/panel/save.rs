//! Saves the picture and the scene, and opens scenes.
use super::group;
use crate::viewer::input::Input;
use egui::Ui;
use std::collections::HashSet;
use std::path::PathBuf;

pub struct State {
    picture: String,
    scene: String,
    opened: String,
    /// Files that this session has written.
    written: HashSet<PathBuf>,
    /// A file of somebody else's that the next press would replace.
    to_replace: Option<PathBuf>,
}

impl Default for State {
    fn default() -> Self {
        Self {
            picture: "threadlight.png".to_owned(),
            scene: "threadlight.toml".to_owned(),
            opened: String::new(),
            written: HashSet::new(),
            to_replace: None,
        }
    }
}

impl State {
    pub fn show(&mut self, ui: &mut Ui, inputs: &mut Vec<Input>) {
        group(ui, "Files", |ui| {
            let tooltip =
                "The picture that is shown: .png (8 bit, display values) or .exr (32-bit float, linear radiance).";
            if let Some(path) = row(ui, &mut self.picture, "save picture", tooltip).filter(|path| self.may_write(path))
            {
                inputs.push(Input::SavePicture(path));
            }
            let tooltip = "The scene (.toml), which `threadlight render` makes the same picture of, to the bit.";
            if let Some(path) = row(ui, &mut self.scene, "save scene", tooltip).filter(|path| self.may_write(path)) {
                inputs.push(Input::SaveScene(path));
            }
            if let Some(path) = &self.to_replace {
                ui.colored_label(
                    ui.visuals().warn_fg_color,
                    format!("{} is there already: once more to replace it", path.display()),
                );
            }
            let tooltip =
                "Opens a scene (.toml), or a material, a light or a mesh, as if its file were dropped on the window.";
            inputs.extend(row(ui, &mut self.opened, "open", tooltip).map(Input::Drop));
        });
    }

    /// Whether `path`, which was asked for, may be written: what was there before this session is only replaced if it is asked for again.
    fn may_write(&mut self, path: &PathBuf) -> bool {
        if path.exists() && !self.written.contains(path) && self.to_replace.as_ref() != Some(path) {
            self.to_replace = Some(path.clone());
            return false;
        }
        self.to_replace = None;
        self.written.insert(path.clone());
        true
    }
}

/// A field for the name of a file, and a button; gives the name when it is entered or the button pressed.
fn row(ui: &mut Ui, path: &mut String, label: &str, tooltip: &str) -> Option<PathBuf> {
    ui.horizontal(|ui| {
        let field = ui.add(egui::TextEdit::singleline(path).desired_width(140.0));
        let is_entered = field.lost_focus() && ui.input(|input| input.key_pressed(egui::Key::Enter));
        let is_clicked = ui.button(label).on_hover_text(tooltip).clicked();
        ((is_entered || is_clicked) && !path.is_empty()).then(|| path.as_str().into())
    })
    .inner
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_was_there_before_is_replaced_only_if_that_is_asked_for_twice() {
        let folder = tempfile::tempdir().unwrap();
        let [new, old, other] = ["new.png", "old.png", "other.png"].map(|name| folder.path().join(name));
        for path in [&old, &other] {
            std::fs::write(path, "of somebody else").unwrap();
        }
        let mut state = State::default();
        assert!(state.may_write(&new));
        std::fs::write(&new, "of this session").unwrap();
        assert!(state.may_write(&new));
        assert!(!state.may_write(&old) && !state.may_write(&other) && !state.may_write(&old));
        assert!(state.may_write(&old) && state.may_write(&old));
    }
}
