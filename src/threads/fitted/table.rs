//! Fitted threads as they are stored, uploaded and looked up: twelve bytes a thread and row, sixteen on the device. In shaders:
//! glsl/threads/fitted.glsl.

use glam::{DVec3, Vec2, Vec3};
use half::f16;

use super::kernel::{Kernel, SHARPEST_LEVEL, WIDEST_LEVEL, all_between, sharp_part};
use super::row::Row;
use crate::brdf::BaseProfile;
use crate::packing::{
    STEREOGRAPHIC_EXTENT, pack_snorm_2x16, stereographic_decode, stereographic_encode, unpack_snorm_2x16,
};
use crate::threads::azimuths::Azimuths;
use crate::threads::rim::EVEN;
use crate::threads::{rows_around, theta_o};

/// A kernel in three words: direction (its place on the stereographic map, 2 x 16 bits), level and red weight, green and blue weight (half floats).
#[derive(Clone, Copy, Debug, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct PackedKernel(pub [u32; 3]);

/// A kernel as shaders see it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnpackedKernel {
    /// Where it looks in the shading frame: its place on the stereographic map of [`crate::packing`].
    pub place: Vec2,
    /// Its width: see [`super::kernel`].
    pub level: f32,
    /// Linear Rec. 709.
    pub weight: Vec3,
}

impl UnpackedKernel {
    /// Where it looks, unit, in the shading frame.
    pub fn direction(&self) -> Vec3 {
        stereographic_decode(self.place).normalize()
    }
}

impl PackedKernel {
    /// The nearest to `kernel`.
    pub fn new(kernel: &Kernel) -> Self {
        let half = |x: f64| u32::from(f16::from_f64(x.min(f64::from(f16::MAX))).to_bits());
        let place = pack_snorm_2x16(stereographic_encode(kernel.direction.as_vec3()) / STEREOGRAPHIC_EXTENT);
        let DVec3 { x: red, y: green, z: blue } = kernel.weight;
        Self([place, half(kernel.level) | half(red) << 16, half(green) | half(blue) << 16])
    }

    /// Twin of `unpack_kernel`.
    pub fn unpack(self) -> UnpackedKernel {
        let half = |bits: u32| f16::from_bits(bits as u16).to_f32();
        let [place, level_red, green_blue] = self.0;
        UnpackedKernel {
            place: STEREOGRAPHIC_EXTENT * unpack_snorm_2x16(place),
            level: half(level_red),
            weight: Vec3::new(half(level_red >> 16), half(green_blue), half(green_blue >> 16)),
        }
    }

    /// The same in double precision.
    pub(super) fn kernel(self) -> Kernel {
        let kernel = self.unpack();
        Kernel {
            direction: kernel.direction().as_dvec3(),
            level: kernel.level.into(),
            weight: kernel.weight.as_dvec3(),
        }
    }

    /// Whether its level and its weight are in their ranges.
    fn is_usable(self) -> bool {
        let UnpackedKernel { level, weight, .. } = self.unpack();
        (SHARPEST_LEVEL as f32..=WIDEST_LEVEL as f32).contains(&level)
            && weight.min_element() >= 0.0
            && weight.is_finite()
    }
}

/// The fitted threads of one material: `azimuths` x `rows` x `count` kernels. Rows of an azimuth stand as
/// those of a [`ThreadTable`](crate::threads::ThreadTable).
#[derive(Clone, Debug, PartialEq)]
pub struct FittedTable {
    /// Number of view angles.
    pub rows: usize,
    /// Number of azimuths of the view, as [`azimuth_count`](crate::threads::azimuths::azimuth_count) has it: 1 of an isotropic BRDF.
    pub azimuths: usize,
    /// Number of threads.
    pub count: usize,
    /// Number of sets of them, each of which does alone, with as many times the weights: thread k is of set k % `sets`.
    pub sets: usize,
    /// Name of the material, for people.
    pub material: String,
    /// How albedos go from the last row but one to the last: [`rim_power`](crate::threads::rim::rim_power).
    pub rim_power: f32,
    /// The profile of what takes what the threads' weights leave of the albedo.
    pub base: BaseProfile,
    /// In each row, azimuth by azimuth. What the threads' weights leave of it is the base's.
    pub albedo: Vec<[f32; 3]>,
    /// Expected error of each row, relative to the radiance under lights of all sizes.
    pub relative_error: Vec<f32>,
    /// Row by row: thread k of row r of azimuth a is `kernels[(a * rows + r) * count + k]`.
    pub kernels: Vec<PackedKernel>,
    /// As many threads in sets, for sub-pixels that do not share a sum, where whole pixels have threads of their own. It bears no name.
    pub of_subpixels: Option<Box<Self>>,
}

