//! Points that fill the unit hypercube evenly: Sobol's in Owen's scrambles. Twin of glsl/low_discrepancy.glsl.
use glam::UVec2;

use super::random::pcg4d;

/// Twin of `owen_scramble`.
fn owen_scramble(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// Twin of `pascal`.
fn pascal(mut x: u32) -> u32 {
    x ^= x >> 1 & 0x5555_5555;
    x ^= x >> 2 & 0x3333_3333;
    x ^= x >> 4 & 0x0f0f_0f0f;
    x ^= x >> 8 & 0x00ff_00ff;
    x ^ x >> 16 & 0x0000_ffff
}

/// Twin of `Stream`.
pub(super) struct Stream {
    shuffle: [u32; 2],
    scramble: [u32; 4],
}

impl Stream {
    /// Stream `index` of a pixel. Twin of `point_stream`.
    pub(super) fn new(pixel: UVec2, index: u32, seed: u64) -> Self {
        let words = |index| pcg4d([pixel.x | pixel.y << 16, index, seed as u32, (seed >> 32) as u32]);
        let [first, second, ..] = words(2 * index);
        Self { shuffle: [first, second], scramble: words(2 * index + 1) }
    }

    /// Twin of `point_bits`.
    pub(super) fn bits(&self, index: u32) -> [u32; 4] {
        let pair = |shuffle: u32, [x, y]: [u32; 2]| {
            let index = owen_scramble(index.reverse_bits(), shuffle).reverse_bits();
            [owen_scramble(index, x), owen_scramble(pascal(index), y)].map(u32::reverse_bits)
        };
        let [a, b, c, d] = self.scramble;
        let ([x, y], [z, w]) = (pair(self.shuffle[0], [a, b]), pair(self.shuffle[1], [c, d]));
        [x, y, z, w]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_elementary_box_of_a_pair_holds_one_point() {
        for seed in [0, 1, 77] {
            let stream = Stream::new(UVec2::new(3, 5), 0, seed);
            for (pair, m, start) in [(0, 4, 0), (1, 8, 0), (0, 8, 512)] {
                for split in 0..=m {
                    let mut seen = vec![false; 1 << m];
                    for index in start..start + (1 << m) {
                        let bits = &stream.bits(index)[2 * pair..];
                        // The number of the column, then of the row: leading bits of each.
                        let leading = |word: u32, count: u32| (u64::from(word) << count >> 32) as usize;
                        seen[leading(bits[0], split) << (m - split) | leading(bits[1], m - split)] = true;
                    }
                    assert!(seen.iter().all(|&seen| seen), "seed {seed}, pair {pair}, 2^{split} of 2^{m}");
                }
            }
        }
    }

    #[test]
    fn streams_are_uniform_and_unlike_each_other() {
        // The first points of many seeds, pixels and streams are independent and uniform: mean 1/2, variance 1/12, no correlation.
        let count = 4096;
        let streams: [fn(u32) -> Stream; 3] = [
            |i| Stream::new(UVec2::ZERO, 0, i.into()),
            |i| Stream::new(UVec2::new(i % 64, i / 64), 0, 0),
            |i| Stream::new(UVec2::ZERO, i, 0),
        ];
        for stream in streams {
            let firsts: Vec<_> =
                (0..count).map(|i| stream(i).bits(0).map(|word| f64::from(word) / 4_294_967_296.0 - 0.5)).collect();
            let mean_of = |g: &dyn Fn(&[f64; 4]) -> f64| firsts.iter().map(g).sum::<f64>() / f64::from(count);
            for i in 0..4 {
                assert!(mean_of(&|p| p[i]).abs() < 0.02);
                assert!((mean_of(&|p| p[i] * p[i]) - 1.0 / 12.0).abs() < 0.005);
                assert!(mean_of(&|p| p[i] * p[(i + 1) % 4]).abs() < 0.006);
            }
        }
    }
}
