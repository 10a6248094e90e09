//! Microfacet distributions, shadowing and Fresnel reflectance, shared by the models that are made of them.
//!
//! Walter et al., "Microfacet Models for Refraction through Rough Surfaces" (2007). roughness_alpha is used as it is, not
//! squared, and masking-shadowing is separable, G = G1(w_i) G1(w_o). Anisotropic forms are those of Heitz, "Understanding the
//! Masking-Shadowing Function in Microfacet-Based BRDFs" (2014). Twin: glsl/brdf/microfacet.glsl.
use std::f64::consts::FRAC_1_PI;

use glam::DVec3;

use super::Parameters;
use crate::error::Result;

mod ggx_lobe;
pub(super) mod metals;
pub(super) mod roughness;

pub use ggx_lobe::{Tap, ggx_lobe};
pub(crate) use roughness::ALPHA_HELP;
pub use roughness::{Axes, NARROWEST_ALPHA, Roughness};

/// Shape of the distribution of microfacet normals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Distribution {
    /// Trowbridge-Reitz: long tails.
    Ggx,
    /// Gaussian slopes.
    Beckmann,
}

impl Distribution {
    /// Reads the key `distribution` and those of a [`Roughness`].
    pub(super) fn from_parameters(parameters: &mut Parameters) -> Result<(Self, Roughness)> {
        let choices = [("ggx", Distribution::Ggx), ("beckmann", Distribution::Beckmann)];
        let distribution = parameters.choice("distribution", &choices, "Distribution of the microfacets' normals.")?;
        Ok((distribution, Roughness::from_parameters(parameters, ALPHA_HELP)?))
    }

    /// D(h) in 1/sr: density of microfacets with normal `h`; the integral of D (n . h) dh is 1. Walter eqs 25, 33.
    #[inline]
    pub fn density(self, h: DVec3, alpha: f64) -> f64 {
        let alpha2 = alpha * alpha;
        // sin^2 from x and y, not 1 - cos^2, which loses all digits in a narrow lobe.
        let (sin2, cos2) = (h.x * h.x + h.y * h.y, h.z * h.z);
        match self {
            Distribution::Ggx => {
                let denominator = alpha2 * cos2 + sin2;
                alpha2 * FRAC_1_PI / (denominator * denominator)
            }
            Distribution::Beckmann => {
                let exponent = sin2 / (cos2 * alpha2);
                // e^-700 is about the smallest double; beyond, 0 / 0 threatens at grazing h.
                if exponent < 700.0 { (-exponent).exp() * FRAC_1_PI / (alpha2 * cos2 * cos2) } else { 0.0 }
            }
        }
    }

    /// D(h) of facets that differ by azimuth: with the roughness of their slope towards h, D above times alpha^2 / (alpha_x alpha_y), which
    /// is Heitz' 1 / (pi alpha_x alpha_y cos^4 (1 + tan^2 / alpha^2)^2) for GGX and e^(-tan^2 / alpha^2) / (pi alpha_x alpha_y cos^4) for Beckmann.
    #[inline]
    pub fn density_along_axes(self, h: DVec3, roughness: Roughness) -> f64 {
        let alpha = roughness.of_slope_towards(h);
        self.density(h, alpha) * (alpha * alpha / roughness.area())
    }

    /// Smith's G1(w) / cos(theta), finite at grazing angles. Walter eqs 34 (GGX) and 27 (Beckmann, his rational form).
    #[inline]
    pub fn g1_over_cos(self, cos_theta: f64, alpha: f64) -> f64 {
        let sin2 = (1.0 - cos_theta * cos_theta).max(0.0);
        match self {
            Distribution::Ggx => 2.0 / (cos_theta + (alpha * alpha * sin2 + cos_theta * cos_theta).sqrt()),
            Distribution::Beckmann => {
                let sin_theta = sin2.sqrt();
                // a = 1 / (alpha tan(theta)); a >= 1.6 is the unshadowed side.
                if cos_theta >= 1.6 * alpha * sin_theta {
                    return 1.0 / cos_theta;
                }
                let a = cos_theta / (alpha * sin_theta);
                (3.535 + 2.181 * a) / (1.0 + 2.276 * a + 2.577 * a * a) / (alpha * sin_theta)
            }
        }
    }

