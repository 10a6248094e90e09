//! Fitted threads. Twin of glsl/methods/fitted.glsl, by functions of the same names.
use std::f32::consts::{FRAC_1_PI, FRAC_PI_2, SQRT_2, TAU};

use glam::{Mat3, Vec3};

use super::{Point, any_tangent};
use crate::brdf::half_vector_width;
use crate::environment::Source;
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

/// Twin of `vmf`.
fn vmf(away: f32, kappa: f32) -> f32 {
    kappa / (TAU * (1.0 - (-2.0 * kappa).exp())) * (-kappa * away).exp()
}

/// Twin of `blurred_kappa`.
fn blurred_kappa(level: f32, source_width: f32) -> f32 {
    let width = FINEST_WIDTH_RAD as f32 * level.exp2();
    1.0 / (width * width + source_width * source_width)
}

/// Twin of `kernel_at`.
fn kernel_at(direction: Vec3, level: f32, to_source: Vec3, source_width: f32) -> f32 {
    let away = 0.5 * (direction - to_source).length_squared();
    let whole = level.floor();
    let finer = vmf(away, blurred_kappa(whole, source_width));
    let coarser = vmf(away, blurred_kappa(whole + 1.0, source_width));
    finer + (level - whole) * (coarser - finer)
}

/// f cos and cos at a source. Twin of `at_source`.
fn at_source(point: &Point, to_source: Vec3, source_width: f32, w_o: Vec3) -> (Vec3, f32) {
    let x = any_tangent(to_source);
    let y = to_source.cross(x);
    let side = |offset: Vec3| {
        let w_i = (to_source + SQRT_2 * source_width * offset).normalize();
        if w_i.z > 0.0 { (point.brdf(w_i, w_o) * w_i.z, w_i.z) } else { (Vec3::ZERO, 0.0) }
    };
    let add = |sum: (Vec3, f32), side: (Vec3, f32)| (sum.0 + 0.25 * side.0, sum.1 + 0.25 * side.1);
    [x, y, -x, -y].map(side).into_iter().fold((Vec3::ZERO, 0.0), add)
}

/// Twin of `replaced`.
fn replaced(lobe_width: f32, to_source: Vec3, source_width: f32, w_o: Vec3) -> f32 {
    let mirror = Vec3::new(-w_o.x, -w_o.y, w_o.z);
    let lobe = 2.6 * lobe_width;
    let x = (((to_source.distance(mirror) + 4.0 * lobe) / (2.0 * source_width) - 1.5) / 1.5).clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

/// Twin of `estimate`.
///
/// # Panics
/// A scene prepared for another method has other threads.
pub(super) fn estimate(point: &Point) -> Vec3 {
    let Some(Threads::Fitted(threads)) = point.material().threads.as_deref() else {
        panic!("fitted threads are there")
    };
    let surface = &point.surface;
    let pyramid = point.twin.vmf_pyramid.expect("the method declares the pyramid");
    let irradiance = point.twin.irradiance.expect("the method declares the map");
    let row = (surface.theta_o * (threads.rows as f32 / FRAC_PI_2)).min((threads.rows - 1) as f32);
    let (below, t) = (row as usize, row.fract());
    let above = (below + 1).min(threads.rows - 1);
    let [a, b] = [below, above].map(|row| Vec3::from(threads.cosine_part[row]));
    let cosine_part = a.lerp(b, t);
    let w_o = surface.view_direction();
    let lobe_width = half_vector_width(&point.material().brdf) as f32;
    let to_frame: Mat3 = surface.frame.transpose();
    let mut sum = Vec3::ZERO;
    let mut sources = Vec::new();
    for &Source { direction, width_rad, power } in point.twin.sources {
        let (to_source, width, power) = (to_frame * direction.as_vec3(), width_rad as f32, power.as_vec3());
        let part = replaced(lobe_width, to_source, width, w_o);
        let (f_cos, cosine) = at_source(point, to_source, width, w_o);
        let of_cosine = cosine_part * (cosine * FRAC_1_PI);
        sum += power * of_cosine.lerp(f_cos, part);
        sources.push((to_source, width, part * power));
    }
    let finest = finest_level(pyramid.levels.face_size);
    for k in (point.first as usize..threads.count).step_by(point.stride) {
        let [a, b] = [below, above].map(|row| threads.row(row)[k].unpack());
        let direction = a.direction.lerp(b.direction, t).normalize();
        let level = level_within_pixel(a.level + t * (b.level - a.level), surface.normal_variance).max(finest);
        let mut radiance = pyramid.levels.lookup(surface.frame * direction, level - finest);
        for &(to_source, width, power) in &sources {
            radiance -= kernel_at(direction, level, to_source, width) * power;
        }
        sum += a.weight.lerp(b.weight, t) * radiance;
    }
    sum += cosine_part * irradiance.lookup(surface.frame.z_axis, 0.0);
    sum.max(Vec3::ZERO)
}