impl FittedTable {
    /// The threads of sub-pixels that do not share a sum.
    pub fn for_subpixels(&self) -> &Self {
        self.of_subpixels.as_deref().unwrap_or(self)
    }

    /// The same, with threads of sub-pixels' own.
    pub(super) fn with_subpixels(self, of_subpixels: Self) -> Self {
        Self { of_subpixels: Some(Box::new(of_subpixels)), ..self }
    }

    /// Itself, and the threads of sub-pixels if they are others.
    pub fn tables(&self) -> impl Iterator<Item = &Self> {
        std::iter::once(self).chain(self.of_subpixels.as_deref())
    }

    /// The kernels of `row`, one per thread; rows of the second azimuth follow those of the first.
    pub fn row(&self, row: usize) -> &[PackedKernel] {
        &self.kernels[row * self.count..][..self.count]
    }

    /// The same in the form that fits have them in.
    pub(super) fn unpacked_row(&self, row: usize) -> Vec<Kernel> {
        self.row(row).iter().map(|packed| packed.kernel()).collect()
    }

    /// The kernels for the view angle `theta_o` and its azimuth `phi_o` from the tangent (radians): between rows as shading has them, but that
    /// weights change evenly between the two last ones, too.
    pub fn seen_from(&self, theta_o: f64, phi_o: f64) -> Vec<Kernel> {
        let (low, high, t) = rows_around(theta_o, self.rows);
        if self.azimuths == 1 {
            return all_between(&self.unpacked_row(low), &self.unpacked_row(high), t);
        }
        let azimuths = Azimuths::around(phi_o, self.azimuths);
        let (rows, [of_first, of_second, of_third]) = azimuths.triangle([low, high], t, self.rows);
        let [first, second, third] = rows.map(|row| self.unpacked_row(row));
        // On the way from the first to the second, and from there to the third.
        let kernels = all_between(&first, &second, of_second / (of_first + of_second).max(f64::MIN_POSITIVE));
        let mut kernels = all_between(&kernels, &third, of_third);
        kernels.iter_mut().for_each(|kernel| kernel.direction.y *= azimuths.side());
        kernels
    }

    /// Expected error relative to the radiance, RMS over rows as a sphere shows them: sin(theta_o) cos(theta_o) of its picture each.
    pub fn mean_relative_error(&self) -> f32 {
        let rows = self.relative_error.iter().enumerate().map(|(row, error)| {
            let weight = (2.0 * theta_o(row % self.rows, self.rows)).sin() as f32;
            (weight, weight * error * error)
        });
        let (weights, squares) = rows.fold((0.0, 0.0), |(w, s), (weight, square)| (w + weight, s + square));
        // A single row, seen along the normal, has no area.
        if weights > 0.0 { (squares / weights).sqrt() } else { self.relative_error.first().copied().unwrap_or(0.0) }
    }

