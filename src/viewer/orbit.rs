//! The orbit camera: an eye on a sphere around a target, and what drags, scrolls and keys do to it.
//!
//! Pixels count from the top left; drags are in pixels of an image of so many rows, so that the same motion of the hand does the
//! same whatever the image's resolution.
use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::{DQuat, DVec2, DVec3};

use super::input::Scroll;
use crate::scene::{BoundingSphere, Camera};

/// A drag across the height of the image turns by half a circle.
const TURN_RAD: f64 = PI;
/// Highest elevation: a tenth of a degree from the poles, so that up never is parallel to the line of sight, and right stays known to
/// 1e-4 in the single precision of shaders.
const MAX_ELEVATION_RAD: f64 = FRAC_PI_2 - 0.1 * PI / 180.0;
/// A line of the scroll wheel brings the eye nearer by a tenth of its distance.
const ZOOM_A_LINE: f64 = 0.9;
/// Touchpads scroll by pixels: so many are a line, as browsers have it.
const PIXELS_A_LINE: f64 = 40.0;
/// Nearest distance in radii of the objects: nearer, positions in single precision (6e-8 of the radius) would be off by more than a
/// tenth of a pixel.
const NEAREST: f64 = 1e-3;
/// Farthest distance of the eye from the target, and of the target from the objects, in radii: farther, they are less than two pixels.
const FARTHEST: f64 = 1e3;
/// The turntable turns once in so many seconds.
pub const TURNTABLE_S: f64 = 20.0;

/// A camera that moves on a sphere around what it looks at. Motions that are not finite do nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orbit {
    bounds: BoundingSphere,
    target: DVec3,
    /// Whatever the camera calls up, unit: the axis of the orbit.
    vertical: DVec3,
    /// From the target towards the eye, without its vertical part; unit.
    heading: DVec3,
    /// Of the eye above the target's horizon.
    elevation_rad: f64,
    distance: f64,
    fov_y_deg: f64,
}

impl Orbit {
    /// The orbit that `camera` (a sound one: [`Camera::validate`]) is on, around objects within `bounds`, of positive radius. Where the camera is
    /// nearer to a pole, nearer or farther than orbits go, it is put at the bound.
    pub fn new(camera: &Camera, bounds: BoundingSphere) -> Self {
        let vertical = camera.unit_up();
        let out = camera.eye - camera.target;
        let height = out.dot(vertical);
        let across = out - height * vertical;
        let mut orbit = Self {
            bounds,
            target: camera.target,
            vertical,
            heading: across.try_normalize().unwrap_or_else(|| vertical.any_orthonormal_vector()),
            elevation_rad: height.atan2(across.length()),
            distance: out.length(),
            fov_y_deg: camera.fov_y_deg,
        };
        orbit.hold();
        orbit
    }

    /// The camera as it stands now.
    pub fn camera(&self) -> Camera {
        let (sin, cos) = self.elevation_rad.sin_cos();
        let eye = self.target + self.distance * (cos * self.heading + sin * self.vertical);
        Camera { eye, target: self.target, up: self.vertical, fov_y_deg: self.fov_y_deg }
    }

    /// Turns the objects as if a drag by `drag_px` rolled them: to the right moves the eye to the left, down moves it up, as far as
    /// the pole.
    pub fn turn(&mut self, drag_px: DVec2, image_rows: f64) {
        let angle = angle_rad(drag_px, image_rows);
        self.turn_about_vertical(-angle.x);
        self.elevation_rad += angle.y;
        self.hold();
    }

    /// Moves eye and target along the image such that what is under the cursor, as far away as the target, stays under it.
    pub fn pan(&mut self, drag_px: DVec2, image_rows: f64) {
        let drag = finite(drag_px / image_rows);
        let camera = self.camera();
        let image_height = 2.0 * self.distance * camera.half_size(1.0).y;
        let (right, up, _) = camera.basis();
        self.target += image_height * (drag.y * up - drag.x * right);
        self.hold();
    }

    /// Brings the eye nearer to the target (scrolled forwards) or away from it.
    pub fn zoom(&mut self, scroll: Scroll) {
        let lines = match scroll {
            Scroll::Lines(lines) => lines,
            Scroll::Pixels(pixels) => pixels / PIXELS_A_LINE,
        };
        if lines.is_finite() {
            self.distance *= ZOOM_A_LINE.powf(lines);
        }
        self.hold();
    }

    /// Looks at the middle of the objects from the same side, such that all of them fill an image of `aspect` = width / height.
    pub fn frame(&mut self, aspect: f64) {
        self.target = self.bounds.centre;
        self.distance = Camera::framing_distance(self.bounds.radius, self.fov_y_deg, aspect);
        self.hold();
    }

    /// Turns as a turntable does in `seconds`.
    pub fn turntable(&mut self, seconds: f64) {
        self.turn_about_vertical(seconds / TURNTABLE_S * TAU);
        self.hold();
    }

