//! Rough GGX metal that loses no light between its facets: the model `conductor` and what is reflected more than once.
//!
//! Kulla and Conty, "Revisiting Physically Based Shading at Imageworks" (2017). E(theta) is the albedo of the single-scattering lobe with
//! F = 1, mean E its mean over the hemisphere by cosine:
//!
//! ```text
//! f = F D G / (4 cos theta_i cos theta_o) + tint (1 - E(theta_i)) (1 - E(theta_o)) / (pi (1 - mean E)),
//! tint = mean F^2 mean E / (1 - mean F (1 - mean E)).
//! ```
//!
//! mean F is the reflectance of the smooth metal under diffuse light. Reciprocal. A metal that absorbs nothing reflects all light at every
//! angle (the integral of the second term is 1 - E(theta_o)); one that does reflects less. E is a table of 128 cosines, more of them
//! towards grazing angles, good to 2e-3.
use std::f64::consts::{FRAC_1_PI, FRAC_PI_2, PI};
use std::sync::{Arc, OnceLock};

use glam::{DVec2, DVec3};

use crate::brdf::cosines::{at_cosine, mean_under_even_light};
use crate::brdf::microfacet::metals::index_of_refraction;
use crate::brdf::microfacet::{ALPHA_HELP, Distribution, fresnel_conductor};
use crate::brdf::{Model, NARROWEST_ALPHA, Parameters, Roughness, Spacing, hash_numbers, reflect};
use crate::error::Result;

/// A rough metal with multiple scattering.
#[derive(Clone, Debug)]
pub struct MultiscatterConductor {
    /// Roughness of GGX, 0.001 to 1, not squared.
    pub alpha: f64,
    /// Real part of the refractive index at the red, green and blue wavelengths.
    pub eta: DVec3,
    /// Imaginary part, not negative.
    pub k: DVec3,
    /// Made when first asked for.
    loss: Arc<OnceLock<Loss>>,
}

/// What single scattering loses.
#[derive(Debug)]
struct Loss {
    /// 1 - E at cosines (i / (n - 1))^2.
    table: Vec<f64>,
    /// tint / (pi (1 - mean E)) per channel.
    factor: DVec3,
}

impl MultiscatterConductor {
    /// A metal of that roughness and index of refraction.
    pub fn new(alpha: f64, eta: DVec3, k: DVec3) -> Self {
        Self { alpha, eta, k, loss: Arc::default() }
    }

    fn loss(&self) -> &Loss {
        self.loss.get_or_init(|| {
            const COUNT: usize = 128;
            let cosine = |i: f64| (i / (COUNT - 1) as f64).powi(2);
            let table: Vec<f64> =
                (0..COUNT).map(|i| 1.0 - albedo(self.alpha, cosine(i as f64).max(1e-4)).min(1.0)).collect();
            let loss: f64 = mean_under_even_light(COUNT, |cos| at_cosine(&table, cos));
            let reflectance = mean_under_even_light(COUNT, |cos| fresnel_conductor(cos, self.eta, self.k));
            let tint = reflectance * reflectance * (1.0 - loss) / (1.0 - reflectance * loss);
            // A mirror loses nothing, and needs nothing back.
            let factor = if loss > 1e-9 { tint * (FRAC_1_PI / loss) } else { DVec3::ZERO };
            Loss { table, factor }
        })
    }
}

/// E: the albedo of GGX facets that reflect all light, seen at `cos_theta`.
fn albedo(alpha: f64, cos_theta: f64) -> f64 {
    const TANGENT_STEPS: usize = 256;
    const PHI_STEPS: usize = 64;
    let w_o = DVec3::new((1.0 - cos_theta * cos_theta).sqrt(), 0.0, cos_theta);
    let mut sum = 0.0;
    for i in 0..TANGENT_STEPS {
        // The facets' normals in equal shares of D cos: tan^2 theta_h = alpha^2 u / (1 - u). By x^2 towards both ends of u.
        let x = (i as f64 + 0.5) / TANGENT_STEPS as f64;
        let u = x * x * (3.0 - 2.0 * x);
        let share = 6.0 * x * (1.0 - x) / TANGENT_STEPS as f64;
        let theta_h = (alpha * (u / (1.0 - u)).sqrt()).atan();
        let (sin_theta_h, cos_theta_h) = theta_h.min(FRAC_PI_2).sin_cos();
        for j in 0..PHI_STEPS {
            let h = (DVec2::from_angle(PI * (j as f64 + 0.5) / PHI_STEPS as f64) * sin_theta_h).extend(cos_theta_h);
            let cos_theta_d = w_o.dot(h);
            let w_i = reflect(w_o, h);
            if cos_theta_d > 0.0 && w_i.z > 0.0 {
                // f cos_theta_i dw_i with dw_i = 4 cos_theta_d dw_h, over D cos_theta_h.
                let g = Distribution::Ggx.g1_over_cos(w_i.z, alpha) * Distribution::Ggx.g1_over_cos(w_o.z, alpha);
                sum += share * g * w_i.z * cos_theta_d / cos_theta_h;
            }
        }
    }
    sum / PHI_STEPS as f64
}

impl Model for MultiscatterConductor {
    fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
        let h = (w_i + w_o).normalize();
        let once = fresnel_conductor(w_o.dot(h), self.eta, self.k)
            * Distribution::Ggx.torrance_sparrow(w_i, w_o, h, Roughness::isotropic(self.alpha));
        let Loss { table, factor } = self.loss();
        once + *factor * (at_cosine(table, w_i.z) * at_cosine(table, w_o.z))
    }

    fn from_parameters(parameters: &mut Parameters) -> Result<Self> {
        let alpha = parameters.number("alpha", NARROWEST_ALPHA..=1.0, Spacing::Logarithmic, ALPHA_HELP)?;
        let (eta, k) = index_of_refraction(parameters)?;
        Ok(Self::new(alpha, eta, k))
    }

    fn hash_content(&self, hasher: &mut blake3::Hasher) {
        hash_numbers(hasher, [self.alpha]);
        hash_numbers(hasher, self.eta.to_array());
        hash_numbers(hasher, self.k.to_array());
    }
}
