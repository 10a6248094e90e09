//! Differences of vectors that notice what is no number.
use glam::DVec3;

/// Maxima of vectors pass over what is no number, and so would tests.
pub trait Farthest {
    /// The greatest part, without signs. Fails where one is no number.
    fn farthest(self) -> f64;
}

impl Farthest for DVec3 {
    fn farthest(self) -> f64 {
        assert!(self.is_finite(), "{self}");
        self.abs().max_element()
    }
}
