//! Smoothing, section 3.2.2: each thread moves by half its Laplacian vector over theta_o; of an anisotropic BRDF, then over phi_o.
use glam::DVec3;

use super::MIN_COS;
use super::slice::reflect;

/// Smooths one thread, given as one unit direction per row. The first and the last stay: they have one neighbour.
pub fn smooth(thread: &[DVec3]) -> Vec<DVec3> {
    let mut smoothed = thread.to_vec();
    for row in 1..thread.len().saturating_sub(1) {
        let laplacian = 0.5 * (thread[row - 1] + thread[row + 1]) - thread[row];
        // Unit vectors above the horizon: their weighted mean is above it too, and not zero.
        smoothed[row] = (thread[row] + 0.5 * laplacian).normalize();
    }
    smoothed
}

/// Smooths one thread over the azimuths of one view angle: its directions in the surface's own axes, and w_o of each. What moves is the half
/// vector, since lobes stay where they are there: the mirrored view goes around, and its Laplacian would draw it inwards. What would be
/// mirrored below the horizon stays.
pub fn smooth_over_azimuths(thread: &[DVec3], w_o: &[DVec3]) -> Vec<DVec3> {
    let half_vectors: Vec<_> = thread.iter().zip(w_o).map(|(s, w_o)| (s + w_o).normalize()).collect();
    let mirrored = smooth(&half_vectors).into_iter().zip(w_o).map(|(h, w_o)| reflect(*w_o, h));
    mirrored.zip(thread).map(|(s, before)| if s.z > MIN_COS { s } else { *before }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thread_moves_by_half_its_laplacian() {
        let thread = [0.0f64, 0.02, 0.0, 0.01].map(|angle| DVec3::new(angle.sin(), 0.0, angle.cos()));
        let angles: Vec<f64> = smooth(&thread).iter().map(|s| s.x.asin()).collect();
        // Laplacians: (0 + 0) / 2 - 0.02 = -0.02 and (0.02 + 0.01) / 2 - 0 = 0.015; angles this small add like vectors.
        for (angle, expected) in angles.iter().zip([0.0, 0.01, 0.0075, 0.01]) {
            assert!((angle - expected).abs() < 1e-6, "{angles:?}");
        }
    }

    #[test]
    fn a_thread_that_turns_evenly_stays() {
        let thread: Vec<DVec3> =
            (0..20).map(|row| 0.02 * f64::from(row)).map(|a| DVec3::new(a.sin(), 0.0, a.cos())).collect();
        assert!(smooth(&thread).iter().zip(&thread).all(|(a, b)| a.distance(*b) < 1e-12));
    }

    #[test]
    fn a_thread_on_one_facet_stays_as_the_view_goes_around_and_a_kink_is_halved() {
        let w_o: Vec<_> =
            (0..10).map(|i| 0.17 * f64::from(i)).map(|a| DVec3::new(0.6 * a.cos(), 0.6 * a.sin(), 0.8)).collect();
        let facet = |tilt: f64| DVec3::new(tilt.sin(), 0.0, tilt.cos());
        let mut thread: Vec<_> = w_o.iter().map(|w_o| reflect(*w_o, facet(0.1))).collect();
        let smoothed = smooth_over_azimuths(&thread, &w_o);
        assert!(smoothed.iter().zip(&thread).all(|(a, b)| a.distance(*b) < 1e-12));
        thread[4] = reflect(w_o[4], facet(0.12));
        let h = (smooth_over_azimuths(&thread, &w_o)[4] + w_o[4]).normalize();
        assert!(h.distance(facet(0.11)) < 1e-5, "{h}");
    }

    #[test]
    fn one_or_two_rows_stay() {
        for rows in 0..3 {
            let thread = vec![DVec3::Z; rows];
            assert_eq!(smooth(&thread), thread);
        }
    }
}
