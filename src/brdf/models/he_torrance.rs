//! He, Torrance, Sillion and Greenberg's wave-optical metal: specular, directional-diffuse and uniform-diffuse terms, unpolarised.
//!
//! "A Comprehensive Physical Model for Light Reflection" (1991), whose appendix has the formulas. A surface whose heights
//! are Gaussian, of standard deviation sigma_0, with the autocorrelation length tau, both in micrometres; each channel at one wavelength lambda, 0.65, 0.55 and 0.45 um:
//!
//! ```text
//! f = F S e^(-g) Delta + F S D G / (pi cos theta_i cos theta_o) + diffuse / pi
//! g = (2 pi sigma / lambda (cos theta_i + cos theta_o))^2
//! sigma = sigma_0 / sqrt(1 + (z_0 / sigma_0)^2): what light sees of the heights at grazing angles
//! D = pi^2 tau^2 / (4 lambda^2) sum over m >= 1 of g^m e^-g / (m! m) e^(-v_xy^2 tau^2 / (4 m)), v = 2 pi / lambda (w_i + w_o)
//! S = S(theta_i) S(theta_o), S = (1 - erfc(x) / 2) / (1 + Lambda(x)), x = tau cot theta / (2 sigma_0)
//! ```
//!
//! For unpolarised light the paper's G is (|w_i + w_o|^2 / (cos theta_i + cos theta_o))^2: of its brackets each is the squared sine of the
//! angle between w_i and w_o, and they cancel. F is the exact Fresnel reflectance at half of that angle.
//!
//! Lambda is (e^(-x^2) / (x sqrt pi) - erfc(x)) / 2, Smith's. As printed, the paper's is without the exponential.
//!
//! Departures: Delta, a perfect mirror in the paper, is a Beckmann lobe of the width `specular_alpha`, as a mirror has no BRDF. For g above
//! 100 the sum, a mean over Poisson's distribution, is taken by its moments, with an error of the order of 1 / g^2 near its peak.
//!
//! Rough surfaces (sigma_0 well above lambda) are those of geometrical optics: Beckmann's facets of alpha = 2 sigma_0 / tau. Smooth ones
//! are mirrors. Reciprocal. Energy is at most 1.05 within the theory's range, tau above lambda and 2 sigma_0 / tau below about 0.6, with
//! diffuse + F <= 1; beyond it is not bounded by it.
use std::f64::consts::{FRAC_1_PI, PI};

use glam::{DVec3, dvec3};

use crate::brdf::microfacet::metals::index_of_refraction;
use crate::brdf::microfacet::{Distribution, fresnel_conductor};
use crate::brdf::{Model, Parameters, Spacing, hash_numbers};
use crate::error::Result;

/// Wavelengths of red, green and blue in micrometres.
const LAMBDA_UM: DVec3 = dvec3(0.65, 0.55, 0.45);

/// The model of He, Torrance, Sillion and Greenberg.
#[derive(Clone, Copy, Debug)]
pub struct HeTorrance {
    /// Albedo of the uniform-diffuse term per channel, 0 to 1.
    pub diffuse: DVec3,
    /// sigma_0: root mean square of the heights in micrometres, 0.001 to 10.
    pub sigma_um: f64,
    /// tau: their autocorrelation length in micrometres, 0.1 to 100.
    pub tau_um: f64,
    /// Width of the lobe that stands for the mirror, as Beckmann's alpha, 0.001 to 0.1.
    pub specular_alpha: f64,
    /// Real part of the refractive index at the red, green and blue wavelengths.
    pub eta: DVec3,
    /// Imaginary part, not negative.
    pub k: DVec3,
}

