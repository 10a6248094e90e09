//! The split sum. Twin of glsl/methods/split_sum.glsl, by functions of the same names.
use glam::Vec3;

use super::{Point, rows_around};
use crate::environment::level_of_alpha;
use crate::threads::rim::towards_row_above;
use crate::threads::split_sum::ROWS;

/// Twin of `estimate`.
pub(super) fn estimate(point: &Point) -> Vec3 {
    let surface = &point.surface;
    let split_sum = point.split_sum();
    let light = point.twin.light.prefiltered.as_ref().expect("the method looks prefiltered light up");
    let (row, rows) = rows_around(surface.theta_o, ROWS);
    let [below, above] = rows.map(|row| split_sum.albedos[row]);
    let towards = towards_row_above(row, ROWS, split_sum.rim_power);
    let [diffuse, specular] = [0, 1].map(|part| below[part].as_vec3().lerp(above[part].as_vec3(), towards));
    let w_o = surface.view_direction();
    let mirror = surface.frame * Vec3::new(-w_o.x, -w_o.y, w_o.z);
    let level = level_of_alpha(split_sum.roughness_alpha as f32);
    let bits = point.twin.fractions;
    diffuse * light.irradiance.lookup_by(surface.frame.z_axis, 0.0, bits)
        + specular * light.by_ggx.lookup_by(mirror, level, bits)
}