    fn turn_about_vertical(&mut self, angle_rad: f64) {
        if angle_rad.is_finite() {
            let turned = DQuat::from_axis_angle(self.vertical, angle_rad % TAU) * self.heading;
            // Made orthogonal again, or roundings of many turns would add up.
            let across = turned - turned.dot(self.vertical) * self.vertical;
            self.heading = across.try_normalize().unwrap_or(self.heading);
        }
    }

    /// Puts what is beyond its bounds back to them.
    fn hold(&mut self) {
        let BoundingSphere { centre, radius } = self.bounds;
        let farthest = FARTHEST * radius;
        self.target = centre + (self.target - centre).clamp_length_max(farthest);
        // Far from the origin roundings set the bound: the line of sight is to be known to a millionth.
        let nearest = (NEAREST * radius).max(1e6 * f64::EPSILON * self.target.length());
        self.distance = self.distance.clamp(nearest, farthest.max(nearest));
        self.elevation_rad = self.elevation_rad.clamp(-MAX_ELEVATION_RAD, MAX_ELEVATION_RAD);
    }
}

/// By how much a drag along the image turns the environment, in degrees: what is seen in it follows the cursor where the
/// camera looks level.
pub fn environment_turn_deg(drag_px: f64, image_rows: f64) -> f64 {
    angle_rad(DVec2::new(drag_px, 0.0), image_rows).x.to_degrees()
}

fn angle_rad(drag_px: DVec2, image_rows: f64) -> DVec2 {
    TURN_RAD * finite(drag_px / image_rows)
}

