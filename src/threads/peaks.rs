//! Peaks, section 3.2.3: a sample sits on a sharp maximum of the slice, so that the maximum is never missed.
use std::f64::consts::FRAC_1_PI;

use glam::DVec3;

use super::slice::Slice;

/// A maximum is sharp where the pdf there is more than this many times the greatest of a diffuse surface, 1 / pi: a lobe
/// of about 20 degrees or less. A sample there costs nothing, even where so many others share the lobe that none is needed.
const SHARP: f64 = 10.0;

/// The sharp maximum of `slice`, if it has one.
pub fn sharp_peak(slice: &Slice) -> Option<DVec3> {
    let peak = slice.peak();
    (slice.pdf(peak) > SHARP * FRAC_1_PI).then_some(peak)
}

/// Puts the sample nearest to `peak`, or the one that sat on the peak of the row before, onto it, and returns its index.
pub fn occupy(peak: DVec3, samples: &mut [DVec3], before: Option<usize>) -> usize {
    let nearest = || {
        let distances = samples.iter().map(|s| s.distance_squared(peak));
        distances.enumerate().min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(i, _)| i)
    };
    let chosen = before.unwrap_or_else(nearest);
    samples[chosen] = peak;
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{Brdf, SeenBrdf};
    use crate::threads::test_materials;

    #[test]
    fn a_narrow_lobe_is_sharp_and_a_diffuse_one_is_not() {
        assert!(sharp_peak(&Slice::new(&SeenBrdf::from_all_around(test_materials::narrow()), 0.5)).is_some());
        assert!(sharp_peak(&Slice::new(&SeenBrdf::from_all_around(&Brdf::builtin("clay").unwrap()), 0.5)).is_none());
    }

    #[test]
    fn the_nearest_sample_takes_the_peak_and_keeps_it() {
        let mut samples = [DVec3::X, DVec3::Y, DVec3::Z];
        let peak = DVec3::new(0.1, 0.8, 0.2).normalize();
        assert_eq!(occupy(peak, &mut samples, None), 1);
        assert_eq!(occupy(DVec3::Z, &mut samples, Some(1)), 1);
        assert_eq!(samples[1], DVec3::Z);
    }
}
