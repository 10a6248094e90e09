//! Fitted threads. Twin of glsl/methods/fitted.glsl, by functions of the same names.
use std::f32::consts::PI;

use glam::{DVec3, IVec2, Mat3, Vec2, Vec3, Vec4};

use super::{CpuShader, Point, Surface, rows_around, smoothstep, turned};
use crate::brdf::{MIN_COS_THETA_D, MaterialRecord, NARROWING_COSINES};
use crate::environment::sources::clearance;
use crate::environment::{LightMap, SourceRecord};
use crate::light::{BlurredLight, finest_level};
use crate::packing::stereographic_decode;
use crate::shader_constants::fitted::{
    self, FAR, LOW_COSINE, LOW_DEVIATIONS, MOST_VIEW, OPENED_WITHIN, STEEP, VERY_FAR, WIDEST_WHOLE_RAD,
    WIDTHS_ON_THE_WAY,
};
use crate::threads::azimuths::Azimuths;
use crate::threads::fitted::kernel::{FINEST_WIDTH_RAD, level_of_variance, sharp_part, variance_of_level};
use crate::threads::fitted::{FittedTable, NEARLY_FLAT_RAD, UnpackedKernel};
use crate::threads::rim::towards_row_above;

/// Twin of `variance_of_pixel` in glsl/vmf_pyramid.glsl.
fn variance_of_pixel(normal_variance: f32) -> f32 {
    4.0 * normal_variance / (FINEST_WIDTH_RAD * FINEST_WIDTH_RAD) as f32
}

/// Twin of `level_within_pixel` in glsl/vmf_pyramid.glsl.
fn level_within_pixel(level: f32, added_variance: f32) -> f32 {
    level_of_variance(variance_of_level(level) + added_variance)
}

/// Twin of `sharp_radiance` in glsl/vmf_pyramid.glsl.
fn sharp_radiance(map: &LightMap, direction: Vec3, sources: f32) -> Vec3 {
    let mut sum = Vec3::ZERO;
    for (weight, texel) in map.corners(direction) {
        sum += weight * if texel.w > 0.0 { sources } else { 1.0 } * texel.truncate();
    }
    sum
}

fn blurred_light<'a>(twin: &'a CpuShader) -> &'a BlurredLight {
    twin.light.blurred.as_ref().expect("the method looks the blurred environment up")
}

/// Twin of `blurred_radiance` in glsl/vmf_pyramid.glsl.
fn blurred_radiance(twin: &CpuShader, direction: Vec3, level: f32, sources: f32) -> Vec3 {
    let light = blurred_light(twin);
    let finest = finest_level(&light.rest);
    let sharp = sharp_part(level, finest);
    let mut radiance = Vec3::ZERO;
    if sharp < 1.0 {
        let pyramid_level = (level - finest).max(0.0);
        radiance = (1.0 - sharp) * light.rest.levels.lookup_by(direction, pyramid_level, twin.fractions);
        if let Some(pyramid) = light.sources.as_ref().filter(|_| sources > 0.0) {
            radiance += (1.0 - sharp) * sources * pyramid.levels.lookup_by(direction, pyramid_level, twin.fractions);
        }
    }
    if sharp > 0.0 {
        let map = twin.map.as_ref().expect("fitted threads have the map");
        radiance += sharp * sharp_radiance(map, direction, sources);
    }
    radiance
}

// What Rust has in double precision.
const _: () = assert!(MIN_COS_THETA_D as f32 == fitted::MIN_COS_THETA_D);
const _: () = assert!(NEARLY_FLAT_RAD as f32 == fitted::NEARLY_FLAT_RAD);

/// A lobe, seen from w_o in the shading frame. Twin of `Lobe`.
struct Lobe<'a> {
    point: &'a Point<'a>,
    w_o: Vec3,
    mirror: Vec3,
    width: f32,
    radius: f32,
}

