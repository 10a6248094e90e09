//! The pyramid of known kernels: the environment convolved with von Mises-Fisher kernels, level by level twice as wide.
//! Fitted threads look these up. Twin: glsl/vmf_pyramid.comp, which makes it at load.
use std::f64::consts::FRAC_PI_4;
use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;

use super::cube::{coordinates, direction_of, texel_solid_angle};
use super::pyramid::Pyramid;
use super::to_dvec3;

/// Width of a level's kernel in texels of that level, in the middle of a face.
const TEXELS_A_WIDTH: f64 = 2.0;

/// Texels along the edge of a face of the level whose kernel has a width of one radian; there are no wider ones.
const WIDEST_FACE_SIZE: usize = (2.0 * TEXELS_A_WIDTH) as usize;

/// Kernels end where they have fallen to exp(-8), and beyond is 3.4e-4 of their mass; the rest is scaled to have it all.
const KERNEL_EXTENT: f64 = 8.0;

/// The environment blurred by kernels.
#[derive(Clone, Debug, PartialEq)]
pub struct VmfPyramid {
    /// Level l holds the convolution with the kernel of width [`Self::finest_width_rad`] 2^l, as a bilinear lookup returns it.
    pub levels: Pyramid,
}

/// What texels were convolved with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum BlurKernel {
    /// The texel itself.
    Box = 0,
    /// The kernel that, with the blur of a bilinear lookup, makes the level's vMF kernel.
    Vmf = 1,
    /// As the level of twice the size, and then means of 2 x 2 texels.
    Mean = 2,
}

/// How to make one map.
#[derive(Clone, Copy, Debug)]
pub struct BlurStep {
    /// The map it is made from: that of an earlier step, or none for the finest of the box-filtered pyramid.
    pub from: Option<usize>,
    /// What that was convolved with.
    pub from_kernel: BlurKernel,
    /// Texels along the edges of that one's faces.
    pub from_size: usize,
    /// Texels along the edges of its own faces.
    pub size: usize,
    /// What it is convolved with.
    pub kernel: BlurKernel,
}

impl VmfPyramid {
    /// How its maps are made for faces of `finest` texels: levels (kernel [`BlurKernel::Vmf`]) from fine to coarse, and means of 2 x 2
    /// texels of them.
    ///
    /// Level 0 is made from the box-filtered one, and each other from means of a finer level of its own: that is so smooth that nothing is
    /// lost by sampling it there, while box-filtered texels as large would no longer tell where in them a light was.
    pub fn steps(finest: usize) -> Vec<BlurStep> {
        let vmf = |from, from_kernel, from_size, size| BlurStep {
            from,
            from_kernel,
            from_size,
            size,
            kernel: BlurKernel::Vmf,
        };
        let mut steps = vec![vmf(None, BlurKernel::Box, finest, finest)];
        // Where the means of the levels so far are.
        let mut means = Vec::new();
        let mut size = finest / 2;
        while size >= WIDEST_FACE_SIZE {
            let (from, from_size) = (Some(steps.len() - 1), 2 * size);
            steps.push(BlurStep { from, from_kernel: BlurKernel::Vmf, from_size, size, kernel: BlurKernel::Mean });
            means.push((steps.len() - 1, size));
            // vMF kernels convolved are nearly vMF kernels again, the more so the narrower one of them is.
            let finer_by = match size {
                128.. => 1,
                32.. => 2,
                _ => 3,
            };
            let (from, from_size) = means[means.len().saturating_sub(finer_by)];
            steps.push(vmf(Some(from), BlurKernel::Mean, from_size, size));
            size /= 2;
        }
        steps
    }

    /// From the box-filtered pyramid of the same environment, on the CPU: slow.
    pub fn new(source: &Pyramid) -> Self {
        let mut maps: Vec<Vec<[f32; 3]>> = Vec::new();
        let steps = Self::steps(source.face_size);
        for step in &steps {
            let from = step.from.map_or(&source.levels[0], |from| &maps[from]);
            maps.push(if step.kernel == BlurKernel::Mean {
                means_of_four(from, step.size)
            } else {
                blurred(from, step)
            });
        }
        let levels = steps.iter().zip(maps).filter(|(step, _)| step.kernel == BlurKernel::Vmf).map(|(_, map)| map);
        Self { levels: Pyramid { face_size: source.face_size, levels: levels.collect() } }
    }

