//! Smoothing, section 3.2.2: each thread moves by half its Laplacian vector over theta_o (F3).
use glam::DVec3;

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
    fn one_or_two_rows_stay() {
        for rows in 0..3 {
            let thread = vec![DVec3::Z; rows];
            assert_eq!(smooth(&thread), thread);
        }
    }
}
