//! GGX's lobe about the mirror direction as prefiltered maps have it, the same from everywhere: that seen along the normal, n = v = r
//! (Karis, "Real Shading in Unreal Engine 4", 2013).
use std::f64::consts::TAU;

use glam::{DVec3, dvec3};

use crate::brdf::Distribution;

/// A direction of the lobe around z, and what it stands for.
#[derive(Clone, Copy, Debug)]
pub struct Tap {
    /// Unit, z positive.
    pub direction: DVec3,
    /// n . l: Karis's weight. Not normalised.
    pub weight: f64,
    /// In steradian: those of all taps are the hemisphere.
    pub solid_angle_sr: f64,
}

/// The lobe of this roughness in `rings` of equal mass of D (n . h) dh, each of as many taps.
///
/// Light at l has the density D (n . h) / (4 v . h) = D / 4.
pub fn ggx_lobe(roughness_alpha: f64, rings: usize) -> Vec<Tap> {
    // Above the horizon the half vector is within 45 degrees of the normal: tan^2 theta_h = alpha^2 u / (1 - u) is at most 1.
    let alpha_2 = roughness_alpha * roughness_alpha;
    let most = 1.0 / (1.0 + alpha_2);
    let tap = |i: usize| {
        let (ring, azimuth) = (i / rings, i % rings);
        let u = most * (ring as f64 + 0.5) / rings as f64;
        let tan_theta_h = (alpha_2 * u / (1.0 - u)).sqrt();
        let phi = TAU * (azimuth as f64 + 0.5 * (ring % 2) as f64) / rings as f64;
        let h = dvec3(tan_theta_h * phi.cos(), tan_theta_h * phi.sin(), 1.0).normalize();
        let direction = 2.0 * h.z * h - DVec3::Z;
        let density = Distribution::Ggx.density(h, roughness_alpha) / 4.0;
        Tap { direction, weight: direction.z, solid_angle_sr: most / (density * (rings * rings) as f64) }
    };
    (0..rings * rings).map(tap).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn taps_have_the_mass_and_the_width_of_the_lobe() {
        for alpha in [0.01, 0.25, 1.0] {
            let taps = ggx_lobe(alpha, 32);
            let area: f64 = taps.iter().map(|tap| tap.solid_angle_sr).sum();
            // Of a narrow lobe the last ring stands for nearly all of the hemisphere.
            assert!((area / TAU - 1.0).abs() < 0.05 || alpha < 0.1, "{alpha}: {area}");
            // Half of the mass of D (n . h) is within tan theta_h = alpha; the part 1 / (1 + alpha^2) of all is above the horizon.
            let within = taps.iter().filter(|tap| tap.direction.z.acos() < 2.0 * alpha.atan() + 1e-9).count();
            let expected = 0.5 * (1.0 + alpha * alpha) * taps.len() as f64;
            assert!((within as f64 - expected).abs() <= 32.0, "{alpha}: {within} {expected}");
            assert!(taps.iter().all(|tap| tap.direction.is_normalized() && tap.weight > 0.0), "{alpha}");
        }
    }
}
