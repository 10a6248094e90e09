//! The truth: equation (1) of every sub-pixel, on the CPU in double precision, with an estimate of its own error.
//!
//! The integrand is [`Environment::radiance`] times [`Brdf::evaluate`] times the cosine; nothing of threads or pyramids is in it,
//! and nothing random. The sphere is cut into cells; over each, BRDF times cosine is a polynomial through a few nodes, and
//! the integral of radiance times each polynomial is known exactly (`light`). So every pixel of the environment counts in full, and only
//! the BRDF has to be resolved: cells are split where that changes the result most, pixel by pixel, until what splitting still
//! changes is below the tolerance (`cubature`). Where a lobe may be, cells are split from the start until they are
//! as small as it is narrow (`lobe`), so that none is missed.
//!
//! [`Environment::radiance`]: crate::environment::Environment::radiance
//! [`Brdf::evaluate`]: crate::brdf::Brdf::evaluate
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use glam::{DVec3, UVec2, dvec3};
use rayon::prelude::*;

use crate::evaluate::metrics::Display;
use crate::geometry_texel::GeometryTexel;
use crate::memo::{Origin, Round, Step};
use crate::passes::View;
use crate::pipeline::render_geometry;
use crate::prepare::Prepared;
use crate::progress::{Observer, Parts};
use crate::rendering::Rendering;
use crate::shading::display_value;
use crate::vulkan::Device;
use crate::{Error, Result};

mod cubature;
mod gpu;
mod integrator;
mod light;
mod lobe;
mod progressive;
mod step;
#[cfg(test)]
mod tests;

use integrator::rms;
pub use integrator::{Integrator, PixelEstimate, Point};
pub use progressive::{Estimate, Refinement, STAGES, progressive};
pub use step::parse;

/// Tolerance where none is given: a twentieth of a step of an 8-bit display value.
pub const TOLERANCE: f64 = 2e-4;
/// The same on the GPU, where each half of an error takes four times the samples: a quarter of a step.
pub const GPU_TOLERANCE: f64 = 1e-3;
/// Where the reference is made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Processor {
    /// By quadrature in double precision; the tolerance is that of the worst pixel.
    #[default]
    Cpu,
    /// By thousands of samples of [`Method::Mis`](crate::method::Method::Mis) in single precision; the tolerance is that
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
}

impl Default for ReferenceSettings {
    fn default() -> Self {
        Self { tolerance: TOLERANCE, processor: Processor::Cpu }
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
        let to_environment = prepared.view.to_environment();
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

impl ReferenceImage {
    /// It as the other methods' results are.
    pub fn rendering(&self, prepared: &Prepared) -> Rendering {
        let radiance = self.over_background(prepared);
        let mut rendering = Rendering {
            display: tone_map(&radiance, &prepared.view),
            radiance,
            lookups: self.evaluations,
            frame_ms: self.seconds * 1e3,
            ..Rendering::default()
        };
        rendering.counters.covered_subpixels = self.covered_subpixels as u32;
        rendering
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

/// The reference of `prepared`, for the geometry that `device` rasterises. The observer of `round` hears of rows of pixels, or of frames.
///
/// # Errors
/// Whatever Vulkan refuses; a tolerance that is not positive; cancelled.
pub fn reference(
    prepared: &Prepared,
    device: &Arc<Device>,
    settings: &ReferenceSettings,
    round: &Round,
) -> Result<ReferenceImage> {
    if !(settings.tolerance > 0.0 && settings.tolerance.is_finite()) {
        let problem = format!("is {}", settings.tolerance);
        return Err(Error::input("tolerance", problem, format!("use a positive number, such as {TOLERANCE}")));
    }
    if settings.processor == Processor::Gpu {
        return gpu::reference_on_gpu(prepared, device, settings.tolerance, round);
    }
    let start = Instant::now();
    let geometry = render_geometry(device, prepared, round)?;
    let image = round.ask(&step::Integrate { prepared, geometry: &geometry, tolerance: settings.tolerance })?;
    let cached = round.asked(step::Integrate::NAME).last().is_some_and(|asked| asked.origin != Origin::Made);
    Ok(ReferenceImage { seconds: start.elapsed().as_secs_f64(), cached, ..(*image).clone() })
}

/// A pixel that sees a surface.
pub(super) struct Texel {
    /// Linear radiance times coverage, and coverage.
    pub(super) rgba: [f32; 4],
    /// Sub-pixels that see a surface.
    points: usize,
    estimate: PixelEstimate,
}

impl Integrator<'_> {
    /// The picture of `geometry`, texels as [`crate::rendering::Rendering::geometry`] has them.
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
        let (evaluations, covered) = (AtomicU64::new(0), AtomicU64::new(0));
        let rows_done = Parts::new(height, observer);
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
            rows_done.advance()?;
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
    pub(super) fn texel(
        &self,
        view: &View,
        geometry: &[[u32; 2]],
        [x, y]: [usize; 2],
        tolerance: f64,
        observer: &dyn Observer,
    ) -> Result<Option<Texel>> {
        observer.check()?;
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
        let to_environment = view.to_environment();
        let subpixels = (0..side).flat_map(|v| (0..side).map(move |u| (x * side + u, y * side + v)));
        subpixels
            .filter_map(|(u, v)| {
                let texel = geometry[v * width as usize + u];
                let GeometryTexel { normal, tangent, material } = GeometryTexel::unpack(UVec2::from_array(texel))?;
                let w_o = -view.camera.ray(u as f64, v as f64, width, height);
                let point = Point::new(to_environment * normal.as_dvec3().normalize(), to_environment * w_o, material);
                Some(tangent.map_or(point, |tangent| point.with_tangent(to_environment * tangent.as_dvec3())))
            })
            .collect()
    }
}