impl<'a> Lobe<'a> {
    /// Twin of `lobe_of`.
    fn of(point: &'a Point) -> Self {
        let w_o = point.surface.view_direction();
        let mirror = point.surface.frame * Vec3::new(-w_o.x, -w_o.y, w_o.z);
        let record = point.record();
        let [a, b, c, d, e] = NARROWING_COSINES.map(|cosine| cosine as f32);
        let (from, to) = (Vec4::new(a, b, c, d), Vec4::new(b, c, d, e));
        let way = ((from - w_o.z) / (from - to)).clamp(Vec4::ZERO, Vec4::ONE);
        let narrower = w_o.z.max(MIN_COS_THETA_D as f32) * Vec4::from(record.narrowing).dot(way).exp2();
        Self { point, w_o, mirror, width: narrower * record.lobe_width, radius: narrower * record.lobe_radius }
    }

    /// Twin of `is_isotropic`.
    fn is_isotropic(&self) -> bool {
        self.point.fitted_threads().is_some_and(|table| table.azimuths == 1)
    }

    /// Twin of `across_lobe`.
    fn across(&self, w: Vec2) -> f32 {
        if self.is_isotropic() {
            return w.length();
        }
        let record = self.point.record();
        let w = turned(w.extend(0.0), self.point.surface.phi_o).truncate();
        let axis = Vec2::from(record.long_axis);
        Vec2::new(w.dot(axis) * record.narrowness, w.dot(axis.perp())).length()
    }

    /// Twin of `half_vector`.
    fn half_vector(&self, direction: Vec3) -> (Vec2, f32) {
        let h = self.point.surface.frame.transpose() * direction + self.w_o;
        let twice_cos_theta_d = h.length().max(1e-6);
        (h.truncate() / twice_cos_theta_d, twice_cos_theta_d)
    }

    /// Twin of `half_angles`.
    fn half_angles(&self, direction: Vec3) -> [f32; 2] {
        let (h, twice_cos_theta_d) = self.half_vector(direction);
        [self.across(h), 0.5 * twice_cos_theta_d]
    }

    /// Twin of `away_from`.
    fn away(&self, direction: Vec3) -> f32 {
        if self.is_isotropic() {
            return direction.distance(self.mirror);
        }
        let (h, _) = self.half_vector(direction);
        2.0 * self.across(Vec2::new(h.x, self.w_o.z * h.y))
    }

    /// Twin of `clearance_of`.
    fn clearance(&self, source: &SourceRecord, least_width: f32) -> f32 {
        let away = self.away(source.direction.truncate());
        clearance(away, source.direction.w.max(least_width), self.radius)
    }

    /// Twin of `opens`.
    fn opens(&self, source: &SourceRecord, least_width: f32) -> bool {
        let width = source.direction.w;
        let away = self.away(source.direction.truncate());
        let is_near = away + WIDTHS_ON_THE_WAY * self.width < OPENED_WITHIN * width;
        let [sin_theta_h, cos_theta_d] = self.half_angles(source.direction.truncate());
        let &MaterialRecord { flank, dark_from, .. } = self.point.record();
        let is_on_flank = sin_theta_h * width > STEEP * flank * flank * cos_theta_d && sin_theta_h < dark_from;
        width > least_width && (is_near || is_on_flank || width > WIDEST_WHOLE_RAD)
    }

    /// Twin of `descend`.
    fn descend(&self, s: usize, sources: &[SourceRecord], least_width: f32) -> usize {
        let is_divided = |source: &&SourceRecord| source.axes[0].w > 1.0 && self.opens(source, least_width);
        s + sources[s..].iter().take_while(is_divided).count()
    }

    /// Those sources that are not taken part by part, in turn.
    fn sources<'s>(&self, sources: &'s [SourceRecord], least_width: f32) -> impl Iterator<Item = &'s SourceRecord> {
        let mut next = 0;
        std::iter::from_fn(move || {
            let s = (next < sources.len()).then(|| self.descend(next, sources, least_width))?;
            next = s + sources[s].axes[0].w as usize;
            Some(&sources[s])
        })
    }

    /// Twin of `least_clearance`.
    fn least_clearance(&self, sources: &[SourceRecord], least_width: f32) -> f32 {
        let sources = self.sources(sources, least_width);
        sources.map(|source| self.clearance(source, least_width)).fold(FAR, f32::min)
    }
}

/// Twin of `share_of_brdf`.
fn share_of_brdf(least_clearance: f32, lobe: &Lobe) -> f32 {
    smoothstep(lobe.point.record().clear, least_clearance)
}

