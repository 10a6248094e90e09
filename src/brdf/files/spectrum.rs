//! Linear Rec. 709 colours of spectra of reflectance, as they look under daylight.
//!
//! CIE 1931 colour matching functions of the 2 degree observer (ISO/CIE 11664-1), illuminant D65 (ISO/CIE 11664-2), both in steps of 5 nm,
//! and the primaries of [`Primaries::REC_709`]. The white of Rec. 709 is that of D65, so a flat spectrum is grey.
use glam::{DVec3, dvec3};

use crate::picture::Primaries;

/// The least and the greatest wavelength in the table, and its step, in nm. Beyond, the eye sees less than a ten-thousandth.
pub(super) const VISIBLE_NM: [f64; 2] = [380.0, 780.0];
const STEP_NM: f64 = 5.0;

/// The weight in each channel of a spectrum's values at these wavelengths, in nm and ascending: linear between them, and as at the first
/// and last beyond. Weights of a channel sum to 1.
pub(super) fn rec709_weights(wavelengths_nm: &[f64]) -> Vec<DVec3> {
    let mut weights = vec![DVec3::ZERO; wavelengths_nm.len()];
    let mut sum = DVec3::ZERO;
    let of_xyz = Primaries::REC_709.to_xyz().inverse();
    // Steps of 1 nm, in which what is linear between other steps is summed as well as need be.
    for nm in VISIBLE_NM[0] as u32..=VISIBLE_NM[1] as u32 {
        let nm = f64::from(nm);
        let response = of_xyz * response_at(nm);
        sum += response;
        let after = wavelengths_nm.partition_point(|&known| known <= nm);
        if after == 0 || after == wavelengths_nm.len() {
            weights[after.saturating_sub(1)] += response;
        } else {
            let t = (nm - wavelengths_nm[after - 1]) / (wavelengths_nm[after] - wavelengths_nm[after - 1]);
            weights[after - 1] += (1.0 - t) * response;
            weights[after] += t * response;
        }
    }
    weights.into_iter().map(|weight| weight / sum).collect()
}

/// What light of this wavelength in D65 adds to X, Y and Z, on any scale.
fn response_at(nm: f64) -> DVec3 {
    let position = (nm - VISIBLE_NM[0]) / STEP_NM;
    let first = (position as usize).min(CIE_1931_AND_D65.len() - 2);
    let t = position - first as f64;
    let [x, y, z, d65]: [f64; 4] = std::array::from_fn(|column| {
        (1.0 - t) * CIE_1931_AND_D65[first][column] + t * CIE_1931_AND_D65[first + 1][column]
    });
    dvec3(x, y, z) * d65
}

