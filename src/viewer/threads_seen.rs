//! Threads seen: those of the material under the cursor, as curves over the hemisphere; the samples for the view angle there; and where in
//! the environment these look.

use egui::ecolor::Hsva;
use egui::{Color32, ColorImage, Painter, Pos2, Rect, Sense, Shape, Stroke, TextureId, Ui, Vec2, pos2, vec2};
use glam::{DMat3, DVec2, DVec3, dvec3};

use crate::brdf::MAX_THETA_O_DEG;
use crate::environment::Environment;
use crate::evaluate::Display;
use crate::passes::View;
use crate::prepare::Prepared;
use crate::scene::BoundingSphere;
use crate::scene::mesh::Hit;
use crate::threads::Threads;

/// Of more threads than this, every second, third or so is drawn.
const MOST_CURVES: usize = 128;
/// Rows of a curve: enough for it to be smooth in an inset.
const MOST_ROWS: usize = 45;
/// Columns of the thumbnail of an environment, which has half as many rows.
pub const THUMBNAIL_COLUMNS: usize = 256;

/// The point of a surface that is under the cursor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Its material's place in [`Prepared::materials`].
    pub material: usize,
    /// Angle between the normal and the direction to the eye, in radians.
    pub theta_o_rad: f64,
    /// Azimuth of that direction from the tangent, in radians; 0 of an isotropic material.
    pub phi_o_rad: f64,
    /// Shading frame to the environment's own picture.
    to_environment: DMat3,
}

impl SurfacePoint {
    /// What of `prepared`, whose objects are within these `spheres`, is seen in column `x` and row `y` of its picture from `view` (pixel
    /// centres have halves); none for the background.
    pub fn under(prepared: &Prepared, spheres: &[BoundingSphere], view: &View, x: f64, y: f64) -> Option<Self> {
        let direction = view.camera.ray(x - 0.5, y - 0.5, view.width, view.height);
        let meets = |sphere: &BoundingSphere| {
            // Rounding is far below a thousandth.
            (sphere.centre - view.camera.eye).reject_from(direction).length() <= 1.001 * sphere.radius
        };
        let near = prepared.objects.iter().zip(spheres).filter(|(_, sphere)| meets(sphere));
        let hits = near.filter_map(|(object, _)| {
            let to_object = object.to_world.inverse();
            let origin = to_object.transform_point3(view.camera.eye);
            let along = to_object.transform_vector3(direction);
            let Hit { distance, normal, tangent: of_mesh } = prepared.meshes[object.mesh].mesh.hit(origin, along)?;
            let tangent = object.tangent.map(|tangent| {
                let of_surface = tangent.rule.at((origin + distance * along).as_vec3(), of_mesh.as_vec3()).as_dvec3();
                (object.to_world.matrix3 * of_surface, tangent.turn())
            });
            Some((distance, to_object.matrix3.transpose() * normal, tangent, object.material as usize))
        });
        let (_, normal, tangent, material) = hits.min_by(|(a, ..), (b, ..)| a.total_cmp(b))?;
        let (n, w_o) = (normal.try_normalize()?, -direction);
        let x = (w_o - n.dot(w_o) * n).try_normalize().unwrap_or_else(|| n.any_orthonormal_vector());
        let to_world = DMat3::from_cols(x, n.cross(x), n);
        let to_environment = view.to_environment() * to_world;
        let phi_o_rad = tangent.map_or(0.0, |(tangent, turn)| {
            -turn.rotate(DVec2::new(tangent.dot(x), tangent.dot(to_world.y_axis))).to_angle()
        });
        Some(Self {
            material,
            phi_o_rad,
            theta_o_rad: n.dot(w_o).clamp(0.0, 1.0).acos().min(MAX_THETA_O_DEG.to_radians()),
            to_environment,
        })
    }

    /// Where `direction` of the shading frame is in the environment's picture: parts of its width and height.
    pub fn in_environment(&self, direction: DVec3) -> [f64; 2] {
        Environment::lat_long(self.to_environment * direction)
    }
}

/// A small picture of `environment` as it is displayed at this intensity.
pub fn thumbnail(environment: &Environment, intensity: f64, display: Display) -> ColorImage {
    let (columns, rows) = (THUMBNAIL_COLUMNS, THUMBNAIL_COLUMNS / 2);
    // The texels that a pixel of the thumbnail covers, at least one.
    let part = |index: usize, of: usize, texels: usize| {
        let [first, end] = [index, index + 1].map(|index| index * texels / of);
        first.min(texels - 1)..end.max(first + 1).min(texels)
    };
    let pixel = |i: usize| {
        let (across, down) =
            (part(i % columns, columns, environment.width), part(i / columns, rows, environment.height));
        let count = (across.len() * down.len()) as f64;
        let texels = down.flat_map(|row| across.clone().map(move |column| row * environment.width + column));
        let sum =
            texels.fold(DVec3::ZERO, |sum, texel| sum + DVec3::from_array(environment.texels[texel].map(f64::from)));
        let mean = (sum * (intensity / count)).to_array();
        let [r, g, b] = mean.map(|radiance| (255.0 * display.value(radiance)).round() as u8);
        Color32::from_rgb(r, g, b)
    };
    ColorImage::new([columns, rows], (0..columns * rows).map(pixel).collect())
}

