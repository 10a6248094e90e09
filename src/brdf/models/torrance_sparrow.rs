//! Torrance and Sparrow's V-shaped grooves: f = diffuse / pi + F P G / (4 cos theta_i cos theta_o).
//!
//! Torrance and Sparrow, "Theory for Off-Specular Reflection from Roughened Surfaces" (1967):
//! - P = b e^(-(theta_h / spread)^2): facets are distributed by a Gaussian of their angle, not of their slope. The paper's c is 1 / spread,
//!   0.05 for its angles in degrees, so its spread is 20. b, a free constant of the paper, makes the projected area of the facets 1;
//! - G = min(1, 2 (n . h) cos theta_o / (w_o . h), 2 (n . h) cos theta_i / (w_o . h)), the shadowing and masking of long V-shaped grooves;
//! - F is the exact unpolarised Fresnel reflectance for the index eta + i k; k = 0 is a dielectric.
//!
//! The paper's units: its off-specular peaks are of radiance, which is f cos theta_i. Reciprocal. The lobe conserves energy; with a
//! diffuse part it does where diffuse + F <= 1.
use std::f64::consts::{FRAC_1_PI, FRAC_PI_2, PI};

use glam::DVec3;

use crate::brdf::microfacet::metals::index_of_refraction;
use crate::brdf::microfacet::{fresnel_conductor, v_cavities};
use crate::brdf::{Model, Parameters, Spacing, hash_numbers};
use crate::error::Result;

/// Torrance and Sparrow's model.
#[derive(Clone, Copy, Debug)]
pub struct TorranceSparrow {
    /// Albedo of the diffuse part per channel, 0 to 1.
    pub diffuse: DVec3,
    /// Angle to the normal at which facets are rarer by e, in degrees: 0.1 to 60.
    pub spread_deg: f64,
    /// Real part of the refractive index at the red, green and blue wavelengths.
    pub eta: DVec3,
    /// Imaginary part, not negative.
    pub k: DVec3,
    /// b in 1/sr.
    density: f64,
}

/// b: 1 over the integral of e^(-(theta / spread)^2) cos theta over directions.
fn normalisation(spread: f64) -> f64 {
    // Midpoint rule to where the Gaussian has fallen by e^-49.
    const STEPS: usize = 2000;
    let end = (7.0 * spread).min(FRAC_PI_2);
    let term = |i: usize| {
        let theta = end * (i as f64 + 0.5) / STEPS as f64;
        (-(theta / spread).powi(2)).exp() * theta.sin() * theta.cos()
    };
    (2.0 * PI * end / STEPS as f64 * (0..STEPS).map(term).sum::<f64>()).recip()
}

impl TorranceSparrow {
    /// Facets of that spread and index of refraction.
    pub fn new(diffuse: DVec3, spread_deg: f64, eta: DVec3, k: DVec3) -> Self {
        Self { diffuse, spread_deg, eta, k, density: normalisation(spread_deg.to_radians()) }
    }
}

impl Model for TorranceSparrow {
    fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
        let h = (w_i + w_o).normalize();
        let theta_h = (h.x * h.x + h.y * h.y).sqrt().atan2(h.z);
        let p = self.density * (-(theta_h / self.spread_deg.to_radians()).powi(2)).exp();
        let lobe = 0.25 * p * v_cavities(w_i, w_o, h) / (w_i.z * w_o.z);
        self.diffuse * FRAC_1_PI + fresnel_conductor(w_o.dot(h), self.eta, self.k) * lobe
    }

    fn from_parameters(parameters: &mut Parameters) -> Result<Self> {
        let diffuse = parameters.diffuse()?;
        let help = "Angle to the normal, in degrees, at which facets are rarer by e.";
        let spread_deg = parameters.number("spread_deg", 0.1..=60.0, Spacing::Logarithmic, help)?;
        let (eta, k) = index_of_refraction(parameters)?;
        Ok(Self::new(diffuse, spread_deg, eta, k))
    }

    fn hash_content(&self, hasher: &mut blake3::Hasher) {
        for colour in [self.diffuse, self.eta, self.k] {
            hash_numbers(hasher, colour.to_array());
        }
        hash_numbers(hasher, [self.spread_deg]);
    }
}
