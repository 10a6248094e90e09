//! The pyramid of known kernels: the environment convolved with von Mises-Fisher kernels, level by level twice as wide.
//! Fitted threads look these up. Twin: glsl/vmf_pyramid.comp, by which GPUs make it; processors make it here, in a fifth of the time
//! that lavapipe takes for that.
use std::ops::Range;

use glam::{DVec2, DVec3, dvec2};
use rayon::prelude::*;

use super::cube::{coordinates, direction_of, texel_solid_angle};
use super::pyramid::Pyramid;
use super::to_dvec3;
use crate::error::Result;
use crate::progress::{Observer, Parts};
use crate::shader_constants::vmf_pyramid_comp;
use crate::vector_math::exp;

/// Width of a level's kernel in texels of that level, in the middle of a face.
const TEXELS_A_WIDTH: f64 = vmf_pyramid_comp::TEXELS_A_WIDTH as f64;

/// Texels along the edge of a face of the level whose kernel has a width of one radian; there are no wider ones.
const WIDEST_FACE_SIZE: usize = (2.0 * TEXELS_A_WIDTH) as usize;

/// Kernels end where they have fallen to exp(-8), and beyond is 3.4e-4 of their mass; the rest is scaled to have it all.
const KERNEL_EXTENT: f64 = vmf_pyramid_comp::KERNEL_EXTENT as f64;

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
    Box = vmf_pyramid_comp::BOX,
    /// The kernel that, with the blur of a bilinear lookup, makes the level's vMF kernel.
    Vmf = vmf_pyramid_comp::VMF,
    /// As the level of twice the size, and then means of 2 x 2 texels.
    Mean = vmf_pyramid_comp::MEAN,
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
    /// Texels along the edge of a face of each level, where level 0 has `finest`.
    pub(super) fn sizes(finest: usize) -> Vec<usize> {
        let levels = Self::steps(finest).into_iter().filter(|step| step.kernel != BlurKernel::Mean);
        levels.map(|step| step.size).collect()
    }

    /// How its maps are made for faces of `finest` texels: levels (kernel [`BlurKernel::Vmf`]) from fine to coarse, and means of 2 x 2
    /// texels of them.
    ///
    /// Level 0 is made from the box-filtered one, and each other from means of a finer level of its own, one to three levels finer: that is so
    /// smooth that nothing is lost by sampling it there, while box-filtered texels as large would no longer tell where in them a light was.
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

    /// From the box-filtered pyramid of the same environment. `observer` hears of rows of texels.
    ///
    /// # Errors
    /// Cancelled by `observer`.
    pub fn new(source: &Pyramid, observer: &dyn Observer) -> Result<Self> {
        let mut maps: Vec<Vec<[f32; 3]>> = Vec::new();
        let steps = Self::steps(source.face_size);
        let blurs = || steps.iter().filter(|step| step.kernel == BlurKernel::Vmf);
        observer.check()?;
        let rows = Parts::new(blurs().map(|step| step.size).sum(), observer);
        for step in &steps {
            let from = step.from.map_or(&source.levels[0], |from| &maps[from]);
            maps.push(match step.kernel {
                BlurKernel::Mean => means_of_four(from, step.size),
                _ => blurred(from, step, &rows)?,
            });
        }
        let levels = steps.iter().zip(maps).filter(|(step, _)| step.kernel == BlurKernel::Vmf).map(|(_, map)| map);
        Ok(Self { levels: Pyramid { face_size: source.face_size, levels: levels.collect() } })
    }

    /// Width of the kernel of level 0, in radians.
    pub fn finest_width_rad(&self) -> f64 {
        width_rad_of(self.levels.face_size)
    }
}

/// The width of the kernel whose level has faces of this size.
pub fn width_rad_of(face_size: usize) -> f64 {
    2.0 * TEXELS_A_WIDTH / face_size as f64
}

/// 1 - the mean cosine of a vMF kernel, 1 + 1 / kappa - coth(kappa). Mean cosines multiply under convolution.
fn vmf_deficit(kappa: f64) -> f64 {
    // Beyond 10, coth is 1 to single precision.
    if kappa > 10.0 { 1.0 / kappa } else { 1.0 + 1.0 / kappa - 1.0 / kappa.tanh() }
}

