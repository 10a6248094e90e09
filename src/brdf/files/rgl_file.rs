//! Reads measured materials from RGL's `.bsdf` files, RGB and spectral.
//!
//! Fields that are read, of single-precision numbers, with n_phi and n_theta measured angles: `phi_i` (n_phi; up to 2: isotropic), `theta_i`
//! (n_theta), `ndf` and `sigma` (rows over azimuth, columns over the angle to the normal), `vndf` (n_phi, n_theta, rows, columns), and `rgb`
//! (n_phi, n_theta, 3, n, n) or `spectra` (n_phi, n_theta, n_wavelengths, n, n) with `wavelengths` (n_wavelengths, in nm); one byte,
//! `jacobian`. What they mean: `rgl.rs`. How much of a turn `phi_i` is of follows from its ends, as in Mitsuba 3.
//! `luminance`, for drawing samples, `valid`, `version` and `description` are not needed.
//!
//! Spectra become colours under D65, `spectrum.rs`. What is read takes at most eight times the memory of the file.
use std::f32::consts::{FRAC_PI_2, PI, TAU};
use std::path::Path;

use glam::Vec3;

use super::spectrum::{VISIBLE_NM, rec709_weights};
use super::tensor_file::{Tensor, TensorFile};
use crate::brdf::Brdf;
use crate::brdf::rgl::{Grid, Rgl, RglTables, Warp};
use crate::error::{Error, Result};
use crate::files::FileFormat;

pub(super) const FORMAT: FileFormat<Brdf> = FileFormat {
    extension: "bsdf",
    name: "an RGL .bsdf",
    is_of_format: |_| true,
    parse: |path, bytes, _| parse(path, bytes),
};

/// The greatest of measured values and densities of normals that are read, and the least projected area: of what is within, f is a
/// number in single precision.
const MOST: f32 = 1e9;
const LEAST_AREA: f32 = 1e-6;

/// The last angle of files is the right one, rounded up.
const MOST_THETA: f32 = FRAC_PI_2 + 1e-5;

/// Wavelengths that are read, in nm.
const WAVELENGTHS_NM: std::ops::RangeInclusive<f32> = 1.0..=1e6;

fn parse(path: &Path, bytes: &[u8]) -> Result<Brdf> {
    tables(bytes).map(|tables| Brdf::Rgl(Rgl::of(tables))).map_err(|problem| {
        Error::in_file(path, problem, "fetch the file again; .bsdf of the RGL database are read, RGB and spectral")
    })
}

fn tables(bytes: &[u8]) -> Result<RglTables, String> {
    let file = TensorFile::parse(bytes)?;
    let phi_i = file.numbers::<1>("phi_i", -TAU..=TAU)?;
    ascending("phi_i", &phi_i)?;
    let parts = parts_of_a_turn(&phi_i)?;
    let theta_i = file.numbers::<1>("theta_i", 0.0..=MOST_THETA)?;
    ascending("theta_i", &theta_i)?;
    let angles = [phi_i.shape[0], theta_i.shape[0]];
    let vndf = file.numbers::<4>("vndf", 0.0..=f32::MAX)?;
    let density = Grid { size: square("vndf", &vndf.shape, angles, &[])?, values: vndf.all().collect() };
    Ok(RglTables {
        parts,
        phi_a: phi_i.all().map(f64::from).collect(),
        theta_a: theta_i.all().map(f64::from).collect(),
        visible_normals: Warp::of(density)?,
        values: if file.has("spectra") { of_spectra(&file, angles) } else { of_rgb(&file, angles) }?,
        normals: grid(&file, "ndf", 0.0)?,
        projected_area: grid(&file, "sigma", LEAST_AREA)?,
        has_jacobian: file.byte("jacobian")? != 0,
    })
}

/// The greatest distance of azimuths from what ends a part of a turn: far more than rounding, less than any step.
const SAME_AZIMUTH: f32 = 0.01;

