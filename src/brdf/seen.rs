//! A BRDF as a view sees it: w_o is in the plane of x and z, and the surface is turned under it.
use glam::{DVec2, DVec3};

use super::Brdf;

/// Azimuths of the view whose mean stands for all: every 15 degrees.
const MEAN_AZIMUTHS: usize = 24;

/// A BRDF in the frame of the view. Of an isotropic one every azimuth of the view is the same; an anisotropic one is seen from one of them,
/// or as the mean of all.
#[derive(Clone, Debug)]
pub struct SeenBrdf<'a> {
    brdf: &'a Brdf,
    /// Cosine and sine of the azimuths phi_o of w_o, from the tangent; none where w_o is along it or the azimuth does not matter.
    azimuths: Vec<DVec2>,
}

impl<'a> SeenBrdf<'a> {
    /// From the azimuth `phi_o` of w_o, in radians from the tangent.
    pub fn from_azimuth(brdf: &'a Brdf, phi_o: f64) -> Self {
        Self { brdf, azimuths: if phi_o == 0.0 { Vec::new() } else { vec![DVec2::from_angle(phi_o)] } }
    }

    /// From any: itself if it is isotropic, else the mean over azimuths.
    pub fn from_all_around(brdf: &'a Brdf) -> Self {
        let azimuth = |i: usize| DVec2::from_angle(std::f64::consts::TAU * i as f64 / MEAN_AZIMUTHS as f64);
        let count = if brdf.is_isotropic() { 0 } else { MEAN_AZIMUTHS };
        Self { brdf, azimuths: (0..count).map(azimuth).collect() }
    }

    /// f(w_i, w_o) as [`Brdf::evaluate`], `w_o` in the plane of x and z.
    pub fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
        if self.azimuths.is_empty() {
            return self.brdf.evaluate(w_i, w_o);
        }
        let f = |azimuth: &DVec2| self.brdf.evaluate(turned(w_i, *azimuth), turned(w_o, *azimuth));
        self.azimuths.iter().map(f).sum::<DVec3>() / self.azimuths.len() as f64
    }

    /// [`Brdf::evaluate_all`], `w_o` in the plane of x and z.
    pub fn evaluate_all(&self, w_i: &[DVec3], w_o: DVec3) -> Vec<DVec3> {
        if self.azimuths.is_empty() {
            return self.brdf.evaluate_all(w_i, w_o);
        }
        let mut mean = vec![DVec3::ZERO; w_i.len()];
        for azimuth in &self.azimuths {
            let directions: Vec<_> = w_i.iter().map(|w| turned(*w, *azimuth)).collect();
            let f = self.brdf.evaluate_all(&directions, turned(w_o, *azimuth));
            mean.iter_mut().zip(f).for_each(|(mean, f)| *mean += f / self.azimuths.len() as f64);
        }
        mean
    }
}

/// `w` turned about z by an angle of this cosine and sine.
fn turned(w: DVec3, angle: DVec2) -> DVec3 {
    angle.rotate(w.truncate()).extend(w.z)
}
