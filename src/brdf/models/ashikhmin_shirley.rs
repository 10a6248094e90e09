//! Ashikhmin and Shirley's Phong: a Blinn lobe with Schlick's Fresnel, and a diffuse part that makes room for it. Twin:
//! glsl/brdf/ashikhmin_shirley.glsl.
//!
//! Ashikhmin and Shirley, "An Anisotropic Phong BRDF Model" (2000), with exponents n_x and n_y, his n_u and n_v, along the tangent turned by
//! `rotation_deg` and across it:
//!
//! ```text
//! f = sqrt((n_x + 1) (n_y + 1)) / (8 pi) (n . h)^n / ((w_o . h) max(cos theta_i, cos theta_o)) F(w_o . h)             (eq 4)
//!   + 28 / (23 pi) diffuse (1 - specular) (1 - (1 - cos theta_i / 2)^5) (1 - (1 - cos theta_o / 2)^5),              (eq 5)
//! n = n_x cos^2 phi_h + n_y sin^2 phi_h,   F(c) = specular + (1 - specular) (1 - c)^5.
//! ```
//!
//! Reciprocal. Energy is conserved for all parameters: the lobe's albedo is at most F, the diffuse part's at most diffuse (1 - specular).
use std::f64::consts::PI;

use glam::{DVec2, DVec3, Vec4};

use crate::brdf::microfacet::fresnel_schlick;
use crate::brdf::microfacet::roughness::{Axes, is_along_axes};
use crate::brdf::{Model, Parameters, Spacing, hash_numbers};
use crate::error::Result;

/// The model of Ashikhmin and Shirley.
#[derive(Clone, Copy, Debug)]
pub struct AshikhminShirley {
    /// R_d per channel, 0 to 1: what is left of it under the lobe is `diffuse` (1 - `specular`).
    pub diffuse: DVec3,
    /// R_s per channel, 0 to 1: reflectance at normal incidence.
    pub specular: DVec3,
    /// Exponents of the lobe along both axes, 0 to 100,000.
    pub exponent: DVec2,
    /// These axes.
    pub axes: Axes,
}

impl AshikhminShirley {
    /// sqrt((n_x + 1) (n_y + 1)) / (8 pi)
    fn normalisation(&self) -> f64 {
        ((self.exponent.x + 1.0) * (self.exponent.y + 1.0)).sqrt() / (8.0 * PI)
    }

    /// The exponent towards `h`.
    fn exponent_towards(&self, h: DVec3) -> f64 {
        let square = self.axes.along(h).powf(2.0);
        // The normal has no azimuth, and any power of its cosine is 1.
        let is_round = self.exponent.x == self.exponent.y || square.element_sum() == 0.0;
        if is_round { self.exponent.x } else { self.exponent.dot(square) / square.element_sum() }
    }
}

impl Model for AshikhminShirley {
    fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
        let h = (w_i + w_o).normalize();
        let cos_theta_d = w_o.dot(h);
        let exponent = self.exponent_towards(h);
        // (n . h)^n by the sine, which keeps its digits in a narrow lobe.
        let lobe = (0.5 * exponent * (-(h.x * h.x + h.y * h.y).min(1.0)).ln_1p()).exp();
        let lobe = if exponent > 0.0 { lobe } else { 1.0 };
        let specular = self.normalisation() * lobe / (cos_theta_d * w_i.z.max(w_o.z));
        let room = |cos: f64| 1.0 - (1.0 - 0.5 * cos).powi(5);
        fresnel_schlick(cos_theta_d, self.specular) * specular
            + self.diffuse * (1.0 - self.specular) * (28.0 / (23.0 * PI) * room(w_i.z) * room(w_o.z))
    }

    fn from_parameters(parameters: &mut Parameters) -> Result<Self> {
        let help = "Colour of the diffuse part, under what the lobe leaves of the light, linear Rec. 709.";
        let diffuse = parameters.colour("diffuse", 0.0..=1.0, help)?;
        let help = "Reflectance of the lobe's facets at normal incidence, linear Rec. 709.";
        let specular = parameters.colour("specular", 0.0..=1.0, help)?;
        let range = 0.0..=1e5;
        if !is_along_axes(parameters, "exponent", ["exponent_x", "exponent_y"])? {
            let help = "Exponent of the lobe: the larger, the narrower.";
            let exponent = parameters.number("exponent", range, Spacing::Logarithmic, help)?;
            return Ok(Self { diffuse, specular, exponent: DVec2::splat(exponent), axes: Axes::new(0.0) });
        }
        let help = "Exponent of the lobe along the first axis, which is the tangent where the rotation is 0.";
        let exponent_x = parameters.number("exponent_x", range.clone(), Spacing::Logarithmic, help)?;
        let help = "Exponent of the lobe across the first axis.";
        let exponent_y = parameters.number("exponent_y", range, Spacing::Logarithmic, help)?;
        let axes = Axes::from_parameters(parameters)?;
        // Equal exponents are the same however they are turned.
        let axes = if exponent_x == exponent_y { Axes::new(0.0) } else { axes };
        Ok(Self { diffuse, specular, exponent: DVec2::new(exponent_x, exponent_y), axes })
    }

    fn gpu_parameters(&self) -> [Vec4; 3] {
        let diffuse = self.diffuse * (1.0 - self.specular) * (28.0 / (23.0 * PI));
        [
            diffuse.as_vec3().extend(self.exponent.x as f32),
            self.specular.as_vec3().extend(self.exponent.y as f32),
            Vec4::X * self.normalisation() as f32,
        ]
    }

    fn without_rotation(&self) -> Option<(Self, f64)> {
        self.axes.without_rotation().map(|(axes, deg)| (Self { axes, ..*self }, deg))
    }

    fn hash_content(&self, hasher: &mut blake3::Hasher) {
        hash_numbers(hasher, self.diffuse.to_array());
        hash_numbers(hasher, self.specular.to_array());
        match self.exponent.x == self.exponent.y {
            true => hash_numbers(hasher, [self.exponent.x]),
            false => hash_numbers(hasher, [self.exponent.x, self.exponent.y, self.axes.rotation_deg()]),
        }
    }
}
