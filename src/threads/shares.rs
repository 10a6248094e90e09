//! Keeps the samples' shares of the pdf equal, which the forces alone do not.
//!
//! Not in the paper. In the tail of a steep lobe a cone reaches into the lobe for its share, is narrower than the local
//! spacing ought to be, and so lets more samples in than belong there. Left to settle by the forces alone, 100 samples
//! of a plastic miss its albedo by up to 9 % in a channel and soft lights by 5.6 %; with this pull, and a few steps per row
//! instead of all, by 1 % and 3 %.
use glam::{DVec2, DVec3};

use super::slice::Slice;

/// Part of the way to its place that a sample is drawn in each row. The next rows do the rest, and threads stay smooth.
const PULL: f64 = 0.1;

/// Draws each sample but the `fixed` one towards the place along theta_h at which its rank says the CDF should be: the k-th
/// of m from the middle of the lobe outwards has k + 1/2 shares of 1/m inside it.
pub fn balance(slice: &Slice, samples: &mut [DVec3], fixed: Option<usize>) {
    let count = samples.len() as f64;
    let mut places: Vec<(DVec2, usize)> = samples.iter().enumerate().map(|(i, &s)| (slice.coordinate(s), i)).collect();
    places.sort_by(|a, b| a.0.x.total_cmp(&b.0.x));
    for (rank, (uv, i)) in places.into_iter().enumerate() {
        if fixed != Some(i) {
            let u = uv.x + PULL * ((rank as f64 + 0.5) / count - uv.x);
            samples[i] = slice.direction(DVec2::new(u, uv.y));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::Brdf;

    #[test]
    fn samples_end_with_equal_shares_inside_each_other() {
        let clay = Brdf::builtin("clay").unwrap();
        let slice = Slice::new(&clay, 0.4);
        let mut samples: Vec<DVec3> = (0..10).map(|i| slice.direction(DVec2::new(0.03 * f64::from(i), 0.4))).collect();
        let fixed = samples[3];
        for _ in 0..100 {
            balance(&slice, &mut samples, Some(3));
        }
        assert_eq!(samples[3], fixed);
        let mut u: Vec<f64> = samples.iter().map(|&s| slice.coordinate(s).x).collect();
        u.remove(3);
        u.sort_by(f64::total_cmp);
        assert!(u.windows(2).all(|pair| pair[1] - pair[0] > 0.09), "{u:?}");
    }
}
