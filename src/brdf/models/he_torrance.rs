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
//! Departures: Delta, a perfect mirror in the paper, is a lobe of Beckmann's facets of the alpha `specular_alpha` with Smith's shadowing, as a mirror has
//! no BRDF. For g above 20 the sum, a mean over Poisson's distribution, is taken by its moments, with an error of at most 1e-4 of its peak.
//!
//! Rough surfaces (sigma_0 well above lambda) are those of geometrical optics: Beckmann's facets of alpha = 2 sigma_0 / tau. Smooth ones
//! are mirrors. Reciprocal. Energy is at most 1.05 within the theory's range, tau above lambda and 2 sigma_0 / tau below about 0.6, with
//! diffuse + F <= 1; beyond it is not bounded by it.
use std::f64::consts::{FRAC_1_PI, PI};

use glam::DVec3;
use lambert_w::lambert_w0;

use crate::brdf::microfacet::metals::{WAVELENGTHS_UM, index_of_refraction};
use crate::brdf::microfacet::{Distribution, Roughness, fresnel_conductor};
use crate::brdf::{Model, NARROWEST_ALPHA, Parameters, Spacing, hash_numbers};
use crate::error::Result;

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
    /// sigma / sigma_0, of the `slopes` of both directions: z_0 solves
    /// sqrt(pi / 2) z_0 = sigma_0 / 4 (K(theta_i) + K(theta_o)) e^(-z_0^2 / (2 sigma_0^2)).
    fn effective_roughness(&self, slopes: &[Slope; 2]) -> f64 {
        // K = tan theta erfc(x), and tan theta is tau / (2 sigma_0 x).
        let k: f64 = slopes.iter().map(|slope| 0.5 * self.tau_um / self.sigma_um * slope.erfc / slope.x).sum();
        let right = k / 4.0 / (PI / 2.0).sqrt();
        // With y = z_0 / sigma_0 this is y^2 e^(y^2) = right^2, and y^2 is Lambert's W(right^2).
        (1.0 + lambert_w0(right * right)).sqrt().recip()
    }
}

/// The sum over m >= 1 of g^m e^-g / m! e^(-a / m) / m: D of one channel over (pi tau / (2 lambda))^2, where `a` is v_xy^2 tau^2 / 4.
fn scattering(g: f64, a: f64) -> f64 {
    if g > MOST_SUMMED { by_moments(g, a / g) } else { by_sum(g, a) }
}

/// Above this g Poisson's weights g^m e^-g / m! are narrow enough for their moments.
const MOST_SUMMED: f64 = 20.0;

/// By its terms, up to five deviations and five above the mean: the others have less than 1e-7 of Poisson's weights.
fn by_sum(g: f64, a: f64) -> f64 {
    let last = (g + 5.0 * g.sqrt()) as u32 + 5;
    let (mut weight, mut sum) = ((-g).exp(), 0.0);
    for m in 1..=last {
        let by_m = f64::from(m).recip();
        weight *= g * by_m;
        sum += weight * by_m * (-a * by_m).exp();
    }
    sum
}

/// By Poisson's moments, `u` = a / g, with an error of 1e-4 of the peak: with m = g (1 + e), e^(-a / m) / m is e^-u / g times the sum over n of
/// (-e)^n L_n(u), the series that generates Laguerre's polynomials. The means of powers of -e up to the sixth are those here.
fn by_moments(g: f64, u: f64) -> f64 {
    let r = g.recip();
    let means = [r, -r * r, r * r * (3.0 + r), -r.powi(3) * (10.0 + r), r.powi(3) * (15.0 + r * (25.0 + r))];
    // L_0 has the mean 1, L_1 the mean 0.
    let (mut before, mut laguerre, mut sum) = (1.0, 1.0 - u, 1.0);
    for (n, mean) in (2..).map(f64::from).zip(means) {
        (before, laguerre) = (laguerre, ((2.0 * n - 1.0 - u) * laguerre - (n - 1.0) * before) / n);
        sum += mean * laguerre;
    }
    ((-u).exp() * r * sum).max(0.0)
}

/// x of one direction, and erfc(x).
struct Slope {
    x: f64,
    erfc: f64,
}

