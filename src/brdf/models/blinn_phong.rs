//! Blinn-Phong with a normalised lobe: f = diffuse / pi + specular c_n (n . h)^n. Twin: glsl/brdf/blinn_phong.glsl.
use std::f64::consts::{FRAC_1_PI, PI};

use glam::{DVec3, Vec4};

use crate::brdf::{Model, Parameters, Spacing, hash_numbers, warn_of_excess};
use crate::error::Result;

/// Blinn's half-vector form of the Phong model.
///
/// c_n = (n + 2)(n + 4) / (8 pi (2^(-n/2) + n)) is the exact normalisation at normal incidence: there the lobe's albedo is
/// `specular`, and it is no greater at any other angle. So diffuse + specular <= 1 conserves energy.
#[derive(Clone, Copy, Debug)]
pub struct BlinnPhong {
    /// Albedo of the diffuse part per channel, 0 to 1.
    pub diffuse: DVec3,
    /// Albedo of the lobe at normal incidence per channel, 0 to 1.
    pub specular: DVec3,
    /// Exponent n of the lobe, 0 to 100,000.
    pub exponent: f64,
}

impl BlinnPhong {
    /// c_n in 1/sr.
    fn normalisation(&self) -> f64 {
        let n = self.exponent;
        (n + 2.0) * (n + 4.0) / (8.0 * PI * ((-0.5 * n).exp2() + n))
    }
}

impl Model for BlinnPhong {
    fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
        let h = (w_i + w_o).normalize();
        self.diffuse * FRAC_1_PI + self.specular * (self.normalisation() * h.z.powf(self.exponent))
    }

    fn from_parameters(parameters: &mut Parameters) -> Result<Self> {
        let help = "Exponent of the lobe: the larger, the narrower.";
        let model = Self {
            diffuse: parameters.diffuse()?,
            specular: parameters.colour(
                "specular",
                0.0..=1.0,
                "Albedo of the lobe seen along the normal, linear Rec. 709.",
            )?,
            exponent: parameters.number("exponent", 0.0..=1e5, Spacing::Logarithmic, help)?,
        };
        warn_of_excess(parameters, "blinn_phong: diffuse + specular", model.diffuse + model.specular);
        Ok(model)
    }

    fn gpu_parameters(&self) -> [Vec4; 3] {
        let (diffuse, specular) = (self.diffuse.as_vec3(), self.specular.as_vec3());
        [diffuse.extend(self.exponent as f32), specular.extend(self.normalisation() as f32), Vec4::ZERO]
    }

    fn hash_content(&self, hasher: &mut blake3::Hasher) {
        hash_numbers(hasher, self.diffuse.to_array());
        hash_numbers(hasher, self.specular.to_array());
        hash_numbers(hasher, [self.exponent]);
    }
}
