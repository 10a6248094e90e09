//! What the split sum looks up of a BRDF: how much it reflects of light from all around, and of that about the mirror direction.
//!
//! Karis, "Real Shading in Unreal Engine 4" (2013), for any BRDF: roughness and diffuse part are those by which the split sum answers lights
//! best, and the BRDF's own albedo is in the place of Karis's table of scale and bias, which approximates that of GGX.
use std::f64::consts::{FRAC_PI_2, TAU};

use glam::{DVec3, dvec3};
use rayon::prelude::*;

use super::fitted::kernel::vmf_peak;
use super::fitted::lights::{BaseAnswers, LightSettings, Quadrature, SCALES, TestLights, light_kappa};
use super::rim::rim_power;
use super::slice::{Resolution, Slice};
use super::theta_o;
use crate::brdf::{BaseProfile, Brdf, NARROWEST_ALPHA, SeenBrdf, Tap, ggx_lobe};
use crate::shader_constants::split_sum::SPLIT_SUM_ROWS;

/// View angles: theta_o = row 90 deg / (ROWS - 1), the last 89.99 degrees.
pub const ROWS: usize = SPLIT_SUM_ROWS as usize;

/// View angles at which lights are answered.
const FITTED_ROWS: [usize; 6] = [0, 20, 40, 55, 70, 80];
/// Test lights of each.
const LIGHTS: LightSettings = LightSettings { count: 512, threads: 1, seed: 0 };
/// The lobe is so many rings of so many taps.
const RINGS: usize = 12;

/// Beside the narrowest lobe so many up to 1 are tried, and steps between the neighbours of the best.
const ALPHA_STEPS: usize = 20;
const REFINING_STEPS: usize = 6;

/// A BRDF in two terms, each its albedo times light that is filtered by a fixed lobe.
#[derive(Clone, Debug, PartialEq)]
pub struct SplitSum {
    /// How widely the light about the mirror direction is filtered: GGX's roughness as it is, not squared.
    pub roughness_alpha: f64,
    /// How albedos go from the last row but one to the last: [`rim_power`].
    pub rim_power: f32,
    /// Row by row, the albedo of Lambert's part and what is left of the BRDF's own.
    pub albedos: Vec<[DVec3; 2]>,
}

impl SplitSum {
    /// Of `brdf`. Of an anisotropic one the roughness is that of the mean over the azimuths of the view, and albedos are the means of those
    /// along and across the tangent.
    pub fn new(brdf: &Brdf) -> Self {
        let (seen, is_isotropic) = (SeenBrdf::from_all_around(brdf), brdf.is_isotropic());
        let answers: Vec<_> = FITTED_ROWS.into_par_iter().map(|row| Answers::new(&seen, row)).collect();
        let cost_at = |log_alpha: f64| fit(&answers, log_alpha.exp()).1;
        let step = -NARROWEST_ALPHA.ln() / ALPHA_STEPS as f64;
        let places: Vec<_> = (0..=ALPHA_STEPS).map(|i| NARROWEST_ALPHA.ln() + step * i as f64).collect();
        let costs: Vec<_> = places.par_iter().map(|&place| cost_at(place)).collect();
        let best = (0..places.len()).min_by(|&a, &b| costs[a].total_cmp(&costs[b])).expect("there are some");
        let (mut low, mut high) = ((places[best] - step).max(places[0]), (places[best] + step).min(0.0));
        for _ in 0..REFINING_STEPS {
            let [a, b] = [low + (high - low) / 3.0, high - (high - low) / 3.0];
            if cost_at(a) < cost_at(b) { high = b } else { low = a }
        }
        let roughness_alpha = (0.5 * (low + high)).exp();
        let (diffuse, _) = fit(&answers, roughness_alpha);
        let albedo = |theta_o: f64| {
            let from = |phi_o: f64| brdf.albedo_from(theta_o, phi_o);
            // Along and across the tangent: of a long lobe the least and the most.
            if is_isotropic { from(0.0) } else { 0.5 * (from(0.0) + from(FRAC_PI_2)) }
        };
        let albedos: Vec<_> = (0..ROWS).into_par_iter().map(|row| albedo(theta_o(row, ROWS))).collect();
        let rim_power = rim_power(&albedos, albedo);
        let parts = |albedo: DVec3| {
            let diffuse = diffuse.min(albedo);
            [diffuse, albedo - diffuse]
        };
        Self { roughness_alpha, rim_power, albedos: albedos.into_iter().map(parts).collect() }
    }

    /// The numbers of the shader's buffer: roughness_alpha, then the two albedos of each row.
    pub fn device_floats(&self) -> Vec<f32> {
        let rows = self.albedos.iter().flatten().flat_map(|albedo| albedo.as_vec3().to_array());
        std::iter::once(self.roughness_alpha as f32).chain(rows).collect()
    }
}

/// How the BRDF answers lights in a row.
struct Answers {
    lights: TestLights,
    albedo: DVec3,
    mirror: DVec3,
}

