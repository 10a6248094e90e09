//! Corrects p so that a white furnace gives the albedo of every channel exactly in every row.
//!
//! Not in the paper, whose p of equation (4) does so for the luminance only: few samples meet the colours of a highlight and
//! of its surroundings in slightly wrong proportion. Dividing p by factors c_k near 1 mends that ("calibration weights",
//! Deville and Sarndal 1992); among all that do, these are the nearest to 1 in the least squares.
use glam::{DMat3, DVec3};

use super::Sample;
use super::slice::Slice;

/// Divides the pdfs of one row by c_k = 1 + mu . r_k, normalised to a mean of 1, where r_k = f (n.s) / (p albedo) and mu solves
/// (mean of r r^T) mu = 1 - mean of r.
pub fn calibrate(slice: &Slice, row: &mut [Sample]) {
    let albedo = slice.albedo();
    let count = row.len() as f64;
    // A channel in which nothing is reflected is right as it is.
    let ratio = |s: &Sample| {
        let term = slice.f_cos(s.direction()) / f64::from(s.p);
        DVec3::select(albedo.cmpgt(DVec3::ZERO), term / albedo, DVec3::ONE)
    };
    let ratios: Vec<DVec3> = row.iter().map(ratio).collect();
    let mean = ratios.iter().sum::<DVec3>() / count;
    let gram = ratios.iter().map(|&r| DMat3::from_cols(r * r.x, r * r.y, r * r.z)).sum::<DMat3>() * (1.0 / count);
    // Grey slices have equal channels, hence a singular matrix. A colour spread of 1 % is the least worth correcting.
    let mu = (gram + DMat3::from_diagonal(DVec3::splat(1e-4))).inverse() * (DVec3::ONE - mean);
    // A handful of samples may ask for more than a correction; then the furnace stays a little off instead.
    let factors: Vec<f64> = ratios.iter().map(|&r| (1.0 + mu.dot(r)).clamp(0.5, 2.0)).collect();
    let mean = factors.iter().sum::<f64>() / count;
    for (sample, factor) in row.iter_mut().zip(factors) {
        sample.p *= (mean / factor) as f32;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::threads::test_materials;

    #[test]
    fn every_channel_gets_its_albedo_and_p_hardly_changes() {
        for (name, brdf) in test_materials::all() {
            let slice = Slice::new(&brdf, 0.7);
            let before: Vec<Sample> = slice.points(50).map(|s| Sample::new(s, slice.pdf(s))).collect();
            let mut row = before.clone();
            calibrate(&slice, &mut row);
            let furnace = row.iter().map(|s| slice.f_cos(s.direction()) / f64::from(s.p)).sum::<DVec3>() / 50.0;
            let error = ((furnace - slice.albedo()) / slice.albedo()).abs().max_element();
            assert!(error < 2e-3, "{name}: {error}");
            assert!(row.iter().zip(&before).all(|(a, b)| (a.p / b.p - 1.0).abs() < 0.2), "{name}");
        }
    }
}
