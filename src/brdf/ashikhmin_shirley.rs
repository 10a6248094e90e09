//! Ashikhmin and Shirley's Phong: a Blinn lobe with Schlick's Fresnel, and a diffuse part that makes room for it.
//!
//! Ashikhmin and Shirley, "An Anisotropic Phong BRDF Model" (2000), with n_u = n_v = n, which is the isotropic case:
//!
//! ```text
//! f = (n + 1) / (8 pi) (n . h)^n / ((w_o . h) max(cos theta_i, cos theta_o)) F(w_o . h)                              (eq 4)
//!   + 28 / (23 pi) diffuse (1 - specular) (1 - (1 - cos theta_i / 2)^5) (1 - (1 - cos theta_o / 2)^5),              (eq 5)
//! F(c) = specular + (1 - specular) (1 - c)^5.
//! ```
//!
//! Reciprocal. Energy is conserved for all parameters: the lobe's albedo is at most F, the diffuse part's at most diffuse (1 - specular).
use std::f64::consts::PI;

use glam::DVec3;

use super::microfacet::fresnel_schlick;
use super::{Model, Parameters, Spacing, hash_numbers};
use crate::error::Result;

/// The model of Ashikhmin and Shirley, isotropic.
#[derive(Clone, Copy, Debug)]
pub struct AshikhminShirley {
    /// R_d per channel, 0 to 1: what is left of it under the lobe is `diffuse` (1 - `specular`).
    pub diffuse: DVec3,
    /// R_s per channel, 0 to 1: reflectance at normal incidence.
    pub specular: DVec3,
    /// Exponent n of the lobe, 0 to 100,000.
    pub exponent: f64,
}

impl Model for AshikhminShirley {
    fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
        let h = (w_i + w_o).normalize();
        let cos_theta_d = w_o.dot(h);
        // (n . h)^n by the sine, which keeps its digits in a narrow lobe.
        let lobe = (0.5 * self.exponent * (-(h.x * h.x + h.y * h.y).min(1.0)).ln_1p()).exp();
        let lobe = if self.exponent > 0.0 { lobe } else { 1.0 };
        let specular = (self.exponent + 1.0) / (8.0 * PI) * lobe / (cos_theta_d * w_i.z.max(w_o.z));
        let room = |cos: f64| 1.0 - (1.0 - 0.5 * cos).powi(5);
        fresnel_schlick(cos_theta_d, self.specular) * specular
            + self.diffuse * (1.0 - self.specular) * (28.0 / (23.0 * PI) * room(w_i.z) * room(w_o.z))
    }

    fn from_parameters(parameters: &mut Parameters) -> Result<Self> {
        let help = "Colour of the diffuse part, under what the lobe leaves of the light, linear Rec. 709.";
        let diffuse = parameters.colour("diffuse", 0.0..=1.0, help)?;
        let help = "Reflectance of the lobe's facets at normal incidence, linear Rec. 709.";
        let specular = parameters.colour("specular", 0.0..=1.0, help)?;
        let help = "Exponent of the lobe: the larger, the narrower.";
        let exponent = parameters.number("exponent", 0.0..=1e5, Spacing::Logarithmic, help)?;
        Ok(Self { diffuse, specular, exponent })
    }

    fn hash_content(&self, hasher: &mut blake3::Hasher) {
        hash_numbers(hasher, self.diffuse.to_array());
        hash_numbers(hasher, self.specular.to_array());
        hash_numbers(hasher, [self.exponent]);
    }
}
