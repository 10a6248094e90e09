//! The truth: equation (1) of every sub-pixel, on the CPU in double precision, with an estimate of its own error.
//!
//! The integrand is [`Environment::radiance`] times [`Brdf::evaluate`] times the cosine; nothing of threads or pyramids is in it,
//! and nothing random. The sphere is cut into cells; over each, BRDF times cosine is a polynomial through a few nodes, and
//! the integral of radiance times each polynomial is known exactly (`light`). So every pixel of the environment counts in full, and only
//! the BRDF has to be resolved: cells are split where that changes the result most, pixel by pixel, until what splitting still
//! changes is below the tolerance (`cubature`). Around mirror directions cells are split from the start until they
//! are as small as the lobe (`lobe`), so that none is missed, however narrow.
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::time::Instant;

use glam::{DMat3, DVec3, UVec2, dvec3};
use rayon::prelude::*;

use crate::brdf::{Brdf, half_vector_width};
use crate::environment::Environment;
use crate::passes::View;
use crate::pipeline::render_geometry;
use crate::prepare::Prepared;
use crate::shading::{display_value, unpack_geometry};
use crate::threads::Observer;
use crate::vulkan::Device;
use crate::{Error, Result};

mod cache;
mod cubature;
mod gpu;
mod light;
mod progressive;
#[cfg(test)]
mod tests;

use cubature::Cubature;
use light::{CellPlace, Light};
pub use progressive::{Estimate, STAGES, Stage, progressive};

/// Tolerance where none is given: a twentieth of a step of an 8-bit display value.
pub const TOLERANCE: f64 = 2e-4;
/// The same on the GPU, where each half of an error takes four times the samples: a quarter of a step.
pub const GPU_TOLERANCE: f64 = 1e-3;
/// A pixel gives up at so many cells.
const MOST_CELLS: usize = 1 << 18;
/// After so many splits of a pixel's cells, well under a millisecond, the observer is asked: a pixel may take seconds.
const SPLITS_A_LOOK: usize = 64;
/// What the view angle is held below: at 90 degrees f is 0 and no slice is left. A renderer only meets it where an
/// interpolated normal turns from the eye.
pub const MAX_THETA_O_DEG: f64 = 89.99;
/// At grazing angles lobes grow ever thinner across. Beyond this (87 degrees, a rim of 0.1 % of a sphere) cells are small enough to find
/// part of them, and what is found is split like all else.
const MIN_COS_THETA_D: f64 = 0.05;
/// What is left of a cell's error by splitting it: see the test that estimates are honest.
const ERROR_LEFT: f64 = 0.5;
/// Above display white, where display values no longer tell, linear radiance is held to 1/0.05 = 20 times the tolerance, relatively.
const ABOVE_WHITE: f64 = 0.05;

/// Where the reference is made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Processor {
    /// By quadrature in double precision; the tolerance is that of the worst pixel.
    #[default]
    Cpu,
    /// By thousands of samples of [`Method::Combined`](crate::method::Method::Combined) in single precision; the tolerance is that
    /// of the RMS over the picture. Never from the cache: fast devices are faster than it is worth.
    Gpu,
}

impl Processor {
    /// The tolerance where none is given.
    pub fn default_tolerance(self) -> f64 {
        match self {
            Self::Cpu => TOLERANCE,
            Self::Gpu => GPU_TOLERANCE,
        }
    }
}

/// How exact the reference is to be.
#[derive(Clone, Debug)]
pub struct ReferenceSettings {
    /// Largest estimated error, in display values, whose range is 1: RMS over channels.
    pub tolerance: f64,
    /// Where to make it.
    pub processor: Processor,
    /// Folder to keep results in, and to take them from.
    pub cache: Option<PathBuf>,
}

impl Default for ReferenceSettings {
    fn default() -> Self {
        Self { tolerance: TOLERANCE, processor: Processor::Cpu, cache: None }
    }
}

/// The reference picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReferenceImage {
    /// Linear radiance times coverage, and coverage, row by row from the top left: means over sub-pixels.
    pub radiance: Vec<[f32; 4]>,
    /// RMS over channels and covered pixels of the estimated error of display values.
    pub error_estimate: f64,
    /// The largest estimate of a pixel (RMS over channels); above the tolerance only where a pixel ran into the bound on its points.
    pub max_error_estimate: f64,
    /// How often the integrand was evaluated.
    pub evaluations: u64,
    /// Sub-pixels that see a surface.
    pub covered_subpixels: u64,
    /// Time it took, or takes to read from the cache.
    pub seconds: f64,
    /// Whether it came from the cache.
    pub cached: bool,
}