/// A motion as a part of the image: none where there is none to be told, and at most a thousand images, as squares of larger numbers
/// might not be finite.
fn finite(motion: DVec2) -> DVec2 {
    if motion.is_finite() { motion.clamp(DVec2::splat(-1e3), DVec2::splat(1e3)) } else { DVec2::ZERO }
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT: BoundingSphere = BoundingSphere { centre: DVec3::ZERO, radius: 1.0 };

    fn start() -> Camera {
        Camera::framing(DVec3::ZERO, 1.0, 4.0 / 3.0)
    }

    fn nearly(a: Camera, b: Camera) -> bool {
        let same = |a: DVec3, b: DVec3| a.distance(b) < 1e-9 * (1.0 + a.length());
        same(a.eye, b.eye)
            && same(a.target, b.target)
            && same(a.unit_up(), b.unit_up())
            && (a.fov_y_deg - b.fov_y_deg).abs() < 1e-9
    }

    #[test]
    fn a_camera_comes_back_as_it_was() {
        let tilted = Camera {
            eye: DVec3::new(3.0, -2.0, 1.0),
            target: DVec3::new(0.5, 1.0, 0.0),
            up: DVec3::new(0.1, 2.0, 0.3),
            fov_y_deg: 70.0,
        };
        let below = Camera { eye: DVec3::new(-0.02, -5.0, 0.03), ..start() };
        for camera in [start(), tilted, below] {
            assert!(nearly(Orbit::new(&camera, UNIT).camera(), camera), "{camera:?}");
        }
    }

    #[test]
    fn a_drag_rolls_the_front_of_the_object_along() {
        for drag in [DVec2::new(7.0, 0.0), DVec2::new(0.0, 7.0), DVec2::new(-3.0, 5.0)] {
            let mut orbit = Orbit::new(&start(), UNIT);
            let front = orbit.camera().eye.normalize();
            let seen_at = |orbit: &Orbit| {
                let (right, up, forward) = orbit.camera().basis();
                let from_eye = front - orbit.camera().eye;
                DVec2::new(from_eye.dot(right), -from_eye.dot(up)) / from_eye.dot(forward)
            };
            let before = seen_at(&orbit);
            orbit.turn(drag, 480.0);
            assert!((seen_at(&orbit) - before).dot(drag) > 0.0, "{drag}");
        }
        // Across the whole image and back again is where it began.
        let mut orbit = Orbit::new(&start(), UNIT);
        (0..4).for_each(|_| orbit.turn(DVec2::new(240.0, 0.0), 480.0));
        assert!(nearly(orbit.camera(), start()));
    }

    #[test]
    fn beyond_the_pole_nothing_flips() {
        for direction in [1.0, -1.0] {
            let mut orbit = Orbit::new(&start(), UNIT);
            let right = orbit.camera().basis().0;
            for _ in 0..1000 {
                orbit.turn(DVec2::new(0.0, direction * 31.0), 480.0);
                let camera = orbit.camera();
                camera.validate().unwrap();
                assert!(camera.basis().0.distance(right) < 1e-9 && camera.basis().1.y > 0.0, "{camera:?}");
            }
            // The first drag back moves at once.
            let top = orbit.camera();
            orbit.turn(DVec2::new(0.0, -direction * 10.0), 480.0);
            assert!(orbit.camera().eye.distance(top.eye) > 0.1);
        }
    }

    #[test]
    fn a_pan_keeps_the_point_under_the_cursor() {
        for (up, drag) in [(DVec3::Y, DVec2::new(31.0, -17.0)), (DVec3::new(0.3, 1.0, 0.2), DVec2::new(-80.0, 44.0))] {
            let camera = Camera { up, ..start() };
            let mut orbit = Orbit::new(&camera, UNIT);
            let from = DVec2::new(250.0, 300.0);
            let (_, _, forward) = camera.basis();
            let ray = camera.ray(from.x, from.y, 640, 480);
            // As far along the line of sight as the target.
            let point = camera.eye + ray * (camera.eye.distance(camera.target) / ray.dot(forward));
            orbit.pan(drag, 480.0);
            let moved = orbit.camera();
            let expected = moved.ray(from.x + drag.x, from.y + drag.y, 640, 480);
            assert!((point - moved.eye).normalize().distance(expected) < 1e-12);
        }
    }

    #[test]
    fn zooming_goes_to_the_target_and_back_and_stops_at_the_bounds() {
        let mut orbit = Orbit::new(&start(), UNIT);
        let distance = |orbit: &Orbit| orbit.camera().eye.distance(orbit.camera().target);
        let before = distance(&orbit);
        orbit.zoom(Scroll::Lines(1.0));
        assert!((distance(&orbit) / before - 0.9).abs() < 1e-12 && orbit.camera().target == DVec3::ZERO);
        orbit.zoom(Scroll::Pixels(-40.0));
        assert!(nearly(orbit.camera(), start()));
        orbit.zoom(Scroll::Lines(1e9));
        assert!((distance(&orbit) / 1e-3 - 1.0).abs() < 1e-9);
        orbit.zoom(Scroll::Lines(-1e9));
        assert!((distance(&orbit) / 1e3 - 1.0).abs() < 1e-9);
    }

    #[test]
    fn framing_looks_from_the_same_side_as_large_as_the_default_view() {
        let bounds = BoundingSphere { centre: DVec3::new(1.0, 2.0, 3.0), radius: 2.0 };
        let mut orbit = Orbit::new(&start(), bounds);
        orbit.turn(DVec2::new(100.0, 40.0), 480.0);
        let side = (orbit.camera().eye - orbit.camera().target).normalize();
        orbit.pan(DVec2::new(300.0, 20.0), 480.0);
        orbit.zoom(Scroll::Lines(7.0));
        for aspect in [4.0 / 3.0, 0.5] {
            orbit.frame(aspect);
            let default = Camera::framing(bounds.centre, 2.0, aspect);
            let eye = bounds.centre + side * default.eye.distance(default.target);
            assert!(nearly(orbit.camera(), Camera { eye, ..default }), "{aspect}");
        }
    }

    #[test]
    fn the_turntable_turns_once_in_its_time_about_the_vertical() {
        let mut orbit = Orbit::new(&start(), UNIT);
        let height = orbit.camera().eye.y;
        for _ in 0..1200 {
            orbit.turntable(TURNTABLE_S / 1200.0);
            assert!((orbit.camera().eye.y - height).abs() < 1e-9);
        }
        assert!(nearly(orbit.camera(), start()));
    }

    #[test]
    fn the_environment_turns_with_the_cursor() {
        assert_eq!(environment_turn_deg(480.0, 480.0), 180.0);
        assert_eq!(environment_turn_deg(1.0, 0.0), 0.0);
    }

    #[test]
    fn no_motion_however_mad_gives_a_camera_that_cannot_see() {
        const NUMBERS: [f64; 9] =
            [0.0, 1.0, -3.0, 1e300, -1e300, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MIN_POSITIVE];
        for bounds in
            [UNIT, BoundingSphere { centre: DVec3::splat(1e8), radius: 1e-8 }, BoundingSphere { radius: 1e9, ..UNIT }]
        {
            // Knuth's MMIX generator; its high bits are the good ones.
            let mut state = 1_u64;
            let mut next = || {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                (state >> 33) as usize
            };
            let mut orbit = Orbit::new(&start(), bounds);
            for _ in 0..20_000 {
                let [a, b, c] = [0; 3].map(|_| NUMBERS[next() % NUMBERS.len()]);
                let rows = if next() % 2 == 0 { 480.0 } else { c };
                match next() % 6 {
                    0 => orbit.turn(DVec2::new(a, b), rows),
                    1 => orbit.pan(DVec2::new(a, b), rows),
                    2 => orbit.zoom(Scroll::Lines(a)),
                    3 => orbit.zoom(Scroll::Pixels(a)),
                    4 => orbit.turntable(a),
                    _ => orbit.frame(if next() % 2 == 0 { 1.3 } else { a }),
                }
                orbit.camera().validate().unwrap();
            }
        }
    }
}
