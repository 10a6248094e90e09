//! Oren and Nayar's rough diffuse surface, in full: facets of Lambert's kind in V-shaped grooves, with their interreflection.
//!
//! Oren and Nayar, "Generalization of Lambert's Reflectance Model" (1994), the functional approximation for Gaussian slopes:
//! f = L1 + L2, with alpha and beta the greater and the smaller of theta_i and theta_o, phi the azimuth between them,
//!
//! ```text
//! L1 = reflectance / pi (C1 + cos phi C2 tan beta + (1 - |cos phi|) C3 tan((alpha + beta) / 2)),
//! L2 = 0.17 reflectance^2 / pi s2 / (s2 + 0.13) (1 - cos phi (2 beta / pi)^2),
//! C1 = 1 - s2 / (2 (s2 + 0.33)),
//! C2 = 0.45 s2 / (s2 + 0.09) (sin alpha, less (2 beta / pi)^3 where cos phi < 0),
//! C3 = 0.125 s2 / (s2 + 0.09) (4 alpha beta / pi^2)^2.
//! ```
//!
//! s2 is the variance of the facets' angle in rad^2; sigma = 0 is Lambert. Reciprocal. The approximation is of energy at most 1 but for
//! a few per cent: white surfaces reach 1.05 at grazing views, with sigma of about 18 degrees. Where both directions graze, f grows without bound, but its integral does
//! not; where it would be negative it is 0.
use std::f64::consts::{FRAC_1_PI, FRAC_PI_2, PI};

use glam::DVec3;

use crate::brdf::{Model, Parameters, Spacing, hash_numbers};
use crate::error::Result;

/// Oren and Nayar's model.
#[derive(Clone, Copy, Debug)]
pub struct OrenNayar {
    /// Albedo of the facets per channel, 0 to 1.
    pub reflectance: DVec3,
    /// Standard deviation of the facets' angle to the normal, 0 to 60 degrees.
    pub sigma_deg: f64,
}

impl Model for OrenNayar {
    fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
        let s2 = self.sigma_deg.to_radians().powi(2);
        let sines = [w_i, w_o].map(|w| (w.x * w.x + w.y * w.y).sqrt());
        let angles = [sines[0].atan2(w_i.z), sines[1].atan2(w_o.z)];
        let [greater, smaller] = if angles[0] > angles[1] { [0, 1] } else { [1, 0] };
        let (alpha, beta) = (angles[greater], angles[smaller]);
        // The cosine of a right angle in double precision: tangents stay finite.
        let cosines = [w_i.z, w_o.z].map(|z| z.max(FRAC_PI_2.cos()));
        let tan_beta = sines[smaller] / cosines[smaller];
        // tan((alpha + beta) / 2), without the tangent of a sum.
        let tan_mean = (sines[0] + sines[1]) / (cosines[0] + cosines[1]);
        let product = sines[0] * sines[1];
        // Along the normal the azimuth is arbitrary, and has no weight.
        let cos_phi = if product > 0.0 { ((w_i.x * w_o.x + w_i.y * w_o.y) / product).clamp(-1.0, 1.0) } else { 0.0 };
        let c1 = 1.0 - 0.5 * s2 / (s2 + 0.33);
        let back = if cos_phi < 0.0 { (2.0 * beta / PI).powi(3) } else { 0.0 };
        let c2 = 0.45 * s2 / (s2 + 0.09) * (sines[greater] - back);
        let c3 = 0.125 * s2 / (s2 + 0.09) * (4.0 * alpha * beta / (PI * PI)).powi(2);
        let direct = c1 + cos_phi * c2 * tan_beta + (1.0 - cos_phi.abs()) * c3 * tan_mean;
        let indirect = 0.17 * s2 / (s2 + 0.13) * (1.0 - cos_phi * (2.0 * beta / PI).powi(2));
        self.reflectance * ((DVec3::splat(direct) + self.reflectance * indirect).max(DVec3::ZERO) * FRAC_1_PI)
    }

    fn from_parameters(parameters: &mut Parameters) -> Result<Self> {
        let reflectance = parameters.colour("reflectance", 0.0..=1.0, "Albedo of the facets, linear Rec. 709.")?;
        let help = "Standard deviation of the facets' angle to the normal, in degrees: 0 is Lambert.";
        let sigma_deg = parameters.number("sigma_deg", 0.0..=60.0, Spacing::Linear, help)?;
        Ok(Self { reflectance, sigma_deg })
    }

    fn hash_content(&self, hasher: &mut blake3::Hasher) {
        hash_numbers(hasher, self.reflectance.to_array());
        hash_numbers(hasher, [self.sigma_deg]);
    }
}