impl ReferenceImage {
    /// The picture with the environment behind it where `prepared` shows it; linear, RGBA.
    pub fn over_background(&self, prepared: &Prepared) -> Vec<[f32; 4]> {
        if !prepared.show_environment {
            return self.radiance.clone();
        }
        let View { camera, width, height, .. } = prepared.view;
        let to_environment = to_environment(&prepared.view);
        let pixels = self.radiance.iter().enumerate().map(|(pixel, &[r, g, b, coverage])| {
            if coverage >= 1.0 {
                return [r, g, b, coverage];
            }
            let (x, y) = (pixel as u32 % width, pixel as u32 / width);
            let ray = camera.ray(f64::from(x), f64::from(y), width, height);
            let behind = prepared.environment.radiance(to_environment * ray) * prepared.view.intensity;
            let sum = dvec3(r.into(), g.into(), b.into()) + (1.0 - f64::from(coverage)) * behind;
            sum.min(DVec3::splat(f32::MAX.into())).as_vec3().extend(1.0).to_array()
        });
        pixels.collect()
    }
}

/// `radiance` (RGBA) as a display shows it, 8 bits a channel. Twin of glsl/tone_map.comp.
pub fn tone_map(radiance: &[[f32; 4]], view: &View) -> Vec<u8> {
    let byte = |value: f32| (255.0 * value).round() as u8;
    let pixel = |&[r, g, b, alpha]: &[f32; 4]| {
        let shown =
            |value: f32| byte(if alpha > 0.0 { display_value(value / alpha, view.exposure, view.gamma) } else { 0.0 });
        [shown(r), shown(g), shown(b), byte(alpha)]
    };
    radiance.iter().flat_map(pixel).collect()
}

/// Takes directions in the world to directions in the environment's own picture.
fn to_environment(view: &View) -> DMat3 {
    DMat3::from_rotation_y(-view.rotation_deg.to_radians())
}

/// The reference of `prepared`, for the geometry that `device` rasterises. `observer` hears of rows of pixels, or of frames.
///
/// # Errors
/// Whatever Vulkan refuses; a tolerance that is not positive; cancelled.
pub fn reference(
    prepared: &Prepared,
    device: &Arc<Device>,
    settings: &ReferenceSettings,
    observer: &dyn Observer,
) -> Result<ReferenceImage> {
    if !(settings.tolerance > 0.0 && settings.tolerance.is_finite()) {
        let problem = format!("is {}", settings.tolerance);
        return Err(Error::input("tolerance", problem, format!("use a positive number, such as {TOLERANCE}")));
    }
    if settings.processor == Processor::Gpu {
        return gpu::reference_on_gpu(prepared, device, settings.cache.as_deref(), settings.tolerance, observer);
    }
    let start = Instant::now();
    let geometry = render_geometry(device, settings.cache.as_deref(), prepared)?;
    let key = cache::key(prepared, &geometry, settings.tolerance);
    if let Some(image) = settings.cache.as_deref().and_then(|folder| cache::read(folder, &key, &prepared.view)) {
        return Ok(ReferenceImage { seconds: start.elapsed().as_secs_f64(), cached: true, ..image });
    }
    let brdfs = prepared.materials.iter().map(|material| &material.brdf);
    let integrator = Integrator::new(&prepared.environment, prepared.view.intensity, brdfs, prepared.view.subpixels);
    let image = integrator.image(&prepared.view, &geometry, settings.tolerance, observer)?;
    let image = ReferenceImage { seconds: start.elapsed().as_secs_f64(), ..image };
    if let Some(folder) = &settings.cache {
        cache::write(folder, &key, &prepared.view, &image);
    }
    Ok(image)
}

/// A point to shade: its frame in the environment's axes, and its view.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    /// Columns: x, the part of w_o orthogonal to n; y = z cross x; z = n.
    frame: DMat3,
    /// Towards the eye, in that frame; at most [`MAX_THETA_O_DEG`] from z.
    w_o: DVec3,
    /// Index of the material.
    material: usize,
}

impl Point {
    /// The point of unit normal `n` seen from unit `w_o`, both in the axes of the environment.
    pub fn new(n: DVec3, w_o: DVec3, material: usize) -> Self {
        let cos_theta_o = n.dot(w_o);
        let across = w_o - cos_theta_o * n;
        let sin_theta_o = across.length();
        // Seen along the normal any axis will do; 1e-12 is ten thousand roundings, so the axis is still good to 1e-4 there.
        let x = if sin_theta_o > 1e-12 { across / sin_theta_o } else { n.any_orthonormal_vector() };
        let theta_o = sin_theta_o.atan2(cos_theta_o).min(MAX_THETA_O_DEG.to_radians());
        Self { frame: DMat3::from_cols(x, n.cross(x), n), w_o: dvec3(theta_o.sin(), 0.0, theta_o.cos()), material }
    }

