//! Pass 2 of the paper on the CPU: the twin of glsl/shade.comp and its methods, in single precision as there.
//!
//! It starts from the texels of the geometry cache, so that the two can be compared pixel by pixel. BRDFs are evaluated
//! in double precision; everything else follows the shader line by line.
use crate::brdf::Brdf;
use crate::environment::Pyramid;
use crate::passes::View;
use crate::threads::ThreadTable;
use glam::{DVec3, Mat3, UVec2, Vec2, Vec3, Vec4};
use std::f32::consts::FRAC_PI_2;

/// A point to shade: its shading frame and view angle. Twin of `Surface` in glsl/surface.glsl.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// Columns: x, the part of w_o orthogonal to n; y = z cross x; z = n.
    pub frame: Mat3,
    /// Angle between the normal and w_o in radians.
    pub theta_o: f32,
}

impl Surface {
    /// The frame at unit normal `n`, seen from unit `w_o`. Twin of `make_surface`.
    pub fn new(n: Vec3, w_o: Vec3) -> Self {
        let cos_theta_o = n.dot(w_o);
        let across = w_o - cos_theta_o * n;
        let sin_theta_o = across.length();
        // The reason for 1e-6 stands in the shader.
        let x = if sin_theta_o > 1e-6 { across / sin_theta_o } else { any_tangent(n) };
        Self { frame: Mat3::from_cols(x, n.cross(x), n), theta_o: sin_theta_o.atan2(cos_theta_o) }
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

/// The paper's estimate, equation (2), over threads `first`, `first + stride`, ... Twin of glsl/methods/paper.glsl.
pub fn paper(surface: &Surface, brdf: &Brdf, threads: &ThreadTable, light: &Pyramid, first: usize, stride: usize) -> Vec3 {
    let (m, rows) = (threads.count, threads.rows);
    let row = (surface.theta_o * (rows as f32 / FRAC_PI_2)).min((rows - 1) as f32);
    let theta_o = f64::from(row * (FRAC_PI_2 / rows as f32));
    let w_o = DVec3::new(theta_o.sin(), 0.0, theta_o.cos());
    let row_0 = row as usize;
    let row_1 = (row_0 + 1).min(rows - 1);
    let t = row - row_0 as f32;
    let mut sum = Vec3::ZERO;
    for k in (first..m).step_by(stride) {
        let [sample_0, sample_1] = [row_0, row_1].map(|row| {
            let sample = &threads.samples[row * m + k];
            sample.direction().as_vec3().extend(sample.p.log2())
        });
        let blend: Vec4 = sample_0.lerp(sample_1, t);
        let (w_i, log2_p) = (blend.truncate().normalize(), blend.w);
        let direction = surface.frame * w_i;
        let level = light.level_of((-(m as f32).log2() - log2_p).exp2(), direction);
        let radiance = light.lookup(direction, level);
        sum += brdf.evaluate(w_i.as_dvec3(), w_o).as_vec3() * radiance * (w_i.z * (-log2_p).exp2());
    }
    sum / m as f32
}

/// Linear radiance times coverage, and coverage, of the pixel that sees `texels` (row by row, sub-pixels of one pixel),
/// which is `interior` if they lie on one smooth surface. Twin of `main` in glsl/shade.comp.
pub fn shade(
    view: &View,
    pixel: UVec2,
    texels: &[UVec2],
    interior: bool,
    materials: &[(Brdf, ThreadTable)],
    light: &Pyramid,
    intensity: f32,
) -> Vec4 {
    let rays = view.camera_rays();
    let size = UVec2::new(view.width, view.height) * view.subpixels;
    let [cos, sin] = view.rotation();
    let to_environment = |d: Vec3| Vec3::new(cos * d.x - sin * d.z, d.y, sin * d.x + cos * d.z);
    let mut sum = Vec3::ZERO;
    let mut covered = 0;
    for (j, texel) in texels.iter().enumerate() {
        let Some((normal, material)) = unpack_geometry(*texel) else { continue };
        covered += 1;
        let subpixel = pixel * view.subpixels + UVec2::new(j as u32 % view.subpixels, j as u32 / view.subpixels);
        let w_o = -rays.ray((subpixel.as_vec2() + 0.5) / size.as_vec2()).normalize();
        let surface = Surface::new(to_environment(normal), to_environment(w_o));
        let (brdf, threads) = &materials[material];
        let (first, stride) = if interior { (j, texels.len()) } else { (0, 1) };
        sum += paper(&surface, brdf, threads, light, first, stride);
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
