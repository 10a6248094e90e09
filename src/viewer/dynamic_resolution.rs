//! How fine pictures are while they move, so that they keep up with the hand.
use std::time::Duration;

/// A moving picture takes this long at most, where that can be had: ten frames a second, with what putting it into the window
/// and drawing the panel take (lavapipe: 30 ms).
const TARGET_S: f64 = 0.060;
/// Scales of width and height that moving pictures have, from fine to coarse. Few, since each change of size makes images anew.
const SCALES: [f64; 6] = [1.0, 0.75, 0.5, 0.375, 0.25, 0.125];
/// A scale is kept as long as it takes no more than this much of the target: what flickers disturbs more.
const LEAVES: f64 = 1.3;
/// A finer one is taken where it takes no more than this.
const ENTERS: f64 = 0.8;

/// Pictures get no coarser than by so many scales at once: a slow one, such as the first of another size, says little of the next.
const FALLS: usize = 2;

/// What a picture has cost.
#[derive(Clone, Copy, Debug)]
struct Cost {
    pixels: f64,
    seconds: f64,
}

/// What frames cost, and hence how large moving ones can be.
#[derive(Clone, Copy, Debug, Default)]
pub struct DynamicResolution {
    /// Of the last picture in full size.
    full: Option<Cost>,
    /// Of the last coarser one. The two tell apart what a picture costs anyway, and what for each pixel.
    coarse: Option<Cost>,
    /// Index of the scale that moving pictures have.
    scale: usize,
}

impl DynamicResolution {
    /// Takes note that a picture of `size`, which is `full` or a part of that, was drawn anew in this time.
    pub fn drawn(&mut self, size: [u32; 2], full: [u32; 2], time: Duration) {
        let cost = Cost { pixels: pixels(size), seconds: time.as_secs_f64() };
        let of = if size == full { &mut self.full } else { &mut self.coarse };
        if cost.pixels > 0.0 {
            *of = Some(cost);
        }
    }

    /// The size of a picture of `size` while it moves.
    pub fn moving(&mut self, size: [u32; 2]) -> [u32; 2] {
        let seconds = |scale: usize| self.seconds(pixels(scaled(size, scale)));
        let fits = |scale: &usize| {
            let slack = match scale.cmp(&self.scale) {
                std::cmp::Ordering::Less => ENTERS,
                std::cmp::Ordering::Equal => LEAVES,
                std::cmp::Ordering::Greater => 1.0,
            };
            seconds(*scale) <= slack * TARGET_S
        };
        let wanted = (0..SCALES.len()).find(fits).unwrap_or(SCALES.len() - 1);
        self.scale = wanted.min(self.scale + FALLS);
        scaled(size, self.scale)
    }

    /// What a picture of so many pixels would take.
    fn seconds(&self, pixels: f64) -> f64 {
        match (self.full, self.coarse) {
            (Some(full), Some(coarse)) if full.pixels > coarse.pixels => {
                let a_pixel = ((full.seconds - coarse.seconds) / (full.pixels - coarse.pixels)).max(0.0);
                coarse.seconds + a_pixel * (pixels - coarse.pixels)
            }
            (Some(cost), _) | (None, Some(cost)) => cost.seconds * pixels / cost.pixels,
            (None, None) => 0.0,
        }
    }
}

fn pixels([width, height]: [u32; 2]) -> f64 {
    f64::from(width) * f64::from(height)
}

fn scaled(size: [u32; 2], scale: usize) -> [u32; 2] {
    size.map(|side| ((f64::from(side) * SCALES[scale]).round() as u32).max(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    const FULL: [u32; 2] = [640, 480];

    /// A picture costs `fixed` milliseconds, and `each` more in full size.
    fn cost(size: [u32; 2], [fixed, each]: [f64; 2]) -> Duration {
        Duration::from_secs_f64(1e-3 * (fixed + each * pixels(size) / pixels(FULL)))
    }

    /// The sizes of ten pictures in a row, after one in full size.
    fn sizes(costs: [f64; 2]) -> Vec<[u32; 2]> {
        let mut dynamic_resolution = DynamicResolution::default();
        dynamic_resolution.drawn(FULL, FULL, cost(FULL, costs));
        let next = |_| {
            let size = dynamic_resolution.moving(FULL);
            dynamic_resolution.drawn(size, FULL, cost(size, costs));
            size
        };
        (0..10).map(next).collect()
    }

    #[test]
    fn what_is_quick_moves_as_it_is_and_what_is_slow_gets_coarser() {
        assert_eq!(DynamicResolution::default().moving(FULL), FULL);
        for (costs, expected) in [
            ([0.0, 10.0], FULL),
            ([0.0, 100.0], [480, 360]),
            ([0.0, 230.0], [320, 240]),
            // However coarse, it takes more than it may.
            ([70.0, 1e5], [80, 60]),
        ] {
            assert_eq!(sizes(costs)[9], expected, "{costs:?} ms");
        }
    }

    #[test]
    fn what_a_picture_costs_anyway_does_not_make_it_coarser() {
        // Half of width and height take 75 ms, which is little more than they may. Taken for the price of the pixels alone, these
        // would say that the half of that is still too much.
        let sizes = sizes([50.0, 100.0]);
        assert!(sizes.iter().all(|size| *size == [320, 240]), "{sizes:?}");
    }

    #[test]
    fn a_scale_is_kept_though_times_vary() {
        let mut dynamic_resolution = DynamicResolution::default();
        dynamic_resolution.drawn(FULL, FULL, cost(FULL, [0.0, 200.0]));
        for step in 0..20 {
            let size = dynamic_resolution.moving(FULL);
            assert_eq!(size, [320, 240]);
            dynamic_resolution.drawn(size, FULL, cost(size, [0.0, if step % 2 == 0 { 170.0 } else { 240.0 }]));
        }
        dynamic_resolution.drawn([0, 0], FULL, Duration::from_millis(10));
        assert_eq!(dynamic_resolution.moving(FULL), [320, 240]);
    }

    #[test]
    fn one_slow_picture_does_not_make_the_next_one_tiny() {
        let mut dynamic_resolution = DynamicResolution::default();
        dynamic_resolution.drawn(FULL, FULL, cost(FULL, [5.0, 50.0]));
        assert_eq!(dynamic_resolution.moving(FULL), FULL);
        dynamic_resolution.drawn(FULL, FULL, cost(FULL, [5.0, 5000.0]));
        assert_eq!(dynamic_resolution.moving(FULL), [320, 240]);
    }
}
