//! Cook and Torrance's metal and plastic: f = diffuse / pi + specular F D G / (pi cos theta_i cos theta_o).
//!
//! Cook and Torrance, "A Reflectance Model for Computer Graphics" (SIGGRAPH 1981, TOG 1982):
//! - D = e^(-tan^2 theta_h / m^2) / (4 m^2 cos^4 theta_h), Beckmann's, in the form of 1981. The form of 1982 lacks the 4, by which a
//!   surface would reflect four times what it receives;
//! - G = min(1, 2 (n . h) cos theta_o / (w_o . h), 2 (n . h) cos theta_i / (w_o . h)), the V-shaped grooves of Torrance and Sparrow;
//! - F is the exact Fresnel reflectance of a dielectric whose index, per channel, follows from the reflectance `f0` at normal incidence:
//!   (1 + sqrt f0) / (1 - sqrt f0). That is how the paper stands in for metals whose absorption is not known.
//!
//! `diffuse` and `specular` are the paper's d R_d and s. Reciprocal. Energy is conserved where diffuse + specular <= 1.
use std::f64::consts::FRAC_1_PI;

use glam::DVec3;

use crate::brdf::microfacet::{Distribution, fresnel_dielectric, v_cavities};
use crate::brdf::{Model, NARROWEST_ALPHA, Parameters, Spacing, hash_numbers, warn_of_excess};
use crate::error::Result;

/// Cook and Torrance's model.
#[derive(Clone, Copy, Debug)]
pub struct CookTorrance {
    /// Albedo of the diffuse part per channel, 0 to 1.
    pub diffuse: DVec3,
    /// The lobe's share s, 0 to 1.
    pub specular: f64,
    /// Reflectance of the facets at normal incidence per channel, 0 to 0.99.
    pub f0: DVec3,
    /// m: root mean square slope of the facets along any one direction, times sqrt(2), which is that over both. 0.001 to 1.
    pub m: f64,
}

/// The index of refraction of a dielectric of reflectance `f0` at normal incidence.
fn index_of(f0: f64) -> f64 {
    (1.0 + f0.sqrt()) / (1.0 - f0.sqrt())
}

impl Model for CookTorrance {
    fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
        let h = (w_i + w_o).normalize();
        let cos_theta_d = w_o.dot(h);
        // D / pi with the 4 of the form of 1981.
        let d = 0.25 * Distribution::Beckmann.density(h, self.m);
        let fresnel = self.f0.map(|f0| fresnel_dielectric(cos_theta_d, index_of(f0)));
        self.diffuse * FRAC_1_PI + fresnel * (self.specular * d * v_cavities(w_i, w_o, h) / (w_i.z * w_o.z))
    }

    fn from_parameters(parameters: &mut Parameters) -> Result<Self> {
        let model = Self {
            diffuse: parameters.diffuse()?,
            specular: parameters.number("specular", 0.0..=1.0, Spacing::Linear, "Share of the lobe, s.")?,
            f0: parameters.colour(
                "f0",
                0.0..=0.99,
                "Reflectance of the facets at normal incidence, linear Rec. 709.",
            )?,
            m: parameters.number(
                "m",
                NARROWEST_ALPHA..=1.0,
                Spacing::Logarithmic,
                "Slope of the facets: 0.01 is nearly a mirror.",
            )?,
        };
        warn_of_excess(parameters, "cook_torrance: diffuse + specular", model.diffuse + model.specular);
        Ok(model)
    }

    fn hash_content(&self, hasher: &mut blake3::Hasher) {
        hash_numbers(hasher, self.diffuse.to_array());
        hash_numbers(hasher, self.f0.to_array());
        hash_numbers(hasher, [self.specular, self.m]);
    }
}
