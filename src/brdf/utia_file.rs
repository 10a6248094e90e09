//! Reads measured materials from `.bin` files of the UTIA BRDF database, as far as they are isotropic.
//!
//! Filip and Vávra, "Template-Based Sampling of Anisotropic BRDFs" (2014). The file is 3 planes of 288 x 288 f64, little-endian, for red, green
//! and blue: rows over light, columns over view, each of index phi + 48 theta with phi in steps of 7.5 degrees and theta in steps of 15
//! degrees, from 0 to 75. (The database's own reader, as jdupuy/dj_brdf and asztr/UTIA-brdf restate it.)
//!
//! The materials are anisotropic. What is read is the mean over the material's azimuth: light and view turn together. Values below 0 count as 0.
//! What is read takes no more memory than the file.
use std::path::Path;

use glam::Vec3;

use super::Brdf;
use super::goniometric::{Goniometric, Means, Nodes};
use crate::error::{Error, Result};
use crate::file_format::FileFormat;

pub(super) const FORMAT: FileFormat<Brdf> =
    FileFormat { extension: "bin", name: "a UTIA .bin", is_of_format: |_| true, parse };

/// Angles to the normal, and azimuths.
const THETAS: usize = 6;
const PHIS: usize = 48;
/// Directions of light, and of view.
const SIDE: usize = THETAS * PHIS;
const FILE_BYTES: usize = 3 * 8 * SIDE * SIDE;

fn parse(path: &Path, bytes: &[u8]) -> Result<Brdf> {
    table(bytes).map(Brdf::Goniometric).map_err(|problem| {
        Error::in_file(path, problem, "fetch the file again; a UTIA BRDF is three planes of 288 x 288 numbers")
    })
}

fn table(bytes: &[u8]) -> Result<Goniometric, String> {
    if bytes.len() != FILE_BYTES {
        return Err(format!("has {} bytes instead of {FILE_BYTES}", bytes.len()));
    }
    let (values, _) = bytes.as_chunks::<8>();
    if let Some(place) = values.iter().position(|&value| !(f64::from_le_bytes(value) as f32).is_finite()) {
        let (plane, row, column) = (place / (SIDE * SIDE), place / SIDE % SIDE, place % SIDE);
        let value = f64::from_le_bytes(values[place]);
        return Err(format!("holds {value:e} in plane {plane}, row {row}, column {column}"));
    }
    let thetas = Nodes { count: THETAS, first: 0.0, step: 15f64.to_radians() };
    let azimuths = Nodes { count: PHIS / 2 + 1, first: 0.0, step: 7.5f64.to_radians() };
    let mut means = Means::new(thetas, azimuths);
    for row in 0..SIDE {
        for column in 0..SIDE {
            let value = |plane: usize| f64::from_le_bytes(values[column + SIDE * (row + SIDE * plane)]).max(0.0) as f32;
            let turned = (column % PHIS + PHIS - row % PHIS) % PHIS;
            let node = [row / PHIS, column / PHIS, turned.min(PHIS - turned)];
            // Parts of a mean are small, so that the sum of the greatest is a number.
            means.add(node, Vec3::new(value(0), value(1), value(2)).min(Vec3::splat(1e30)));
        }
    }
    means.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DVec3, dvec3};

    /// The bytes of a file with `value` of plane, theta_i, phi_i, theta_v and phi_v, these in steps.
    fn made(value: impl Fn(usize, usize, usize, usize, usize) -> f64) -> Vec<u8> {
        let cells = (0..3 * SIDE * SIDE).map(|index| {
            let (plane, row, column) = (index / SIDE / SIDE, index / SIDE % SIDE, index % SIDE);
            value(plane, row / PHIS, row % PHIS, column / PHIS, column % PHIS)
        });
        cells.flat_map(f64::to_le_bytes).collect()
    }

    fn direction(theta_deg: f64, phi_deg: f64) -> DVec3 {
        let ((sin_theta, cos_theta), (sin_phi, cos_phi)) =
            (theta_deg.to_radians().sin_cos(), phi_deg.to_radians().sin_cos());
        dvec3(sin_theta * cos_phi, sin_theta * sin_phi, cos_theta)
    }

    #[test]
    fn nodes_are_where_the_database_has_them_and_the_material_turns() {
        // Of light, of view, of the azimuth between them, and of the material: the last is averaged away.
        let bytes = made(|plane, theta_i, phi_i, theta_v, phi_v| match plane {
            0 => (1 + theta_i) as f64,
            1 => theta_v as f64 + (phi_i % 2) as f64,
            _ => (phi_v + PHIS - phi_i) as f64 % PHIS as f64,
        });
        let brdf = parse(Path::new("x.bin"), &bytes).unwrap();
        for (theta_i, theta_o, azimuth) in
            [(0.0, 0.0, 0.0), (15.0, 60.0, 90.0), (22.5, 75.0, 180.0), (80.0, 7.5, 33.75)]
        {
            let found = brdf.evaluate(direction(theta_i, 20.0), direction(theta_o, 20.0 + azimuth));
            let steps = |theta: f64| theta.min(75.0) / 15.0;
            // Blue is the mean of an azimuth and the one in a mirror, but at 0, where both are the same.
            let blue = if azimuth == 0.0 { 0.0 } else { 24.0 };
            let expected = dvec3(1.0 + steps(theta_i), 0.5 + steps(theta_o), blue);
            assert!((found - expected).abs().max_element() < 1e-4, "{theta_i} {theta_o} {azimuth}: {found}");
        }
    }

    #[test]
    fn files_that_are_none_are_refused_with_a_reason() {
        let good = made(|_, _, _, _, _| 0.3);
        let mut nan = good.clone();
        nan[8 * (SIDE + 2)..][..8].copy_from_slice(&f64::NAN.to_le_bytes());
        for (bytes, reason) in [
            (&good[..good.len() - 1], "bytes instead of 1990656"),
            (&[][..], "has 0 bytes"),
            (&nan, "NaN in plane 0, row 1, column 2"),
            (&made(|_, _, _, _, _| 0.0), "nothing but zero"),
            (&made(|_, _, _, _, _| -1.0), "nothing but zero"),
            (&made(|_, _, _, _, _| 1e300), "1e300 in plane 0"),
        ] {
            let error = parse(Path::new("x.bin"), bytes).unwrap_err().to_string();
            assert!(error.starts_with("x.bin: ") && error.contains(reason), "{reason}: {error}");
        }
    }
}
