//! Phong's lobe about the mirror direction, normalised: f = diffuse / pi + specular (n + 2) / (2 pi) (r . w_o)^n. Twin: glsl/brdf/phong.glsl.
//!
//! Phong, "Illumination for Computer Generated Pictures" (1975), with r the mirror image of w_i; the factor is that of Lafortune and
//! Willems, "Using the Modified Phong Reflectance Model for Physically Based Rendering" (1994), who divide Phong's term by the cosine of
//! the light so that it is a BRDF that is reciprocal. Isotropic.
//!
//! Energy: the lobe's albedo is `specular` at normal incidence and smaller at all other angles, since part of the lobe is below the
//! horizon. So diffuse + specular <= 1 conserves energy; a warning says so where they are more.
use std::f64::consts::{FRAC_1_PI, PI};

use glam::{DVec3, Vec4};

use crate::brdf::{Model, Parameters, Spacing, hash_numbers, warn_of_excess};
use crate::error::Result;

/// Phong's model as a BRDF.
#[derive(Clone, Copy, Debug)]
pub struct Phong {
    /// Albedo of the diffuse part per channel, 0 to 1.
    pub diffuse: DVec3,
    /// Albedo of the lobe at normal incidence per channel, 0 to 1.
    pub specular: DVec3,
    /// Exponent n of the lobe, 0 to 100,000.
    pub exponent: f64,
}

impl Phong {
    /// (n + 2) / (2 pi) in 1/sr.
    fn normalisation(&self) -> f64 {
        (self.exponent + 2.0) / (2.0 * PI)
    }
}

impl Model for Phong {
    fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
        let mirrored = DVec3::new(-w_i.x, -w_i.y, w_i.z);
        // 1 - cos from the chord, which keeps its digits in a narrow lobe.
        let below_one = 0.5 * (mirrored - w_o).length_squared();
        let lobe = if below_one < 1.0 { (self.exponent * (-below_one).ln_1p()).exp() } else { 0.0 };
        self.diffuse * FRAC_1_PI + self.specular * (self.normalisation() * lobe)
    }

    fn from_parameters(parameters: &mut Parameters) -> Result<Self> {
        let model = Self {
            diffuse: parameters.diffuse()?,
            specular: parameters.colour(
                "specular",
                0.0..=1.0,
                "Albedo of the lobe seen along the normal, linear Rec. 709.",
            )?,
            exponent: parameters.number(
                "exponent",
                0.0..=1e5,
                Spacing::Logarithmic,
                "Exponent of the lobe: the larger, the narrower.",
            )?,
        };
        warn_of_excess(parameters, "phong: diffuse + specular", model.diffuse + model.specular);
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