/// x, y and z of the observer, and D65, from 380 nm in steps of 5 nm.
#[rustfmt::skip]
const CIE_1931_AND_D65: [[f64; 4]; 81] = [
    [0.001368, 0.000039, 0.006450, 49.9755],
    [0.002236, 0.000064, 0.010550, 52.3118],
    [0.004243, 0.000120, 0.020050, 54.6482],
    [0.007650, 0.000217, 0.036210, 68.7015],
    [0.014310, 0.000396, 0.067850, 82.7549],
    [0.023190, 0.000640, 0.110200, 87.1204],
    [0.043510, 0.001210, 0.207400, 91.4860],
    [0.077630, 0.002180, 0.371300, 92.4589],
    [0.134380, 0.004000, 0.645600, 93.4318],
    [0.214770, 0.007300, 1.039050, 90.0570],
    [0.283900, 0.011600, 1.385600, 86.6823],
    [0.328500, 0.016840, 1.622960, 95.7736],
    [0.348280, 0.023000, 1.747060, 104.8650],
    [0.348060, 0.029800, 1.782600, 110.9360],
    [0.336200, 0.038000, 1.772110, 117.0080],
    [0.318700, 0.048000, 1.744100, 117.4100],
    [0.290800, 0.060000, 1.669200, 117.8120],
    [0.251100, 0.073900, 1.528100, 116.3360],
    [0.195360, 0.090980, 1.287640, 114.8610],
    [0.142100, 0.112600, 1.041900, 115.3920],
    [0.095640, 0.139020, 0.812950, 115.9230],
    [0.057950, 0.169300, 0.616200, 112.3670],
    [0.032010, 0.208020, 0.465180, 108.8110],
    [0.014700, 0.258600, 0.353300, 109.0820],
    [0.004900, 0.323000, 0.272000, 109.3540],
    [0.002400, 0.407300, 0.212300, 108.5780],
    [0.009300, 0.503000, 0.158200, 107.8020],
    [0.029100, 0.608200, 0.111700, 106.2960],
    [0.063270, 0.710000, 0.078250, 104.7900],
    [0.109600, 0.793200, 0.057250, 106.2390],
    [0.165500, 0.862000, 0.042160, 107.6890],
    [0.225750, 0.914850, 0.029840, 106.0470],
    [0.290400, 0.954000, 0.020300, 104.4050],
    [0.359700, 0.980300, 0.013400, 104.2250],
    [0.433450, 0.994950, 0.008750, 104.0460],
    [0.512050, 1.000000, 0.005750, 102.0230],
    [0.594500, 0.995000, 0.003900, 100.0000],
    [0.678400, 0.978600, 0.002750, 98.1671],
    [0.762100, 0.952000, 0.002100, 96.3342],
    [0.842500, 0.915400, 0.001800, 96.0611],
    [0.916300, 0.870000, 0.001650, 95.7880],
    [0.978600, 0.816300, 0.001400, 92.2368],
    [1.026300, 0.757000, 0.001100, 88.6856],
    [1.056700, 0.694900, 0.001000, 89.3459],
    [1.062200, 0.631000, 0.000800, 90.0062],
    [1.045600, 0.566800, 0.000600, 89.8026],
    [1.002600, 0.503000, 0.000340, 89.5991],
    [0.938400, 0.441200, 0.000240, 88.6489],
    [0.854450, 0.381000, 0.000190, 87.6987],
    [0.751400, 0.321000, 0.000100, 85.4936],
    [0.642400, 0.265000, 0.000050, 83.2886],
    [0.541900, 0.217000, 0.000030, 83.4939],
    [0.447900, 0.175000, 0.000020, 83.6992],
    [0.360800, 0.138200, 0.000010, 81.8630],
    [0.283500, 0.107000, 0.000000, 80.0268],
    [0.218700, 0.081600, 0.000000, 80.1207],
    [0.164900, 0.061000, 0.000000, 80.2146],
    [0.121200, 0.044580, 0.000000, 81.2462],
    [0.087400, 0.032000, 0.000000, 82.2778],
    [0.063600, 0.023200, 0.000000, 80.2810],
    [0.046770, 0.017000, 0.000000, 78.2842],
    [0.032900, 0.011920, 0.000000, 74.0027],
    [0.022700, 0.008210, 0.000000, 69.7213],
    [0.015840, 0.005723, 0.000000, 70.6652],
    [0.011359, 0.004102, 0.000000, 71.6091],
    [0.008111, 0.002929, 0.000000, 72.9790],
    [0.005790, 0.002091, 0.000000, 74.3490],
    [0.004109, 0.001484, 0.000000, 67.9765],
    [0.002899, 0.001047, 0.000000, 61.6040],
    [0.002049, 0.000740, 0.000000, 65.7448],
    [0.001440, 0.000520, 0.000000, 69.8856],
    [0.001000, 0.000361, 0.000000, 72.4863],
    [0.000690, 0.000249, 0.000000, 75.0870],
    [0.000476, 0.000172, 0.000000, 69.3398],
    [0.000332, 0.000120, 0.000000, 63.5927],
    [0.000235, 0.000085, 0.000000, 55.0054],
    [0.000166, 0.000060, 0.000000, 46.4182],
    [0.000117, 0.000042, 0.000000, 56.6118],
    [0.000083, 0.000030, 0.000000, 66.8054],
    [0.000059, 0.000021, 0.000000, 65.0941],
    [0.000042, 0.000015, 0.000000, 63.3828],
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::farthest::Farthest;

    /// The colour of a spectrum that is given at these wavelengths.
    fn colour(wavelengths_nm: &[f64], spectrum: impl Fn(f64) -> f64) -> DVec3 {
        let weights = rec709_weights(wavelengths_nm);
        wavelengths_nm.iter().zip(weights).map(|(&nm, weight)| weight * spectrum(nm)).sum()
    }

    #[test]
    fn a_flat_spectrum_is_grey_however_it_is_sampled() {
        for wavelengths_nm in [&[550.0][..], &[400.0, 700.0], &[360.0, 410.0, 505.5, 640.0, 1000.0]] {
            let found = colour(wavelengths_nm, |_| 0.5);
            assert!((found - 0.5).farthest() < 1e-12, "{found}");
        }
    }

    #[test]
    fn white_is_d65() {
        let xyz: DVec3 = (380..=780).map(|nm| response_at(f64::from(nm))).sum();
        let sum = Primaries::REC_709.to_xyz().inverse() * xyz;
        // Of white, all three channels are the same; the last digits of tables and primaries are rounded.
        assert!((sum / sum.y - 1.0).farthest() < 1e-3, "{sum}");
    }

    #[test]
    fn a_spectrum_has_its_colour_whatever_its_steps() {
        let every = |step: usize| (360..=1000).step_by(step).map(f64::from).collect::<Vec<_>>();
        // A red edge, as of brick.
        let red = |nm: f64| 0.05 + 0.55 / (1.0 + (-(nm - 590.0) / 15.0).exp());
        let (fine, coarse) = (colour(&every(1), red), colour(&every(4), red));
        assert!((fine - coarse).farthest() < 1e-3, "{fine} {coarse}");
        assert!(fine.x > 0.5 && fine.y < 0.2 && fine.z < 0.1, "{fine}");
    }
}