/// kappa of the vMF kernel whose mean cosine is 1 - `deficit`.
fn kappa_of_deficit(deficit: f64) -> f64 {
    let kappa = 1.0 / deficit;
    // Beyond 10 kappa is the deficit's inverse; below, that is where the iteration starts.
    if kappa > 10.0 { kappa } else { (0..20).fold(kappa, |kappa, _| kappa * vmf_deficit(kappa) / deficit) }
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
    let width = width_rad_of(size);
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

/// Texels side by side that are summed over at once.
const LANES: usize = 8;

/// Texels side by side in a row of a map; those beyond its end have no solid angle.
#[derive(Clone, Copy, Default)]
struct Block {
    direction: [[f32; LANES]; 3],
    solid_angle: [f32; LANES],
    radiance: [[f32; LANES]; 3],
}

/// A map in blocks: face by face, row by row.
struct Blocks {
    size: usize,
    /// In a row.
    a_row: usize,
    all: Vec<Block>,
    /// How many of the blocks before each, and before the end, have light.
    lit_before: Vec<u32>,
}

impl Blocks {
    fn new(source: &[[f32; 3]], size: usize) -> Self {
        let a_row = size.div_ceil(LANES);
        let block = |index: usize| {
            let (row, first) = (index / a_row, index % a_row * LANES);
            let mut block = Block::default();
            for lane in 0..LANES.min(size - first) {
                let direction = texel_direction(size, row * size + first + lane);
                block.solid_angle[lane] = texel_solid_angle(size, direction) as f32;
                let radiance = source[row * size + first + lane];
                for axis in 0..3 {
                    block.direction[axis][lane] = direction[axis] as f32;
                    block.radiance[axis][lane] = radiance[axis];
                }
            }
            block
        };
        let all: Vec<_> = (0..6 * size * a_row).into_par_iter().map(block).collect();
        let mut lit_before = vec![0];
        lit_before.extend(all.iter().scan(0, |lit, block| {
            *lit += u32::from(block.radiance.as_flattened().iter().any(|&radiance| radiance != 0.0));
            Some(*lit)
        }));
        Self { size, a_row, all, lit_before }
    }

    /// Where in [`Self::all`] a row of a window on `face` is.
    #[inline(always)]
    fn place(&self, face: usize, row: usize, window: &Window) -> Range<usize> {
        let first = (face * self.size + row) * self.a_row;
        let Range { start, end } = window.blocks();
        first + start..first + end
    }

    #[inline(always)]
    fn of_row(&self, face: usize, row: usize, window: &Window) -> &[Block] {
        &self.all[self.place(face, row, window)]
    }

    fn is_dark(&self, face: usize, window: &Window) -> bool {
        let of_row = |row| self.place(face, row, window);
        window.rows.clone().map(of_row).all(|blocks| self.lit_before[blocks.start] == self.lit_before[blocks.end])
    }
}

/// A rectangle of texels on a face.
struct Window {
    rows: Range<usize>,
    columns: Range<usize>,
}

impl Window {
    /// Of those that `cone` reaches on `face`.
    fn of(cone: &Cone, face: usize, size: usize) -> Self {
        let axes = coordinates(face, cone.centre);
        let rows = cone_range(axes.y, axes.z, cone.sin, size);
        let columns = if rows.is_empty() { 0..0 } else { cone_range(axes.x, axes.z, cone.sin, size) };
        Self { rows, columns }
    }

    /// Which blocks of a row have its columns.
    #[inline(always)]
    fn blocks(&self) -> Range<usize> {
        self.columns.start / LANES..self.columns.end.div_ceil(LANES)
    }

    fn is_empty(&self) -> bool {
        self.rows.is_empty() || self.columns.is_empty()
    }

    /// Whether nothing of its cone is on other faces.
    fn is_inside(&self, size: usize) -> bool {
        let inside = |range: &Range<usize>| range.start > 0 && range.end < size;
        !self.is_empty() && inside(&self.rows) && inside(&self.columns)
    }
}

/// What a kernel fills.
struct Cone {
    centre: DVec3,
    kappa: f64,
    /// 1 - cos of its angle.
    extent: f64,
    /// Sine of its angle, and 1 beyond a right angle.
    sin: f64,
}

impl Cone {
    fn new(centre: DVec3, kappa: f64) -> Self {
        let extent = f64::min(KERNEL_EXTENT / kappa, 2.0);
        let sin = if extent < 1.0 { (extent * (2.0 - extent)).sqrt() } else { 1.0 };
        Self { centre, kappa, extent, sin }
    }
}

/// The direction of the middle of a texel, by its place in a map of faces of `size`.
fn texel_direction(size: usize, texel: usize) -> DVec3 {
    let middle = |index: usize| (index as f64 + 0.5) / size as f64;
    direction_of(texel / size / size, middle(texel % size), middle(texel / size % size))
}

/// A map, convolved from the one that `step` names.
fn blurred(source: &[[f32; 3]], step: &BlurStep, rows: &Parts) -> Result<Vec<[f32; 3]>> {
    let blocks = Blocks::new(source, step.from_size);
    let of_row = |row: usize| -> Result<_> {
        let texels = pulp::Arch::new().dispatch(BlurRow { blocks: &blocks, step, row });
        rows.advance()?;
        Ok(texels)
    };
    let of_rows: Vec<_> = (0..step.size).into_par_iter().map(of_row).collect::<Result<_>>()?;
    let faces = (0..6).flat_map(|face| of_rows.iter().flatten().map(move |texels: &[[f32; 3]; 6]| texels[face]));
    Ok(faces.collect())
}

/// A call of what makes a row of a map on all six faces, compiled for the vector instructions that are there.
struct BlurRow<'a> {
    blocks: &'a Blocks,
    step: &'a BlurStep,
    row: usize,
}