/// Threads of the same hue on the hemisphere and in the environment: pale as a curve, bright where they look.
fn colour(thread: usize, count: usize, lit: bool) -> Color32 {
    let (saturation, value) = if lit { (0.75, 1.0) } else { (0.6, 0.62) };
    Hsva::new(thread as f32 / count as f32, saturation, value, 1.0).into()
}

/// The radius of a sample's dot, in points, by its share of the light: areas are as shares.
fn radius(share: f64, count: usize) -> f32 {
    (3.5 * (share * count as f64).sqrt().clamp(0.4, 2.5) / (count as f64 / 16.0).sqrt().clamp(1.0, 3.0)) as f32
}

/// Draws the hemisphere seen along the normal, the eye to the right: curves of `threads` over the view angle from 0 to 90 degrees, the
/// eye's own way in white, and for the `surface` under the cursor where the eye and the samples are.
pub fn draw_hemisphere(ui: &mut Ui, threads: &Threads, surface: Option<&SurfacePoint>) {
    let side = ui.available_width();
    let (response, painter) = ui.allocate_painter(Vec2::splat(side), Sense::hover());
    let rect = response.rect;
    let centre = rect.center();
    let scale = 0.48 * f64::from(side);
    let place = |direction: DVec3| centre + vec2((scale * direction.x) as f32, (-scale * direction.y) as f32);
    let [rows, count] = threads.size();
    let visuals = ui.visuals();
    let guide = Stroke::new(1.0, visuals.weak_text_color().gamma_multiply(0.5));
    for theta_deg in [30.0_f64, 60.0, 90.0] {
        painter.circle_stroke(centre, (scale * theta_deg.to_radians().sin()) as f32, guide);
    }
    let curve_rows = rows.min(MOST_ROWS);
    for thread in (0..count).step_by(count.div_ceil(MOST_CURVES)) {
        let row = |i: usize| i * (rows - 1) / (curve_rows - 1).max(1);
        let points = (0..curve_rows).map(|i| place(threads.direction(row(i), thread))).collect();
        painter.add(Shape::line(points, Stroke::new(1.2, colour(thread, count, false))));
    }
    let eye = visuals.strong_text_color();
    painter.line_segment([centre, place(DVec3::X)], Stroke::new(1.0, eye));
    if let Some(surface) = surface {
        for (thread, (direction, share)) in
            threads.seen_from(surface.theta_o_rad, surface.phi_o_rad).into_iter().enumerate()
        {
            dot(&painter, place(direction), radius(share, count), colour(thread, count, true));
        }
        let (sin, cos) = surface.theta_o_rad.sin_cos();
        painter.circle_filled(place(dvec3(sin, 0.0, cos)), 4.0, eye);
    }
    response.on_hover_text(
        "The hemisphere of incident directions, seen along the normal: each curve is where a thread looks as the view angle \
         theta_o goes from 0 to 90 degrees. The eye is on the line to the right; dots are the samples for the view angle under the cursor, \
         their areas as the light that they weigh.",
    );
}

/// Draws the environment's `picture` with a dot where each sample looks from the `surface` under the cursor.
pub fn draw_environment(ui: &mut Ui, picture: TextureId, threads: Option<&Threads>, surface: Option<&SurfacePoint>) {
    let width = ui.available_width();
    let (response, painter) = ui.allocate_painter(vec2(width, 0.5 * width), Sense::hover());
    let rect = response.rect;
    let whole = Rect::from_min_max(Pos2::ZERO, pos2(1.0, 1.0));
    painter.image(picture, rect, whole, Color32::WHITE);
    if let (Some(threads), Some(surface)) = (threads, surface) {
        let [_, count] = threads.size();
        for (thread, (direction, share)) in
            threads.seen_from(surface.theta_o_rad, surface.phi_o_rad).into_iter().enumerate()
        {
            let [u, v] = surface.in_environment(direction).map(|part| part as f32);
            let at = rect.min + vec2(u * rect.width(), v * rect.height());
            dot(&painter, at, radius(share, count), colour(thread, count, true));
        }
    }
    response.on_hover_text(
        "The environment as a latitude-longitude picture: dots are where the samples for the surface under the cursor look.",
    );
}

/// A dot that is seen on any background.
fn dot(painter: &Painter, at: Pos2, radius: f32, colour: Color32) {
    painter.circle(at, radius, colour, Stroke::new(1.0, Color32::BLACK));
}

