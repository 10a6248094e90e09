//! Plastic: a rough dielectric coat on a diffuse base. Twin: glsl/brdf/plastic.glsl.
use std::f64::consts::FRAC_1_PI;

use glam::{DVec3, Vec4};

use crate::brdf::cosines::mean_under_even_light;
use crate::brdf::microfacet::{Distribution, fresnel_dielectric};
use crate::brdf::{Model, Parameters, Roughness, Spacing, hash_numbers};
use crate::error::Result;

/// f = F D G / (4 cos_theta_i cos_theta_o) + diffuse / pi (1 - F(theta_i)) (1 - F(theta_o)) / (1 - mean F).
///
/// The base gets what the coat lets through on the way in and out, with F of the smooth interface (Shirley et al., "A
/// Practitioner's Assessment of Light Reflection Models", 1997). It is reciprocal, its albedo is diffuse (1 - F(theta_o)), so
/// `diffuse` is what one sees away from highlights. Energy is at most 1.003; a rough coat loses light towards grazing angles.
/// Simply adding diffuse / pi would differ by 4 to 8 % at small angles and reflect more than 1 at grazing ones.
#[derive(Clone, Copy, Debug)]
pub struct Plastic {
    /// Distribution of the coat's microfacet normals.
    pub distribution: Distribution,
    /// Its roughness_alpha along both axes, 0.001 to 1, not squared.
    pub roughness: Roughness,
    /// Refractive index of the coat, 1 to 5.
    pub ior: f64,
    /// Colour of the base per channel, 0 to 1.
    pub diffuse: DVec3,
    /// diffuse / (1 - mean F).
    base: DVec3,
}

impl Plastic {
    /// A plastic of the given coat and base.
    pub fn new(distribution: Distribution, roughness: Roughness, ior: f64, diffuse: DVec3) -> Self {
        Self { distribution, roughness, ior, diffuse, base: diffuse / (1.0 - mean_fresnel(ior)) }
    }
}

/// Reflectance of the smooth interface under diffuse light: the integral of F(c) 2 c dc over the cosine c.
fn mean_fresnel(ior: f64) -> f64 {
    // Converged to better than 1e-6.
    mean_under_even_light(512, |cos| fresnel_dielectric(cos, ior))
}

impl Model for Plastic {
    fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
        let h = (w_i + w_o).normalize();
        let coat =
            fresnel_dielectric(w_o.dot(h), self.ior) * self.distribution.torrance_sparrow(w_i, w_o, h, self.roughness);
        let transmitted = (1.0 - fresnel_dielectric(w_i.z, self.ior)) * (1.0 - fresnel_dielectric(w_o.z, self.ior));
        DVec3::splat(coat) + self.base * (transmitted * FRAC_1_PI)
    }

    fn from_parameters(parameters: &mut Parameters) -> Result<Self> {
        let (distribution, roughness) = Distribution::from_parameters(parameters)?;
        let help = "Index of refraction of the coat, against air.";
        let ior = parameters.number("ior", 1.0..=5.0, Spacing::Linear, help)?;
        let diffuse = parameters.colour("diffuse", 0.0..=1.0, "Colour of the base under the coat, linear Rec. 709.")?;
        Ok(Self::new(distribution, roughness, ior, diffuse))
    }

    fn gpu_parameters(&self) -> [Vec4; 3] {
        [
            self.base.as_vec3().extend(0.0),
            Vec4::new(self.ior as f32, self.distribution.gpu_id(), 0.0, 0.0),
            self.roughness.gpu_parameters(),
        ]
    }

    fn without_rotation(&self) -> Option<(Self, f64)> {
        self.roughness.without_rotation().map(|(roughness, deg)| (Self { roughness, ..*self }, deg))
    }

    fn hash_content(&self, hasher: &mut blake3::Hasher) {
        hash_numbers(hasher, [f64::from(self.distribution.gpu_id())]);
        self.roughness.hash_content(hasher);
        hash_numbers(hasher, [self.ior]);
        hash_numbers(hasher, self.diffuse.to_array());
    }
}
