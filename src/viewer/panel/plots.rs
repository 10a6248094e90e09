//! Plots of the material: lobes, the image over half and difference angle, albedo.
use crate::brdf::Brdf;
use crate::evaluate::material_curves::{CELLS, CHANNELS, LIGHTS, in_plane};
use crate::memo::{Key, Keyed};
use crate::viewer::interaction::Viewer;
use crate::viewer::plots::{Plots, SidePlots};
use egui::{
    CollapsingHeader, Color32, ColorImage, Painter, Pos2, Rect, RichText, Sense, Shape, Stroke, TextureHandle,
    TextureOptions, Ui, pos2, vec2,
};

/// Between the two small plots, in points.
const GAP: f32 = 8.0;

/// The images as they were last uploaded, with the material that they are of.
#[derive(Default)]
pub struct State {
    images: Option<(Key, Vec<TextureHandle>)>,
}

impl State {
    /// The group of the panel, of the material of this name; while it is closed nothing is plotted.
    pub fn show(&mut self, ui: &mut Ui, viewer: &mut Viewer, material: Option<&str>) {
        CollapsingHeader::new(RichText::new("Plots").strong()).default_open(false).show(ui, |ui| {
            let Some(material) = material.and_then(|name| shown_material(viewer, name)) else { return };
            let Some(plots) = viewer.plotter.of(&material).cloned() else {
                ui.weak("are being made");
                return;
            };
            for (side, image) in plots.sides.iter().zip(self.images_of(ui, &plots)) {
                if let Some(azimuth_deg) = side.azimuth_deg {
                    ui.label(format!("azimuth {azimuth_deg}°"))
                        .on_hover_text("Of the plane that is plotted, from the tangent.");
                }
                lobes(ui, side);
                ui.horizontal(|ui| {
                    ui.spacing_mut().item_spacing.x = GAP;
                    let width = 0.5 * (ui.available_width() - GAP);
                    half_difference_image(ui, image, width);
                    albedo(ui, side, width);
                });
            }
        });
    }

    fn images_of(&mut self, ui: &Ui, plots: &Plots) -> &[TextureHandle] {
        if self.images.as_ref().is_none_or(|(key, _)| *key != plots.key) {
            let upload = |side: &SidePlots| {
                // Its first row is the lowest.
                let rows = side.image.chunks_exact(CELLS).rev();
                let pixels = rows.flatten().map(|&[r, g, b]| Color32::from_rgb(r, g, b)).collect();
                ui.ctx().load_texture(
                    "half and difference angle",
                    ColorImage::new([CELLS; 2], pixels),
                    TextureOptions::LINEAR,
                )
            };
            self.images = Some((plots.key, plots.sides.iter().map(upload).collect()));
        }
        self.images.as_ref().map_or(&[], |(_, images)| images)
    }
}

/// The material of this name as it is shown; until it is, that of the first object.
fn shown_material(viewer: &Viewer, name: &str) -> Option<Keyed<Brdf>> {
    let materials = &viewer.loaded()?.prepared.materials;
    let shown = materials.iter().find(|material| material.name == name).or(materials.first())?;
    Some(shown.turned_brdf.clone())
}

/// Lobes above the surface, with their lights.
fn lobes(ui: &mut Ui, side: &SidePlots) {
    let width = ui.available_width();
    let (response, painter) = ui.allocate_painter(vec2(width, 0.5 * width + 16.0), Sense::hover());
    let rect = response.rect;
    let origin = pos2(rect.center().x, rect.bottom() - 2.0);
    let longest = side.lobes.iter().flatten().fold(1e-3, |longest: f64, [x, z]| longest.max(x.hypot(*z)));
    let scale = 0.48 * f64::from(width) / longest;
    let place = |[x, z]: [f64; 2]| origin + vec2((scale * x) as f32, (-scale * z) as f32);
    let guide = guide(ui);
    painter.line_segment([place([-longest, 0.0]), place([longest, 0.0])], guide);
    for (index, ((theta_i_deg, rgb), lobe)) in LIGHTS.into_iter().zip(&side.lobes).enumerate() {
        let colour = colour(rgb);
        let w_i = in_plane(theta_i_deg) * longest;
        painter.line_segment([origin, place([w_i.x, w_i.z])], Stroke::new(1.0, colour.gamma_multiply(0.5)));
        painter.add(Shape::line(lobe.iter().map(|point| place(*point)).collect(), Stroke::new(1.5, colour)));
        let at = rect.left_top() + vec2(0.0, 13.0 * index as f32);
        text(&painter, at, egui::Align2::LEFT_TOP, &format!("{theta_i_deg}°"), colour);
    }
    response.on_hover_text(
        "Lobes in the plane of incidence for light at these angles from the normal, from the right: the cube root of luminance times the cosine. \
         The longest one fills the plot.",
    );
}

/// The image with its axes' names.
fn half_difference_image(ui: &mut Ui, image: &TextureHandle, width: f32) {
    let (response, painter) = ui.allocate_painter(vec2(width, width), Sense::hover());
    let rect = response.rect;
    painter.image(image.id(), rect, Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0)), Color32::WHITE);
    painter.rect_stroke(rect, 0.0, guide(ui), egui::StrokeKind::Inside);
    response.on_hover_text(
        "f as a display value at phi_d = 90 degrees: theta_h from 0 at the left to 90 degrees, theta_d from 0 at the bottom to 90. The highlight is \
         the left edge, grazing views are the top, retroreflection is the bottom.",
    );
}

/// Albedo over the view angle, as far as it is known.
fn albedo(ui: &mut Ui, side: &SidePlots, width: f32) {
    let (response, painter) = ui.allocate_painter(vec2(width, width), Sense::hover());
    let rect = response.rect;
    painter.rect_stroke(rect, 0.0, guide(ui), egui::StrokeKind::Inside);
    let most = side.albedo.iter().fold(1.0, |most: f64, (_, albedo)| most.max(albedo.max_element()));
    for (channel, (_, rgb)) in CHANNELS.into_iter().enumerate() {
        let place = |(theta_o_deg, albedo): &(f64, glam::DVec3)| {
            let [x, y] = [theta_o_deg / 90.0, albedo[channel] / most].map(|part| part as f32);
            pos2(rect.left() + x * rect.width(), rect.bottom() - y * rect.height())
        };
        painter.add(Shape::line(side.albedo.iter().map(place).collect(), Stroke::new(1.5, colour(rgb))));
    }
    if side.albedo.is_empty() {
        text(&painter, rect.center(), egui::Align2::CENTER_CENTER, "albedo", ui.visuals().weak_text_color());
    }
    response.on_hover_text(
        "Albedo of the three channels over the view angle, 0 to 90 degrees from left to right; the top is 1, or the greatest albedo if that is more. It \
         is found when the material has stayed for a moment.",
    );
}

fn guide(ui: &Ui) -> Stroke {
    Stroke::new(1.0, ui.visuals().weak_text_color().gamma_multiply(0.5))
}

/// Dark colours are made for white paper: a third of the way to white they are seen on the panel.
fn colour(rgb: [u8; 3]) -> Color32 {
    let [r, g, b] = rgb.map(|channel| channel / 3 * 2 + 85);
    Color32::from_rgb(r, g, b)
}

fn text(painter: &Painter, at: Pos2, anchor: egui::Align2, text: &str, colour: Color32) {
    painter.text(at, anchor, text, egui::FontId::proportional(11.0), colour);
}