/// The place of the cursor in the picture, in pixels, from its place on the screen and the `picture`'s rectangle there (both in points).
pub fn in_picture(cursor: Pos2, picture: Rect, [width, height]: [u32; 2]) -> Option<DVec2> {
    let part = (cursor - picture.min) / picture.size();
    let is_inside = picture.contains(cursor) && part.x.is_finite() && part.y.is_finite();
    is_inside.then(|| DVec2::new(f64::from(part.x) * f64::from(width), f64::from(part.y) * f64::from(height)))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;
    use crate::method::Method;
    use crate::prepare::prepare;
    use crate::scene::{Scene, Source};

    /// The built-in sphere, with few threads.
    fn sphere(method: Method) -> Prepared {
        let mut scene = Scene::default();
        scene.shading.method = method;
        scene.shading.threads = Some(4);
        scene.environment.source = Source::Builtin("white".into());
        scene.environment.rotation_deg = 90.0;
        prepare(&scene, &crate::memo::Memo::default().round(&())).unwrap()
    }

    #[test]
    fn the_surface_under_the_cursor_is_that_of_the_sphere() {
        let prepared = sphere(Method::Uniform);
        let under = |x: f64| SurfacePoint::under(&prepared, &prepared.spheres(), &prepared.view, x, 240.0);
        assert_eq!(under(1.0), None);
        // In the middle the normal points at the eye.
        let middle = under(320.0).unwrap();
        assert!(middle.theta_o_rad < 0.01 && middle.material == 0, "{middle:?}");
        let to_eye = prepared.view.camera.eye.normalize();
        let turned = DMat3::from_rotation_y(-90_f64.to_radians()) * to_eye;
        let [[u, v], [expected_u, expected_v]] = [middle.in_environment(DVec3::Z), Environment::lat_long(turned)];
        assert!((u - expected_u).abs() < 1e-2 && (v - expected_v).abs() < 1e-2);
        // Towards the rim the view angle grows, and the eye stays where it is.
        let mut before = 0.0;
        for x in (330..600).step_by(20) {
            let Some(surface) = under(f64::from(x)) else { break };
            assert!(surface.theta_o_rad > before && surface.theta_o_rad < FRAC_PI_2);
            before = surface.theta_o_rad;
            let ray = prepared.view.camera.ray(f64::from(x) - 0.5, 239.5, 640, 480);
            let (sin, cos) = surface.theta_o_rad.sin_cos();
            let eye = surface.to_environment * dvec3(sin, 0.0, cos);
            assert!(eye.distance(DMat3::from_rotation_y(-FRAC_PI_2) * -ray) < 1e-6);
        }
        assert!(before > 0.8);
    }

    #[test]
    fn samples_are_those_that_shading_uses_and_share_all_of_the_light() {
        for method in [Method::Fitted, Method::Paper] {
            let prepared = sphere(method);
            let threads = &prepared.materials[0].threads.as_ref().unwrap();
            for row in [0, 30, 90] {
                let seen = threads.seen_from(row as f64 / 90.0 * FRAC_PI_2 + 1e-12, 0.0);
                assert!((seen.iter().map(|(_, share)| share).sum::<f64>() - 1.0).abs() < 1e-6);
                for (thread, (direction, share)) in seen.into_iter().enumerate() {
                    assert!(direction.distance(threads.direction(row, thread)) < 1e-6 && share >= 0.0);
                }
            }
        }
    }

    #[test]
    fn a_thumbnail_is_the_mean_of_what_it_covers_as_it_is_displayed() {
        let display = Display { exposure: 1.0, gamma: 1.0 };
        let white = Environment::builtin("white").unwrap();
        let picture = thumbnail(&white, 0.5, display);
        assert_eq!(picture.size, [256, 128]);
        let expected = (127.5 * white.texels[0][0]).round() as u8;
        assert!(picture.pixels.iter().all(|pixel| pixel.r().abs_diff(expected) <= 1), "{:?}", picture.pixels[0]);
    }

    #[test]
    fn insets_draw_without_a_window() {
        let prepared = sphere(Method::Fitted);
        let threads = &prepared.materials[0].threads.as_ref().unwrap();
        let surface = SurfacePoint::under(&prepared, &prepared.spheres(), &prepared.view, 400.0, 240.0);
        let shapes = |surface: Option<&SurfacePoint>| {
            let context = egui::Context::default();
            let output = context.run(Default::default(), |context| {
                egui::CentralPanel::default().show(context, |ui| {
                    draw_hemisphere(ui, threads, surface);
                    draw_environment(ui, TextureId::default(), Some(threads), surface);
                });
            });
            output.shapes.len()
        };
        // Four dots each, and the eye.
        assert_eq!(shapes(surface.as_ref()), shapes(None) + 9);
    }

    #[test]
    fn the_cursor_is_found_in_the_picture() {
        let picture = Rect::from_min_size(pos2(100.0, 50.0), vec2(320.0, 240.0));
        assert_eq!(in_picture(pos2(100.0, 50.0), picture, [640, 480]), Some(DVec2::ZERO));
        assert_eq!(in_picture(pos2(260.0, 170.0), picture, [640, 480]), Some(DVec2::new(320.0, 240.0)));
        assert_eq!(in_picture(pos2(99.0, 50.0), picture, [640, 480]), None);
        assert_eq!(in_picture(pos2(100.0, 50.0), Rect::ZERO, [640, 480]), None);
    }
}