impl HeTorrance {
    /// sigma / sigma_0: z_0 solves sqrt(pi / 2) z_0 = sigma_0 / 4 (K(theta_i) + K(theta_o)) e^(-z_0^2 / (2 sigma_0^2)).
    fn effective_roughness(&self, x: [f64; 2]) -> f64 {
        // K = tan theta erfc(x), and tan theta is tau / (2 sigma_0 x).
        let slope = 0.5 * self.tau_um / self.sigma_um;
        let k: f64 = x.iter().map(|&x| slope / x.max(1e-12) * libm::erfc(x)).sum();
        let right = k / 4.0 / (PI / 2.0).sqrt();
        // Of y = z_0 / sigma_0, y = right e^(-y^2 / 2): it lies below `right`, and below 10 for any number.
        let (mut low, mut high) = (0.0f64, right.min(10.0));
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if middle < right * (-0.5 * middle * middle).exp() { low = middle } else { high = middle }
        }
        (1.0 + low * low).sqrt().recip()
    }

    /// D of one channel over (pi tau / (2 lambda))^2, where `a` is v_xy^2 tau^2 / 4.
    fn scattering(g: f64, a: f64) -> f64 {
        let term = |m: f64| (-a / m).exp() / m;
        if g > 100.0 {
            let second = (-a / g).exp() * (2.0 - 4.0 * a / g + (a / g).powi(2)) / g.powi(3);
            return (term(g) + 0.5 * g * second).max(0.0);
        }
        // Poisson's weights beyond eight deviations are less than what double precision resolves of the rest.
        let first = (g - 8.0 * g.sqrt()).floor().max(1.0);
        let last = (g + 8.0 * g.sqrt() + 12.0).ceil();
        let mut weight = (first * g.ln() - g - libm::lgamma(first + 1.0)).exp();
        let (mut sum, mut m) = (0.0, first);
        while m <= last {
            sum += weight * term(m);
            m += 1.0;
            weight *= g / m;
        }
        sum
    }
}

/// S of one direction.
fn shadowing(x: f64) -> f64 {
    // cot theta is infinite along the normal, where nothing is in the shade.
    if x > 6.0 {
        return 1.0;
    }
    let x = x.max(1e-12);
    let lambda = 0.5 * ((-x * x).exp() / (PI.sqrt() * x) - libm::erfc(x));
    (1.0 - 0.5 * libm::erfc(x)) / (1.0 + lambda)
}

impl Model for HeTorrance {
    fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
        let sum = w_i + w_o;
        let h = sum.normalize();
        let x = [w_i, w_o].map(|w| 0.5 * self.tau_um / self.sigma_um * w.z / (w.x * w.x + w.y * w.y).sqrt().max(1e-12));
        let sigma_um = self.sigma_um * self.effective_roughness(x);
        let visible = fresnel_conductor(w_o.dot(h), self.eta, self.k) * (shadowing(x[0]) * shadowing(x[1]));
        let geometry = (sum.length_squared() / sum.z).powi(2);
        let over_cos = (w_i.z * w_o.z).recip();
        let mirror = 0.25 * Distribution::Beckmann.density(h, self.specular_alpha) * over_cos;
        let channel = |lambda_um: f64| {
            let g = (2.0 * PI * sigma_um / lambda_um * sum.z).powi(2).max(1e-300);
            let a = (PI * self.tau_um / lambda_um).powi(2) * (sum.x * sum.x + sum.y * sum.y);
            let d = (0.5 * PI * self.tau_um / lambda_um).powi(2) * Self::scattering(g, a);
            (-g).exp() * mirror + d * geometry * over_cos * FRAC_1_PI
        };
        visible * LAMBDA_UM.map(channel) + self.diffuse * FRAC_1_PI
    }

    fn from_parameters(parameters: &mut Parameters) -> Result<Self> {
        let diffuse =
            parameters.colour("diffuse", 0.0..=1.0, "Albedo of the uniform-diffuse term, linear Rec. 709.")?;
        let help = "Root mean square of the surface's heights in micrometres.";
        let sigma_um = parameters.number("sigma_um", 1e-3..=10.0, Spacing::Logarithmic, help)?;
        let help = "Autocorrelation length of the surface's heights in micrometres.";
        let tau_um = parameters.number("tau_um", 0.1..=100.0, Spacing::Logarithmic, help)?;
        let help = "Width of the lobe that stands for the mirror-like term, as Beckmann's alpha.";
        let specular_alpha = parameters.number("specular_alpha", 1e-3..=0.1, Spacing::Logarithmic, help)?;
        let (eta, k) = index_of_refraction(parameters)?;
        Ok(Self { diffuse, sigma_um, tau_um, specular_alpha, eta, k })
    }

    fn hash_content(&self, hasher: &mut blake3::Hasher) {
        for colour in [self.diffuse, self.eta, self.k] {
            hash_numbers(hasher, colour.to_array());
        }
        hash_numbers(hasher, [self.sigma_um, self.tau_um, self.specular_alpha]);
    }
}
