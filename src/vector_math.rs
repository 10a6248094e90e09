//! Functions of single precision that are vector instructions where the processor has them.
use half::f16;
use half::slice::HalfFloatSliceExt;

/// Four numbers rounded to half floats, at once.
#[inline]
pub fn half_floats(four: [f32; 4]) -> [f16; 4] {
    let mut halves = [f16::ZERO; 4];
    halves.convert_from_f32_slice(&four);
    halves
}

/// exp of a number x that is not positive, with a relative error of at most 2e-7 + 1e-7 |x|, and to 2e-35 below -80. Compilers cannot make vector instructions of
/// the standard library's.
#[inline(always)]
pub fn exp(x: f32) -> f32 {
    // Adding 1.5 2^23 rounds to a whole number, which is then in the last bits.
    const ROUND: f32 = 12_582_912.0;
    let binary = x.max(-80.0) * std::f32::consts::LOG2_E;
    let rounded = binary + ROUND;
    let f = (binary - (rounded - ROUND)) * std::f32::consts::LN_2;
    // Taylor's series over +-0.35: the next term is 1.2e-7.
    let series = 1.0 + f * (1.0 + f * (0.5 + f * (1.0 / 6.0 + f * (1.0 / 24.0 + f * (1.0 / 120.0 + f / 720.0)))));
    f32::from_bits((rounded.to_bits() << 23).wrapping_add(1.0_f32.to_bits())) * series
}

#[cfg(test)]
mod tests {
    use super::exp;

    #[test]
    fn exp_is_that_of_the_standard_library() {
        for i in 0..=80_000 {
            let x = -1e-3 * i as f32;
            let (found, exact) = (f64::from(exp(x)), f64::from(x).exp());
            // x itself times log2 e is rounded, which counts by x.
            assert!((found - exact).abs() < (2e-7 + 1e-7 * f64::from(-x)) * exact, "{x}: {found} {exact}");
        }
        assert!(exp(-1e30) < 2e-35 && exp(f32::NEG_INFINITY) < 2e-35);
    }
}
