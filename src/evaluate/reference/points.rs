//! The points of the unit square at which the reference evaluates: Sobol's (0,2)-sequence in independent Owen scrambles.
use glam::DVec2;

/// Point `index` of scramble `set`, in (0, 1)^2.
///
/// Any 2^m points from the start of a set lie one in each box of every grid of 2^m equal boxes with sides of powers of two.
/// Each set by itself is uniform, so means over different sets are independent estimates of the same integral.
pub fn point(set: u32, index: u32) -> DVec2 {
    let seed = hash(set);
    // Sobol's first dimension is the index with its bits reversed; Owen's scramble works on reversed bits too.
    let x = owen_scramble(index, seed).reverse_bits();
    let y = owen_scramble(sobol_second(index).reverse_bits(), hash(seed)).reverse_bits();
    // The middle of the box of width 2^-32: never exactly 0 or 1.
    (DVec2::new(f64::from(x), f64::from(y)) + 0.5) / 4_294_967_296.0
}

/// Sobol's second dimension: direction numbers 1, 3, 5, 15, 17, ... (Pascal's triangle modulo 2).
fn sobol_second(index: u32) -> u32 {
    let (mut rest, mut direction, mut result) = (index, 1 << 31, 0);
    while rest != 0 {
        if rest & 1 == 1 {
            result ^= direction;
        }
        rest >>= 1;
        direction ^= direction >> 1;
    }
    result
}

/// Owen's nested uniform scramble of a number whose lowest bit is the most significant of the fraction, as a hash (Laine
/// and Karras 2011, with the constants of Vegdahl that Burley 2020 recommends).
fn owen_scramble(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// A seed unlike those of other numbers (the finaliser of MurmurHash3).
fn hash(number: u32) -> u32 {
    let mut x = number.wrapping_add(0x9e37_79b9);
    x = (x ^ (x >> 16)).wrapping_mul(0x85eb_ca6b);
    x = (x ^ (x >> 13)).wrapping_mul(0xc2b2_ae35);
    x ^ (x >> 16)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_elementary_box_holds_one_point() {
        for set in [0, 1, 77] {
            for m in [4, 8] {
                for split in 0..=m {
                    let (columns, rows) = (1 << split, 1 << (m - split));
                    let mut seen = vec![false; 1 << m];
                    for index in 0..1 << m {
                        let p = point(set, index) * DVec2::new(f64::from(columns), f64::from(rows));
                        seen[(p.y as i32 * columns + p.x as i32) as usize] = true;
                    }
                    assert!(seen.iter().all(|&seen| seen), "set {set}, {columns} x {rows}");
                }
            }
        }
    }

    #[test]
    fn sets_are_uniform_and_unlike_each_other() {
        // The first points of many sets are independent and uniform: mean 1/2, variance 1/12, no correlation.
        let count = 4096;
        let firsts: Vec<DVec2> = (0..count).map(|set| point(set, 0) - 0.5).collect();
        let mean = firsts.iter().sum::<DVec2>() / f64::from(count);
        let variance = firsts.iter().map(|p| *p * *p).sum::<DVec2>() / f64::from(count);
        let correlation = firsts.iter().map(|p| p.x * p.y).sum::<f64>() / f64::from(count);
        assert!(mean.abs().max_element() < 0.02, "{mean}");
        assert!((variance - 1.0 / 12.0).abs().max_element() < 0.005, "{variance}");
        assert!(correlation.abs() < 0.006, "{correlation}");
    }
}