    /// D G / (4 cos_theta_i cos_theta_o) in 1/sr: the BRDF of a rough mirror of reflectance 1. `h` is the half vector.
    #[inline]
    pub fn torrance_sparrow(self, w_i: DVec3, w_o: DVec3, h: DVec3, roughness: Roughness) -> f64 {
        let g1_over_cos = |w: DVec3| self.g1_over_cos(w.z, roughness.seen_along(w));
        0.25 * self.density_along_axes(h, roughness) * g1_over_cos(w_i) * g1_over_cos(w_o)
    }

    /// The number by which the shaders know the distribution.
    pub(super) fn gpu_id(self) -> f32 {
        match self {
            Distribution::Ggx => 0.0,
            Distribution::Beckmann => 1.0,
        }
    }
}

/// Shadowing and masking of long V-shaped grooves: G of Torrance and Sparrow (1967) in the form of Blinn (1977). `h` is the half vector.
#[inline]
pub fn v_cavities(w_i: DVec3, w_o: DVec3, h: DVec3) -> f64 {
    (2.0 * h.z * w_i.z.min(w_o.z) / w_o.dot(h)).min(1.0)
}

/// Schlick's approximation (1994) of the Fresnel reflectance of what reflects `f0` at normal incidence.
#[inline]
pub fn fresnel_schlick(cos_theta: f64, f0: DVec3) -> DVec3 {
    f0 + (1.0 - f0) * (1.0 - cos_theta.clamp(0.0, 1.0)).powi(5)
}

/// Exact unpolarised Fresnel reflectance of a conductor with refractive index `eta` + i `k` in air.
#[inline]
pub fn fresnel_conductor(cos_theta: f64, eta: DVec3, k: DVec3) -> DVec3 {
    let cos_theta = cos_theta.clamp(0.0, 1.0);
    let (cos2, sin2) = (cos_theta * cos_theta, 1.0 - cos_theta * cos_theta);
    let channel = |eta: f64, k: f64| {
        // (a - i b)^2 = (eta - i k)^2 - sin^2, as in Born and Wolf; only a and a^2 + b^2 are needed.
        let difference = eta * eta - k * k - sin2;
        let a2_b2 = (difference * difference + 4.0 * eta * eta * k * k).sqrt();
        let a = (0.5 * (a2_b2 + difference)).max(0.0).sqrt();
        let (s_sum, s_cross) = (a2_b2 + cos2, 2.0 * a * cos_theta);
        let r_s = (s_sum - s_cross) / (s_sum + s_cross);
        let (p_sum, p_cross) = (cos2 * a2_b2 + sin2 * sin2, s_cross * sin2);
        // At grazing both are sin^4 > 0; at the normal cos^2 a2_b2 > 0: the sum never vanishes.
        let r_p = r_s * (p_sum - p_cross) / (p_sum + p_cross);
        // Where nothing is reflected, eta = 1 without absorption, rounding gives either sign.
        (0.5 * (r_s + r_p)).max(0.0)
    };
    DVec3::new(channel(eta.x, k.x), channel(eta.y, k.y), channel(eta.z, k.z))
}

/// Exact unpolarised Fresnel reflectance of a dielectric of index `ior` >= 1, seen from air.
#[inline]
pub fn fresnel_dielectric(cos_theta: f64, ior: f64) -> f64 {
    let cos_i = cos_theta.clamp(0.0, 1.0);
    let cos_t = (1.0 - (1.0 - cos_i * cos_i) / (ior * ior)).max(0.0).sqrt();
    // ior = 1 at grazing is the one 0 / 0: both cosines vanish, nothing is reflected.
    if cos_i + cos_t == 0.0 {
        return 0.0;
    }
    let r_s = (cos_i - ior * cos_t) / (cos_i + ior * cos_t);
    let r_p = (ior * cos_i - cos_t) / (ior * cos_i + cos_t);
    0.5 * (r_s * r_s + r_p * r_p)
}
