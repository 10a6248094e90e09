//! Von Mises-Fisher kernels: what one trilinear lookup in the environment's pyramid weighs directions by.
//!
//! vMF(w; d, kappa) = kappa / (2 pi (1 - exp(-2 kappa))) exp(kappa (w . d - 1)); its width is sigma = 1 / sqrt(kappa). Level l of a
//! pyramid holds the environment convolved with the kernel of width [`FINEST_WIDTH_RAD`] 2^l, and a lookup between two levels has a
//! linear blend of their kernels. Level -1 is the environment as it is.
use std::f64::consts::PI;

use glam::DVec3;

/// Width of the kernel of level 0 in radians: 0.22 degrees, two texels in the middle of a face of 1024.
pub const FINEST_WIDTH_RAD: f64 = 1.0 / 256.0;

/// The sharpest level: no blur, for lobes that are mirrors.
pub const SHARPEST_LEVEL: f64 = -1.0;

/// The widest level: there the kernel has a width of one radian.
pub const WIDEST_LEVEL: f64 = 8.0;

/// kappa of the kernel of a whole `level`.
pub fn kappa_of_level(level: f64) -> f64 {
    // For none at all a width of 0.002 degrees: far narrower than any light or pixel, and its square is no trouble to f64.
    const SHARP_KAPPA: f64 = 1e9;
    if level < 0.0 { SHARP_KAPPA } else { (FINEST_WIDTH_RAD * level.exp2()).powi(-2) }
}

/// A length on the scale of a kernel of `level`: its width; for those sharper than level 0, as if widths went on halving.
pub fn scale_rad(level: f64) -> f64 {
    FINEST_WIDTH_RAD * level.exp2()
}

/// vMF in its own direction, in 1/sr.
pub fn vmf_peak(kappa: f64) -> f64 {
    kappa / (2.0 * PI * -(-2.0 * kappa).exp_m1())
}

/// The integral of the product of two kernels whose directions are `cos` apart, and its derivative by `cos`.
///
/// With R = |a d + b c| it is a b sinh R / (4 pi R sinh a sinh b) (Jupp and Mardia 1989), here with the exponentials divided out.
#[inline]
pub fn overlap(cos: f64, pair: &Pair) -> (f64, f64) {
    let r = (pair.squares + pair.twice_product * cos).max(0.0).sqrt();
    // R - a - b without cancellation.
    let exponent = pair.twice_product * (cos - 1.0) / (r + pair.sum);
    if exponent < -40.0 {
        return (0.0, 0.0);
    }
    // Both kernels have kappa of at least 1, so R is only small where they are opposite; 1e-3 is far from where 1/R matters.
    let r = r.max(1e-3);
    let value = pair.factor * exponent.exp() / r;
    let (twice, value) = if r < 20.0 {
        let e = (-2.0 * r).exp();
        (e, value * (1.0 - e))
    } else {
        (0.0, value)
    };
    // d log(sinh R / R) / dR = coth R - 1 / R, dR / dcos = a b / R.
    let coth = (1.0 + twice) / (1.0 - twice);
    (value, value * (coth - 1.0 / r) * 0.5 * pair.twice_product / r)
}

/// What [`overlap`] needs of two kappas.
#[derive(Clone, Copy, Debug)]
pub struct Pair {
    squares: f64,
    twice_product: f64,
    sum: f64,
    factor: f64,
}

impl Pair {
    /// Of kernels of these two kappas.
    pub fn new(a: f64, b: f64) -> Self {
        let rest = |kappa: f64| -(-2.0 * kappa).exp_m1();
        Self {
            squares: a * a + b * b,
            twice_product: 2.0 * a * b,
            sum: a + b,
            factor: a * b / (2.0 * PI * rest(a) * rest(b)),
        }
    }
}

/// The direction in a kernel around `d` that has the part `u` of its mass nearer to `d`, at angle `azimuth` around it.
pub fn vmf_direction(d: DVec3, kappa: f64, u: f64, azimuth: f64) -> DVec3 {
    // 1 - cos of the angle: inverse of the CDF.
    let one_minus = -(1.0 - u * -(-2.0 * kappa).exp_m1()).ln() / kappa;
    let sin = (one_minus * (2.0 - one_minus)).max(0.0).sqrt();
    let (x, y) = d.any_orthonormal_pair();
    (1.0 - one_minus) * d + sin * (azimuth.cos() * x + azimuth.sin() * y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::threads::slice::fibonacci_lattice;
    use std::f64::consts::TAU;

    fn vmf(cos: f64, kappa: f64) -> f64 {
        vmf_peak(kappa) * (kappa * (cos - 1.0)).exp()
    }

    #[test]
    fn overlap_is_the_integral_of_the_product() {
        for (a, b) in [(1.0, 1.0), (4.0, 100.0), (300.0, 200.0), (5000.0, 2.0), (kappa_of_level(-1.0), 300.0)] {
            for angle in [0.0f64, 0.05, 0.3, 1.0, 3.0] {
                let d = DVec3::Z;
                let c = DVec3::new(angle.sin(), 0.0, angle.cos());
                let count = 200_000;
                // Points drawn by the narrower kernel.
                let sum: f64 = fibonacci_lattice(count)
                    .map(|uv| {
                        let w = if a > b {
                            vmf_direction(d, a, uv.x, TAU * uv.y)
                        } else {
                            vmf_direction(c, b, uv.x, TAU * uv.y)
                        };
                        if a > b { vmf(w.dot(c), b) } else { vmf(w.dot(d), a) }
                    })
                    .sum::<f64>()
                    / count as f64;
                let pair = Pair::new(a, b);
                let (value, slope) = overlap(angle.cos(), &pair);
                assert!((value - sum).abs() < 1e-3 * sum + 1e-9, "{a} {b} {angle}: {value} {sum}");
                let step = 1e-5;
                let numeric =
                    (overlap(angle.cos() + step, &pair).0 - overlap(angle.cos() - step, &pair).0) / (2.0 * step);
                assert!((slope - numeric).abs() < 1e-3 * numeric.abs() + 1e-9, "{a} {b} {angle}: {slope} {numeric}");
            }
        }
    }
}
