//! Any base under any dielectric coat.
//!
//! With primes for directions within the coat (Snell's law at its mean surface), n its index of refraction, T what its upper side lets
//! through and A(theta') = e^(-absorption thickness / cos theta') (Beer):
//!
//! ```text
//! f = F D G / (4 cos theta_i cos theta_o)
//!     + 1/n^2 (f_base(w_i', w_o') (T_i A_i T_o A_o + k_i k_o) + h_i h_o)
//! ```
//!
//! - The first line is what the upper side reflects: GGX facets, exact Fresnel (Walter et al. 2007). T(theta) = 1 - its albedo there, so
//!   that with a base that loses nothing all light comes back but for 0.7 %. For a smooth coat T is Fresnel's, up to 89.5 degrees.
//! - f_base T_i T_o / n^2 is light that goes in, is reflected by the base once, and comes out (Weidlich and Wilkie, "Arbitrarily Layered
//!   Micro-Facet Surfaces", 2007). Their formula is without 1/n^2, by which radiance falls where its cone widens; then energy does not
//!   add up.
//! - The rest is light that the inside of the coat sends back to the base, once or often: all that is beyond the critical angle, and 1 - T of the
//!   rest. Its energy from each angle is that of all orders for isotropic bases, less 0.5 %: `interreflection.rs` sums them in the mean over
//!   azimuth. For a diffuse base that is Saunderson's correction (1942), f = T_i T_o reflectance / (n^2 pi (1 - reflectance r)), r the coat's reflectance
//!   for diffuse light from within. What is lost is the direction. In the mirror direction the sum says by which factor later light raises the
//!   lobe: that is k k. What then lacks leaves evenly: h h, of which the integral is what lacks, in the manner of Kulla and Conty (2017). Both are
//!   exact for a diffuse base and for a mirror; between them a lobe of later light is taken for the base's own lobe and a haze.
//!
//! Reciprocal as the base is. Energy is at most 1.002 over isotropic bases, 1.03 at some azimuths over anisotropic ones that lose nothing, or at most
//! that of the base where the base reflects more than it receives. ior = 1 without absorption is the base itself.
//!
//! Left out: the coat's roughness as to what goes through (it would widen the base's lobe; Guo et al., "Position-Free Monte Carlo
//! Simulation for Arbitrary Layered BSDFs", 2018, have it), light that facets of the coat reflect among them (it is taken to go in),
//! scattering in the coat, and that Fresnel's reflectance of the base is less against the coat than against air: the base is as it was
//! measured in air. Of an anisotropic base, how much light comes later is a mean over azimuths.
use std::sync::{Arc, OnceLock};

use glam::DVec3;

use crate::brdf::{Brdf, Model, Parameters};
use crate::error::Result;

mod base;
mod coat;
mod interreflection;

pub use base::{
    base_file, base_file_in, base_files, base_files_from, base_files_of, change_base_files, resolve_base_files,
};
pub use coat::Coat;
use coat::Interface;
use interreflection::Interreflection;

/// A base under a dielectric coat. Cheap to clone.
#[derive(Clone, Debug)]
pub struct Layered {
    /// What is below.
    pub base: Arc<Brdf>,
    /// What is above.
    pub coat: Coat,
    /// Made when first asked for.
    known: Arc<OnceLock<Known>>,
}

#[derive(Debug)]
struct Known {
    interface: Interface,
    interreflection: Interreflection,
}

impl Layered {
    /// This base under this coat.
    pub fn new(base: Brdf, coat: Coat) -> Self {
        Self { base: Arc::new(base), coat, known: Arc::default() }
    }

    fn known(&self) -> &Known {
        self.known.get_or_init(|| {
            let interface = self.coat.interface();
            let interreflection = Interreflection::new(&self.base, &self.coat, &interface);
            Known { interface, interreflection }
        })
    }
}

impl Model for Layered {
    fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
        let Known { interface, interreflection } = self.known();
        let [inner_i, inner_o] = [w_i, w_o].map(|w| self.coat.refract(w));
        let entering = |w: DVec3, inner: DVec3| interface.transmittance(w.z) * self.coat.left_after(inner.z);
        let once = entering(w_i, inner_i) * entering(w_o, inner_o);
        let later = interreflection.lobe(w_i.z) * interreflection.lobe(w_o.z);
        let haze = interreflection.haze(w_i.z) * interreflection.haze(w_o.z);
        let below = self.base.evaluate(inner_i, inner_o) * (once + later) + haze;
        self.coat.reflection(w_i, w_o) + below / (self.coat.ior * self.coat.ior)
    }

    fn is_reciprocal(&self) -> bool {
        self.base.is_reciprocal()
    }

    fn from_parameters(parameters: &mut Parameters) -> Result<Self> {
        let base = base::read(parameters)?;
        let coat = parameters.table("coat", "{ alpha, ior, thickness, absorption }", Coat::from_parameters)?;
        Ok(Self::new(base, coat))
    }

    fn without_rotation(&self) -> Option<(Self, f64)> {
        // The coat is alike in all directions, so both turn together.
        self.base.without_rotation().map(|(base, deg)| (Self::new(base, self.coat), deg))
    }

    fn hash_content(&self, hasher: &mut blake3::Hasher) {
        hasher.update(self.base.fingerprint().as_bytes());
        self.coat.hash_content(hasher);
    }
}

#[cfg(test)]
mod tests;
