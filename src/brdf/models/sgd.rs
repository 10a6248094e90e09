//! Shifted-gamma microfacets: f = (diffuse + specular F D G1(theta_i) G1(theta_o) / (cos theta_i cos theta_o)) / pi.
//!
//! Bagher, Soler and Holzschuch, "Accurate Fitting of Measured Reflectances Using a Shifted Gamma Micro-Facet Distribution" (2012). Every
//! parameter is of each channel:
//! - D = kappa e^(-a) / (pi a^p cos^4 theta_h), a = alpha + tan^2 theta_h / alpha; kappa is 1 / (alpha Gamma(1 - p, alpha)) where D is to
//!   be normalised, and is given, since some published fits are not;
//! - F = f0 - f1 cos theta_d + (1 - f0) (1 - cos theta_d)^5, which may leave [0, 1];
//! - G1(theta) = 1 + lambda (1 - e^(c max(theta - theta_0, 0)^k)), cut to [0, 1]; angles in radians.
//!
//! The fits of the MERL materials have been published as tables (e.g. in dj_brdf by J. Dupuy): copy a row into a material file. Reciprocal.
//! Energy is not bounded by the form; the fits have albedos below 1 at most angles, not at all. f is cut
//! at 0.
use std::f64::consts::FRAC_1_PI;

use glam::DVec3;

use crate::brdf::{Model, Parameters, Scale, hash_numbers, theta};
use crate::error::Result;

/// The model of Bagher, Soler and Holzschuch; all per channel.
#[derive(Clone, Copy, Debug)]
pub struct Sgd {
    /// The published rho_d, 0 to 1.
    pub diffuse: DVec3,
    /// The published rho_s, 0 to 100.
    pub specular: DVec3,
    /// Width of D, 1e-6 to 10.
    pub alpha: DVec3,
    /// Exponent of D, -10 to 10.
    pub p: DVec3,
    /// F at normal incidence is f0 - f1. -100 to 100.
    pub f0: DVec3,
    /// Slope of F, -100 to 100.
    pub f1: DVec3,
    /// Factor of D, 0 to 1e6.
    pub kappa: DVec3,
    /// Depth of the shadowing, 0 to 100.
    pub lambda: DVec3,
    /// Factor in its exponent, 0 to 1e12.
    pub c: DVec3,
    /// Power in its exponent, 0 to 1000.
    pub k: DVec3,
    /// Angle at which it starts, in radians, -10 to 10.
    pub theta_0: DVec3,
}

impl Sgd {
    /// G1 of the direction `w`.
    fn g1(&self, w: DVec3) -> DVec3 {
        let theta = theta(w);
        // Beyond all numbers it would be none where c is 0.
        let power = |channel: usize| (theta - self.theta_0[channel]).max(0.0).powf(self.k[channel]).min(f64::MAX);
        // Beyond e^700 is no double; so deep a shadow is black whatever the rest.
        let exponent = (self.c * DVec3::from_array([0, 1, 2].map(power))).min(DVec3::splat(700.0));
        (1.0 - self.lambda * exponent.map(f64::exp_m1)).clamp(DVec3::ZERO, DVec3::ONE)
    }
}

impl Model for Sgd {
    fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
        let h = (w_i + w_o).normalize();
        let (cos2, sin2) = (h.z * h.z, h.x * h.x + h.y * h.y);
        let a = self.alpha + sin2 / cos2 / self.alpha;
        let d = self.kappa * (-a - self.p * a.map(f64::ln)).exp() * FRAC_1_PI / (cos2 * cos2);
        let cos_theta_d = w_o.dot(h);
        let fresnel = self.f0 - self.f1 * cos_theta_d + (1.0 - self.f0) * (1.0 - cos_theta_d).powi(5);
        let shadowing = self.g1(w_i) * self.g1(w_o);
        let lobe = d * fresnel * shadowing / (w_i.z * w_o.z);
        // At grazing directions, in the shade or far out on the lobe, 0 times infinity threatens; e^-700 is about the smallest double.
        let is_lit = a.cmplt(DVec3::splat(700.0)) & shadowing.cmpgt(DVec3::ZERO);
        let lobe = DVec3::select(is_lit, lobe, DVec3::ZERO);
        ((self.diffuse + self.specular * lobe) * FRAC_1_PI).max(DVec3::ZERO)
    }

    fn from_parameters(parameters: &mut Parameters) -> Result<Self> {
        // Scales hold nearly all of what Bagher et al. (2012) fitted to 40 measured materials.
        let (even, factors) = (Scale::linear, Scale::logarithmic);
        Ok(Self {
            diffuse: parameters.diffuse()?,
            specular: parameters.colour_on("specular", 0.0..=100.0, factors(1e-3..=10.0), "Factor of the lobe.")?,
            alpha: parameters.colour_on("alpha", 1e-6..=10.0, factors(1e-5..=1.0), "Width of the lobe.")?,
            p: parameters.colour_on("p", -10.0..=10.0, even(0.0..=1.5), "Fall of the lobe: its power.")?,
            f0: parameters.colour_on(
                "f0",
                -100.0..=100.0,
                factors(1e-4..=10.0),
                "Fresnel term: f0 - f1 at normal incidence.",
            )?,
            f1: parameters.colour_on(
                "f1",
                -100.0..=100.0,
                even(-1.0..=1.0),
                "Fresnel term: its slope with the cosine.",
            )?,
            kappa: parameters.colour_on("kappa", 0.0..=1e6, factors(1.0..=1e5), "Factor of the distribution.")?,
            lambda: parameters.colour_on("lambda", 0.0..=100.0, factors(1e-3..=10.0), "Depth of the shadowing.")?,
            c: parameters.colour_on(
                "c",
                0.0..=1e12,
                factors(1e-8..=1e2),
                "Factor in the exponent of the shadowing.",
            )?,
            k: parameters.colour_on(
                "k",
                0.0..=1000.0,
                factors(1.0..=1e3),
                "Power in the exponent of the shadowing.",
            )?,
            theta_0: parameters.colour_on(
                "theta_0",
                -10.0..=10.0,
                even(-1.0..=1.5),
                "Angle at which shadowing starts, in radians.",
            )?,
        })
    }

    fn hash_content(&self, hasher: &mut blake3::Hasher) {
        let Self { diffuse, specular, alpha, p, f0, f1, kappa, lambda, c, k, theta_0 } = *self;
        for colour in [diffuse, specular, alpha, p, f0, f1, kappa, lambda, c, k, theta_0] {
            hash_numbers(hasher, colour.to_array());
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::dvec3;

    use crate::brdf::tests::samples::of_model;

    #[test]
    fn without_c_there_is_no_shadow_whatever_the_power() {
        let sgd = |shadow: &str| {
            of_model(
                "sgd",
                &format!(
                    "diffuse = 0\nspecular = 1\nalpha = 0.1\np = 0.5\nf0 = 0.5\nf1 = 0\nkappa = 1\nlambda = 0.5\ntheta_0 = -1\n{shadow}"
                ),
            )
        };
        let w_o = dvec3(1.3_f64.sin(), 0.0, 1.3_f64.cos());
        let mirrored = dvec3(-w_o.x, 0.0, w_o.z);
        let [even, steep] = ["c = 0\nk = 1", "c = 0\nk = 1000"].map(|shadow| sgd(shadow).evaluate(mirrored, w_o));
        assert!(even == steep && even.min_element() > 0.0, "{even} {steep}");
    }
}
