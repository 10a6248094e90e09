//! Resampled importance sampling. Twin of glsl/methods/ris.glsl.
use glam::Vec3;

use super::{Point, importance_sampling::SliceRows, light_sampling::light_pdf, random::to_unit};
use crate::brdf::LUMINANCE;
use crate::shader_constants::ris::CANDIDATES;

/// Twin of `estimate`.
pub(super) fn estimate(point: &Point) -> Vec3 {
    let frame = point.surface.frame;
    let w_o = point.surface.view_direction();
    let rows = SliceRows::new(point.slices(), w_o, point.surface.phi_o);
    let mut sum = Vec3::ZERO;
    for k in point.partition() {
        let mut weight_sum = 0.0;
        let mut kept = Vec3::ZERO;
        for c in 0..CANDIDATES {
            let index = k * CANDIDATES + c;
            let bits = point.random_bits(2 * index);
            let drawn = match c % 2 {
                0 => rows.sample_brdf(w_o, bits).map(|(w_i, _)| w_i),
                _ => Some(frame.transpose() * point.sample_light(bits)).filter(|w_i| w_i.z > 0.0),
            };
            let Some(w_i) = drawn else { continue };
            let direction = frame * w_i;
            let texel = point.environment_texel(direction);
            let value = point.brdf(w_i, w_o) * texel.truncate() * w_i.z;
            let q = value.dot(LUMINANCE.as_vec3());
            let p = 0.5 * (rows.brdf_pdf(w_i, w_o, (w_i + w_o).normalize()) + light_pdf(texel, direction));
            let weight = q / p;
            weight_sum += weight;
            if weight > 0.0 && to_unit(point.random_bits(2 * index + 1)).x * weight_sum < weight {
                kept = value / q;
            }
        }
        sum += kept * (weight_sum / CANDIDATES as f32);
    }
    sum / point.sample_count() as f32
}
