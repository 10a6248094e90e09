//! Structural similarity (Wang, Bovik, Sheikh and Simoncelli 2004, "Image quality assessment").
//!
//! Our own, as it has to be of display values in single precision, with a map that a mask can be laid on: image-compare's
//! windows are 8 x 8 blocks of 8-bit values without weights, dssim-core's score is a multi-scale variant in Lab. The value
//! is that of scikit-image 0.26,
//! `structural_similarity(a, b, gaussian_weights=True, sigma=1.5, use_sample_covariance=False, data_range=1,
//! channel_axis=-1)`, which, as the paper does, counts only windows that lie in the picture entirely.
use rayon::prelude::*;

/// Pixels from the middle of a window to its edge: windows are 11 x 11.
pub const RADIUS: usize = 5;
/// Side of a window in pixels, and so the least width and height of a picture that has an SSIM.
pub const WINDOW: usize = 2 * RADIUS + 1;
/// Standard deviation of the window's Gaussian weights, in pixels.
const SIGMA: f64 = 1.5;
/// (K1 L)^2 and (K2 L)^2 of equation (12) with K1 = 0.01, K2 = 0.03 and the range of values L = 1.
const C1: f64 = 0.01 * 0.01;
const C2: f64 = 0.03 * 0.03;

/// SSIM of every window inside two pictures of values in [0, 1], mean over the channels: (width - 10) x (height - 10)
/// values, row by row, the first for the window around pixel (5, 5).
///
/// # Panics
/// If a picture has not `width` x `height` pixels, or is smaller than a window.
pub fn ssim_map(a: &[[f32; 3]], b: &[[f32; 3]], width: usize, height: usize) -> Vec<f64> {
    assert!(width >= WINDOW && height >= WINDOW, "smaller than a window");
    assert!(a.len() == width * height && b.len() == width * height, "one value a pixel");
    let mut map = vec![0.0; (width - 2 * RADIUS) * (height - 2 * RADIUS)];
    for channel in 0..3 {
        // Weighted means of a, b, a^2, b^2 and a b in every window.
        let mean = |value: &(dyn Fn(f64, f64) -> f64 + Sync)| {
            let value = |i: usize| value(f64::from(a[i][channel]), f64::from(b[i][channel]));
            blur(&(0..a.len()).map(value).collect::<Vec<_>>(), width)
        };
        let (mean_a, mean_b) = (mean(&|a, _| a), mean(&|_, b| b));
        let (mean_aa, mean_bb, mean_ab) = (mean(&|a, _| a * a), mean(&|_, b| b * b), mean(&|a, b| a * b));
        map.par_iter_mut().enumerate().for_each(|(i, ssim)| {
            let (mu_a, mu_b) = (mean_a[i], mean_b[i]);
            let (variance_a, variance_b) = (mean_aa[i] - mu_a * mu_a, mean_bb[i] - mu_b * mu_b);
            let covariance = mean_ab[i] - mu_a * mu_b;
            // Equation (13).
            *ssim += (2.0 * mu_a * mu_b + C1) * (2.0 * covariance + C2)
                / ((mu_a * mu_a + mu_b * mu_b + C1) * (variance_a + variance_b + C2))
                / 3.0;
        });
    }
    map
}

/// The Gaussian mean of every window inside a picture: along rows, then along columns.
fn blur(values: &[f64], width: usize) -> Vec<f64> {
    let weights = gaussian();
    let height = values.len() / width;
    let (columns, rows) = (width - 2 * RADIUS, height - 2 * RADIUS);
    let mut along_rows = vec![0.0; columns * height];
    along_rows.par_chunks_mut(columns).zip(values.par_chunks(width)).for_each(|(out, row)| {
        for (x, out) in out.iter_mut().enumerate() {
            *out = weights.iter().zip(&row[x..]).map(|(weight, value)| weight * value).sum();
        }
    });
    let mut means = vec![0.0; columns * rows];
    means.par_chunks_mut(columns).enumerate().for_each(|(y, out)| {
        for (weight, row) in weights.iter().zip(along_rows[y * columns..].chunks(columns)) {
            out.iter_mut().zip(row).for_each(|(out, value)| *out += weight * value);
        }
    });
    means
}

/// The window's weights along one axis; they sum to 1.
fn gaussian() -> [f64; WINDOW] {
    let weight = |i: usize| (-0.5 * ((i as f64 - RADIUS as f64) / SIGMA).powi(2)).exp();
    let sum: f64 = (0..WINDOW).map(weight).sum();
    std::array::from_fn(|i| weight(i) / sum)
}
