//! Lambert: a perfectly diffuse surface, f = reflectance / pi. Twin: glsl/brdf/lambert.glsl.
use std::f64::consts::FRAC_1_PI;

use glam::{DVec3, Vec4};

use crate::brdf::{Model, Parameters, hash_numbers};
use crate::error::Result;

/// A perfectly diffuse surface.
#[derive(Clone, Copy, Debug)]
pub struct Lambert {
    /// Albedo per channel, 0 to 1.
    pub reflectance: DVec3,
}

impl Model for Lambert {
    fn evaluate(&self, _w_i: DVec3, _w_o: DVec3) -> DVec3 {
        self.reflectance * FRAC_1_PI
    }

    fn from_parameters(parameters: &mut Parameters) -> Result<Self> {
        Ok(Self { reflectance: parameters.colour("reflectance", 0.0..=1.0, "Albedo, linear Rec. 709.")? })
    }

    fn gpu_parameters(&self) -> [Vec4; 3] {
        [self.reflectance.as_vec3().extend(0.0), Vec4::ZERO, Vec4::ZERO]
    }

    fn hash_content(&self, hasher: &mut blake3::Hasher) {
        hash_numbers(hasher, self.reflectance.to_array());
    }
}
