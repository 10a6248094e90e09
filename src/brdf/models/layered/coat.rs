//! A dielectric coat: what it reflects, how light is bent into it, and what it lets through and absorbs.
use glam::{DVec2, DVec3, dvec3};

use crate::brdf::cosines::at_cosine;
use crate::brdf::microfacet::{Distribution, fresnel_dielectric};
use crate::brdf::{NARROWEST_ALPHA, Parameters, Roughness, Spacing, hash_numbers, reflect};
use crate::error::Result;

/// Intervals between the cosines (i / n)^2 at which the reflectance of the interface is known.
const INTERVALS: usize = 128;

/// Cosines within the coat below which a path counts as one of this cosine: it is 10^6 times the coat's thickness.
const LEAST_COS: f64 = 1e-6;

/// A clear or coloured layer with a rough upper side of GGX facets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Coat {
    /// Roughness of its upper side, 0.001 to 1, not squared.
    pub alpha: f64,
    /// Its index of refraction, 1 to 3.
    pub ior: f64,
    /// In millimetres, 0 to 10.
    pub thickness_mm: f64,
    /// Absorption per channel in 1/mm, 0 to 100.
    pub absorption: DVec3,
}

impl Coat {
    pub(super) fn from_parameters(parameters: &mut Parameters) -> Result<Self> {
        let help = "Roughness of the coat, used as it is, not squared: 0.001 is a mirror.";
        let alpha = parameters.number("alpha", NARROWEST_ALPHA..=1.0, Spacing::Logarithmic, help)?;
        let ior =
            parameters.number("ior", 1.0..=3.0, Spacing::Linear, "Index of refraction of the coat, against air.")?;
        let help = "Thickness of the coat in millimetres; 0 where left out.";
        let thickness_mm = parameters.number_or("thickness", 0.0..=10.0, 0.0, help)?;
        let help = "What the coat absorbs of red, green and blue, in 1/mm: e^(-absorption thickness) is left on the way straight through.";
        let is_coloured = parameters.has("absorption");
        let absorption = if is_coloured { parameters.colour("absorption", 0.0..=100.0, help)? } else { DVec3::ZERO };
        Ok(Self { alpha, ior, thickness_mm, absorption })
    }

    pub(super) fn hash_content(&self, hasher: &mut blake3::Hasher) {
        hash_numbers(hasher, [self.alpha, self.ior, self.thickness_mm]);
        hash_numbers(hasher, self.absorption.to_array());
    }

    /// Light that its upper side reflects: F D G / (4 cos cos), in 1/sr.
    #[inline]
    pub fn reflection(&self, w_i: DVec3, w_o: DVec3) -> f64 {
        let h = (w_i + w_o).normalize();
        let lobe = Distribution::Ggx.torrance_sparrow(w_i, w_o, h, Roughness::isotropic(self.alpha));
        fresnel_dielectric(w_o.dot(h), self.ior) * lobe
    }

    /// The direction within the coat of light that is `w` outside: Snell's law at its mean surface.
    #[inline]
    pub fn refract(&self, w: DVec3) -> DVec3 {
        let across = w.truncate() / self.ior;
        across.extend(self.cos_inside(w.z))
    }

    /// The cosine within the coat for one outside.
    #[inline]
    pub fn cos_inside(&self, cos_outside: f64) -> f64 {
        (1.0 - (1.0 - cos_outside * cos_outside) / (self.ior * self.ior)).max(0.0).sqrt()
    }

    /// The cosine outside for one within; none where light is reflected totally.
    #[inline]
    pub fn cos_outside(&self, cos_inside: f64) -> Option<f64> {
        let square = 1.0 - (1.0 - cos_inside * cos_inside) * self.ior * self.ior;
        (square > 0.0).then(|| square.sqrt())
    }

    /// The smallest cosine within the coat of light from outside.
    pub fn critical_cos(&self) -> f64 {
        self.cos_inside(0.0)
    }

    /// What is left on the way through at this cosine within: Beer's law.
    #[inline]
    pub fn left_after(&self, cos_inside: f64) -> DVec3 {
        (self.absorption * (-self.thickness_mm / cos_inside.max(LEAST_COS))).exp()
    }

    /// Reflectance of its upper side, by the cosine outside.
    pub(super) fn interface(&self) -> Interface {
        let reflectance = |i: usize| self.reflectance((i as f64 / INTERVALS as f64).powi(2).max(1e-6));
        Interface { reflectance: (0..=INTERVALS).map(reflectance).collect() }
    }

    /// The integral of [`Self::reflection`] times cos over all light: the mean of F G1(w_i) over the facets that are seen from `cos_theta`
    /// (Heitz, "Sampling the GGX Distribution of Visible Normals", 2018), by the midpoint rule over his two random numbers.
    fn reflectance(&self, cos_theta: f64) -> f64 {
        const STEPS: usize = 32;
        let w_o = dvec3((1.0 - cos_theta * cos_theta).sqrt(), 0.0, cos_theta);
        // Stretched to alpha = 1, where seen facets are those of a half ball.
        let stretched = dvec3(self.alpha * w_o.x, 0.0, w_o.z).normalize();
        let (t1, t2) = (DVec3::Y, stretched.cross(DVec3::Y));
        let term = |place: usize| {
            let [u, v] = [place / STEPS, place % STEPS].map(|i| (i as f64 + 0.5) / STEPS as f64);
            let disk = DVec2::from_angle(std::f64::consts::TAU * v) * u.sqrt();
            let s = 0.5 * (1.0 + stretched.z);
            let y = (1.0 - s) * (1.0 - disk.x * disk.x).max(0.0).sqrt() + s * disk.y;
            let z = (1.0 - disk.x * disk.x - y * y).max(0.0).sqrt();
            let normal = disk.x * t1 + y * t2 + z * stretched;
            let h = dvec3(self.alpha * normal.x, self.alpha * normal.y, normal.z.max(0.0)).normalize();
            let w_i = reflect(w_o, h);
            let g1 = |cos: f64| cos * Distribution::Ggx.g1_over_cos(cos, self.alpha);
            if w_i.z > 0.0 { fresnel_dielectric(w_o.dot(h), self.ior) * g1(w_i.z) } else { 0.0 }
        };
        // Facets at either side of the plane of the view are alike: half of the azimuths, v from a quarter back to a quarter on, will do.
        let quarter = STEPS / 4;
        let is_counted = |place: &usize| place % STEPS < quarter || place % STEPS >= STEPS - quarter;
        (0..STEPS * STEPS).filter(is_counted).map(term).sum::<f64>() / (STEPS * STEPS / 2) as f64
    }
}

/// The upper side of a coat as what is below sees it.
#[derive(Clone, Debug)]
pub(super) struct Interface {
    /// At the cosines (i / INTERVALS)^2 outside.
    reflectance: Vec<f64>,
}

impl Interface {
    /// What is not reflected: it goes in or out. What several facets reflect in turn is part of it.
    pub fn transmittance(&self, cos_outside: f64) -> f64 {
        1.0 - at_cosine(&self.reflectance, cos_outside)
    }
}