/// Twin of `needs_subpixels`.
pub(super) fn needs_subpixels(point: &Point) -> bool {
    if point.twin.light.blurred.is_none() {
        return false;
    }
    let (sources, record, lobe) = (&point.twin.sources, point.record(), Lobe::of(point));
    let deviation = point.surface.normal_variance.sqrt();
    let most = lobe.width.min(NEARLY_FLAT_RAD as f32).max(record.shared_deviation * lobe.w_o.z);
    let view_variance = point.twin.prepared.view.view_variance();
    point.surface.normal_variance > most * most + 0.25 * view_variance
        || 0.5 * view_variance.sqrt() > MOST_VIEW * lobe.width
        || share_of_brdf(lobe.least_clearance(sources, 3.0 * 2.0 * deviation), &lobe) < 1.0
}

/// Twin of `risen`.
fn risen(z: f32, deviation: f32) -> [f32; 2] {
    let half_side = (3.0_f32.sqrt() * deviation).max(1e-6);
    if z >= half_side {
        return [z, z];
    }
    let above = (z + half_side).max(0.0);
    [above * above / (4.0 * half_side), 0.5 * above]
}

/// Twin of `Points`.
struct Points {
    last: Vec2,
    between: f32,
    weight: Vec2,
    is_stairs: bool,
}

impl Points {
    /// Twin of `points_on_square`.
    fn on_square(side: i32, sets: bool) -> Self {
        let last = Vec2::splat(0.5 * (side - 1) as f32);
        if side == 3 && !sets {
            return Self {
                last,
                between: (3.0 * 0.6_f32).sqrt(),
                weight: Vec2::new(4.0, -1.5) / 9.0,
                is_stairs: false,
            };
        }
        let between = if side == 2 && !sets { 2.0 } else { 12.0_f32.sqrt() / side as f32 };
        Self { last, between, weight: Vec2::new(1.0 / side as f32, 0.0), is_stairs: false }
    }

    /// Twin of `points_on_stairs`.
    fn on_stairs() -> Self {
        let between = 12.0_f32.sqrt() / 4.0;
        Self { last: Vec2::new(1.5, 0.0), between, weight: Vec2::new(0.5, 0.0), is_stairs: true }
    }

    /// Each point, and its weight.
    fn iter(&self) -> impl Iterator<Item = (Vec2, f32)> {
        let [columns, rows] = (2.0 * self.last + 1.0).as_ivec2().to_array();
        (0..columns * rows).map(move |i| {
            let place = IVec2::new(i % columns, i / columns).as_vec2() - self.last;
            let at = self.between * place;
            let to_side = place.x * (41.0 - 20.0 * place.x * place.x) / (6.0 * 5.0_f32.sqrt());
            let at = if self.is_stairs { at.with_y(to_side) } else { at };
            (at, (self.weight.x + self.weight.y * place.abs()).element_product())
        })
    }
}

/// What all sources are to a surface. Twin of `AtSources`.
struct AtSources {
    f_cos: Vec3,
    cosine: Vec3,
    least_clearance: f32,
}

/// Twin of `within_pixel`.
fn within_pixel(axis: Vec3, surface: &Surface) -> Vec3 {
    axis * (1.0 + 4.0 * surface.normal_variance / axis.length_squared()).sqrt()
}

impl AtSources {
    /// Twin of `add_source`.
    fn add(&mut self, source: &SourceRecord, clear: f32, lobe: &Lobe) {
        let point = lobe.point;
        let to_frame = point.surface.frame.transpose();
        let middle = to_frame * source.direction.truncate();
        let [mut x, mut y] = source.axes.map(|axis| to_frame * axis.truncate());
        let slope = Vec2::new(x.z, y.z);
        let deviation = slope.length();
        let half_side = 3.0_f32.sqrt() * deviation;
        if middle.z + half_side <= 0.0 {
            return;
        }
        let side = if clear > VERY_FAR {
            1
        } else if clear > FAR {
            2
        } else {
            3
        };
        let lowest = middle.z - half_side;
        let is_low = clear > FAR && lowest < if side == 1 { LOW_DEVIATIONS * deviation } else { LOW_COSINE };
        let points = if is_low {
            let up = slope / deviation.max(1e-6);
            [x, y] = [up.x * x + up.y * y, up.x * y - up.y * x];
            Points::on_stairs()
        } else {
            if lowest > 0.0 {
                [x, y] = [x, y].map(|axis| within_pixel(axis, &point.surface));
            }
            Points::on_square(side, lowest < 0.0)
        };
        let part_deviation = deviation / (2.0 * points.last.x + 1.0);
        for (at, weight) in points.iter() {
            let w_i = (middle + at.x * x + at.y * y).normalize();
            let [cos, above] = risen(w_i.z, part_deviation);
            if cos > 0.0 {
                let power = weight * cos * source.power.truncate();
                self.f_cos += power * point.brdf(w_i.with_z(above).normalize(), lobe.w_o);
                self.cosine += power * point.record().base.at(w_i.with_z(above).normalize().z);
            }
        }
    }
}

