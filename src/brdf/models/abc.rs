//! The ABC model's microfacets: f = diffuse / pi + F D G / (pi cos theta_i cos theta_o), D = A / (1 + B (1 - n . h))^C.
//!
//! Low, Kronander, Ynnerman and Unger, "BRDF Models for Accurate and Efficient Rendering of Glossy Surfaces" (2012), the microfacet form:
//! - A, of each channel, is the size of the lobe; D is not normalised;
//! - the published fits are of this form: without 1 / pi all 40 of them err more;
//! - G = min(1, 2 (n . h) cos theta_o / (w_o . h), 2 (n . h) cos theta_i / (w_o . h));
//! - F is the exact unpolarised Fresnel reflectance of a dielectric of index `ior`.
//!
//! The fits of the MERL materials have been published as tables (e.g. in dj_brdf by J. Dupuy): copy a row into a material file. Reciprocal.
//! Energy is not bounded by the form; the fits have albedos below 1 at most angles, not at all.
use std::f64::consts::FRAC_1_PI;

use glam::DVec3;

use crate::brdf::microfacet::{fresnel_dielectric, v_cavities};
use crate::brdf::{Model, Parameters, Scale, Spacing, hash_numbers};
use crate::error::Result;

/// The model of Low, Kronander, Ynnerman and Unger.
#[derive(Clone, Copy, Debug)]
pub struct Abc {
    /// The published k_D per channel, 0 to 1.
    pub diffuse: DVec3,
    /// A per channel, 0 to 1e6.
    pub a: DVec3,
    /// B, 0 to 1e9: the lobe is as wide as sqrt(2 / B).
    pub b: f64,
    /// C, 0 to 100: how it falls.
    pub c: f64,
    /// Index of refraction, 1 to 100.
    pub ior: f64,
}

impl Model for Abc {
    fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
        let h = (w_i + w_o).normalize();
        // 1 - n . h from the sine, which keeps its digits in a narrow lobe.
        let below_one = (h.x * h.x + h.y * h.y) / (1.0 + h.z);
        let d = (1.0 + self.b * below_one).powf(-self.c);
        let lobe = fresnel_dielectric(w_o.dot(h), self.ior) * d * v_cavities(w_i, w_o, h) / (w_i.z * w_o.z);
        (self.diffuse + self.a * lobe) * FRAC_1_PI
    }

    fn from_parameters(parameters: &mut Parameters) -> Result<Self> {
        Ok(Self {
            diffuse: parameters.diffuse()?,
            // Scales hold what Löw et al. (2012) fitted to 40 measured materials.
            a: parameters.colour_on("a", 0.0..=1e6, Scale::logarithmic(0.1..=1e4), "Size of the lobe, A.")?,
            b: parameters.number_on(
                "b",
                0.0..=1e9,
                Scale::logarithmic(10.0..=1e7),
                "B: the lobe is as wide as sqrt(2 / B).",
            )?,
            c: parameters.number_on("c", 0.0..=100.0, Scale::logarithmic(0.05..=5.0), "C: how the lobe falls.")?,
            ior: parameters.number("ior", 1.0..=100.0, Spacing::Logarithmic, "Index of refraction, against air.")?,
        })
    }

    fn hash_content(&self, hasher: &mut blake3::Hasher) {
        hash_numbers(hasher, self.diffuse.to_array());
        hash_numbers(hasher, self.a.to_array());
        hash_numbers(hasher, [self.b, self.c, self.ior]);
    }
}
