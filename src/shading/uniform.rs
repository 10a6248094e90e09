//! Monte Carlo, uniform over the hemisphere. Twin of glsl/methods/uniform.glsl.
use std::f32::consts::TAU;

use glam::{Vec2, Vec3};

use super::{Point, random::to_unit};

/// Twin of `estimate`.
pub(super) fn estimate(point: &Point) -> Vec3 {
    let w_o = point.surface.view_direction();
    let mut sum = Vec3::ZERO;
    for k in point.partition() {
        let u = to_unit(point.random_bits(k));
        let w_i = ((1.0 - u.x * u.x).sqrt() * Vec2::from_angle(TAU * u.y)).extend(u.x);
        sum += point.brdf(w_i, w_o) * point.environment_radiance(point.surface.frame * w_i) * (TAU * w_i.z);
    }
    sum / point.sample_count() as f32
}
