//! Importance sampling with filtered lookups. Twin of glsl/methods/filtered.glsl.
use glam::Vec3;

use super::{Point, importance_sampling::SliceRows};

/// Twin of `estimate`.
pub(super) fn estimate(point: &Point) -> Vec3 {
    let w_o = point.surface.view_direction();
    let rows = SliceRows::new(point.slices(), w_o, point.surface.phi_o);
    let fixed_set = point.fixed_stream();
    let mut sum = Vec3::ZERO;
    for k in point.partition() {
        let Some((w_i, p)) = rows.sample_brdf(w_o, point.sample_bits(&fixed_set, k)) else { continue };
        let solid_angle = 1.0 / (point.sample_count() as f32 * p);
        let radiance = point.filtered_radiance(point.surface.frame * w_i, solid_angle);
        sum += point.brdf(w_i, w_o) * (w_i.z / p) * radiance;
    }
    sum / point.sample_count() as f32
}