impl pulp::NullaryFnOnce for BlurRow<'_> {
    /// Texel after texel, that of each face.
    type Output = Vec<[[f32; 3]; 6]>;

    #[inline(always)]
    fn call(self) -> Self::Output {
        let &BlurStep { from_kernel, from_size, size, kernel, .. } = self.step;
        let mut weights = Vec::new();
        let mut texels = vec![[[0.0; 3]; 6]; size];
        // Loops, not closures, which would not be compiled for those instructions.
        for (column, texels) in texels.iter_mut().enumerate() {
            let centre: [DVec3; 6] =
                std::array::from_fn(|face| texel_direction(size, (face * size + self.row) * size + column));
            // All faces are alike. (F14)
            let from = texel_deficit(from_kernel, from_size, centre[0]);
            let kappa = kappa_of_deficit((texel_deficit(kernel, size, centre[0]) - from) / (1.0 - from));
            let cone = Cone::new(centre[0], kappa);
            let window = Window::of(&cone, 0, from_size);
            if !window.is_inside(from_size) {
                for face in 0..6 {
                    texels[face] = convolved(self.blocks, &Cone { centre: centre[face], ..cone }, &mut weights);
                }
            } else if (0..6).any(|face| !self.blocks.is_dark(face, &window)) {
                let sum = weigh(self.blocks, 0, &window, &cone, &mut weights);
                for (face, texel) in texels.iter_mut().enumerate() {
                    let [red, green, blue] = weighted_sum(self.blocks, face, &window, &weights);
                    *texel = [red / sum, green / sum, blue / sum];
                }
            }
        }
        texels
    }
}

/// The map of these blocks, weighed by the kernel of this cone, wherever that is (F15). `weights` is room to work in.
#[inline(always)]
fn convolved(blocks: &Blocks, cone: &Cone, weights: &mut Vec<[f32; LANES]>) -> [f32; 3] {
    let windows: [Window; 6] = std::array::from_fn(|face| Window::of(cone, face, blocks.size));
    let mut sum = 0.0;
    let mut radiance = [0.0; 3];
    if (0..6).all(|face| blocks.is_dark(face, &windows[face])) {
        return radiance;
    }
    for (face, window) in windows.iter().enumerate() {
        if window.is_empty() {
            continue;
        }
        sum += weigh(blocks, face, window, cone, weights);
        let of_face = weighted_sum(blocks, face, window, weights);
        (0..3).for_each(|channel| radiance[channel] += of_face[channel]);
    }
    radiance.map(|sum_of_radiance| sum_of_radiance / sum)
}