/// How many of the ranges of `phi_i` make a turn: 1, 2 or 4. They begin at -180 degrees.
fn parts_of_a_turn(phi_i: &Tensor<1>) -> Result<u32, String> {
    let (first, last) = (phi_i.all().next().unwrap_or_default(), phi_i.all().last().unwrap_or_default());
    if phi_i.shape[0] <= 2 {
        return Ok(1);
    }
    let parts = (TAU / (last - first)).round();
    let is_known = [1.0, 2.0, 4.0].contains(&parts);
    if !is_known || first < -PI - SAME_AZIMUTH || last > TAU / parts - PI + SAME_AZIMUTH {
        let [first, last] = [first, last].map(f32::to_degrees);
        return Err(format!(
            "has azimuths phi_i from {first:.1} to {last:.1} degrees, not -180 to -90, to 0 or to 180"
        ));
    }
    Ok(parts as u32)
}

/// The field `name` of two dimensions.
fn grid(file: &TensorFile, name: &str, least: f32) -> Result<Grid<f32>, String> {
    let field = file.numbers::<2>(name, least..=MOST)?;
    Ok(Grid { size: sides(name, field.shape)?, values: field.all().collect() })
}

/// Columns and rows of the last two dimensions of the field `name`, if the ones before are the numbers of azimuths
/// and angles, and `between`.
fn square(name: &str, shape: &[usize], angles: [usize; 2], between: &[usize]) -> Result<[usize; 2], String> {
    let (before, last) = shape.split_at(shape.len() - 2);
    if before != [&angles, between].concat() {
        let [phis, thetas] = angles;
        return Err(format!(
            "has a field {name} of dimensions {shape:?}, which do not go with its {phis} x {thetas} angles"
        ));
    }
    sides(name, [last[0], last[1]])
}

/// Columns and rows.
fn sides(name: &str, [rows, columns]: [usize; 2]) -> Result<[usize; 2], String> {
    if rows < 2 || columns < 2 {
        return Err(format!("has a field {name} of {rows} x {columns} nodes; there have to be two along each axis"));
    }
    Ok([columns, rows])
}

fn ascending(name: &str, field: &Tensor<1>) -> Result<(), String> {
    let rises = field.all().zip(field.all().skip(1)).all(|(value, next)| value < next);
    if rises { Ok(()) } else { Err(format!("has a field {name} that does not ascend")) }
}

fn of_rgb(file: &TensorFile, angles: [usize; 2]) -> Result<Grid<Vec3>, String> {
    let rgb = file.numbers::<5>("rgb", -MOST..=MOST)?;
    let size = square("rgb", &rgb.shape, angles, &[3])?;
    let nodes = size[0] * size[1];
    let squares = angles[0] * angles[1];
    let mut values = Vec::with_capacity(squares * nodes);
    for angle in 0..squares {
        let [red, green, blue] = [0, 1, 2].map(|channel| rgb.slice((3 * angle + channel) * nodes, nodes));
        values.extend(red.zip(green).zip(blue).map(|((red, green), blue)| Vec3::new(red, green, blue)));
    }
    Ok(Grid { size, values })
}

fn of_spectra(file: &TensorFile, angles: [usize; 2]) -> Result<Grid<Vec3>, String> {
    let wavelengths = file.numbers::<1>("wavelengths", WAVELENGTHS_NM)?;
    ascending("wavelengths", &wavelengths)?;
    let [count] = wavelengths.shape;
    let wavelengths_nm: Vec<f64> = wavelengths.all().map(f64::from).collect();
    // What is missing at the ends has the value of the end; of this, the eye sees 2 parts of a thousand.
    if wavelengths_nm[0] > 420.0 || wavelengths_nm[count - 1] < 680.0 {
        let [first, last] = [wavelengths_nm[0], wavelengths_nm[count - 1]];
        let [blue, red] = VISIBLE_NM;
        return Err(format!("has wavelengths from {first} to {last} nm, less than what is visible, {blue} to {red}"));
    }
    let spectra = file.numbers::<5>("spectra", -MOST..=MOST)?;
    let size = square("spectra", &spectra.shape, angles, &[count])?;
    let nodes = size[0] * size[1];
    let weights: Vec<Vec3> = rec709_weights(&wavelengths_nm).into_iter().map(|weight| weight.as_vec3()).collect();
    let mut values = vec![Vec3::ZERO; angles[0] * angles[1] * nodes];
    for (angle, square) in values.chunks_exact_mut(nodes).enumerate() {
        for (wavelength, &weight) in weights.iter().enumerate() {
            let plane = spectra.slice((angle * count + wavelength) * nodes, nodes);
            square.iter_mut().zip(plane).for_each(|(colour, value)| *colour += value * weight);
        }
    }
    Ok(Grid { size, values })
}
