//! The threads of the material under the cursor, and where in the environment they look.
use super::comparison::on_screen;
use super::group;
use crate::evaluate::Display;
use crate::memo::Key;
use crate::viewer::interaction::Viewer;
use crate::viewer::threads_seen::{self, SurfacePoint, in_picture};
use egui::{TextureHandle, TextureOptions, Ui};
use std::path::Path;

/// What is kept from frame to frame.
#[derive(Default)]
pub struct State {
    /// What is under the cursor.
    surface: Option<SurfacePoint>,
    /// The environment's thumbnail as it was last uploaded, with its environment, intensity and display.
    thumbnail: Option<(Key, f64, Display, TextureHandle)>,
}

impl State {
    pub fn show(&mut self, ui: &mut Ui, viewer: &Viewer) {
        let Some(loaded) = viewer.loaded() else { return };
        group(ui, "Threads", |ui| {
            let prepared = &loaded.prepared;
            // While something is dragged it stays: a large mesh takes longer to look through than a frame has.
            if !ui.input(|input| input.pointer.any_down()) {
                self.surface = viewer.shown_view().and_then(|view| {
                    let scale = ui.ctx().pixels_per_point();
                    let [x, y] = viewer.cursor?.map(|pixels| pixels as f32 / scale);
                    let size = [view.width, view.height];
                    let place = in_picture(egui::pos2(x, y), on_screen(ui.ctx(), viewer.area), size)?;
                    SurfacePoint::under(prepared, &loaded.spheres, &view, place.x, place.y)
                });
            }
            let surface = self.surface.filter(|surface| surface.material < prepared.materials.len());
            let material = &prepared.materials[surface.map_or(0, |surface| surface.material)];
            match surface {
                Some(surface) => {
                    // Names of materials from files are paths.
                    let name = Path::new(&material.name).file_name().unwrap_or_default().to_string_lossy();
                    ui.label(format!("{name}, theta_o = {:.1}°", surface.theta_o_rad.to_degrees()))
                }
                None => ui.weak("move the cursor over an object"),
            };
            let threads = material.threads.as_deref();
            match threads {
                Some(threads) => threads_seen::draw_hemisphere(ui, threads, surface.as_ref()),
                None => drop(ui.weak("this method has no threads")),
            }
            let image = &viewer.session.shown().image;
            let intensity = viewer.session.shown().environment.intensity;
            let display = Display { exposure: image.exposure, gamma: image.gamma };
            let is_good = |(environment, of, shown, _): &(Key, f64, Display, TextureHandle)| {
                (*environment, *of, *shown) == (prepared.environment.key, intensity, display)
            };
            if !self.thumbnail.as_ref().is_some_and(is_good) {
                let picture = threads_seen::thumbnail(&prepared.environment, intensity, display);
                let texture = ui.ctx().load_texture("environment", picture, TextureOptions::LINEAR);
                self.thumbnail = Some((prepared.environment.key, intensity, display, texture));
            }
            if let Some((.., texture)) = &self.thumbnail {
                threads_seen::draw_environment(ui, texture.id(), threads, surface.as_ref());
            }
        });
    }
}