/// Twin of `at_sources`.
fn at_sources(lobe: &Lobe, sources: &[SourceRecord]) -> AtSources {
    let mut sum = AtSources { f_cos: Vec3::ZERO, cosine: Vec3::ZERO, least_clearance: FAR };
    let least_width = 2.0 * lobe.point.surface.normal_variance.sqrt();
    for source in lobe.sources(sources, least_width) {
        let clear = lobe.clearance(source, least_width);
        sum.least_clearance = sum.least_clearance.min(clear);
        sum.add(source, clear, lobe);
    }
    sum
}

/// Between which rows a view is. Twin of `Rows`.
struct Rows {
    index: [usize; 3],
    share: Vec3,
    weight_share: Vec3,
    side: f32,
}

impl Rows {
    /// Twin of `rows_at`.
    fn at(surface: &Surface, threads: &FittedTable) -> Self {
        let (row, [below, above]) = rows_around(surface.theta_o, threads.rows);
        let t = row.fract();
        let mut rows = Self::even(surface, threads, [below, above], t);
        let towards = towards_row_above(row, threads.rows, threads.rim_power);
        if towards != t {
            let [of_below, of_above] = [(1.0 - towards) / (1.0 - t).max(1e-6), towards / t.max(1e-6)];
            let is_above = |index: usize| index % threads.rows == above;
            rows.weight_share *= Vec3::from(rows.index.map(|index| if is_above(index) { of_above } else { of_below }));
        }
        rows
    }

    /// With weights that change evenly.
    fn even(surface: &Surface, threads: &FittedTable, [below, above]: [usize; 2], t: f32) -> Self {
        let of = |index, share, side| Self { index, share, weight_share: share, side };
        if threads.azimuths == 1 {
            return of([below, above, below], Vec3::new(1.0 - t, t, 0.0), 1.0);
        }
        let azimuths = Azimuths::around(surface.phi_o.to_angle().into(), threads.azimuths);
        let (index, share) = azimuths.triangle([below, above], t.into(), threads.rows);
        of(index, DVec3::from(share).as_vec3(), azimuths.side() as f32)
    }

    /// Twin of `kernel_at`, in the shading frame.
    fn kernel(&self, threads: &FittedTable, k: usize) -> UnpackedKernel {
        let [a, b, c] = self.index.map(|row| threads.row(row)[k].unpack());
        let ([p, q, r], [x, y, z]) = (self.share.to_array(), self.weight_share.to_array());
        UnpackedKernel {
            place: Vec2::new(1.0, self.side) * (p * a.place + q * b.place + r * c.place),
            level: p * a.level + q * b.level + r * c.level,
            weight: x * a.weight + y * b.weight + z * c.weight,
        }
    }

    /// Twin of `albedo_at`.
    fn albedo(&self, threads: &FittedTable) -> Vec3 {
        let [a, b, c] = self.index.map(|row| Vec3::from(threads.albedo[row]));
        Mat3::from_cols(a, b, c) * self.weight_share
    }
}