    /// f(w_i, w_o) (n . w_i) per channel, in 1/sr, for unit `direction` in the axes of the environment.
    #[inline]
    fn f_cos(&self, brdf: &Brdf, direction: DVec3) -> DVec3 {
        let w_i = self.frame.transpose() * direction;
        if w_i.z > 0.0 { brdf.evaluate(w_i, self.w_o) * w_i.z } else { DVec3::ZERO }
    }

    /// Whether a lobe whose half vectors are within `width` (radians) of the normal may hide between the nodes of a cell: the
    /// cell's half vectors then spread farther than both the lobe and their distance from the normal.
    fn may_hide_lobe(&self, width: f64, place: CellPlace) -> bool {
        let w_i = self.frame.transpose() * place.middle();
        let half_vector = (w_i + self.w_o).normalize_or_zero();
        let cos_theta_d = half_vector.dot(self.w_o).max(MIN_COS_THETA_D);
        // Reflection doubles angles in the plane of incidence; across it, it shrinks them by the cosine.
        let spread = place.side() / (2.0 * cos_theta_d);
        w_i.z > -place.side() && spread > width && spread > half_vector.distance(DVec3::Z)
    }
}

/// The radiance of a pixel and what is known of its error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelEstimate {
    /// Linear radiance times coverage.
    pub radiance: DVec3,
    /// Standard error of it.
    pub radiance_error: DVec3,
    /// Standard error of the display values.
    pub display_error: DVec3,
    /// How often the integrand was evaluated.
    pub evaluations: u64,
}

/// A pixel that sees a surface.
struct Texel {
    /// Linear radiance times coverage, and coverage.
    rgba: [f32; 4],
    /// Sub-pixels that see a surface.
    points: usize,
    estimate: PixelEstimate,
}

/// How a radiance is shown, for errors to be measured in what is seen.
#[derive(Clone, Copy, Debug)]
pub struct Display {
    /// Factor on radiance.
    pub exposure: f64,
    /// Display values are radiance to the power of 1/gamma.
    pub gamma: f64,
}

impl Display {
    fn of(view: &View) -> Self {
        Self { exposure: f64::from(view.exposure), gamma: f64::from(view.gamma) }
    }

    fn value(&self, radiance: f64) -> f64 {
        (self.exposure * radiance).clamp(0.0, 1.0).powf(1.0 / self.gamma)
    }

    /// The error of a display value, from `radiance` and its standard error.
    fn error(&self, radiance: f64, error: f64) -> f64 {
        let shown = 0.5 * (self.value(radiance + error) - self.value(radiance - error));
        if self.exposure * radiance > 1.0 { shown.max(ABOVE_WHITE * error / radiance) } else { shown }
    }
}

/// Evaluates equation (1) for one environment and some materials.
pub struct Integrator<'a> {
    light: Light<'a>,
    intensity: f64,
    /// With the widths of their lobes.
    brdfs: Vec<(&'a Brdf, f64)>,
    subpixels: usize,
}

impl<'a> Integrator<'a> {
    /// For `environment` times `intensity`, materials `brdfs`, and pixels of up to `subpixels` squared points.
    pub fn new(
        environment: &'a Environment,
        intensity: f64,
        brdfs: impl IntoIterator<Item = &'a Brdf>,
        subpixels: u32,
    ) -> Self {
        let brdfs = brdfs.into_iter().map(|brdf| (brdf, half_vector_width(brdf))).collect();
        Self { light: Light::new(environment), intensity, brdfs, subpixels: (subpixels * subpixels) as usize }
    }

    /// The picture of `geometry`, texels as [`crate::pipeline::Rendering::geometry`] has them.
    ///
    /// # Errors
    /// Only [`Error::Cancelled`].
    pub fn image(
        &self,
        view: &View,
        geometry: &[[u32; 2]],
        tolerance: f64,
        observer: &dyn Observer,
    ) -> Result<ReferenceImage> {
        let start = Instant::now();
        let (width, height) = (view.width as usize, view.height as usize);
        let (evaluations, covered, rows_done) = (AtomicU64::new(0), AtomicU64::new(0), AtomicUsize::new(0));
        let row = |y: usize| -> Result<(Vec<[f32; 4]>, Vec<DVec3>)> {
            let (mut texels, mut errors) = (Vec::with_capacity(width), Vec::new());
            for x in 0..width {
                let Some(Texel { rgba, points, estimate }) = self.texel(view, geometry, [x, y], tolerance, observer)?
                else {
                    texels.push([0.0; 4]);
                    continue;
                };
                evaluations.fetch_add(estimate.evaluations, Ordering::Relaxed);
                covered.fetch_add(points as u64, Ordering::Relaxed);
                errors.push(estimate.display_error);
                texels.push(rgba);
            }
            observer.progress(rows_done.fetch_add(1, Ordering::Relaxed) + 1, height);
            Ok((texels, errors))
        };
        let rows = (0..height).into_par_iter().map(row).collect::<Result<Vec<_>>>()?;
        let errors = || rows.iter().flat_map(|(_, errors)| errors);
        let (count, squares) = errors().fold((0, 0.0), |(n, sum), error| (n + 3, sum + error.length_squared()));
        Ok(ReferenceImage {
            error_estimate: (squares / f64::from(count.max(1))).sqrt(),
            max_error_estimate: errors().fold(0.0, |most, error| rms(*error).max(most)),
            radiance: rows.iter().flat_map(|(texels, _)| texels).copied().collect(),
            evaluations: evaluations.into_inner(),
            covered_subpixels: covered.into_inner(),
            seconds: start.elapsed().as_secs_f64(),
            cached: false,
        })
    }

