//! Random numbers by counting. Twin of glsl/random.glsl.
use glam::{UVec2, Vec4};

/// PCG4D (Jarzynski and Olano 2020, Hash Functions for GPU Rendering).
pub(crate) fn pcg4d(words: [u32; 4]) -> [u32; 4] {
    let mut v = words.map(|word| word.wrapping_mul(1_664_525).wrapping_add(1_013_904_223));
    let mix = |v: &mut [u32; 4]| {
        for (to, a, b) in [(0, 1, 3), (1, 2, 0), (2, 0, 1), (3, 1, 2)] {
            v[to] = v[to].wrapping_add(v[a].wrapping_mul(v[b]));
        }
    };
    mix(&mut v);
    v = v.map(|word| word ^ word >> 16);
    mix(&mut v);
    v
}

/// Four random words for a sub-pixel. Twin of `random_bits`.
pub(super) fn random_bits(subpixel: UVec2, index: u32, seed: u64) -> [u32; 4] {
    pcg4d([subpixel.x | subpixel.y << 16, index, seed as u32, (seed >> 32) as u32])
}

/// Multiples of 2^-24 in [0, 1).
pub(super) fn to_unit(bits: [u32; 4]) -> Vec4 {
    Vec4::from(bits.map(|word| (word >> 8) as f32 * (1.0 / 16_777_216.0)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_even_and_independent_across_pixels_samples_and_seeds() {
        // Sums over a grid of neighbours, in each direction: mean 1/2, variance 1/12, no correlation with the next.
        let numbers = |step: [u32; 3]| {
            let at = move |i: u32| (UVec2::new(7 + step[0] * i, 3), step[1] * i, u64::from(step[2] * i));
            (0..20_000).map(move |i| {
                let (subpixel, index, seed) = at(i);
                to_unit(random_bits(subpixel, index, seed)).as_dvec4()
            })
        };
        for step in [[1, 0, 0], [0, 1, 0], [0, 0, 1]] {
            let values: Vec<_> = numbers(step).map(|u| u - 0.5).collect();
            let n = values.len() as f64;
            let mean = values.iter().sum::<glam::DVec4>() / n;
            assert!(mean.abs().max_element() < 4.5 * (1.0 / 12.0 / n).sqrt(), "{step:?}: {mean}");
            let variance = values.iter().map(|u| u * u).sum::<glam::DVec4>() / n;
            assert!(
                (variance - 1.0 / 12.0).abs().max_element() < 4.5 * (1.0 / 180.0 / n).sqrt(),
                "{step:?}: {variance}"
            );
            let next = values.windows(2).map(|pair| pair[0] * pair[1]).sum::<glam::DVec4>() / n;
            let across = values.iter().map(|u| *u * glam::DVec4::new(u.y, u.z, u.w, u.x)).sum::<glam::DVec4>() / n;
            assert!(next.abs().max_element() < 4.5 / 12.0 / n.sqrt(), "{step:?}: {next}");
            assert!(across.abs().max_element() < 4.5 / 12.0 / n.sqrt(), "{step:?}: {across}");
        }
    }
}
