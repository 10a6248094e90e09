//! Multiple importance sampling of lobe and light at evenly distributed points. Twin of glsl/methods/mis.glsl.
use glam::Vec3;

use super::{Point, importance_sampling::SliceRows, light_sampling::light_pdf, low_discrepancy::Stream};

/// Twin of `estimate`.
pub(super) fn estimate(point: &Point) -> Vec3 {
    let frame = point.surface.frame;
    let w_o = point.surface.view_direction();
    let rows = SliceRows::new(point.slices(), w_o, point.surface.phi_o);
    let [by_brdf, by_light] = [0, 1].map(|index| point.stream(index));
    let mut sum = Vec3::ZERO;
    for k in point.partition() {
        let [x, y, z, w] = by_brdf.bits(k);
        let drawn_by_brdf = rows.sample_brdf(w_o, [z, x, y, w]).map(|(w_i, _)| w_i);
        let drawn_by_light = frame.transpose() * point.sample_light(by_light.bits(k));
        for w_i in drawn_by_brdf.into_iter().chain([drawn_by_light]).filter(|w_i| w_i.z > 0.0) {
            let direction = frame * w_i;
            let texel = point.environment_texel(direction);
            let p = rows.brdf_pdf(w_i, w_o, (w_i + w_o).normalize()) + light_pdf(texel, direction);
            sum += point.brdf(w_i, w_o) * texel.truncate() * (w_i.z / p);
        }
    }
    sum / point.sample_count() as f32
}

impl Point<'_> {
    fn stream(&self, index: u32) -> Stream {
        let prepared = self.twin.prepared;
        Stream::new(self.subpixel / prepared.view.subpixels, index, prepared.sampling.seed)
    }
}