    /// The pixel in column `x` and row `y` of the picture of `geometry`; none where no surface is seen.
    fn texel(
        &self,
        view: &View,
        geometry: &[[u32; 2]],
        [x, y]: [usize; 2],
        tolerance: f64,
        observer: &dyn Observer,
    ) -> Result<Option<Texel>> {
        if observer.cancelled() {
            return Err(Error::Cancelled);
        }
        let points = self.points(view, geometry, x, y);
        if points.is_empty() {
            return Ok(None);
        }
        let estimate = self.observed_pixel(&points, tolerance, Display::of(view), observer)?;
        // Beyond single precision there is no picture: the brightest number stands for it.
        let [r, g, b] = estimate.radiance.to_array().map(|value| value.min(f64::from(f32::MAX)) as f32);
        let rgba = [r, g, b, points.len() as f32 / self.subpixels as f32];
        Ok(Some(Texel { rgba, points: points.len(), estimate }))
    }

    /// What the covered sub-pixels of the pixel in column `x` and row `y` see, row by row.
    pub fn points(&self, view: &View, geometry: &[[u32; 2]], x: usize, y: usize) -> Vec<Point> {
        let side = view.subpixels as usize;
        let [width, height] = view.cache_size();
        let to_environment = to_environment(view);
        let subpixels = (0..side).flat_map(|v| (0..side).map(move |u| (x * side + u, y * side + v)));
        subpixels
            .filter_map(|(u, v)| {
                let texel = geometry[v * width as usize + u];
                let (normal, material) = unpack_geometry(UVec2::from_array(texel))?;
                let w_o = -view.camera.ray(u as f64, v as f64, width, height);
                Some(Point::new(to_environment * normal.as_dvec3().normalize(), to_environment * w_o, material))
            })
            .collect()
    }

    /// The sum over `points` divided by the number of sub-pixels, to within `tolerance` as `display` shows it.
    ///
    /// # Panics
    /// With more points than sub-pixels, or of materials that are not there.
    pub fn pixel(&self, points: &[Point], tolerance: f64, display: Display) -> PixelEstimate {
        self.observed_pixel(points, tolerance, display, &()).expect("nobody cancels")
    }

    /// The same; the only error is that `observer` cancels it.
    fn observed_pixel(
        &self,
        points: &[Point],
        tolerance: f64,
        display: Display,
        observer: &dyn Observer,
    ) -> Result<PixelEstimate> {
        assert!(points.len() <= self.subpixels, "at most one point a sub-pixel");
        let f_cos =
            |direction: DVec3| points.iter().map(|point| point.f_cos(self.brdfs[point.material].0, direction)).sum();
        let must_split = |place| points.iter().any(|point| point.may_hide_lobe(self.brdfs[point.material].1, place));
        let mut cubature = Cubature::new(&self.light, f_cos, must_split);
        let scale = self.intensity / self.subpixels as f64;
        for split in 1.. {
            let radiance = scale * cubature.integral;
            let radiance_error = scale * ERROR_LEFT * cubature.squares.powf(0.5);
            let channel = |i: usize| display.error(radiance[i], radiance_error[i]);
            let display_error = DVec3::from_array([0, 1, 2].map(channel));
            // A channel matters as much as its error is seen.
            let seen = display_error / radiance_error.max(DVec3::splat(f64::MIN_POSITIVE));
            let done = rms(display_error) <= tolerance || cubature.len() >= MOST_CELLS;
            if done || !cubature.refine(seen * seen) {
                let evaluations = cubature.evaluations * points.len() as u64;
                return Ok(PixelEstimate { radiance, radiance_error, display_error, evaluations });
            }
            if split % SPLITS_A_LOOK == 0 && observer.cancelled() {
                return Err(Error::Cancelled);
            }
        }
        unreachable!("there is no end to splits")
    }
}

fn rms(channels: DVec3) -> f64 {
    (channels.length_squared() / 3.0).sqrt()
}
