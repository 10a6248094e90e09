//! A measured BRDF as a table over the angles of light and view to the normal and the azimuth between them.
//!
//! What goniometers measure of isotropic materials, and what is left of anisotropic ones when they are turned about the normal while one looks:
//! the mean over the azimuth of the material. Between nodes f is linear in each of the three angles; nodes without a value have no weight.
//! Beyond the first and the last angle to the normal it is as there. It is the same in a mirror, but reciprocal only as far as measured.
use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DVec3, Vec3, Vec4};

use super::{Model, Parameters};
use crate::error::{Error, Result};

/// A measured BRDF. Cheap to clone.
#[derive(Clone)]
pub struct Goniometric {
    /// (rgb valid, valid), index azimuth + azimuths (theta_o + thetas (theta_i)).
    nodes: Arc<[Vec4]>,
    thetas: Nodes,
    azimuths: Nodes,
    fingerprint: blake3::Hash,
}

/// Nodes of an angle, in radians, at equal steps.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nodes {
    pub count: usize,
    pub first: f64,
    pub step: f64,
}

impl Nodes {
    /// The node before `angle` and the one after, at the ends the same, and the weight of the second.
    fn around(&self, angle: f64) -> ([usize; 2], f32) {
        let last = self.count - 1;
        let position = ((angle - self.first) / self.step).clamp(0.0, last as f64);
        let low = position as usize;
        ([low, (low + 1).min(last)], (position - low as f64) as f32)
    }
}

/// Means of values at the nodes, as they come.
pub(super) struct Means {
    /// Sums of the colours at each node, and their number.
    sums: Vec<Vec4>,
    thetas: Nodes,
    azimuths: Nodes,
}

impl Means {
    /// Azimuths go from 0 to 180 degrees.
    pub fn new(thetas: Nodes, azimuths: Nodes) -> Self {
        let count = azimuths.count * thetas.count * thetas.count;
        Self { sums: vec![Vec4::ZERO; count], thetas, azimuths }
    }

    /// Adds what was measured at the nodes of theta_i, theta_o and azimuth.
    pub fn add(&mut self, [theta_i, theta_o, azimuth]: [usize; 3], value: Vec3) {
        self.sums[azimuth + self.azimuths.count * (theta_o + self.thetas.count * theta_i)] += value.extend(1.0);
    }

    /// The table; the error is that it is black, or has no values.
    pub fn finish(mut self) -> Result<Goniometric, String> {
        for sum in &mut self.sums {
            *sum /= sum.w.max(1.0);
        }
        if !self.sums.iter().any(|node| node.truncate().max_element() > 0.0) {
            return Err("holds nothing but zero or invalid cells".into());
        }
        let mut hasher = blake3::Hasher::new();
        super::hash_numbers(&mut hasher, self.sums.iter().flat_map(|node| node.to_array()).map(f64::from));
        for Nodes { count, first, step } in [self.thetas, self.azimuths] {
            super::hash_numbers(&mut hasher, [count as f64, first, step]);
        }
        let Self { sums, thetas, azimuths } = self;
        Ok(Goniometric { nodes: sums.into(), thetas, azimuths, fingerprint: hasher.finalize() })
    }
}

impl std::fmt::Debug for Goniometric {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("Goniometric").field("fingerprint", &self.fingerprint).finish_non_exhaustive()
    }
}

impl Model for Goniometric {
    const HAS_PARAMETERS: bool = false;
    const IS_RECIPROCAL: bool = false;

    fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
        let theta = |w: DVec3| w.truncate().length().atan2(w.z);
        let (across_i, across_o) = (w_i.truncate(), w_o.truncate());
        // Of a direction along the normal the azimuth is arbitrary, and atan2 is 0.
        let azimuth = across_i.perp_dot(across_o).abs().atan2(across_i.dot(across_o)).min(PI);
        let (theta_i, weight_i) = self.thetas.around(theta(w_i));
        let (theta_o, weight_o) = self.thetas.around(theta(w_o));
        let (azimuth, weight_azimuth) = self.azimuths.around(azimuth);
        let mut sum = Vec4::ZERO;
        for (i, weight_i) in theta_i.into_iter().zip([1.0 - weight_i, weight_i]) {
            for (o, weight_o) in theta_o.into_iter().zip([1.0 - weight_o, weight_o]) {
                let line = self.azimuths.count * (o + self.thetas.count * i);
                let [first, second] = azimuth.map(|azimuth| self.nodes[line + azimuth]);
                sum += weight_i * weight_o * first.lerp(second, weight_azimuth);
            }
        }
        if sum.w > 0.0 { sum.truncate().as_dvec3() / f64::from(sum.w) } else { DVec3::ZERO }
    }

    fn from_parameters(_: &mut Parameters) -> Result<Self> {
        let remedy = "name the file with file = \"....dat\" or \"....bin\" instead";
        Err(Error::input("model `goniometric`", "has no parameters", remedy))
    }

    fn hash_content(&self, hasher: &mut blake3::Hasher) {
        hasher.update(self.fingerprint.as_bytes());
    }
}
