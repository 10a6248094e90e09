//! Which mesh.
use super::{group, source};
use crate::scene::{Mesh, Source, mesh};
use crate::viewer::change::Change;
use crate::viewer::input::Input;
use crate::viewer::interaction::Viewer;
use crate::viewer::orbit::TURNTABLE_S;
use egui::Ui;

#[derive(Default)]
pub struct State {
    path: String,
}

impl State {
    pub fn show(&mut self, ui: &mut Ui, viewer: &Viewer, inputs: &mut Vec<Input>) {
        let objects = &viewer.session.wanted().objects;
        group(ui, "Object", |ui| {
            let current = match objects.as_slice() {
                [object] => object.mesh.to_string(),
                objects => format!("{} objects", objects.len()),
            };
            let names = mesh::builtin_names();
            let files = &Mesh::FILES;
            let tooltip = format!("The mesh in place of all objects: built in, or {}.", files.names());
            let hint = format!("file: {}", files.extensions());
            let chosen = source(ui, "mesh", &current, names, &mut self.path, &tooltip, &hint);
            if let Some(name) = chosen {
                inputs.push(Input::Set(Change::Mesh(Source::named(&name, names))));
            }
            ui.horizontal(|ui| {
                let frame =
                    ui.button("frame").on_hover_text("Moves the camera back until all objects are in the picture: F");
                if frame.clicked() {
                    inputs.push(Input::Key("f".to_owned()));
                }
                let reset = ui.button("reset").on_hover_text("The default view, which frames the objects: Home");
                if reset.clicked() {
                    inputs.push(Input::Key("home".to_owned()));
                }
                let turn = ui.selectable_label(viewer.motion.turntable, "turntable");
                if turn
                    .on_hover_text(format!("Turns the camera around the objects, once in {TURNTABLE_S} s: T"))
                    .clicked()
                {
                    inputs.push(Input::Key("t".to_owned()));
                }
            });
        });
    }
}
