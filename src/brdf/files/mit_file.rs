//! Reads measured materials from `.dat` files of MIT CSAIL.
//!
//! Ngan, Durand and Matusik, "Experimental Analysis of BRDF Models" (2005). The file is a header of 16 little-endian i32, then planes of f32
//! for red, green and blue. Of the header count: 0 to 3, the number of bins over theta_in, theta_out, phi_diff and phi_in, of which the last varies
//! fastest; 6, the parameterisation, 1; 7, the spacing of bins, 0: even; 9, whether phi_diff goes to 180 degrees (1) or to 360 (0); 10, the
//! number of channels, 3. Angles theta go to 90 degrees, phi_in to 360. Negative bins were not measured. (The description that comes with the data, as
//! wdas/brdf restates it.)
//!
//! What the description leaves open: phi_in is taken as the azimuth of the light from the tangent, and phi_diff as that of the view less
//! that of the light, as in BRDF Explorer (but for half a turn of both). Where phi_diff ends at 180 degrees, light and view change places
//! beyond, as reciprocity has it. Numbers are taken for f in 1/sr as they are; their scale is not described (BRDF Explorer multiplies
//! them by 10). Reading takes at most twice the memory of the file.
use std::f64::consts::{FRAC_PI_2, PI};
use std::path::Path;

use glam::Vec3;

use crate::brdf::Brdf;
use crate::brdf::goniometric::{Axes, Goniometric, Nodes};
use crate::error::{Error, Result};
use crate::files::FileFormat;

pub(super) const FORMAT: FileFormat<Brdf> = FileFormat {
    extension: "dat",
    name: "an MIT CSAIL .dat",
    is_of_format: |_| true,
    parse: |path, bytes, _| parse(path, bytes),
};

const HEADER_BYTES: usize = 64;

fn parse(path: &Path, bytes: &[u8]) -> Result<Brdf> {
    table(bytes).map(Brdf::Goniometric).map_err(|problem| {
        Error::in_file(
            path,
            problem,
            "fetch the file again; BRDFs of MIT CSAIL over theta_in, theta_out, phi_diff and phi_in are read",
        )
    })
}

