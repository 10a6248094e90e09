//! Rough metal: f = F D G / (4 cos_theta_i cos_theta_o), exact conductor Fresnel. Twin: glsl/brdf/conductor.glsl.
use glam::{DVec3, Vec4};

use crate::brdf::microfacet::metals::index_of_refraction;
use crate::brdf::microfacet::{Distribution, fresnel_conductor};
use crate::brdf::{Model, Parameters, Roughness, hash_numbers};
use crate::error::Result;

/// A rough metal surface.
#[derive(Clone, Copy, Debug)]
pub struct Conductor {
    /// Distribution of microfacet normals.
    pub distribution: Distribution,
    /// Its roughness_alpha along both axes, 0.001 to 1, not squared.
    pub roughness: Roughness,
    /// Real part of the refractive index at the red, green and blue wavelengths.
    pub eta: DVec3,
    /// Imaginary part (extinction), not negative.
    pub k: DVec3,
}

impl Model for Conductor {
    fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
        let h = (w_i + w_o).normalize();
        fresnel_conductor(w_o.dot(h), self.eta, self.k)
            * self.distribution.torrance_sparrow(w_i, w_o, h, self.roughness)
    }

    fn from_parameters(parameters: &mut Parameters) -> Result<Self> {
        let (distribution, roughness) = Distribution::from_parameters(parameters)?;
        let (eta, k) = index_of_refraction(parameters)?;
        Ok(Self { distribution, roughness, eta, k })
    }

    fn gpu_parameters(&self) -> [Vec4; 3] {
        [
            self.eta.as_vec3().extend(0.0),
            self.k.as_vec3().extend(self.distribution.gpu_id()),
            self.roughness.gpu_parameters(),
        ]
    }

    fn without_rotation(&self) -> Option<(Self, f64)> {
        self.roughness.without_rotation().map(|(roughness, deg)| (Self { roughness, ..*self }, deg))
    }

    fn hash_content(&self, hasher: &mut blake3::Hasher) {
        hash_numbers(hasher, [f64::from(self.distribution.gpu_id())]);
        self.roughness.hash_content(hasher);
        hash_numbers(hasher, self.eta.to_array());
        hash_numbers(hasher, self.k.to_array());
    }
}
