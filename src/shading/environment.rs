//! Monte Carlo with p in proportion to the environment's light. Twin of glsl/methods/environment.glsl.
use glam::Vec3;

use super::{Point, light_sampling::light_pdf};

/// Twin of `estimate`.
pub(super) fn estimate(point: &Point) -> Vec3 {
    let w_o = point.surface.view_direction();
    let mut sum = Vec3::ZERO;
    for k in point.partition() {
        let direction = point.sample_light(point.random_bits(k));
        let w_i = point.surface.frame.transpose() * direction;
        if w_i.z > 0.0 {
            let texel = point.environment_texel(direction);
            let p = light_pdf(texel, direction);
            if p > 0.0 {
                sum += point.brdf(w_i, w_o) * texel.truncate() * (w_i.z / p);
            }
        }
    }
    sum / point.sample_count() as f32
}
