//! Reads measured materials from `.bin` files of the UTIA BRDF database.
//!
//! Filip and Vávra, "Template-Based Sampling of Anisotropic BRDFs" (2014). The file is 3 planes of 288 x 288 f64, little-endian, for red, green
//! and blue: rows over light, columns over view, each of index phi + 48 theta with phi in steps of 7.5 degrees and theta in steps of 15
//! degrees, from 0 to 75. (The database's own reader, as asztr/UTIA-brdf restates it. jdupuy/dj_brdf has the same layout, but other values:
//! the chapter on usage.)
//!
//! At nodes f is what the database's reader finds; values below 0 count as 0, and where light or view is along the normal the mean over its azimuths
//! takes the place of each. Between nodes that reader is linear in the azimuth of the view where `goniometric.rs` is linear in the azimuth between
//! light and view, and beyond 75 degrees it goes on in a straight line where f stays as it is at 75 here. Of GGX with alpha 0.1 x 0.4, 0.2 x 0.5 and 0.3, tabulated like that, it errs by 27, 9 and 5.5 % of the
//! light, and this by 24, 8 and 4.5. Reading takes no more memory than the file.
use std::path::Path;

use glam::Vec3;

use crate::brdf::Brdf;
use crate::brdf::goniometric::{Axes, Goniometric, Nodes};
use crate::brdf::models::MOST_MEASURED;
use crate::error::{Error, Result};
use crate::files::FileFormat;

pub(super) const FORMAT: FileFormat<Brdf> = FileFormat {
    extension: "bin",
    name: "a UTIA .bin",
    is_of_format: |_| true,
    parse: |path, bytes, _| parse(path, bytes),
};

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
    let mut values: Vec<_> =
        values.iter().map(|value| (f64::from_le_bytes(*value) as f32).clamp(0.0, MOST_MEASURED)).collect();
    values.chunks_exact_mut(SIDE * SIDE).for_each(make_one_along_the_normal);

    let phis = Nodes { count: PHIS, first: 0.0, step: 7.5f64.to_radians(), is_circle: true };
    let thetas = Nodes { count: THETAS, first: 0.0, step: 15f64.to_radians(), is_circle: false };
    Goniometric::of(Axes { thetas, azimuths: phis, turns: phis }, |[theta_i, theta_o, azimuth, phi_i]| {
        let (row, column) = (phi_i + PHIS * theta_i, (phi_i + azimuth) % PHIS + PHIS * theta_o);
        Some(Vec3::from([0, 1, 2].map(|plane| values[column + SIDE * (row + SIDE * plane)])))
    })
}

/// Where light or view is along the normal, which has no azimuth, replaces the values of a plane by their mean over azimuths. As they were measured,
/// they differ by noise, and f would jump at the normal as a lobe of no width does.
fn make_one_along_the_normal(plane: &mut [f32]) {
    for column in 0..SIDE {
        let mean = (0..PHIS).map(|row| plane[column + SIDE * row]).sum::<f32>() / PHIS as f32;
        (0..PHIS).for_each(|row| plane[column + SIDE * row] = mean);
    }
    for row in plane.chunks_exact_mut(SIDE) {
        let mean = row[..PHIS].iter().sum::<f32>() / PHIS as f32;
        row[..PHIS].fill(mean);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::tests::direction;
    use crate::farthest::Farthest;
    use glam::dvec3;

    /// The bytes of a file with `value` of plane, theta_i, phi_i, theta_v and phi_v, these in steps.
    fn made(value: impl Fn(usize, usize, usize, usize, usize) -> f64) -> Vec<u8> {
        let cells = (0..3 * SIDE * SIDE).map(|index| {
            let (plane, row, column) = (index / SIDE / SIDE, index / SIDE % SIDE, index % SIDE);
            value(plane, row / PHIS, row % PHIS, column / PHIS, column % PHIS)
        });
        cells.flat_map(f64::to_le_bytes).collect()
    }

    #[test]
    fn nodes_are_where_the_database_has_them() {
        let bytes = made(|plane, theta_i, phi_i, theta_v, phi_v| match plane {
            0 => (10 * theta_i + theta_v) as f64,
            // One along the normal.
            1 => (phi_i * theta_i.min(1)) as f64,
            _ => (phi_v * theta_v.min(1)) as f64,
        });
        let brdf = parse(Path::new("x.bin"), &bytes).unwrap();
        for (theta_i, phi_i, theta_o, phi_o) in
            [(0.0, 0.0, 0.0, 0.0), (15.0, 7.5, 60.0, 352.5), (22.5, 180.0, 75.0, 90.0), (80.0, 240.0, 7.5, 150.0)]
        {
            let found = brdf.evaluate(direction(theta_i, phi_i), direction(theta_o, phi_o));
            let steps = |theta: f64| theta.min(75.0) / 15.0;
            let phi_steps = |theta: f64, phi: f64| steps(theta).min(1.0) * phi / 7.5;
            let expected =
                dvec3(10.0 * steps(theta_i) + steps(theta_o), phi_steps(theta_i, phi_i), phi_steps(theta_o, phi_o));
            assert!((found - expected).farthest() < 1e-4, "{theta_i} {phi_i} {theta_o} {phi_o}: {found}");
        }
        // From the last azimuth to the first, which is the next, both turning together.
        let found = brdf.evaluate(direction(30.0, 356.25), direction(30.0, 356.25 - 90.0));
        assert!((found - dvec3(22.0, 23.5, 35.5)).farthest() < 1e-4, "{found}");
    }

    #[test]
    fn along_the_normal_all_azimuths_are_their_mean() {
        // 0, 2, 0, 2 and so on by the azimuth of the light, of the view, and of both.
        let odd = |phi: usize| 2.0 * (phi % 2) as f64;
        let bytes = made(|plane, _, phi_i, _, phi_v| match plane {
            0 => odd(phi_i),
            1 => odd(phi_v),
            _ => odd(phi_i + phi_v),
        });
        let brdf = parse(Path::new("x.bin"), &bytes).unwrap();
        for (theta_i, theta_o, expected) in [
            (0.0, 0.0, [1.0, 1.0, 1.0]),
            (0.0, 30.0, [1.0, 2.0, 1.0]),
            (30.0, 0.0, [0.0, 1.0, 1.0]),
            (30.0, 30.0, [0.0, 2.0, 2.0]),
        ] {
            let found = brdf.evaluate(direction(theta_i, 15.0), direction(theta_o, 7.5));
            assert!((found - glam::DVec3::from(expected)).farthest() < 1e-5, "{theta_i} {theta_o}: {found}");
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