    /// The threads that the device has. A diffuse material has none.
    pub fn used(&self) -> UsedThreads<'_> {
        let of_thread = |thread: usize| {
            let kernels = self.kernels.iter().skip(thread).step_by(self.count).map(|kernel| kernel.unpack());
            let [mut has_weight, mut sharpest] = [0.0, f32::INFINITY];
            for kernel in kernels {
                has_weight = kernel.weight.max_element().max(has_weight);
                sharpest = kernel.level.min(sharpest);
            }
            (thread, if has_weight > 0.0 { sharpest } else { f32::INFINITY })
        };
        let of_set = |set: usize| {
            let mut threads: Vec<_> = (set..self.count).step_by(self.sets).map(of_thread).collect();
            threads.sort_by(|(_, a), (_, b)| a.total_cmp(b));
            threads
        };
        let sets: Vec<_> = (0..self.sets).map(of_set).collect();
        let mut used: Vec<_> = (0..self.count).map(|place| sets[place % self.sets][place / self.sets]).collect();
        used.truncate(used.iter().rposition(|(_, sharpest)| sharpest.is_finite()).map_or(0, |last| last + 1));
        UsedThreads { table: self, threads: used }
    }

    /// Words of a row in a file, besides its threads.
    pub(in super::super) const FILE_ROW_WORDS: usize = 4;

    /// The words of a file: albedo and relative error of each row, then the kernels; then the same of sub-pixels' own threads.
    pub(in super::super) fn file_words(&self) -> Vec<u32> {
        let rows = self.albedo.iter().zip(&self.relative_error);
        let rows = rows.flat_map(|([red, green, blue], error)| [*red, *green, *blue, *error]).map(f32::to_bits);
        let words = rows.chain(self.kernels.iter().flat_map(|kernel| kernel.0));
        words.chain(self.of_subpixels.iter().flat_map(|table| table.file_words())).collect()
    }

    /// Rows and kernels of such words. A foreign writer can get the checksum right and a number wrong.
    pub(in super::super) fn from_file_words(of_rows: &[u32], of_threads: &[u32]) -> Result<Self, String> {
        let (of_rows, kernels) = (of_rows.as_chunks::<4>().0, of_threads.as_chunks().0);
        let kernels: Vec<_> = kernels.iter().copied().map(PackedKernel).collect();
        let albedo: Vec<[f32; 3]> = of_rows.iter().map(|&[r, g, b, _]| [r, g, b].map(f32::from_bits)).collect();
        let relative_error: Vec<f32> = of_rows.iter().map(|&[.., error]| f32::from_bits(error)).collect();
        if !albedo.iter().flatten().chain(&relative_error).all(|value| (0.0..=f32::MAX).contains(value)) {
            return Err("holds a row whose albedo or error is none".into());
        }
        if !kernels.iter().all(|kernel| kernel.is_usable()) {
            return Err("holds a thread whose level or weight is none".into());
        }
        Ok(Self {
            rows: 0,
            azimuths: 0,
            count: 0,
            sets: 0,
            material: String::new(),
            rim_power: EVEN,
            base: BaseProfile::EVEN,
            albedo,
            relative_error,
            kernels,
            of_subpixels: None,
        })
    }

    /// Packs `rows`, as many for each of `azimuths`.
    pub(super) fn pack(rows: &[Row], azimuths: usize, sets: usize, rim_power: f32, base: BaseProfile) -> Self {
        let kernels: Vec<_> = rows.iter().flat_map(|row| row.kernels.iter().map(PackedKernel::new)).collect();
        Self {
            rows: rows.len() / azimuths,
            azimuths,
            count: rows.first().map_or(0, |row| row.kernels.len()),
            sets,
            material: String::new(),
            rim_power,
            base,
            albedo: rows.iter().map(|row| row.albedo.as_vec3().to_array()).collect(),
            relative_error: rows.iter().map(|row| row.relative_error as f32).collect(),
            kernels,
            of_subpixels: None,
        }
    }
}

/// The threads of a table in the order of the device. In each set those that have weight in some row are first, and of these the sharpest;
/// what follows the last that has weight in any set is left out.
pub struct UsedThreads<'a> {
    table: &'a FittedTable,
    /// With the sharpest level that each has in any row; an infinite one of those without weight.
    threads: Vec<(usize, f32)>,
}

impl UsedThreads<'_> {
    /// How many there are.
    pub fn count(&self) -> usize {
        self.threads.len()
    }

    /// How many of them, up to the last one that does, look up the environment as it is in some row, where its pyramid begins at `level`.
    pub fn sharp_count(&self, level: f32) -> usize {
        let is_sharp = |&(_, sharpest): &(usize, f32)| sharpest.is_finite() && sharp_part(sharpest, level) > 0.0;
        self.threads.iter().rposition(is_sharp).map_or(0, |last| last + 1)
    }

    /// The view angle in radians, that of a row, up to which none of them does; none if none ever does.
    pub fn sharp_from(&self, level: f32) -> Option<f64> {
        let FittedTable { rows, azimuths, .. } = *self.table;
        let is_sharp = |thread: &(usize, f32), row: usize| {
            thread.1.is_finite() && sharp_part(self.table.row(row)[thread.0].unpack().level, level) > 0.0
        };
        let of_angle = |row: &usize| {
            (0..azimuths).any(|azimuth| self.threads.iter().any(|thread| is_sharp(thread, azimuth * rows + row)))
        };
        (0..rows).find(of_angle).map(|first| theta_o(first.saturating_sub(1), rows))
    }

    /// The buffer of the shader. Azimuth by azimuth: the albedo of each row, then thread by thread its kernels of all rows.
    pub fn device_elements(&self) -> Vec<[u32; 4]> {
        let FittedTable { rows, azimuths, .. } = *self.table;
        let of_azimuth = |azimuth: usize| {
            let rows = azimuth * rows..(azimuth + 1) * rows;
            let albedos = self.table.albedo[rows.clone()].iter().map(|albedo| albedo.map(f32::to_bits));
            let kernels_of = move |thread: usize| rows.clone().map(move |row| self.table.row(row)[thread].0);
            albedos.chain(self.threads.iter().flat_map(move |&(thread, _)| kernels_of(thread)))
        };
        (0..azimuths).flat_map(of_azimuth).map(|[x, y, z]| [x, y, z, 0]).collect()
    }
}