fn table(bytes: &[u8]) -> Result<Goniometric, String> {
    let (header, values) = bytes.split_at_checked(HEADER_BYTES).ok_or("is too short to be a BRDF of MIT CSAIL")?;
    let header: Vec<i32> = header.as_chunks().0.iter().map(|&number| i32::from_le_bytes(number)).collect();
    let (parameterisation, spacing, is_half, channels) = (header[6], header[7], header[9], header[10]);
    if (parameterisation, spacing, channels) != (1, 0, 3) || !(0..=1).contains(&is_half) {
        return Err(format!(
            "says that it has parameterisation {parameterisation}, spacing {spacing}, half data {is_half} and {channels} channels"
        ));
    }
    let dimensions: Vec<usize> = header[..4].iter().map(|&size| usize::try_from(size).unwrap_or(0)).collect();
    let [thetas, views, azimuths, turns] = [dimensions[0], dimensions[1], dimensions[2], dimensions[3]];
    let cells = dimensions.iter().try_fold(1, |product: usize, &size| product.checked_mul(size));
    let expected = cells.filter(|&cells| cells > 0).and_then(|cells| cells.checked_mul(12));
    if expected != Some(values.len()) || thetas != views {
        return Err(format!(
            "has {} bytes behind its header of {thetas} x {views} x {azimuths} x {turns} bins",
            values.len()
        ));
    }
    let (numbers, _) = values.as_chunks::<4>();
    let cells = numbers.len() / 3;
    if let Some(place) = numbers.iter().position(|&number| !f32::from_le_bytes(number).is_finite()) {
        return Err(format!(
            "holds {} in plane {}, bin {}",
            f32::from_le_bytes(numbers[place]),
            place / cells,
            place % cells
        ));
    }

    // Nodes are the middles of bins.
    let axes = Axes {
        thetas: Nodes::of_bins(thetas, FRAC_PI_2),
        azimuths: if is_half == 1 { Nodes::of_bins(azimuths, PI) } else { Nodes::of_bins_around(azimuths) },
        turns: Nodes::of_bins_around(turns),
    };
    Goniometric::of(axes, |[theta_in, theta_out, azimuth, turn]| {
        let cell = turn + turns * (azimuth + azimuths * (theta_out + views * theta_in));
        let rgb = Vec3::from([0, 1, 2].map(|plane| f32::from_le_bytes(numbers[cell + cells * plane])));
        (rgb.min_element() >= 0.0).then_some(rgb)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::tests::direction;
    use crate::farthest::Farthest;
    use glam::dvec3;

    /// The bytes of a file of 3 angles, 4 or 8 azimuths and 2 turns, with `value` of plane, theta_in, theta_out, phi_diff and phi_in, in bins.
    fn made(is_half: bool, value: impl Fn(usize, [usize; 4]) -> f32) -> Vec<u8> {
        let azimuths = if is_half { 4 } else { 8 };
        let header = [3, 3, azimuths, 2, 0, 0, 1, 0, 0, i32::from(is_half), 3, 0, 0, 0, 0, 0];
        let azimuths = azimuths as usize;
        let cells = 3 * 3 * azimuths * 2;
        let values = (0..3 * cells).map(|index| {
            let (plane, cell) = (index / cells, index % cells);
            value(plane, [cell / 2 / azimuths / 3, cell / 2 / azimuths % 3, cell / 2 % azimuths, cell % 2])
        });
        header.into_iter().flat_map(i32::to_le_bytes).chain(values.flat_map(f32::to_le_bytes)).collect()
    }

    #[test]
    fn bins_are_where_the_description_has_them() {
        for is_half in [true, false] {
            // What was not measured, one of the two turns in some bins, has no weight.
            let bytes = made(is_half, |plane, [theta_i, theta_o, azimuth, turn]| match plane {
                0 => theta_i as f32 + if turn == 1 && theta_o == 2 { -100.0 } else { 1.0 },
                1 => (theta_o + 10 * turn) as f32,
                _ => azimuth as f32,
            });
            let brdf = parse(Path::new("x.dat"), &bytes).unwrap();
            let bin = |angle: f64, size: f64, last: f64| (angle / size - 0.5).clamp(0.0, last);
            // Bins of 30, of 45 and of 180 degrees.
            for (theta_i, theta_o, azimuth, phi_i, turn) in [
                (15.0, 75.0, 22.5, 200.0, 0.0),
                (30.0, 45.0, 90.0, 90.0, 0.0),
                (80.0, 1.0, 150.0, 270.0, 1.0),
                (30.0, 30.0, 100.0, 0.0, 0.5),
                (45.0, 15.0, 100.0, 225.0, 0.75),
            ] {
                let found = brdf.evaluate(direction(theta_i, phi_i), direction(theta_o, phi_i + azimuth));
                let green = bin(theta_o, 30.0, 2.0) + 10.0 * turn;
                let expected = dvec3(1.0 + bin(theta_i, 30.0, 2.0), green, bin(azimuth, 45.0, 7.0));
                assert!((found - expected).farthest() < 1e-4, "{theta_i} {theta_o} {azimuth}: {found}");
            }
            // Beyond 180 degrees bins go on, or light and view change places.
            let found = brdf.evaluate(direction(75.0, 270.0), direction(15.0, 270.0 - 112.5));
            let expected = if is_half { dvec3(1.0, 2.0, 2.0) } else { dvec3(3.0, 10.0, 5.0) };
            assert!((found - expected).farthest() < 1e-4, "{found}");
        }
    }

    #[test]
    fn the_same_numbers_over_other_angles_are_another_material() {
        let half = made(true, |plane, _| plane as f32);
        let mut around = half.clone();
        around[4 * 9..][..4].copy_from_slice(&0_i32.to_le_bytes());
        let [half, around] = [half, around].map(|bytes| parse(Path::new("x.dat"), &bytes).unwrap().fingerprint());
        assert_ne!(half, around);
    }

    #[test]
    fn values_at_the_end_of_single_precision_are_numbers_between_bins_too() {
        let brdf = parse(Path::new("x.dat"), &made(true, |_, _| f32::MAX)).unwrap();
        for t in (0..200).map(f64::from) {
            let found = brdf.evaluate(direction((t * 7.31) % 89.9, t * 31.7), direction((t * 3.77) % 89.9, t * 11.3));
            assert!(found.is_finite() && found.min_element() > 1e29, "{found}");
        }
    }

    #[test]
    fn files_that_are_none_are_refused_with_a_reason() {
        let good = made(true, |_, _| 0.3);
        let with = |index: usize, number: i32| {
            let mut bytes = good.clone();
            bytes[4 * index..][..4].copy_from_slice(&number.to_le_bytes());
            bytes
        };
        for (bytes, reason) in [
            (good[..63].to_vec(), "too short"),
            (good[..good.len() - 1].to_vec(), "3 x 3 x 4 x 2 bins"),
            ([&good[..], &[0]].concat(), "3 x 3 x 4 x 2 bins"),
            (with(0, -3), "0 x 3 x 4 x 2 bins"),
            (with(0, i32::MAX), "2147483647 x 3"),
            (with(6, 0), "parameterisation 0"),
            (with(7, 1), "spacing 1"),
            (with(9, 7), "half data 7"),
            (with(10, 1), "1 channels"),
            (made(true, |_, _| 0.0), "nothing but zero"),
            (made(true, |_, _| -1.0), "nothing but zero"),
            (made(true, |plane, _| if plane == 1 { f32::NAN } else { 1.0 }), "NaN in plane 1, bin 0"),
        ] {
            let error = parse(Path::new("x.dat"), &bytes).unwrap_err().to_string();
            assert!(error.starts_with("x.dat: ") && error.contains(reason), "{reason}: {error}");
        }
    }
}
