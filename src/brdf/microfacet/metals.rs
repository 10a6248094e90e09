//! Indices of refraction of metals, by their chemical symbols.
//!
//! n + i k at 650, 550 and 450 nm for red, green and blue: measured constants as collected in Palik, "Handbook of Optical Constants of
//! Solids" (1985, 1991) and the SOPRA tables, by way of the spectra in Mitsuba's data (`ior`, mitsuba-renderer/mitsuba-data at 01100fa).
//! Three wavelengths are not a spectrum: tints of copper and gold come out weaker than under all of the light that an eye sees. Gold's f0 is
//! 0.94, 0.85, 0.39 by them, and 0.97, 0.80, 0.32 by the constants of the built-in materials, which are weighted by the eye's response.
use glam::{DVec3, dvec3};

use crate::brdf::Parameters;
use crate::error::{Error, Result};

/// Wavelengths of red, green and blue, in micrometres, at which constants are taken.
pub(crate) const WAVELENGTHS_UM: DVec3 = dvec3(0.65, 0.55, 0.45);

#[derive(Clone, Copy, Debug)]
struct Metal {
    eta: DVec3,
    k: DVec3,
}

/// By symbol. Na, Ni and V are only in Palik's collection.
#[rustfmt::skip]
const METALS: &[(&str, Metal)] = &[
    ("Ag", Metal { eta: dvec3(0.13941, 0.12478, 0.15169), k: dvec3(4.1288, 3.3396, 2.4704) }),
    ("Al", Metal { eta: dvec3(1.4748, 0.95857, 0.61795), k: dvec3(7.7941, 6.687, 5.4694) }),
    ("Au", Metal { eta: dvec3(0.16779, 0.35041, 1.5085), k: dvec3(3.1378, 2.7141, 1.8788) }),
    ("Be", Metal { eta: dvec3(3.4644, 3.3641, 3.0954), k: dvec3(3.2018, 3.1729, 3.16) }),
    ("Cr", Metal { eta: dvec3(3.6375, 3.1158, 1.9277), k: dvec3(4.3644, 4.4228, 4.1675) }),
    ("Cu", Metal { eta: dvec3(0.21656, 0.95816, 1.1658), k: dvec3(3.6377, 2.5771, 2.3939) }),
    ("Hg", Metal { eta: dvec3(2.0734, 1.5519, 1.0607), k: dvec3(5.3388, 4.6518, 3.863) }),
    ("Ir", Metal { eta: dvec3(2.5646, 2.2292, 1.8276), k: dvec3(4.6715, 4.3137, 3.6628) }),
    ("K", Metal { eta: dvec3(0.050609, 0.049291, 0.043), k: dvec3(1.7954, 1.4438, 1.0615) }),
    ("Li", Metal { eta: dvec3(0.22641, 0.20617, 0.23822), k: dvec3(3.015, 2.4742, 1.9049) }),
    ("Mo", Metal { eta: dvec3(3.7354, 3.7766, 3.102), k: dvec3(3.5754, 3.5206, 3.4596) }),
    ("Na", Metal { eta: dvec3(0.049811, 0.058564, 0.067309), k: dvec3(2.7032, 2.2482, 1.8015) }),
    ("Nb", Metal { eta: dvec3(2.7663, 2.9296, 2.6558), k: dvec3(2.8724, 2.8704, 2.8568) }),
    ("Ni", Metal { eta: dvec3(2.014, 1.7724, 1.6288), k: dvec3(3.8079, 3.2526, 2.654) }),
    ("Rh", Metal { eta: dvec3(2.1938, 1.9668, 1.7507), k: dvec3(5.7406, 5.016, 4.4523) }),
    ("Ta", Metal { eta: dvec3(1.5901, 2.4706, 2.8456), k: dvec3(2.2206, 1.8376, 2.1136) }),
    ("TiC", Metal { eta: dvec3(3.117, 2.9936, 2.8556), k: dvec3(2.7283, 2.5065, 2.4078) }),
    ("TiN", Metal { eta: dvec3(1.3928, 1.2523, 1.5), k: dvec3(2.8531, 2.1036, 1.3111) }),
    ("V", Metal { eta: dvec3(3.5039, 3.68, 3.1004), k: dvec3(2.9854, 3.0187, 3.3912) }),
    ("VN", Metal { eta: dvec3(2.4054, 2.2485, 2.1478), k: dvec3(2.5356, 2.1937, 1.8244) }),
    ("W", Metal { eta: dvec3(3.6925, 3.5, 3.309), k: dvec3(2.937, 2.7291, 2.5258) }),
];

/// Says of a metal that is not listed that its index of refraction may be given.
fn or_its_index(error: Error) -> Error {
    match error {
        Error::Input { subject, problem, remedy } => {
            Error::Input { subject, problem, remedy: format!("{remedy}, or give `eta` and `k` in its place") }
        }
        other => other,
    }
}

/// Reads the index of refraction: either the key `metal`, a chemical symbol, or `eta` and `k`.
pub(crate) fn index_of_refraction(parameters: &mut Parameters) -> Result<(DVec3, DVec3)> {
    if parameters.has("metal") {
        let help = "Chemical symbol of the metal, whose index of refraction is taken at 650, 550 and 450 nm.";
        let Metal { eta, k } = parameters.choice("metal", METALS, help).map_err(or_its_index)?;
        parameters.instead_of(&["eta", "k"], "metal");
        return Ok((eta, k));
    }
    // No material is outside: the bounds only keep the Fresnel terms far from overflow in single precision.
    let help = "Real part of the conductor's index of refraction, for red, green and blue.";
    let eta = parameters.colour("eta", 1e-3..=100.0, help)?;
    let help = "Extinction: imaginary part of the conductor's index of refraction, for red, green and blue.";
    Ok((eta, parameters.colour("k", 0.0..=100.0, help)?))
}
