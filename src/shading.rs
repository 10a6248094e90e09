//! Pass 2 of the paper on the CPU: the twin of glsl/shade.comp and its methods, in single precision as there.
//!
//! It starts from the texels of the geometry cache, so that the two can be compared pixel by pixel. BRDFs are evaluated
//! in double precision; everything else follows the shader line by line.
use crate::brdf::Brdf;
use crate::environment::Pyramid;
use crate::passes::{SMOOTH_DEG, View};
use crate::threads::ThreadTable;
use glam::{Mat3, UVec2, Vec2, Vec3, Vec4};
use std::f32::consts::FRAC_PI_2;

/// A point to shade: its shading frame and view angle. Twin of `Surface` in glsl/surface.glsl.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// Columns: x, the part of w_o orthogonal to n; y = z cross x; z = n.
    pub frame: Mat3,
    /// Towards the eye, unit.
    pub w_o: Vec3,
    /// Angle between the normal and w_o in radians; above 90 degrees where an interpolated normal faces away.
    pub theta_o: f32,
    /// Solid angle by which lookups grow where sub-pixels share one sum over the threads; else 0.
    pub footprint_sr: f32,
}

impl Surface {
    /// The frame at unit normal `n`, seen from unit `w_o`. Twin of `make_surface`.
    pub fn new(n: Vec3, w_o: Vec3) -> Self {
        let cos_theta_o = n.dot(w_o);
        let across = w_o - cos_theta_o * n;
        let sin_theta_o = across.length();
        // The reason for 1e-6 stands in the shader.
        let x = if sin_theta_o > 1e-6 { across / sin_theta_o } else { any_tangent(n) };
        Self {
            frame: Mat3::from_cols(x, n.cross(x), n),
            w_o,
            theta_o: sin_theta_o.atan2(cos_theta_o),
            footprint_sr: 0.0,
        }
    }
}

/// An axis orthogonal to n. Twin of `any_tangent` (Duff et al. 2017).
fn any_tangent(n: Vec3) -> Vec3 {
    let s = if n.z >= 0.0 { 1.0 } else { -1.0 };
    let a = -1.0 / (s + n.z);
    Vec3::new(1.0 + s * n.x * n.x * a, s * n.x * n.y * a, -s * n.x)
}

/// Octahedral map of a unit vector to [-1, 1]^2. Twin of `octahedral_encode` in glsl/packing.glsl.
pub fn octahedral_encode(n: Vec3) -> Vec2 {
    let n = n / (n.x.abs() + n.y.abs() + n.z.abs());
    let sign = |x: f32| if x >= 0.0 { 1.0 } else { -1.0 };
    if n.z >= 0.0 {
        Vec2::new(n.x, n.y)
    } else {
        Vec2::new((1.0 - n.y.abs()) * sign(n.x), (1.0 - n.x.abs()) * sign(n.y))
    }
}

/// The unit vector back. Twin of `octahedral_decode`.
pub fn octahedral_decode(e: Vec2) -> Vec3 {
    let z = 1.0 - e.x.abs() - e.y.abs();
    let fold = (-z).max(0.0);
    let unfold = |x: f32| if x >= 0.0 { x - fold } else { x + fold };
    Vec3::new(unfold(e.x), unfold(e.y), z).normalize()
}

/// Normal and material index of a texel of the geometry cache; `None` for the background.
/// Twin of `geometry_normal` and `geometry_material`.
pub fn unpack_geometry(texel: UVec2) -> Option<(Vec3, usize)> {
    let unpack = |bits: u32| (f32::from(bits as u16 as i16) / 32767.0).clamp(-1.0, 1.0);
    let normal = octahedral_decode(Vec2::new(unpack(texel.x), unpack(texel.x >> 16)));
    (texel.y != 0).then(|| (normal, texel.y as usize - 1))
}

/// A frame at `n` that does not turn with w_o. Twin of `fixed_frame` in glsl/surface.glsl.
fn fixed_frame(n: Vec3, axis: Vec3) -> Mat3 {
    let along = axis - axis.dot(n) * n;
    // The reason for 1e-6 stands in the shader.
    let x = if along.length_squared() > 1e-6 { along.normalize() } else { any_tangent(n) };
    Mat3::from_cols(x, n.cross(x), n)
}

/// The paper's estimate, equation (2): what glsl/methods/paper.glsl computes, by functions of the same names.
struct Paper<'a> {
    brdf: &'a Brdf,
    threads: &'a ThreadTable,
    light: &'a Pyramid,
    /// Threads `first`, `first + stride`, ...
    first: usize,
    stride: usize,
}

/// View angles between which the threads start to follow the view, as in the shader.
const FACING_DEG: f32 = 3.0;
const TURNING_DEG: f32 = 15.0;

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

/// Where a view angle lies among the rows.
struct Rows {
    below: usize,
    above: usize,
    t: f32,
    theta_o: f32,
}

