//! Monte Carlo with p in proportion to f cos. Twin of glsl/methods/importance.glsl.
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
        sum += point.brdf(w_i, w_o) * (w_i.z / p) * point.environment_radiance(point.surface.frame * w_i);
    }
    sum / point.sample_count() as f32
}