impl Answers {
    fn new(brdf: &SeenBrdf, row: usize) -> Self {
        let theta_o = theta_o(row, ROWS);
        let slices = Slice::with_lobes(brdf, theta_o, Resolution::DRAFT);
        let lights = TestLights::new(&slices, LIGHTS, Quadrature::DRAFT, &BaseAnswers::of(&BaseProfile::EVEN));
        Self { lights, albedo: slices[0].albedo(), mirror: dvec3(-theta_o.sin(), 0.0, theta_o.cos()) }
    }

    /// With a map prefiltered for this roughness, for each light: what a BRDF without a diffuse part leaves of the response, and how much less
    /// that is for a diffuse albedo of 1.
    fn residuals(&self, roughness_alpha: f64) -> Vec<(DVec3, f64)> {
        let taps = ggx_lobe(roughness_alpha, RINGS);
        let total: f64 = taps.iter().map(|tap| tap.weight).sum();
        let (x, y) = self.mirror.any_orthonormal_pair();
        let taps: Vec<_> = taps
            .iter()
            .map(|Tap { direction: d, weight, solid_angle_sr }| {
                let direction = d.x * x + d.y * y + d.z * self.mirror;
                // As maps are made, each tap stands for its cell: a kernel of its area, 2 pi over kappa.
                (direction, weight / total, solid_angle_sr / TAU)
            })
            .collect();
        let TestLights { direction: [xs, ys, zs], weight, cosine, response: [red, green, blue], unit, .. } =
            &self.lights;
        let residual = |scale: usize, j: usize| {
            let light = dvec3(xs[j].into(), ys[j].into(), zs[j].into());
            let tap = |&(direction, share, variance): &(DVec3, f64, f64)| {
                let kappa = 1.0 / (1.0 / light_kappa(scale) + variance);
                share * vmf_peak(kappa) * (kappa * (light.dot(direction) - 1.0)).exp()
            };
            let filtered = f64::from(weight[j]) * taps.iter().map(tap).sum::<f64>();
            let response = dvec3(red[j].into(), green[j].into(), blue[j].into());
            (response - filtered / unit * self.albedo, (f64::from(cosine[j]) - filtered) / unit)
        };
        let of_scale = |scale: usize| self.lights.of_scale(scale).map(move |j| (scale, j));
        (0..SCALES).flat_map(of_scale).map(|(scale, j)| residual(scale, j)).collect()
    }
}

/// The diffuse albedo by which the split sum of this roughness answers best, and the sum of squares that is left.
fn fit(answers: &[Answers], roughness_alpha: f64) -> (DVec3, f64) {
    let residuals: Vec<_> = answers.iter().flat_map(|answers| answers.residuals(roughness_alpha)).collect();
    let least_albedo = answers.iter().map(|answers| answers.albedo).fold(DVec3::INFINITY, DVec3::min);
    let square: f64 = residuals.iter().map(|(_, slope)| slope * slope).sum();
    let product: DVec3 = residuals.iter().map(|(rest, slope)| *slope * *rest).sum();
    let diffuse = (product / square.max(f64::MIN_POSITIVE)).max(DVec3::ZERO).min(least_albedo);
    (diffuse, residuals.iter().map(|(rest, slope)| (*rest - *slope * diffuse).length_squared()).sum())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::tests::samples::of_model;

    fn split_sum(model: &str, parameters: &str) -> SplitSum {
        SplitSum::new(&of_model(model, parameters))
    }

    #[test]
    fn roughness_of_ggx_is_found_again_and_the_terms_are_the_albedo() {
        for alpha in [0.02, 0.1, 0.4] {
            let parameters = format!("distribution = 'ggx'\nalpha = {alpha}\nior = 1.5\ndiffuse = [0.6, 0.3, 0.1]");
            let brdf = of_model("plastic", &parameters);
            let found = SplitSum::new(&brdf);
            assert!((0.6..1.5).contains(&(found.roughness_alpha / alpha)), "{alpha}: {}", found.roughness_alpha);
            for row in [0, 45, 90] {
                let [diffuse, specular] = found.albedos[row];
                assert!((diffuse + specular).abs_diff_eq(brdf.albedo(theta_o(row, ROWS)), 1e-12));
                assert!(diffuse.min_element() >= 0.0 && specular.min_element() >= 0.0, "{alpha} {row}");
            }
            // A wide lobe and the diffuse part cannot be told apart.
            let is_near = found.albedos[0][0].abs_diff_eq(dvec3(0.6, 0.3, 0.1), 0.08);
            assert!(is_near || alpha > 0.1, "{alpha}: {:?}", found.albedos[0]);
        }
    }

    #[test]
    fn what_has_no_lobe_is_diffuse_and_what_reflects_nothing_is_black() {
        let [diffuse, specular] = split_sum("lambert", "reflectance = [0.8, 0.4, 0.1]").albedos[30];
        assert!(
            diffuse.abs_diff_eq(dvec3(0.8, 0.4, 0.1), 0.02) && specular.max_element() < 0.02,
            "{diffuse} {specular}"
        );
        assert_eq!(split_sum("lambert", "reflectance = 0").albedos[0], [DVec3::ZERO; 2]);
    }
}