/// The weights that the kernel of `cone` gives the texels of a window that is not empty, row by row in whole blocks: what these have beyond
/// the window is outside the cone. Returns their sum.
#[inline(always)]
fn weigh(blocks: &Blocks, face: usize, window: &Window, cone: &Cone, weights: &mut Vec<[f32; LANES]>) -> f32 {
    let (c, kappa, extent) = (cone.centre.as_vec3(), cone.kappa as f32, cone.extent as f32);
    let a_row = window.blocks().len();
    weights.resize(window.rows.len() * a_row, [0.0; LANES]);
    let mut sums = [0.0; LANES];
    for (row, weights) in window.rows.clone().zip(weights.chunks_exact_mut(a_row)) {
        for (block, weights) in blocks.of_row(face, row, window).iter().zip(weights) {
            let [xs, ys, zs] = &block.direction;
            let mut of_block = [0.0; LANES];
            for j in 0..LANES {
                let [x, y, z] = [xs[j] - c.x, ys[j] - c.y, zs[j] - c.z];
                // 1 - cos as half the squared distance: exact for neighbours too.
                let away = 0.5 * (x * x + y * y + z * z);
                let within = if away < extent { block.solid_angle[j] } else { 0.0 };
                of_block[j] = exp(-kappa * away) * within;
            }
            for j in 0..LANES {
                sums[j] += of_block[j];
            }
            *weights = of_block;
        }
    }
    sums.iter().sum()
}

/// The sum over a window of radiance times weights, as [`weigh`] has them.
#[inline(always)]
fn weighted_sum(blocks: &Blocks, face: usize, window: &Window, weights: &[[f32; LANES]]) -> [f32; 3] {
    let [mut red, mut green, mut blue] = [[0.0; LANES]; 3];
    for (row, weights) in window.rows.clone().zip(weights.chunks_exact(window.blocks().len())) {
        for (block, weights) in blocks.of_row(face, row, window).iter().zip(weights) {
            let [reds, greens, blues] = &block.radiance;
            for j in 0..LANES {
                red[j] += weights[j] * reds[j];
                green[j] += weights[j] * greens[j];
                blue[j] += weights[j] * blues[j];
            }
        }
    }
    [red, green, blue].map(|lanes| lanes.iter().sum())
}

/// The texels along one axis of a face that a cone reaches: of directions whose shadow in the plane of that axis and the face's own
/// is (x, z), within the angle of this sine.
fn cone_range(x: f64, z: f64, sin_cone: f64, size: usize) -> Range<usize> {
    let shadow = dvec2(x, z);
    let length = shadow.length();
    if length <= sin_cone {
        return 0..size;
    }
    // The shadow of the cone is between these two directions.
    let (sin, along) = (sin_cone / length, shadow / length);
    let cos = (1.0 - sin * sin).sqrt();
    let [low, high] = [-sin, sin].map(|sin| dvec2(along.x * cos + along.y * sin, along.y * cos - along.x * sin));
    // Where on the face, from -1 to 1, if it is there.
    let place = |edge: DVec2| if edge.y > edge.x.abs() { edge.x / edge.y } else { 1f64.copysign(edge.x) };
    // Behind the face a cone may reach beyond the opposite of its axis.
    let low = if z < 0.0 && x < 0.0 { -1.0 } else { place(low) };
    let high = if z < 0.0 && x >= 0.0 { 1.0 } else { place(high) };
    if low > high {
        return 0..0;
    }
    let texel = |place: f64| 0.5 * (place + 1.0) * size as f64;
    texel(low).floor() as usize..(texel(high).ceil() as usize).min(size)
}

#[cfg(test)]
mod tests {
    use super::super::tests::environment;
    use super::*;

    /// Beside other light, where all texels are summed over, and alone, where most are dark and are not.
    #[test]
    fn lamps_alone_are_what_they_add_to_other_light() {
        let spots = [(70, 40), (71, 40), (200, 1), (5, 127), (255, 64), (128, 20)];
        let blurred = |background: f32| {
            let lit = |x, y| [background + if spots.contains(&(x, y)) { 100.0 } else { 0.0 }; 3];
            VmfPyramid::new(&Pyramid::box_filtered(&environment(256, 128, lit)), &()).unwrap().levels
        };
        let [alone, beside] = [0.0, 1.0].map(blurred);
        let mut dark = 0;
        for (alone, beside) in alone.levels.iter().flatten().zip(beside.levels.iter().flatten()) {
            assert!((alone[0] + 1.0 - beside[0]).abs() < 1e-5 * beside[0], "{alone:?} {beside:?}");
            dark += usize::from(*alone == [0.0; 3]);
        }
        assert!(dark > alone.levels[0].len() / 2, "{dark}");
    }

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
        let pyramid = VmfPyramid::new(&Pyramid::box_filtered(&map), &()).unwrap();
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
