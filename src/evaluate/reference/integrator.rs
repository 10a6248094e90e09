//! Equation (1) for one pixel: the sum over the points that its sub-pixels see, and an estimate of its error.
use std::f64::consts::FRAC_1_SQRT_2;

use glam::{DMat3, DVec3, dvec3};

use super::cubature::Cubature;
use super::light::{CellPlace, Light};
use super::lobe::Lobe;
use crate::Result;
use crate::brdf::{Brdf, MAX_THETA_O_DEG};
use crate::environment::Environment;
use crate::evaluate::metrics::Display;
use crate::prepare::Prepared;
use crate::progress::Observer;

/// A pixel gives up at so many cells.
const MOST_CELLS: usize = 1 << 18;
/// After so many splits of a pixel's cells, well under a millisecond, the observer is asked: a pixel may take seconds.
const SPLITS_A_LOOK: usize = 64;
/// What is left of a cell's error by splitting it: see the test that estimates are honest.
const ERROR_LEFT: f64 = 0.5;
/// Cells that a horizon crosses are split down to this level, of 1.4 degrees, if they hold more than this part of all light: a lamp that sets
/// may be between nodes that do not see it. What is missed of cells with less light is small, and of many it is seldom missed the same way.
const HORIZON_LEVEL: u32 = 7;
const MUCH_LIGHT: f64 = 0.01;
/// Above display white, where display values no longer tell, linear radiance is held to 1/0.05 = 20 times the tolerance, relatively.
const ABOVE_WHITE: f64 = 0.05;