impl Slope {
    fn of(w: DVec3, sigma_um: f64, tau_um: f64) -> Self {
        // cot theta is infinite along the normal; at grazing angles x would be 0, by which S and K divide.
        let x = (0.5 * tau_um / sigma_um * w.z / (w.x * w.x + w.y * w.y).sqrt().max(1e-12)).max(1e-12);
        Self { x, erfc: libm::erfc(x) }
    }

    /// S of the direction.
    fn shadowing(&self) -> f64 {
        let &Self { x, erfc } = self;
        let lambda = 0.5 * ((-x * x).exp() / (PI.sqrt() * x) - erfc);
        (1.0 - 0.5 * erfc) / (1.0 + lambda)
    }
}

impl Model for HeTorrance {
    fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
        let sum = w_i + w_o;
        let h = sum.normalize();
        let slopes = [w_i, w_o].map(|w| Slope::of(w, self.sigma_um, self.tau_um));
        let sigma_um = self.sigma_um * self.effective_roughness(&slopes);
        let shadowing: f64 = slopes.iter().map(Slope::shadowing).product();
        let visible = fresnel_conductor(w_o.dot(h), self.eta, self.k) * shadowing;
        let geometry = (sum.length_squared() / sum.z).powi(2);
        let over_cos = (w_i.z * w_o.z).recip();
        // Without shadowing of its own it would reflect up to 3.7 times what it receives at 89.5 degrees.
        let roughness = Roughness::isotropic(self.specular_alpha);
        let mirror = Distribution::Beckmann.torrance_sparrow(w_i, w_o, h, roughness);
        let channel = |lambda_um: f64| {
            let g = (2.0 * PI * sigma_um / lambda_um * sum.z).powi(2).max(1e-300);
            let a = (PI * self.tau_um / lambda_um).powi(2) * (sum.x * sum.x + sum.y * sum.y);
            let d = (0.5 * PI * self.tau_um / lambda_um).powi(2) * scattering(g, a);
            (-g).exp() * mirror + d * geometry * over_cos * FRAC_1_PI
        };
        visible * WAVELENGTHS_UM.map(channel) + self.diffuse * FRAC_1_PI
    }

    fn from_parameters(parameters: &mut Parameters) -> Result<Self> {
        let diffuse =
            parameters.colour("diffuse", 0.0..=1.0, "Albedo of the uniform-diffuse term, linear Rec. 709.")?;
        let help = "Root mean square of the surface's heights in micrometres.";
        let sigma_um = parameters.number("sigma_um", 1e-3..=10.0, Spacing::Logarithmic, help)?;
        let help = "Autocorrelation length of the surface's heights in micrometres.";
        let tau_um = parameters.number("tau_um", 0.1..=100.0, Spacing::Logarithmic, help)?;
        let help = "Width of the lobe that stands for the mirror-like term, as Beckmann's alpha.";
        let specular_alpha = parameters.number("specular_alpha", NARROWEST_ALPHA..=0.1, Spacing::Logarithmic, help)?;
        let (eta, k) = index_of_refraction(parameters)?;
        Ok(Self { diffuse, sigma_um, tau_um, specular_alpha, eta, k })
    }

    fn hash_content(&self, hasher: &mut blake3::Hasher) {
        // Caches hold threads and pictures of earlier versions, whose mirror had no shadowing.
        hasher.update(b"shadowed mirror");
        for colour in [self.diffuse, self.eta, self.k] {
            hash_numbers(hasher, colour.to_array());
        }
        hash_numbers(hasher, [self.sigma_um, self.tau_um, self.specular_alpha]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scattering_is_poissons_mean() {
        for g in [1e-300, 1e-3, 0.3, 1.0, 4.0, 11.0, 19.9, 20.1, 30.0, 100.0, 3000.0] {
            let last = (g + 12.0 * f64::sqrt(g)) as u32 + 40;
            let weight = |m: f64| (m * g.ln() - g - libm::lgamma(m + 1.0)).exp();
            let mean = |a: f64| (1..last).map(f64::from).map(|m| weight(m) * (-a / m).exp() / m).sum::<f64>();
            for u in [0.0, 0.01, 0.2, 1.0, 3.0, 10.0, 100.0, 1e8] {
                let a = u * f64::max(g, 1.0);
                let error = (scattering(g, a) - mean(a)).abs() / mean(0.0);
                assert!(error < if g > MOST_SUMMED { 1e-4 } else { 1e-6 } || mean(0.0) < 1e-30, "{g} {a}: {error}");
            }
        }
    }
}