    /// Width of the kernel of level 0, in radians.
    pub fn finest_width_rad(&self) -> f64 {
        2.0 * TEXELS_A_WIDTH / self.levels.face_size as f64
    }
}

/// 1 - the mean cosine of a vMF kernel, 1 + 1 / kappa - coth(kappa). Mean cosines multiply under convolution.
fn vmf_deficit(kappa: f64) -> f64 {
    // Beyond 10, coth is 1 to the last bit of what is left.
    if kappa > 10.0 { 1.0 / kappa } else { 1.0 + 1.0 / kappa - 1.0 / kappa.tanh() }
}

/// kappa of the vMF kernel whose mean cosine is 1 - `deficit`.
fn kappa_of_deficit(deficit: f64) -> f64 {
    // The deficit is nearly 1 / kappa, so that this is close to a fixed point from the start.
    (0..20).fold(1.0 / deficit, |kappa, _| kappa * vmf_deficit(kappa) / deficit)
}

/// 1 - the mean cosine of what a texel of faces of `size`, around `direction`, was convolved with. Together with the tent of the
/// bilinear lookup, of variance h^2 / 6 along each axis where a box has h^2 / 12, it makes the level's vMF kernel.
fn texel_deficit(kernel: BlurKernel, size: usize, direction: DVec3) -> f64 {
    let solid_angle = texel_solid_angle(size, direction);
    if kernel == BlurKernel::Box {
        return solid_angle / 12.0;
    }
    // Means of 2 x 2 are of texels of half the size, and moved by half of that along each axis.
    let (texel, size) = if kernel == BlurKernel::Mean { (solid_angle / 4.0, 2 * size) } else { (solid_angle, size) };
    let width = 2.0 * TEXELS_A_WIDTH / size as f64;
    let tent = texel / 6.0;
    let deficit = (vmf_deficit(width.powi(-2)) - tent) / (1.0 - tent);
    if kernel == BlurKernel::Mean { deficit + texel / 4.0 * (1.0 - deficit) } else { deficit }
}

/// Means of 2 x 2 texels, faces of `size`.
fn means_of_four(source: &[[f32; 3]], size: usize) -> Vec<[f32; 3]> {
    let mean = |texel: usize| {
        let (face, row, column) = (texel / size / size, texel / size % size, texel % size);
        let at = |right, down| to_dvec3(&source[((face * size + row) * 2 + down) * 2 * size + 2 * column + right]);
        (0.25 * (at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1))).as_vec3().to_array()
    };
    (0..6 * size * size).into_par_iter().map(mean).collect()
}

/// A map, convolved from the one that `step` names.
fn blurred(source: &[[f32; 3]], step: &BlurStep) -> Vec<[f32; 3]> {
    let &BlurStep { from_kernel, from_size, size, kernel, .. } = step;
    let direction = |size: usize, texel: usize| {
        let middle = |index: usize| (index as f64 + 0.5) / size as f64;
        direction_of(texel / size / size, middle(texel % size), middle(texel / size % size))
    };
    let texels = (0..6 * from_size * from_size).into_par_iter().map(|texel| {
        let direction = direction(from_size, texel);
        (direction, texel_solid_angle(from_size, direction))
    });
    let texels: Vec<(DVec3, f64)> = texels.collect();
    let texel_of = |texel: usize| {
        let centre = direction(size, texel);
        let from = texel_deficit(from_kernel, from_size, centre);
        let kappa = kappa_of_deficit((texel_deficit(kernel, size, centre) - from) / (1.0 - from));
        let extent = f64::min(KERNEL_EXTENT / kappa, 2.0);
        let sin_cone = if extent < 1.0 { (extent * (2.0 - extent)).sqrt() } else { 1.0 };
        let (mut sum, mut weight_sum) = (DVec3::ZERO, 0.0);
        for face in 0..6 {
            let axes = coordinates(face, centre);
            let columns = cone_range(axes.x, axes.z, sin_cone, from_size);
            for row in cone_range(axes.y, axes.z, sin_cone, from_size) {
                let start = (face * from_size + row) * from_size;
                for at in start + columns.start..start + columns.end {
                    let (direction, solid_angle) = texels[at];
                    // 1 - cos as half the squared distance: exact for neighbours too.
                    let away = 0.5 * (direction - centre).length_squared();
                    if away < extent {
                        let weight = (-kappa * away).exp();
                        sum += weight * solid_angle * to_dvec3(&source[at]);
                        weight_sum += weight * solid_angle;
                    }
                }
            }
        }
        (sum / weight_sum).as_vec3().to_array()
    };
    (0..6 * size * size).into_par_iter().map(texel_of).collect()
}