/// A point to shade: its frame in the environment's axes, and its view.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    /// Columns: x, the tangent, or without one the part of w_o orthogonal to n; y = z cross x; z = n.
    pub(super) frame: DMat3,
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

    /// The same of an anisotropic material, with what of `tangent` is orthogonal to the normal as its tangent.
    pub fn with_tangent(self, tangent: DVec3) -> Self {
        let n = self.frame.z_axis;
        let Some(x) = (tangent - tangent.dot(n) * n).try_normalize() else { return self };
        let frame = DMat3::from_cols(x, n.cross(x), n);
        Self { frame, w_o: frame.transpose() * (self.frame * self.w_o), ..self }
    }

    /// Adds f(w_i, w_o) (n . w_i) per channel, in 1/sr, for unit `directions` in the axes of the environment.
    fn add_f_cos(&self, brdf: &Brdf, directions: &[DVec3], sums: &mut [DVec3]) {
        let to_local = self.frame.transpose();
        let (mut w_i, mut places) = (Vec::with_capacity(directions.len()), Vec::with_capacity(directions.len()));
        for (place, direction) in directions.iter().enumerate() {
            let direction = to_local * *direction;
            if direction.z > 0.0 {
                w_i.push(direction);
                places.push(place);
            }
        }
        for ((place, w_i), f) in places.into_iter().zip(&w_i).zip(brdf.evaluate_all(&w_i, self.w_o)) {
            sums[place] += f * w_i.z;
        }
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

impl Display {
    /// The error of a display value, from `radiance` and its standard error.
    pub(super) fn error(&self, radiance: f64, error: f64) -> f64 {
        let shown = 0.5 * (self.value(radiance + error) - self.value(radiance - error));
        if self.exposure * radiance > 1.0 { shown.max(ABOVE_WHITE * error / radiance) } else { shown }
    }
}

/// Evaluates equation (1) for one environment and some materials.
pub struct Integrator<'a> {
    light: Light<'a>,
    intensity: f64,
    brdfs: Vec<(&'a Brdf, Lobe)>,
    pub(super) subpixels: usize,
}

impl<'a> Integrator<'a> {
    /// For the light and the materials of `prepared`.
    pub fn of(prepared: &'a Prepared) -> Self {
        let Prepared { view, environment, materials, .. } = prepared;
        Self::new(environment, view.intensity, materials.iter().map(|material| &*material.brdf), view.subpixels)
    }

    /// For `environment` times `intensity`, materials `brdfs`, and pixels of up to `subpixels` squared points.
    pub fn new(
        environment: &'a Environment,
        intensity: f64,
        brdfs: impl IntoIterator<Item = &'a Brdf>,
        subpixels: u32,
    ) -> Self {
        let brdfs = brdfs.into_iter().map(|brdf| (brdf, Lobe::of(brdf))).collect();
        Self { light: Light::new(environment), intensity, brdfs, subpixels: (subpixels * subpixels) as usize }
    }

    /// The sum over `points` divided by the number of sub-pixels, to within `tolerance` as `display` shows it.
    ///
    /// # Panics
    /// With more points than sub-pixels, or of materials that are not there.
    pub fn pixel(&self, points: &[Point], tolerance: f64, display: Display) -> PixelEstimate {
        self.observed_pixel(points, tolerance, display, &()).expect("nobody cancels")
    }

    /// The same; the only error is that `observer` cancels it.
    pub(super) fn observed_pixel(
        &self,
        points: &[Point],
        tolerance: f64,
        display: Display,
        observer: &dyn Observer,
    ) -> Result<PixelEstimate> {
        assert!(points.len() <= self.subpixels, "at most one point a sub-pixel");
        let f_cos = |directions: &[DVec3]| {
            let mut sums = vec![DVec3::ZERO; directions.len()];
            points.iter().for_each(|point| point.add_f_cos(self.brdfs[point.material].0, directions, &mut sums));
            sums
        };
        let lobes: Vec<_> = points.iter().map(|point| self.brdfs[point.material].1.seen_from(point.w_o)).collect();
        let may_hide_lobe = |place: CellPlace| {
            let (middle, half_edges) = (place.middle(), place.half_edges());
            points.iter().zip(&lobes).any(|(point, lobe)| {
                let to_local = point.frame.transpose();
                lobe.may_hide(to_local * middle, half_edges.map(|edge| to_local * edge))
            })
        };
        let has_horizon = |place: CellPlace| {
            let (middle, reach) = (place.middle(), FRAC_1_SQRT_2 * place.side());
            points.iter().any(|point| point.frame.z_axis.dot(middle).abs() < reach)
        };
        let may_hide_lamp = |place: CellPlace| {
            place.level < HORIZON_LEVEL && has_horizon(place) && self.light.share(place) > MUCH_LIGHT
        };
        let must_split = |place: CellPlace| may_hide_lobe(place) || may_hide_lamp(place);
        let mut cubature = Cubature::new(&self.light, f_cos, has_horizon, must_split);
        let scale = self.intensity / self.subpixels as f64;
        let (mut first_weight, mut is_summed) = (None, true);
        for split in 1_usize.. {
            // Polynomials may swing below zero, which radiance never is: by so much the estimate is wrong, whatever its cells say. A display
            // shows no difference between that and black.
            let estimate = scale * cubature.integral;
            let radiance = estimate.max(DVec3::ZERO);
            let radiance_error = (scale * ERROR_LEFT * cubature.squares.map(f64::sqrt)).max(-estimate);
            let channel = |i: usize| display.error(radiance[i], radiance_error[i]);
            let display_error = DVec3::from_array([0, 1, 2].map(channel));
            // A channel matters as much as its error is seen. The first cells were ranked by weights of 1, so others' are relative to the first.
            let seen = display_error / radiance_error.max(DVec3::splat(f64::MIN_POSITIVE));
            let weights = seen * seen;
            let first_weight = *first_weight.get_or_insert(weights.max_element().max(f64::MIN_POSITIVE));
            let is_done = rms(display_error) <= tolerance || cubature.len() >= MOST_CELLS || cubature.is_exhausted();
            if is_done && is_summed {
                let evaluations = (cubature.evaluations() * points.len()) as u64;
                return Ok(PixelEstimate { radiance, radiance_error, display_error, evaluations });
            }
            is_summed = is_done || split.is_power_of_two();
            if !is_done {
                cubature.refine(weights / first_weight);
            }
            if is_summed {
                cubature.sum();
            }
            if split % SPLITS_A_LOOK == 0 {
                observer.check()?;
            }
        }
        unreachable!("there is no end to splits")
    }
}

pub(super) fn rms(channels: DVec3) -> f64 {
    (channels.length_squared() / 3.0).sqrt()
}
