//! The paper's estimate, equation (2). Twin of glsl/methods/paper.glsl, by functions of the same names.
use glam::{Mat3, Vec2, Vec3, Vec4};

use super::{Point, Surface, rows_around, smoothstep, turned};
use crate::shader_constants::paper::{FACING_DEG, TURNING_DEG};
use crate::tangent::tangent_along;
use crate::threads::rim::towards_row_above;
use crate::threads::{ThreadTable, Threads};

/// A frame at `n` that does not turn with w_o. Twin of `fixed_frame` in glsl/surface.glsl.
fn fixed_frame(n: Vec3, axis: Vec3) -> Mat3 {
    let x = tangent_along(axis, n);
    Mat3::from_cols(x, n.cross(x), n)
}

/// Sums of f cos / p and of f cos / p times radiance.
#[derive(Default)]
struct WeightedSum {
    weight: Vec3,
    radiance: Vec3,
}

impl WeightedSum {
    fn weighted_mean(&self) -> Vec3 {
        Vec3::select(self.weight.cmpgt(Vec3::ZERO), self.radiance / self.weight, Vec3::ZERO)
    }
}

/// Where a view lies among the rows.
struct Rows {
    below: usize,
    above: usize,
    t: f32,
    towards: f32,
}

/// The point with the threads of its material.
struct Paper<'a> {
    point: &'a Point<'a>,
    threads: &'a ThreadTable,
}

/// Twin of `estimate`.
///
/// # Panics
/// A scene prepared for another method has no threads.
pub(super) fn estimate(point: &Point) -> Vec3 {
    let Some(Threads::Paper(threads)) = point.threads() else { panic!("the paper's method has its threads") };
    Paper { point, threads }.estimate(&point.surface, point.axis)
}

impl Paper<'_> {
    fn rows_at(&self, surface: &Surface) -> Rows {
        let (row, [below, above]) = rows_around(surface.theta_o, self.threads.rows);
        let towards = towards_row_above(row, self.threads.rows, self.threads.rim_power);
        Rows { below, above, t: row.fract(), towards }
    }

    fn thread(&self, row: usize, k: usize) -> Vec4 {
        self.threads.row(row)[k].device_vector()
    }

    fn partition(&self) -> impl Iterator<Item = usize> + use<> {
        self.point.partition().map(|k| k as usize)
    }

    fn lookup_solid_angle(&self, log2_p: f32) -> f32 {
        let share_sr = (-log2_p).exp2() / self.threads.count as f32;
        let footprint_sr = 64.0 * (self.point.stride - 1) as f32 * self.point.surface.normal_variance;
        (share_sr + footprint_sr).min(share_sr * self.point.stride as f32)
    }

    fn add_term(&self, sum: &mut WeightedSum, frame: Mat3, w_i: Vec3, w_o: Vec3, log2_p: f32) {
        let radiance = self.point.filtered_radiance(frame * w_i, self.lookup_solid_angle(log2_p));
        let of_surface = self.point.surface.frame;
        let turn = Vec2::new(of_surface.x_axis.dot(frame.x_axis), of_surface.y_axis.dot(frame.x_axis));
        let weight = self.point.brdf(turned(w_i, turn), turned(w_o, turn)) * (w_i.z * (-log2_p).exp2());
        sum.weight += weight;
        sum.radiance += weight * radiance;
    }

    fn threads_following_view(&self, surface: &Surface, rows: &Rows) -> Vec3 {
        let (mut sum, w_o) = (WeightedSum::default(), surface.view_direction());
        for k in self.partition() {
            let between = self.thread(rows.below, k).lerp(self.thread(rows.above, k), rows.t);
            self.add_term(&mut sum, surface.frame, between.truncate().normalize(), w_o, between.w);
        }
        sum.weighted_mean()
    }

    fn threads_of_facing_view(&self, surface: &Surface, axis: Vec3) -> Vec3 {
        let frame = fixed_frame(surface.frame.z_axis, axis);
        let w_o = frame.transpose() * surface.w_o;
        let mut sum = WeightedSum::default();
        for k in self.partition() {
            let thread = self.thread(0, k);
            let h = (thread.truncate() + Vec3::Z).normalize();
            let cos_theta_d = w_o.dot(h);
            let w_i = 2.0 * cos_theta_d * h - w_o;
            if w_i.z > 0.0 {
                self.add_term(&mut sum, frame, w_i, w_o, thread.w + (h.z / cos_theta_d).log2());
            }
        }
        sum.weighted_mean()
    }

    fn estimate(&self, surface: &Surface, axis: Vec3) -> Vec3 {
        let rows = self.rows_at(surface);
        let following = smoothstep([FACING_DEG, TURNING_DEG].map(f32::to_radians), surface.theta_o);
        let mut mean = Vec3::ZERO;
        if following > 0.0 {
            mean += following * self.threads_following_view(surface, &rows);
        }
        if following < 1.0 {
            mean += (1.0 - following) * self.threads_of_facing_view(surface, axis);
        }
        let [below, above] = [rows.below, rows.above].map(|row| Vec3::from(self.threads.albedo[row]));
        let share = self.partition().count() as f32 / self.threads.count as f32;
        share * below.lerp(above, rows.towards) * mean
    }
}
