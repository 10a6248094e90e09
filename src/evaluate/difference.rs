//! Where two pictures differ, as a heat map.
use super::metrics::{Comparable, compared_pixels};

/// Differences of display values up to this are black; colours go by the logarithm from here to 1.
pub const SMALLEST: f64 = 1e-4;
/// Rows of the scale below the map, and of the gap above it.
const SCALE_ROWS: usize = 12;
const GAP_ROWS: usize = 4;
/// Pixels that were not compared, the gap, and the scale's ticks.
const LEFT_OUT: [u8; 3] = [72, 78, 84];

/// RGBA, 8 bits each, of a heat map: the largest difference among the three channels' display values, in magma colours from black
/// at 1e-4 and below over violet and orange to pale yellow at 1; the same colour steps for the same factor. Grey pixels were left out.
///
/// # Panics
/// If the sizes differ.
pub fn heat_map(a: &Comparable, b: &Comparable, mask_background: bool) -> Vec<u8> {
    assert_eq!((a.width, a.height), (b.width, b.height), "sizes differ");
    let colour = scale();
    // Without alpha in either there is nothing to leave out.
    let compared = compared_pixels(a, b, mask_background).unwrap_or_else(|_| vec![true; a.display.len()]);
    let map = a.display.iter().zip(&b.display).zip(&compared).map(|((a, b), compared)| {
        let largest = (0..3).map(|channel| (a[channel] - b[channel]).abs()).fold(0.0, f32::max);
        if *compared { colour(place_of(f64::from(largest))) } else { LEFT_OUT }
    });
    map.flat_map(opaque).collect()
}

/// Where on the scale a difference is: 0 at the smallest one, 1 at 1.
fn place_of(difference: f64) -> f64 {
    1.0 - difference.max(SMALLEST).log10() / SMALLEST.log10()
}

/// The scale of a [`heat_map`]: the colour at a place on it, from 0, which is [`SMALLEST`], by the logarithm to 1.
pub fn scale() -> impl Fn(f64) -> [u8; 3] {
    let colours = nv_flip::magma_lut().to_vec();
    move |place: f64| {
        let index = (255.0 * place).round().min(255.0) as usize;
        [colours[3 * index], colours[3 * index + 1], colours[3 * index + 2]]
    }
}

fn opaque([r, g, b]: [u8; 3]) -> [u8; 4] {
    [r, g, b, 255]
}

/// Width, height and RGBA of the [`heat_map`] with its scale below it: 1e-4 on the left and 1 on the right, with a tick at each power of
/// ten.
///
/// # Panics
/// If the sizes differ.
pub fn difference_picture(a: &Comparable, b: &Comparable, mask_background: bool) -> (u32, u32, Vec<u8>) {
    let mut rgba = heat_map(a, b, mask_background);
    let colour = scale();
    let width = a.width;
    let decades = -SMALLEST.log10();
    let scale = (0..width).map(|x| {
        let place = (x as f64 + 0.5) / width as f64;
        let exponent = (place - 1.0) * decades;
        let half_a_pixel = 0.5 * decades / width as f64;
        let is_tick = (exponent - exponent.round()).abs() <= half_a_pixel
            && exponent.round().abs() < decades
            && exponent.round() != 0.0;
        if is_tick { LEFT_OUT } else { colour(place) }
    });
    let scale: Vec<_> = scale.collect();
    let gap = std::iter::repeat_n(LEFT_OUT, GAP_ROWS * width);
    rgba.extend(gap.chain(scale.iter().copied().cycle().take(SCALE_ROWS * width)).flat_map(opaque));
    (width as u32, (a.height + GAP_ROWS + SCALE_ROWS) as u32, rgba)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::Display;

    #[test]
    fn equal_is_black_black_against_white_is_the_end_of_the_scale_and_the_background_grey() {
        let picture = |value: f32| {
            let pixels: Vec<_> = (0..400).map(|i| if i < 20 { [0.0; 4] } else { [value, 0.5, 0.5, 1.0] }).collect();
            Comparable::from_radiance(20, 20, &pixels, true, Display::default())
        };
        let at = |rgba: &[u8], pixel: usize| [rgba[4 * pixel], rgba[4 * pixel + 1], rgba[4 * pixel + 2]];
        let (width, height, equal) = difference_picture(&picture(0.0), &picture(0.0), true);
        assert_eq!((width, height, equal.len()), (20, 36, 4 * 20 * 36));
        let (_, _, differing) = difference_picture(&picture(0.0), &picture(1.0), true);
        assert_eq!((at(&equal, 0), at(&differing, 0)), (LEFT_OUT, LEFT_OUT));
        let last = 20 * 36 - 1;
        assert!(at(&equal, 399).iter().all(|value| *value < 8), "{:?}", at(&equal, 399));
        assert!(at(&differing, 399).iter().all(|value| *value > 180), "{:?}", at(&differing, 399));
        // A scale of 20 pixels ends a tenth of a decade from 1.
        assert!(at(&differing, last).iter().zip(at(&differing, 399)).all(|(a, b)| a.abs_diff(b) < 16));
    }
}
