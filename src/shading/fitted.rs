//! Fitted threads. Twin of glsl/methods/fitted.glsl, by functions of the same names.
use std::f32::consts::FRAC_PI_2;

use glam::Vec3;

use super::Point;
use crate::threads::Threads;
use crate::threads::fitted::kernel::FINEST_WIDTH_RAD;

/// Twin of `finest_level` in glsl/vmf_pyramid.glsl.
fn finest_level(face_size: usize) -> f32 {
    (1024.0 / face_size as f32).log2()
}

/// Twin of `level_within_pixel` in glsl/vmf_pyramid.glsl.
fn level_within_pixel(level: f32, normal_variance: f32) -> f32 {
    let width = FINEST_WIDTH_RAD as f32 * level.exp2();
    level + 0.5 * (1.0 + 4.0 * normal_variance / (width * width)).log2()
}

/// Twin of `estimate`.
///
/// # Panics
/// A scene prepared for another method has other threads.
pub(super) fn estimate(point: &Point) -> Vec3 {
    let Some(Threads::Fitted(threads)) = &point.material().threads else { panic!("fitted threads are there") };
    let surface = &point.surface;
    let pyramid = point.twin.vmf_pyramid.expect("the method declares the pyramid");
    let row = (surface.theta_o * (threads.rows as f32 / FRAC_PI_2)).min((threads.rows - 1) as f32);
    let (below, t) = (row as usize, row.fract());
    let above = (below + 1).min(threads.rows - 1);
    let mut sum = Vec3::ZERO;
    for k in (point.first as usize..threads.count).step_by(point.stride) {
        let [a, b] = [below, above].map(|row| threads.row(row)[k].unpack());
        let direction = surface.frame * a.direction.lerp(b.direction, t).normalize();
        let level = level_within_pixel(a.level + t * (b.level - a.level), surface.normal_variance);
        let radiance = pyramid.levels.lookup(direction, level - finest_level(pyramid.levels.face_size));
        sum += a.weight.lerp(b.weight, t) * radiance;
    }
    if point.first == 0 {
        let [a, b] = [below, above].map(|row| Vec3::from(threads.cosine_part[row]));
        sum += a.lerp(b, t) * pyramid.irradiance.lookup(surface.frame.z_axis, 0.0);
    }
    sum.max(Vec3::ZERO)
}
