//! Pace: how fine pictures are while they move, so that they keep up with the hand.
use std::time::Duration;

/// A moving picture takes this long at most, where that can be had: ten frames a second, with what putting it into the window
/// and drawing the panel take (lavapipe: 30 ms).
const TARGET: Duration = Duration::from_millis(60);
/// Scales of width and height that moving pictures have, from fine to coarse. Few, since each change of size makes images anew.
const SCALES: [f64; 6] = [1.0, 0.75, 0.5, 0.375, 0.25, 0.125];

/// What frames cost, and hence how large moving ones can be.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pace {
    /// Seconds a pixel, of the last frame that shaded.
    seconds_a_pixel: Option<f64>,
}

impl Pace {
    /// Takes note that a picture of so many pixels was drawn anew in this time.
    pub fn drawn(&mut self, [width, height]: [u32; 2], time: Duration) {
        let pixels = f64::from(width) * f64::from(height);
        if pixels > 0.0 {
            self.seconds_a_pixel = Some(time.as_secs_f64() / pixels);
        }
    }

    /// The size of a picture of `size` while it moves.
    pub fn moving(&self, [width, height]: [u32; 2]) -> [u32; 2] {
        let seconds = self.seconds_a_pixel.unwrap_or(0.0) * f64::from(width) * f64::from(height);
        let fits = |scale: &&f64| seconds * **scale * **scale <= TARGET.as_secs_f64();
        let scale = SCALES.iter().find(fits).copied().unwrap_or(SCALES[SCALES.len() - 1]);
        [width, height].map(|side| ((f64::from(side) * scale).round() as u32).max(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_quick_moves_as_it_is_and_what_is_slow_gets_coarser() {
        let mut pace = Pace::default();
        let size = [640, 480];
        assert_eq!(pace.moving(size), size);
        for (ms, expected) in [(10, [640, 480]), (100, [480, 360]), (230, [320, 240]), (100_000, [80, 60])] {
            pace.drawn(size, Duration::from_millis(ms));
            assert_eq!(pace.moving(size), expected, "{ms} ms");
        }
    }

    #[test]
    fn a_coarse_picture_tells_what_a_fine_one_would_cost() {
        let mut pace = Pace::default();
        pace.drawn([320, 240], Duration::from_millis(10));
        assert_eq!(pace.moving([640, 480]), [640, 480]);
        pace.drawn([0, 0], Duration::from_millis(10));
        assert_eq!(pace.moving([640, 480]), [640, 480]);
    }
}
