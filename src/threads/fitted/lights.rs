//! The lights that a fit is tested with, and how a slice answers them.
use std::f64::consts::{FRAC_1_PI, PI, TAU};
use std::sync::OnceLock;

use glam::{DVec3, dvec3};

use super::kernel::{vmf_direction, vmf_peak};
use crate::brdf::luminance;
use crate::threads::slice::{Slice, fibonacci_lattice};

/// Widths of the lights: so many, evenly spaced in their logarithm from a third of a degree, a pixel of a map of 1024 columns, to
/// where a light is as wide as the hemisphere.
pub const SCALES: usize = 8;
const NARROWEST_RAD: f64 = 0.006;
const WIDEST_RAD: f64 = 1.0;

/// Lights of a width are weighted by this power of it. Light in the world has an amplitude spectrum of about 1 / frequency; a mixture of
/// lights of unit power, evenly spread over the logarithm of width, has that with an exponent of 1.
const WIDTH_EXPONENT: f64 = 0.8;

/// Residuals count relative to the response, down to this part of the mean radiance: displays show dim things well, and in the tails of
/// lobes a bright lamp is all that there is.
const DIM_RESPONSE: f64 = 0.1;

/// A light: radiance vMF(w; direction, kappa), so of unit power.
#[derive(Clone, Copy, Debug)]
pub struct Light {
    /// Where it is, unit, in the shading frame.
    pub direction: DVec3,
    /// Which of the widths it has, 0 to [`SCALES`] - 1: see [`light_kappa`].
    pub scale: usize,
}

/// kappa of the lights of a scale.
pub fn light_kappa(scale: usize) -> f64 {
    light_width(scale).powi(-2)
}

fn light_width(scale: usize) -> f64 {
    NARROWEST_RAD * (WIDEST_RAD / NARROWEST_RAD).powf(scale as f64 / (SCALES - 1) as f64)
}

/// Lights, how strongly each counts, and what a slice makes of them.
pub struct TestLights {
    /// The lights.
    pub lights: Vec<Light>,
    /// Factor on the residual of each.
    pub weight: Vec<f64>,
    /// Irradiance over pi of each.
    pub cosine: Vec<f64>,
    /// The slice's answer to each: radiance per channel.
    pub response: Vec<DVec3>,
}

/// Points by which a slice is integrated over wide lights, and over each light.
const SLICE_POINTS: usize = 1500;
const LIGHT_POINTS: usize = 48;

impl TestLights {
    /// About `count` lights, half where `slice` has its lobes and half anywhere. `seed` turns them.
    pub fn new(slice: &Slice, count: usize, seed: usize) -> Self {
        let per_scale = count / SCALES / 2;
        let lobes = slice.lobes();
        let mut lights = Vec::with_capacity(count);
        for scale in 0..SCALES {
            // Sets of different scales, rows and seeds must not line up.
            let shift = |x: f64, by: usize| (x + 0.381_966 * by as f64).fract();
            let turn = scale + SCALES * seed;
            for uv in fibonacci_lattice(per_scale) {
                let near = lobes.direction(glam::dvec2(shift(uv.x, 3 * turn + 1), shift(uv.y, turn)));
                lights.push(Light { direction: near, scale });
            }
            for uv in fibonacci_lattice(per_scale) {
                let z = 1.0 - 2.0 * shift(uv.x, 3 * turn + 2);
                let (sin, phi) = ((1.0 - z * z).sqrt(), TAU * shift(uv.y, turn));
                lights.push(Light { direction: dvec3(sin * phi.cos(), sin * phi.sin(), z), scale });
            }
        }
        let points = SlicePoints::new(slice);
        let response: Vec<_> = lights.iter().map(|light| points.response(slice, light)).collect();
        let cosine: Vec<_> = lights.iter().map(cosine_response).collect();
        // Where nothing is reflected any weight will do.
        let albedo = luminance(slice.albedo());
        let typical = if albedo > 0.0 { albedo } else { 1.0 } / (2.0 * PI);
        let weight = lights
            .iter()
            .zip(&response)
            .map(|(light, response)| {
                let relative = luminance(*response) / typical;
                light_width(light.scale).powf(WIDTH_EXPONENT) / (typical * (relative + DIM_RESPONSE))
            })
            .collect();
        Self { lights, weight, cosine, response }
    }
}

/// Points of equal mass of a slice.
struct SlicePoints {
    /// Direction, and f cos over the density of points.
    points: Vec<(DVec3, DVec3, f64)>,
}

impl SlicePoints {
    fn new(slice: &Slice) -> Self {
        let points = slice.points(SLICE_POINTS).map(|w| {
            let f_cos = slice.f_cos(w);
            (w, f_cos, SLICE_POINTS as f64 * slice.pdf(w))
        });
        Self { points: points.collect() }
    }

    /// The integral of f cos over a light: both sets of points with the balance heuristic.
    fn response(&self, slice: &Slice, light: &Light) -> DVec3 {
        let kappa = light_kappa(light.scale);
        let peak = vmf_peak(kappa);
        let mut sum = DVec3::ZERO;
        for &(w, f_cos, density) in &self.points {
            let exponent = kappa * (w.dot(light.direction) - 1.0);
            if exponent > -30.0 {
                let radiance = peak * exponent.exp();
                sum += f_cos * radiance / (density + LIGHT_POINTS as f64 * radiance);
            }
        }
        for uv in fibonacci_lattice(LIGHT_POINTS) {
            let w = vmf_direction(light.direction, kappa, uv.x, TAU * uv.y);
            if w.z > 0.0 {
                let radiance = peak * (kappa * (w.dot(light.direction) - 1.0)).exp();
                let f_cos = slice.f_cos(w);
                let density = SLICE_POINTS as f64 * slice.pdf_of(f_cos, w);
                sum += f_cos * radiance / (density + LIGHT_POINTS as f64 * radiance);
            }
        }
        sum
    }
}

/// The integral of max(cos, 0) / pi over a light.
fn cosine_response(light: &Light) -> f64 {
    const STEPS: usize = 512;
    static TABLES: OnceLock<Vec<Vec<f64>>> = OnceLock::new();
    let tables = TABLES.get_or_init(|| {
        let table = |scale| (0..=STEPS).map(|i| cosine_integral(2.0 * i as f64 / STEPS as f64 - 1.0, scale)).collect();
        (0..SCALES).map(table).collect()
    });
    let at = (0.5 * (light.direction.z + 1.0)).clamp(0.0, 1.0) * STEPS as f64;
    let below = (at as usize).min(STEPS - 1);
    let table = &tables[light.scale];
    table[below] + (table[below + 1] - table[below]) * (at - below as f64)
}

/// That integral for a light of `scale` whose direction has this z.
fn cosine_integral(z: f64, scale: usize) -> f64 {
    let d = dvec3((1.0 - z * z).max(0.0).sqrt(), 0.0, z);
    let count = 512;
    let points = fibonacci_lattice(count).map(|uv| vmf_direction(d, light_kappa(scale), uv.x, TAU * uv.y).z.max(0.0));
    FRAC_1_PI * points.sum::<f64>() / count as f64
}
