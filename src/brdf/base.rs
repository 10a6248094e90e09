//! What a BRDF scatters evenly around the normal: how that depends on the angle of light.
use std::f64::consts::TAU;

use faer::linalg::solvers::{Llt, Solve};
use faer::{Mat, Side};
use glam::dvec3;

use super::{Brdf, luminance};

/// A diffuse base under a coat, or one of rough facets, answers light from theta_i as T(cos theta_i) cos theta_i: T is a polynomial of the cosine,
/// in the mean over cosine-weighted directions 1, and 1 everywhere of Lambert's.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct BaseProfile(pub [f32; BaseProfile::TERMS]);

impl BaseProfile {
    /// How many coefficients it has: transmission through a coat by Schlick's formula is of degree 5 in the cosine.
    pub const TERMS: usize = 6;

    /// Lambert's.
    pub const EVEN: Self = Self([1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);

    /// How many of its coefficients count: those up to the last that is not 0.
    pub fn terms(&self) -> usize {
        self.0.iter().rposition(|term| *term != 0.0).map_or(0, |last| last + 1)
    }

    /// That of `brdf`: over the azimuth f is least where it is the base alone.
    pub fn of(brdf: &Brdf) -> Self {
        /// View angles, in degrees: nearer to the normal light of all azimuths is near the lobe.
        const ANGLES_DEG: [f64; 6] = [40.0, 48.0, 56.0, 64.0, 72.0, 80.0];
        const AZIMUTHS: usize = 24;
        const COSINES: usize = 64;
        const TERMS: usize = BaseProfile::TERMS;
        /// Less than this part of what is reflected has no say.
        const LEAST_SHARE: f64 = 1e-3;
        let cosine = |i: usize| (i as f64 + 0.5) / COSINES as f64;
        let mut least = [0.0; COSINES];
        let mut most = 0.0;
        for theta_o in ANGLES_DEG.map(f64::to_radians) {
            let w_o = dvec3(theta_o.sin(), 0.0, theta_o.cos());
            for (i, least) in least.iter_mut().enumerate() {
                let (cos, sin) = (cosine(i), (1.0 - cosine(i) * cosine(i)).sqrt());
                let directions = (0..AZIMUTHS).map(|k| TAU * (k as f64 + 0.5) / AZIMUTHS as f64);
                let directions: Vec<_> = directions.map(|phi| dvec3(sin * phi.cos(), sin * phi.sin(), cos)).collect();
                let values = brdf.evaluate_all(&directions, w_o).into_iter().map(luminance);
                let (low, sum) = values.fold((f64::INFINITY, 0.0_f64), |(low, sum), f: f64| (low.min(f), sum + f));
                *least += low.max(0.0) * w_o.z;
                most += sum / AZIMUTHS as f64 * cos * w_o.z;
            }
        }
        let mean = least.iter().enumerate().map(|(i, least)| least * cosine(i)).sum::<f64>();
        // Written so that nothing at all has no say, either.
        if mean <= LEAST_SHARE * most {
            return Self::EVEN;
        }
        // Least squares of T cos.
        let power = |i: usize, p: usize| cosine(i).powi(p as i32 + 1);
        let product = |p: usize, q: usize| (0..COSINES).map(|i| power(i, p) * power(i, q)).sum::<f64>();
        // Powers are nearly alike; what is added to the diagonal keeps coefficients within what single precision sums.
        let matrix = Mat::from_fn(TERMS, TERMS, |p, q| product(p, q) + if p == q { 1e-9 } else { 0.0 });
        let right =
            Mat::from_fn(TERMS, 1, |p, _| (0..COSINES).map(|i| power(i, p) * least[i] * cosine(i) / mean).sum::<f64>());
        let Ok(factor) = Llt::new(matrix.as_ref(), Side::Lower) else { return Self::EVEN };
        let found = factor.solve(&right);
        let found: [f64; TERMS] = std::array::from_fn(|p| found[(p, 0)]);
        // 2 times the integral of c^(p + 1) dc.
        let integral: f64 = found.iter().enumerate().map(|(p, t)| t * 2.0 / (p as f64 + 2.0)).sum();
        Self(found.map(|t| (t / integral) as f32))
    }

    /// T at this cosine. Twin of `base_profile` in glsl/methods/fitted.glsl.
    pub fn at(&self, cos: f32) -> f32 {
        self.0.iter().rev().fold(0.0, |sum, t| sum * cos + t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::tests::samples::of_model;

    #[test]
    fn the_base_of_a_product_is_its_part_that_depends_on_light_whatever_lobe_is_over_it() {
        // Ashikhmin and Shirley's is (1 - (1 - cos theta_i / 2)^5) (1 - (1 - cos theta_o / 2)^5).
        let ashikhmin = |c: f64| 1.0 - (1.0 - 0.5 * c).powi(5);
        let mean =
            (0..1000).map(|i| (f64::from(i) + 0.5) / 1000.0).map(|c| 2.0 * c * ashikhmin(c)).sum::<f64>() / 1000.0;
        let found = BaseProfile::of(&of_model("ashikhmin_shirley", "diffuse = 0.5\nspecular = 0.1\nexponent = 3000"));
        for c in [0.0, 0.1, 0.3, 0.7, 1.0] {
            let error = f64::from(found.at(c as f32)) - ashikhmin(c) / mean;
            assert!(error.abs() < 2e-3, "{c}: off by {error}");
        }
        let lambert = BaseProfile::of(&of_model("lambert", "reflectance = [0.8, 0.5, 0.2]"));
        assert!([0.0, 0.2, 1.0].into_iter().all(|c| (lambert.at(c) - 1.0).abs() < 1e-4), "{lambert:?}");
    }

    #[test]
    fn what_has_no_base_has_lamberts_and_every_base_has_the_mean_1() {
        let black = of_model("lambert", "reflectance = 0");
        let mirror = of_model("conductor", "distribution = 'beckmann'\nalpha = 0.02\nmetal = 'Al'");
        assert_eq!([&black, &mirror].map(BaseProfile::of), [BaseProfile::EVEN; 2]);
        for material in Brdf::builtin_names() {
            let base = BaseProfile::of(&Brdf::builtin(material).unwrap());
            let mean = (0..1000).map(|i| (i as f32 + 0.5) / 1000.0).map(|c| 2.0 * c * base.at(c)).sum::<f32>() / 1000.0;
            assert!((mean - 1.0).abs() < 1e-3, "{material}: {mean}");
        }
    }
}
