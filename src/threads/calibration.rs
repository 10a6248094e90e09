//! Corrects p so that a white furnace gives the albedo of every channel in every row.
//!
//! Not in the paper, whose p of equation (4) does so for the luminance only: few samples meet the colours of a highlight and
//! of its surroundings in slightly wrong proportion. Dividing p by factors c_k near 1 mends that: calibration weights by
//! raking (Deville and Sarndal 1992), which keeps them positive and as near to 1 as can be.
use glam::{DMat3, DVec3};

use super::Sample;
use super::slice::Slice;

/// Part of the samples that must in effect be left. A handful may need more than a correction, above all where none of them
/// has the colour that is missing; then the furnace stays a little off instead.
const LEAST_EFFECTIVE: f64 = 0.9;

/// Divides the pdfs of one row by c_k = exp(mu . r_k), normalised to a mean of 1, where r_k = f (n.s) / (p albedo) per channel
/// and mu is such that the mean of c_k r_k is 1.
pub fn calibrate(slice: &Slice, row: &mut [Sample]) {
    let albedo = slice.albedo();
    let count = row.len() as f64;
    // A channel in which nothing is reflected is right as it is.
    let ratio = |s: &Sample| {
        let term = slice.f_cos(s.direction()) / f64::from(s.p);
        DVec3::select(albedo.cmpgt(DVec3::ZERO), term / albedo, DVec3::ONE)
    };
    let ratios: Vec<DVec3> = row.iter().map(ratio).collect();
    // The bounds only keep Newton's method from running away where there is no solution.
    let factor = |mu: DVec3, r: DVec3| mu.dot(r).exp().clamp(0.1, 10.0);
    let mut mu = DVec3::ZERO;
    // Newton's method; it has all digits after 5 steps unless there is no solution.
    for _ in 0..10 {
        let mut residual = DVec3::ONE;
        // Where colours are alike the matrix is singular: a spread of 1 % is the least worth correcting.
        let mut slope = DMat3::from_diagonal(DVec3::splat(1e-4));
        for &r in &ratios {
            let weighted = r * (factor(mu, r) / count);
            residual -= weighted;
            slope += DMat3::from_cols(weighted * r.x, weighted * r.y, weighted * r.z);
        }
        mu += slope.inverse() * residual;
    }
    let factors = |mu: DVec3| ratios.iter().map(|&r| factor(mu, r)).collect::<Vec<f64>>();
    // Kish's effective number of samples, (sum c)^2 / sum c^2.
    let effective = |c: &[f64]| c.iter().sum::<f64>().powi(2) / c.iter().map(|c| c * c).sum::<f64>();
    let mut factors_of_row = factors(mu);
    while effective(&factors_of_row) < LEAST_EFFECTIVE * count {
        mu *= 0.5;
        factors_of_row = factors(mu);
    }
    let mean = factors_of_row.iter().sum::<f64>() / count;
    for (sample, factor) in row.iter_mut().zip(factors_of_row) {
        sample.p *= (mean / factor) as f32;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::threads::test_materials;

    #[test]
    fn every_channel_gets_its_albedo_and_p_changes_little() {
        for (name, brdf) in test_materials::all() {
            let slice = Slice::new(&brdf, 0.7);
            let before: Vec<Sample> = slice.points(50).map(|s| Sample::new(s, slice.pdf(s))).collect();
            let mut row = before.clone();
            calibrate(&slice, &mut row);
            let furnace = row.iter().map(|s| slice.f_cos(s.direction()) / f64::from(s.p)).sum::<DVec3>() / 50.0;
            let error = ((furnace - slice.albedo()) / slice.albedo()).abs().max_element();
            assert!(error < 2e-3, "{name}: {error}");
            let change = |(a, b): (&Sample, &Sample)| (f64::from(a.p) / f64::from(b.p)).ln().powi(2);
            let rms = (row.iter().zip(&before).map(change).sum::<f64>() / 50.0).sqrt();
            // A lobe of another colour than its surroundings, as alumina-oxide has, needs the most.
            assert!(rms < 0.3, "{name}: {rms}");
        }
    }
}
