//! Generalised cosine lobes: f = diffuse / pi + the sum over lobes of max(C_xy (i_x o_x + i_y o_y) + C_z i_z o_z, 0)^n.
//!
//! Lafortune, Foo, Torrance and Greenberg, "Non-Linear Approximation of Reflectance Functions" (1997), with C_x = C_y, which is the
//! isotropic case. Per channel, as published: C_xy, C_z and n of each lobe are triples. C_xy = -C_z is Phong's lobe, |C_xy| > C_z one that
//! is off-specular, C_xy > 0 one that reflects back towards the light. Components are of the shading frame, both vectors away from the
//! surface (the paper's convention). The size of a lobe is in its C: (C_z / C)^n is what a factor in front of it would be.
//!
//! Reciprocal. Energy is not bounded by the form: C and n have to be chosen for it, as fits do. A single lobe with -C_xy = C_z = C has an
//! albedo of 2 pi C^n / (n + 2) at normal incidence, and less elsewhere.
use std::f64::consts::FRAC_1_PI;

use glam::DVec3;

use crate::brdf::{Model, Parameters, Scale, hash_numbers};
use crate::error::{Error, Result};

/// Lobes at most.
const MAX_LOBES: usize = 4;

/// A lobe's peak at most, 1/sr: beyond it nothing physical lies, and single precision ends.
const MAX_PEAK: f64 = 1e6;

/// Lafortune's model.
#[derive(Clone, Debug)]
pub struct Lafortune {
    /// Albedo of the diffuse part per channel, 0 to 1.
    pub diffuse: DVec3,
    /// One to four.
    pub lobes: Vec<Lobe>,
}

/// One generalised cosine lobe, per channel.
#[derive(Clone, Copy, Debug)]
pub struct Lobe {
    /// C_x = C_y: negative about the mirror direction, positive about the light. -2 to 2.
    pub c_xy: DVec3,
    /// C_z, 0 to 2.
    pub c_z: DVec3,
    /// n, 0 to 10,000.
    pub exponent: DVec3,
}

impl Model for Lafortune {
    fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
        let (across, along) = (w_i.x * w_o.x + w_i.y * w_o.y, w_i.z * w_o.z);
        let lobes = self.lobes.iter().map(|lobe| {
            let base = (lobe.c_xy * across + lobe.c_z * along).max(DVec3::ZERO);
            DVec3::new(base.x.powf(lobe.exponent.x), base.y.powf(lobe.exponent.y), base.z.powf(lobe.exponent.z))
        });
        self.diffuse * FRAC_1_PI + lobes.sum::<DVec3>()
    }

    fn from_parameters(parameters: &mut Parameters) -> Result<Self> {
        let diffuse = parameters.diffuse()?;
        let mut lobes = Vec::new();
        for number in 1..=MAX_LOBES {
            let key = |name: &str| format!("{name}_{number}");
            if number > 1 && !parameters.has(&key("c_xy")) {
                parameters.only_beside(&[&key("c_z"), &key("exponent")], &key("c_xy"));
                // Lobes are numbered without a gap.
                for later in number + 1..=MAX_LOBES {
                    let keys = ["c_xy", "c_z", "exponent"].map(|name| format!("{name}_{later}"));
                    parameters.only_beside(&keys.each_ref().map(String::as_str), &key("c_xy"));
                }
                break;
            }
            let help = "C_x = C_y of the lobe: negative about the mirror direction, positive about the light.";
            let c_xy = parameters.colour_on(&key("c_xy"), -2.0..=2.0, Scale::linear(-1.2..=1.2), help)?;
            let help = "C_z of the lobe, along the normal.";
            let c_z = parameters.colour_on(&key("c_z"), 0.0..=2.0, Scale::linear(0.0..=1.2), help)?;
            let (help, usual) = ("Exponent of the lobe, of each channel.", Scale::logarithmic(1.0..=1e4));
            let exponent = parameters.colour_on(&key("exponent"), 0.0..=1e4, usual, help)?;
            let reach = c_xy.abs().max(c_z);
            let log_peak = (reach.max(DVec3::splat(1e-9)).map(f64::ln) * exponent).max_element();
            if log_peak > MAX_PEAK.ln() {
                let problem = format!("gives a lobe a peak above {MAX_PEAK:e}");
                return Err(Error::input(key("exponent"), problem, "bring C nearer to 1 or take a smaller exponent"));
            }
            lobes.push(Lobe { c_xy, c_z, exponent });
        }
        Ok(Self { diffuse, lobes })
    }

    fn hash_content(&self, hasher: &mut blake3::Hasher) {
        hash_numbers(hasher, self.diffuse.to_array());
        for lobe in &self.lobes {
            hash_numbers(hasher, [lobe.c_xy, lobe.c_z, lobe.exponent].into_iter().flat_map(|colour| colour.to_array()));
        }
    }
}