/// Twin of `estimate`.
///
/// # Panics
/// A scene prepared for another method has other threads.
pub(super) fn estimate(point: &Point) -> Vec3 {
    let threads = point.fitted_threads().expect("fitted threads or Gaussians are there");
    let surface = &point.surface;
    let light = blurred_light(point.twin);
    let sources = &point.twin.sources;
    let rows = Rows::at(surface, threads);
    let lobe = Lobe::of(point);
    let at = at_sources(&lobe, sources);
    let of_kernels = 1.0 - share_of_brdf(at.least_clearance, &lobe);
    let (mut weights, mut sum) = (Vec3::ZERO, Vec3::ZERO);
    for k in (point.first as usize..threads.count).step_by(point.stride) {
        let kernel = rows.kernel(threads, k);
        let level = level_within_pixel(kernel.level, variance_of_pixel(surface.normal_variance));
        let direction = surface.frame * stereographic_decode(kernel.place);
        weights += kernel.weight;
        sum += kernel.weight * blurred_radiance(point.twin, direction, level, of_kernels);
    }
    let share = point.stride as f32;
    let cosine_part = rows.albedo(threads) - share * weights;
    sum = share * sum
        + cosine_part
            * light.irradiance[point.record().base_map as usize].lookup_by(
                surface.frame.z_axis,
                0.0,
                point.twin.fractions,
            );
    sum += at.f_cos.lerp(at.cosine * cosine_part / PI, of_kernels);
    sum.max(Vec3::ZERO)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_setting_light_is_integrated_exactly_where_f_or_f_times_the_cosine_is_constant() {
        let half_side = 0.1;
        for z in [-0.12_f32, -0.1, -0.05, 0.0, 0.03, 0.09, 0.1, 0.2, 0.9] {
            let [cos, middle] = risen(z, half_side / 3.0_f32.sqrt());
            let (low, high) = ((z - half_side).max(0.0), (z + half_side).max(0.0));
            // The means of f z over a uniform z, with f = 1 and with f = 1 / z.
            let [mean, part] = [high * high - low * low, 2.0 * (high - low)].map(|sum| sum / (4.0 * half_side));
            assert!((cos - mean).abs() < 1e-6, "{z}: {cos} instead of {mean}");
            assert!(cos == 0.0 || (cos / middle - part).abs() < 1e-5, "{z}: {} instead of {part}", cos / middle);
        }
    }

    #[test]
    fn points_of_a_source_have_its_mean_its_variance_and_what_has_risen_of_it() {
        type Weighted = Vec<(Vec2, f32)>;
        let square = |side: i32, sets| -> Weighted { Points::on_square(side, sets).iter().collect() };
        let stairs: Weighted = Points::on_stairs().iter().collect();
        let mean = |points: &Weighted, value: &dyn Fn(Vec2) -> f32| -> f32 {
            points.iter().map(|&(at, weight)| weight * value(at)).sum()
        };
        for points in [square(1, false), square(2, false), square(3, false), square(3, true), stairs.clone()] {
            let first = [mean(&points, &|_| 1.0) - 1.0, mean(&points, &|at| at.x), mean(&points, &|at| at.y)];
            assert!(first.iter().all(|error| error.abs() < 1e-6), "{points:?}");
        }
        // Equal parts lack the variance within them, 1 / side^2.
        for (points, variance) in [(square(2, false), 1.0), (square(3, false), 1.0), (square(3, true), 1.0 - 1.0 / 9.0)]
        {
            for value in [mean(&points, &|at| at.x * at.x), mean(&points, &|at| at.y * at.y)] {
                assert!((value - variance).abs() < 1e-6, "{value} of {points:?}");
            }
        }
        let stairs_variances = [mean(&stairs, &|at| at.x * at.x), mean(&stairs, &|at| at.y * at.y)];
        assert!(Vec2::from(stairs_variances).abs_diff_eq(Vec2::new(1.0 - 1.0 / 16.0, 1.0), 1e-6));
        // They lean to no side.
        for (x, y) in [(1, 1), (3, 0), (2, 1), (1, 2), (0, 3)] {
            assert!(mean(&stairs, &|at| at.x.powi(x) * at.y.powi(y)).abs() < 1e-6, "x^{x} y^{y}");
        }
        // Along the way up, 1 of which is a standard deviation: parts against the whole.
        for z in [-2.0_f32, -1.7, -1.0, -0.3, 0.0, 0.4, 1.1, 1.7, 2.0] {
            let [whole, _] = risen(z, 1.0);
            let of_stairs = mean(&stairs, &|at| risen(z + at.x, 0.25)[0]);
            let of_square = mean(&square(3, true), &|at| risen(z + at.x, 1.0 / 3.0)[0]);
            assert!((of_stairs - whole).abs() < 1e-6 && (of_square - whole).abs() < 1e-6, "{z}");
        }
    }
}