/// The texels along one axis of a face that a cone reaches: of directions whose shadow in the plane of that axis and the face's own
/// is (x, z), within the angle of this sine.
fn cone_range(x: f64, z: f64, sin_cone: f64, size: usize) -> Range<usize> {
    let shadow = x.hypot(z);
    if shadow <= sin_cone {
        return 0..size;
    }
    let (middle, half_angle) = (x.atan2(z), (sin_cone / shadow).asin());
    let (low, high) = ((middle - half_angle).max(-FRAC_PI_4), (middle + half_angle).min(FRAC_PI_4));
    if low > high {
        return 0..0;
    }
    let texel = |angle: f64| 0.5 * (angle.tan() + 1.0) * size as f64;
    texel(low).floor().max(0.0) as usize..(texel(high).ceil() as usize).min(size)
}

#[cfg(test)]
mod tests {
    use super::super::tests::environment;
    use super::*;

    /// Against a sum over the pixels of the environment itself.
    #[test]
    fn a_lookup_is_the_convolution_with_the_kernel_of_its_level() {
        const TIMES: usize = 4;
        let map = environment(256, 128, |x, y| {
            let spot = if (x, y) == (70, 40) { 3000.0 } else { 0.0 };
            [1.0 + ((x * 7 + y * 3) % 13) as f32, spot, 1.0 + (x / 16 % 2) as f32]
        });
        let fine: Vec<(DVec3, f64, DVec3)> = (0..TIMES * map.height * TIMES * map.width)
            .map(|i| {
                let at = |index: usize| (index as f64 + 0.5) / TIMES as f64 - 0.5;
                let w = map.direction(at(i % (TIMES * map.width)), at(i / (TIMES * map.width)));
                (w, w.x.hypot(w.z), map.radiance(w))
            })
            .collect();
        let pyramid = VmfPyramid::new(&Pyramid::box_filtered(&map));
        let spot = map.direction(70.0, 40.0);
        for level in 0..pyramid.levels.levels.len() {
            let width = pyramid.finest_width_rad() * (level as f64).exp2();
            let kappa = width.powi(-2);
            let (mut squares, mut largest) = (DVec3::ZERO, DVec3::ZERO);
            for i in 0..40 {
                let z: f64 = 1.0 - (f64::from(i) + 0.5) / 20.0;
                let angle = f64::from(i) * 2.4;
                let anywhere = DVec3::new(angle.cos() * (1.0 - z * z).sqrt(), z, angle.sin() * (1.0 - z * z).sqrt());
                let d = if i % 2 == 0 { anywhere } else { (spot + width * anywhere).normalize() };
                let (mut sum, mut weights) = (DVec3::ZERO, 0.0);
                for &(w, solid_angle, radiance) in &fine {
                    let exponent = kappa * (w.dot(d) - 1.0);
                    if exponent > -30.0 {
                        sum += solid_angle * exponent.exp() * radiance;
                        weights += solid_angle * exponent.exp();
                    }
                }
                let error = pyramid.levels.lookup(d.as_vec3(), level as f32).as_dvec3() - sum / weights;
                squares += error * error / 40.0;
                largest = largest.max(sum / weights);
            }
            let rms = DVec3::from_array(squares.to_array().map(f64::sqrt)) / largest;
            println!("level {level}, width {width:.4}: RMS {rms:.5} of the largest");
            // A single bright pixel, half of the lookups near it, is the worst that there is.
            assert!(rms.x < 1e-3 && rms.y < 8e-3 && rms.z < 2e-3, "level {level}: {rms}");
        }
    }
}
