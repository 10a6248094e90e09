//! The paper's threads as they are stored, uploaded and looked up. In shaders: glsl/threads/paper.glsl.
use std::f32::consts::FRAC_PI_2 as FRAC_PI_2_F32;

use glam::{DVec3, Vec4, dvec3};

use super::rim::EVEN;
use super::rows_around;

/// One incident sample in the shading frame of its row.
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Sample {
    /// Angle to the normal in radians, less than pi / 2.
    pub theta: f32,
    /// Azimuth in radians, counted from the side of w_o; -pi to pi.
    pub phi: f32,
    /// pdf in 1/sr, positive.
    pub p: f32,
}

impl Sample {
    /// The sample at unit `direction` with pdf `p`.
    pub fn new(direction: DVec3, p: f64) -> Self {
        let theta = direction.x.hypot(direction.y).atan2(direction.z) as f32;
        Self { theta, phi: direction.y.atan2(direction.x) as f32, p: p as f32 }
    }

    /// Unit direction w_i.
    pub fn direction(&self) -> DVec3 {
        let (sin_theta, cos_theta) = f64::from(self.theta).sin_cos();
        let (sin_phi, cos_phi) = f64::from(self.phi).sin_cos();
        dvec3(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta)
    }

    /// The sample as shaders have it: its direction, and the logarithm to base 2 of its pdf.
    pub fn device_vector(&self) -> Vec4 {
        self.direction().as_vec3().extend(self.p.log2())
    }

    /// Whether it is above the horizon and has a pdf.
    fn is_usable(&self) -> bool {
        (0.0..FRAC_PI_2_F32).contains(&self.theta) && self.phi.is_finite() && self.p > 0.0 && self.p.is_finite()
    }
}

/// The threads of one material: `rows` x `count` samples. Row r is for theta_o = r 90 deg / (rows - 1), the last for 89.99 degrees.
#[derive(Clone, Debug, PartialEq)]
pub struct ThreadTable {
    /// Number of view angles.
    pub rows: usize,
    /// Number of threads.
    pub count: usize,
    /// The seed it was made with.
    pub seed: u64,
    /// Name of the material, for people.
    pub material: String,
    /// How the albedo goes from the last row but one to the last: [`rim_power`](super::rim::rim_power).
    pub rim_power: f32,
    /// Directional albedo of each row, linear Rec. 709: the integral of f cos that equation (4) divides by.
    pub albedo: Vec<[f32; 3]>,
    /// Row by row: thread k of row r is `samples[r * count + k]`.
    pub samples: Vec<Sample>,
}

impl ThreadTable {
    /// The samples of `row`, one per thread.
    pub fn row(&self, row: usize) -> &[Sample] {
        &self.samples[row * self.count..][..self.count]
    }

    /// Direction and pdf of `thread` seen from `theta_o` (radians), between rows: directions blend as unit vectors (a blend of
    /// phi would break where it wraps), pdfs by their logarithm: half-way between rows a white furnace is 2 to 3 times nearer
    /// to the albedo than with a linear blend (F4). Beyond the last row that row holds.
    pub fn interpolate(&self, theta_o: f64, thread: usize) -> (DVec3, f64) {
        let (low, high, t) = rows_around(theta_o, self.rows);
        let [a, b] = [low, high].map(|row| &self.row(row)[thread]);
        let (p_a, p_b) = (f64::from(a.p), f64::from(b.p));
        (a.direction().lerp(b.direction(), t).normalize(), p_a * (p_b / p_a).powf(t))
    }

    /// The buffer of the shader. Row by row: the albedo, then the threads as [`Sample::device_vector`].
    pub fn device_elements(&self) -> Vec<[u32; 4]> {
        let row = |(row, [red, green, blue]): (usize, &[f32; 3])| {
            let albedo = Vec4::new(*red, *green, *blue, 0.0);
            std::iter::once(albedo).chain(self.row(row).iter().map(Sample::device_vector))
        };
        self.albedo.iter().enumerate().flat_map(row).map(|vector| vector.to_array().map(f32::to_bits)).collect()
    }

    /// Words of a row in a file, besides its threads.
    pub(super) const FILE_ROW_WORDS: usize = 3;

    /// The words of a file: the albedos, then theta, phi and p of each thread.
    pub(super) fn file_words(&self) -> Vec<u32> {
        let samples = self.samples.iter().flat_map(|s| [s.theta, s.phi, s.p]);
        self.albedo.as_flattened().iter().copied().chain(samples).map(f32::to_bits).collect()
    }

    /// Albedos and samples of such words. A foreign writer can get the checksum right and a number wrong.
    pub(super) fn from_file_words(of_rows: &[u32], of_threads: &[u32]) -> Result<Self, String> {
        let numbers = |words: &[u32]| -> Vec<[f32; 3]> {
            words.as_chunks().0.iter().map(|words: &[u32; 3]| words.map(f32::from_bits)).collect()
        };
        let albedo = numbers(of_rows);
        let samples: Vec<Sample> =
            numbers(of_threads).into_iter().map(|[theta, phi, p]| Sample { theta, phi, p }).collect();
        if !samples.iter().all(Sample::is_usable) {
            return Err("holds a sample below the horizon or without a pdf".into());
        }
        if !albedo.as_flattened().iter().all(|value| (0.0..=f32::MAX).contains(value)) {
            return Err("holds an albedo that is none".into());
        }
        Ok(Self { rows: 0, count: 0, seed: 0, material: String::new(), rim_power: EVEN, albedo, samples })
    }
}