impl Paper<'_> {
    fn rows_at(&self, theta_o: f32) -> Rows {
        let count = self.threads.rows;
        let row = (theta_o * (count as f32 / FRAC_PI_2)).min((count - 1) as f32);
        let below = row as usize;
        let above = (below + 1).min(count - 1);
        Rows { below, above, t: row - below as f32, theta_o: row * (FRAC_PI_2 / count as f32) }
    }

    fn thread(&self, row: usize, k: usize) -> Vec4 {
        let sample = &self.threads.row(row)[k];
        sample.direction().as_vec3().extend(sample.p.log2())
    }

    fn partition(&self) -> impl Iterator<Item = usize> + use<> {
        (self.first..self.threads.count).step_by(self.stride)
    }

    fn add_term(&self, sum: &mut WeightedSum, frame: Mat3, w_i: Vec3, w_o: Vec3, log2_p: f32, solid_angle_sr: f32) {
        let direction = frame * w_i;
        let radiance = self.light.lookup(direction, self.light.level_of(solid_angle_sr, direction));
        let weight = self.brdf.evaluate(w_i.as_dvec3(), w_o.as_dvec3()).as_vec3() * (w_i.z * (-log2_p).exp2());
        sum.weight += weight;
        sum.radiance += weight * radiance;
    }

    fn lookup_solid_angle(&self, surface: &Surface, log2_p: f32) -> f32 {
        let share_sr = (-log2_p).exp2() / self.threads.count as f32;
        (share_sr + surface.footprint_sr).min(share_sr * self.stride as f32)
    }

    fn threads_following_view(&self, surface: &Surface, rows: &Rows) -> Vec3 {
        let w_o = Vec3::new(rows.theta_o.sin(), 0.0, rows.theta_o.cos());
        let mut sum = WeightedSum::default();
        for k in self.partition() {
            let between = self.thread(rows.below, k).lerp(self.thread(rows.above, k), rows.t);
            let solid_angle_sr = self.lookup_solid_angle(surface, between.w);
            let w_i = between.truncate().normalize();
            self.add_term(&mut sum, surface.frame, w_i, w_o, between.w, solid_angle_sr);
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
                let log2_p = thread.w + (h.z / cos_theta_d).log2();
                let solid_angle_sr = self.lookup_solid_angle(surface, log2_p);
                self.add_term(&mut sum, frame, w_i, w_o, log2_p, solid_angle_sr);
            }
        }
        sum.weighted_mean()
    }

    fn estimate(&self, surface: &Surface, axis: Vec3) -> Vec3 {
        let rows = self.rows_at(surface.theta_o);
        let (from, to) = (FACING_DEG.to_radians(), TURNING_DEG.to_radians());
        let x = ((surface.theta_o - from) / (to - from)).clamp(0.0, 1.0);
        let following = x * x * (3.0 - 2.0 * x);
        let mut mean = Vec3::ZERO;
        if following > 0.0 {
            mean += following * self.threads_following_view(surface, &rows);
        }
        if following < 1.0 {
            mean += (1.0 - following) * self.threads_of_facing_view(surface, axis);
        }
        let [below, above] = [rows.below, rows.above].map(|row| Vec3::from(self.threads.albedo[row]));
        let share = self.partition().count() as f32 / self.threads.count as f32;
        share * below.lerp(above, rows.t) * mean
    }
}

/// Whether the sub-pixels of a pixel lie on one smooth surface. Twin of glsl/classify.comp.
pub fn is_interior(texels: &[UVec2]) -> bool {
    let Some((first_normal, first_material)) = texels.first().copied().and_then(unpack_geometry) else { return false };
    texels.iter().all(|texel| {
        unpack_geometry(*texel).is_some_and(|(normal, material)| {
            material == first_material && normal.dot(first_normal) >= SMOOTH_DEG.to_radians().cos()
        })
    })
}

/// Solid angle in sr by which lookups grow in a pixel of these sub-pixels. Twin of `footprint` in glsl/shade.comp, which
/// derives it.
fn footprint(texels: &[UVec2]) -> f32 {
    let sum: Vec3 = texels.iter().filter_map(|texel| unpack_geometry(*texel)).map(|(normal, _)| normal).sum();
    let count = texels.len() as f32;
    (64.0 * (count - 1.0) * (1.0 - sum.length() / count)).max(0.0)
}

/// Linear radiance times coverage, and coverage, of the pixel that sees `texels`: its sub-pixels, row by row.
/// Twin of `main` in glsl/shade.comp.
pub fn shade(
    view: &View,
    pixel: UVec2,
    texels: &[UVec2],
    materials: &[(Brdf, ThreadTable)],
    light: &Pyramid,
    intensity: f32,
) -> Vec4 {
    let rays = view.camera_rays();
    let size = UVec2::new(view.width, view.height) * view.subpixels;
    let [cos, sin] = view.rotation();
    let to_environment = |d: Vec3| Vec3::new(cos * d.x - sin * d.z, d.y, sin * d.x + cos * d.z);
    let interior = is_interior(texels);
    let footprint_sr = if interior { footprint(texels) } else { 0.0 };
    let mut sum = Vec3::ZERO;
    let mut covered = 0;
    for (j, texel) in texels.iter().enumerate() {
        let Some((normal, material)) = unpack_geometry(*texel) else { continue };
        covered += 1;
        let subpixel = pixel * view.subpixels + UVec2::new(j as u32 % view.subpixels, j as u32 / view.subpixels);
        let w_o = -rays.ray((subpixel.as_vec2() + 0.5) / size.as_vec2()).normalize();
        let surface = Surface { footprint_sr, ..Surface::new(to_environment(normal), to_environment(w_o)) };
        let (brdf, threads) = &materials[material];
        let (first, stride) = if interior { (j, texels.len()) } else { (0, 1) };
        sum += Paper { brdf, threads, light, first, stride }.estimate(&surface, to_environment(rays.right()));
    }
    if !interior {
        sum /= texels.len() as f32;
    }
    (sum * intensity).extend(covered as f32 / texels.len() as f32)
}

/// Display value in [0, 1] of linear radiance. Twin of glsl/tone_map.comp.
pub fn display_value(radiance: f32, exposure: f32, gamma: f32) -> f32 {
    (exposure * radiance).clamp(0.0, 1.0).powf(1.0 / gamma)
}
