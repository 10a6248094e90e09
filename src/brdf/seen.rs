//! A BRDF as a view sees it: w_o is in the plane of x and z, and the surface is turned under it.
use std::f64::consts::TAU;

use glam::{DVec2, DVec3, dvec2};

use super::{Brdf, Ellipse, LobeShape};

/// Azimuths whose mean stands for all: as many at least.
const MEAN_AZIMUTHS: usize = 24;

/// A BRDF in the frame of the view. Of an isotropic one every azimuth of the view is the same; an anisotropic one is seen from one of them,
/// or as the mean of all.
#[derive(Clone, Debug)]
pub struct SeenBrdf<'a> {
    brdf: &'a Brdf,
    from: Viewpoint,
}

/// Azimuths are from the tangent, as their cosines and sines.
#[derive(Clone, Debug)]
enum Viewpoint {
    /// Along the tangent, or no matter.
    Tangent,
    /// The azimuth phi_o of w_o.
    Azimuth(DVec2),
    /// All of them: azimuths of the half vector, each with its share.
    AllAround(Vec<(DVec2, f64)>),
}

impl<'a> SeenBrdf<'a> {
    /// From the azimuth `phi_o` of w_o, in radians from the tangent.
    pub fn from_azimuth(brdf: &'a Brdf, phi_o: f64) -> Self {
        Self {
            brdf,
            from: if phi_o == 0.0 { Viewpoint::Tangent } else { Viewpoint::Azimuth(DVec2::from_angle(phi_o)) },
        }
    }

    /// From any: itself if it is isotropic, else the mean over azimuths. These are such that half vectors have those that suit its lobe: see
    /// [`Ellipse`].
    pub fn from_all_around(brdf: &'a Brdf) -> Self {
        if brdf.is_isotropic() {
            return Self { brdf, from: Viewpoint::Tangent };
        }
        let ellipse = Ellipse::of(&LobeShape::of(brdf));
        let count = ellipse.azimuths(MEAN_AZIMUTHS);
        let azimuth = |i: usize| {
            let (azimuth, widened) = ellipse.of_circle(DVec2::from_angle(TAU * (i as f64 + 0.5) / count as f64));
            (azimuth, widened / count as f64)
        };
        Self { brdf, from: Viewpoint::AllAround((0..count).map(azimuth).collect()) }
    }

    /// f(w_i, w_o) as [`Brdf::evaluate`], `w_o` in the plane of x and z.
    pub fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
        let from = |azimuth| self.brdf.evaluate(turned(w_i, azimuth), turned(w_o, azimuth));
        match &self.from {
            Viewpoint::Tangent => self.brdf.evaluate(w_i, w_o),
            Viewpoint::Azimuth(azimuth) => from(*azimuth),
            Viewpoint::AllAround(azimuths) => {
                let h = (w_i + w_o).truncate().normalize_or(DVec2::X);
                let back = dvec2(h.x, -h.y);
                azimuths.iter().map(|&(azimuth, share)| from(azimuth.rotate(back)) * share).sum()
            }
        }
    }

    /// [`Brdf::evaluate_all`], `w_o` in the plane of x and z.
    pub fn evaluate_all(&self, w_i: &[DVec3], w_o: DVec3) -> Vec<DVec3> {
        match &self.from {
            Viewpoint::Tangent => self.brdf.evaluate_all(w_i, w_o),
            Viewpoint::Azimuth(azimuth) => {
                let directions: Vec<_> = w_i.iter().map(|w| turned(*w, *azimuth)).collect();
                self.brdf.evaluate_all(&directions, turned(w_o, *azimuth))
            }
            Viewpoint::AllAround(_) => w_i.iter().map(|w_i| self.evaluate(*w_i, w_o)).collect(),
        }
    }
}

/// `w` turned about z by an angle of this cosine and sine.
fn turned(w: DVec3, angle: DVec2) -> DVec3 {
    angle.rotate(w.truncate()).extend(w.z)
}

#[cfg(test)]
mod tests {
    use glam::dvec3;

    use super::*;
    use crate::brdf::tests::samples::of_model;
    use crate::farthest::Farthest;

    #[test]
    fn the_mean_of_a_long_lobe_is_that_over_a_great_many_azimuths() {
        let text = "distribution = 'ggx'\nmetal = 'Al'\nalpha_x = 0.005\nalpha_y = 0.3\nrotation_deg = 20";
        let brdf = of_model("conductor", text);
        let (seen, w_o) = (SeenBrdf::from_all_around(&brdf), dvec3(0.6, 0.0, 0.8));
        const COUNT: usize = 20_000;
        let azimuths = || (0..COUNT).map(|i| DVec2::from_angle(TAU * i as f64 / COUNT as f64));
        // Mirrored by a facet along the normal, and by others up to 30 degrees from it.
        for w_i in [dvec3(-0.6, 0.0, 0.8), dvec3(-0.59, 0.01, 0.8), dvec3(-0.5, 0.3, 0.8), dvec3(0.6, 0.1, 0.7)] {
            let w_i = w_i.normalize();
            let all: DVec3 = azimuths().map(|azimuth| brdf.evaluate(turned(w_i, azimuth), turned(w_o, azimuth))).sum();
            let ratio = seen.evaluate(w_i, w_o) * COUNT as f64 / all;
            assert!((ratio - 1.0).farthest() < 3e-3, "{w_i}: {ratio}");
        }
    }
}
