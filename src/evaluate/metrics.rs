//! How much two pictures differ: RMS, SSIM, FLIP.
use serde::{Deserialize, Serialize};

use super::ssim::{RADIUS, WINDOW, ssim_map};
use crate::error::{Error, Result};
use crate::passes::View;
use crate::picture::{Format, PictureFile};
use crate::scene::ImageSettings;
use crate::statistics::largest;

/// How radiance L is displayed: clamp(exposure L, 0, 1)^(1/gamma).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Display {
    /// Factor on radiance; above 0.
    pub exposure: f64,
    /// Above 0.
    pub gamma: f64,
}

impl Display {
    /// How a picture of these settings shows it.
    pub fn of_image(image: &ImageSettings) -> Self {
        Self { exposure: image.exposure, gamma: image.gamma }
    }

    /// How `view` shows it.
    pub fn of(view: &View) -> Self {
        Self { exposure: f64::from(view.exposure), gamma: f64::from(view.gamma) }
    }

    /// The display value of `radiance`, 0 to 1.
    pub fn value(&self, radiance: f64) -> f64 {
        (self.exposure * radiance).clamp(0.0, 1.0).powf(1.0 / self.gamma)
    }
}

impl Default for Display {
    /// That of a scene that says nothing of it.
    fn default() -> Self {
        Self::of_image(&ImageSettings::default())
    }
}

/// How much two pictures differ, over all three channels of the pixels that were compared.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Metrics {
    /// Root of the mean squared difference of display values, 0 to 1.
    pub rms: f64,
    /// The same of linear radiance, not clamped: what is too bright to display counts in full.
    pub rms_linear: f64,
    /// Largest difference of display values, 0 to 1.
    pub max: f64,
    /// Mean structural similarity of display values: 1 for equal pictures. See [`ssim_map`].
    pub ssim: f64,
    /// Mean FLIP error, 0 to 1, of display values in 8 bits, which FLIP takes for sRGB; for 67 pixels per degree of vision
    /// (Andersson et al. 2020, "FLIP: A difference evaluator for alternating images").
    pub flip: f64,
    /// NaN and infinite values (of 4 channels, of all pixels) in the first picture plus those in the second. They are
    /// compared as 0.
    pub nan: u64,
    /// Pixels that were compared.
    pub pixels: u64,
}

/// A picture in both forms that metrics need.
#[derive(Clone, Debug)]
pub struct Comparable {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Linear radiance times coverage: over black.
    pub radiance: Vec<[f32; 3]>,
    /// Display values of that.
    pub display: Vec<[f32; 3]>,
    /// Where a surface is seen, even in part; none for a picture that does not tell (it has no alpha).
    pub covered: Option<Vec<bool>>,
    /// NaN and infinite values, which are 0 here.
    pub nan: u64,
}

impl Comparable {
    /// Linear radiance times coverage, and coverage (as [`Rendering::radiance`](crate::rendering::Rendering::radiance) has it), row by
    /// row; coverage tells surface from background only if `alpha`.
    ///
    /// # Panics
    /// If there are not `width` x `height` pixels.
    pub fn from_radiance(width: usize, height: usize, rgba: &[[f32; 4]], alpha: bool, display: Display) -> Self {
        Self::new(width, height, rgba, alpha, |[r, g, b, _]| {
            let radiance = [r, g, b];
            (radiance, radiance.map(|value| display.value(value.into()) as f32))
        })
    }

    /// A picture from a file. A PNG's values are display values already, taken to be made with `display`; where it is
    /// transparent, they are laid over black.
    pub fn from_picture(picture: &PictureFile, display: Display) -> Self {
        let (width, height) = (picture.width as usize, picture.height as usize);
        match picture.format {
            Format::Exr => Self::from_radiance(width, height, &picture.rgba, picture.alpha, display),
            Format::Png => Self::new(width, height, &picture.rgba, picture.alpha, |[r, g, b, alpha]| {
                let coverage = f64::from(alpha).powf(1.0 / display.gamma);
                let over_black = [r, g, b].map(|value| f64::from(value) * coverage);
                // What a tiny exposure makes of them may be more than single precision holds.
                let radiance = |value: f64| (value.powf(display.gamma) / display.exposure).min(f32::MAX.into()) as f32;
                let radiance = over_black.map(radiance);
                (radiance, over_black.map(|value| value as f32))
            }),
        }
    }

    /// `forms` takes a pixel to its radiance and its display values.
    fn new(
        width: usize,
        height: usize,
        rgba: &[[f32; 4]],
        alpha: bool,
        forms: impl Fn([f32; 4]) -> ([f32; 3], [f32; 3]),
    ) -> Self {
        assert_eq!(rgba.len(), width * height, "one value a pixel");
        let nan = rgba.iter().flatten().filter(|value| !value.is_finite()).count() as u64;
        let finite = |value: f32| if value.is_finite() { value } else { 0.0 };
        let (radiance, display) = rgba.iter().map(|pixel| forms(pixel.map(finite))).unzip();
        let covered = alpha.then(|| rgba.iter().map(|pixel| pixel[3] > 0.0).collect());
        Self { width, height, radiance, display, covered, nan }
    }
}

/// An error unless pictures of this size can be compared.
pub fn check_comparable_size(width: usize, height: usize) -> Result<()> {
    if width.min(height) >= WINDOW {
        return Ok(());
    }
    let problem = format!("the pictures are {width} x {height}, SSIM needs {WINDOW} x {WINDOW} pixels");
    Err(Error::input("comparison", problem, "give larger pictures"))
}

/// Compares two pictures; the order matters only to FLIP, and little there: `b` is its reference.
///
/// With `mask_background` only pixels count where `a` or `b` sees a surface, as far as they tell (alpha above 0); all
/// others are black in both, so that what is seen there does not leak into the windows of SSIM and the filters of FLIP.
///
/// # Errors
/// Pictures of different sizes, or smaller than a window of SSIM (11 x 11); with the mask, pictures without alpha, or in which
/// no surface is seen, or only within 5 pixels of their border (where SSIM has no windows).
pub fn compare(a: &Comparable, b: &Comparable, mask_background: bool) -> Result<Metrics> {
    let refuse = |problem: String, remedy: &str| Err(Error::input("comparison", problem, remedy));
    let (width, height) = (a.width, a.height);
    if (width, height) != (b.width, b.height) {
        let sizes = format!("{width} x {height} and {} x {}", b.width, b.height);
        return refuse(format!("the pictures' sizes differ, {sizes}"), "give pictures of one size");
    }
    check_comparable_size(width, height)?;
    let remedy = "render with --background none to EXR or PNG, or leave out --mask-background";
    let Ok(compared) = compared_pixels(a, b, mask_background) else {
        return refuse("neither picture has an alpha channel that tells its background".to_owned(), remedy);
    };
    let masked = |values: &[[f32; 3]]| -> Vec<[f32; 3]> {
        values.iter().zip(&compared).map(|(value, compared)| if *compared { *value } else { [0.0; 3] }).collect()
    };
    let (display_a, display_b) = (masked(&a.display), masked(&b.display));

    let pixels = compared.iter().filter(|compared| **compared).count() as u64;
    let (display, linear) = (
        Differences::of_pictures(&display_a, &display_b),
        Differences::of_pictures(&masked(&a.radiance), &masked(&b.radiance)),
    );
    let ssim = ssim_map(&display_a, &display_b, width, height);
    let rows = compared.chunks(width).skip(RADIUS).zip(ssim.chunks(width - 2 * RADIUS));
    let inside = rows.flat_map(|(compared, ssim)| compared[RADIUS..].iter().zip(ssim));
    let Some(ssim) = mean(inside) else {
        return refuse(format!("no surface is seen {RADIUS} pixels or more from the border"), remedy);
    };
    let flip = flip_map(&display_a, &display_b, width, height);
    Ok(Metrics {
        rms: display.rms(pixels),
        rms_linear: linear.rms(pixels),
        max: display.max,
        ssim,
        flip: mean(compared.iter().zip(&flip)).unwrap_or(0.0),
        nan: a.nan + b.nan,
        pixels,
    })
}

/// Neither of two pictures tells where its background is.
pub(super) struct NoAlpha;

/// Which pixels of two pictures of one size are compared.
pub(super) fn compared_pixels(a: &Comparable, b: &Comparable, mask_background: bool) -> Result<Vec<bool>, NoAlpha> {
    match (&a.covered, &b.covered) {
        _ if !mask_background => Ok(vec![true; a.display.len()]),
        (Some(a), Some(b)) => Ok(a.iter().zip(b).map(|(a, b)| *a || *b).collect()),
        (Some(covered), None) | (None, Some(covered)) => Ok(covered.clone()),
        (None, None) => Err(NoAlpha),
    }
}

/// Of all channels.
#[derive(Default)]
pub(super) struct Differences {
    sum_of_squares: f64,
    /// NaN if one is.
    pub(super) max: f64,
}

impl Differences {
    pub(super) fn of(pairs: impl Iterator<Item = [f64; 2]>) -> Self {
        pairs.fold(Self::default(), |sofar, [a, b]| {
            let difference = (a - b).abs();
            Self {
                sum_of_squares: sofar.sum_of_squares + difference * difference,
                max: largest([sofar.max, difference]),
            }
        })
    }

    /// Of two pictures.
    pub(super) fn of_pictures(a: &[[f32; 3]], b: &[[f32; 3]]) -> Self {
        Self::of(a.as_flattened().iter().zip(b.as_flattened()).map(|(a, b)| [*a, *b].map(f64::from)))
    }

    /// Root of the mean square over the channels of so many pixels.
    pub(super) fn rms(&self, pixels: u64) -> f64 {
        (self.sum_of_squares / (3 * pixels) as f64).sqrt()
    }
}

/// The mean of those values that are `true`'s; none if there are none.
fn mean<'a>(values: impl Iterator<Item = (&'a bool, &'a f64)>) -> Option<f64> {
    let (sum, count) =
        values.filter(|(counts, _)| **counts).fold((0.0, 0), |(sum, count), (_, value)| (sum + value, count + 1));
    (count > 0).then(|| sum / f64::from(count))
}

/// FLIP error of each pixel.
fn flip_map(a: &[[f32; 3]], b: &[[f32; 3]], width: usize, height: usize) -> Vec<f64> {
    let image = |values: &[[f32; 3]]| {
        let bytes: Vec<u8> = values.as_flattened().iter().map(|value| (255.0 * value).round() as u8).collect();
        nv_flip::FlipImageRgb8::with_data(width as u32, height as u32, &bytes)
    };
    let errors = nv_flip::flip(image(b), image(a), nv_flip::DEFAULT_PIXELS_PER_DEGREE).to_vec();
    errors.into_iter().map(f64::from).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::read_image;

    /// Values in [0, 1] that a formula of row, column and channel gives: see `agrees_with_scikit_image`.
    fn formula(width: usize, height: usize, shift: usize) -> Vec<[f64; 3]> {
        let value = |x: usize, y: usize, c: usize| ((7 * x + 13 * y + 29 * c + shift * x * y) % 101) as f64 / 100.0;
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| [0, 1, 2].map(|c| value(x, y, c))));
        pixels.collect()
    }

    /// A picture of `display` values, as radiance that is displayed so; covered where `covered` says.
    fn picture(width: usize, display: &[[f64; 3]], covered: impl Fn(usize) -> bool) -> Comparable {
        let pixel = |(i, [r, g, b]): (usize, &[f64; 3])| {
            let radiance = [r, g, b].map(|value| value.powf(2.2) as f32);
            [radiance[0], radiance[1], radiance[2], if covered(i) { 1.0 } else { 0.0 }]
        };
        let pixels: Vec<_> = display.iter().enumerate().map(pixel).collect();
        Comparable::from_radiance(width, display.len() / width, &pixels, true, Display::default())
    }

    /// The numbers are from numpy 2 and scikit-image 0.26:
    ///
    /// ```python
    /// import numpy as np
    /// from skimage.metrics import structural_similarity
    /// def picture(width, height, shift):
    ///     y, x, c = np.meshgrid(np.arange(height), np.arange(width), np.arange(3), indexing="ij")
    ///     return (7 * x + 13 * y + 29 * c + shift * x * y) % 101 / 100
    /// for w, h, shift in ((40, 30, 3), (23, 17, 1)):
    ///     a = picture(w, h, 0)
    ///     b = 0.75 * a + 0.25 * picture(w, h, shift)
    ///     for masked in False, True:
    ///         mask = np.add.outer(np.arange(h), np.arange(w)) % 3 <= (0 if masked else 2)
    ///         inside = mask.copy(); inside[:5] = inside[-5:] = False; inside[:, :5] = inside[:, -5:] = False
    ///         A, B = a * mask[..., None], b * mask[..., None]
    ///         ssim, ssim_map = structural_similarity(A, B, gaussian_weights=True, sigma=1.5,
    ///             use_sample_covariance=False, data_range=1, channel_axis=-1, full=True)
    ///         d = (A - B)[mask]
    ///         rms, rms_linear = np.sqrt((d**2).mean()), np.sqrt(((A**2.2 - B**2.2)[mask]**2).mean())
    ///         if not masked: assert abs(ssim - ssim_map[inside].mean()) < 1e-12
    ///         print(w, h, shift, masked, mask.sum(), rms, rms_linear, np.abs(d).max(), ssim_map[inside].mean())
    /// ```
    #[test]
    fn agrees_with_scikit_image() {
        for (width, height, shift, masked, pixels, rms, rms_linear, max, ssim) in [
            (40, 30, 3, false, 1200, 0.100252676, 0.118371475, 0.25, 0.914490644),
            (40, 30, 3, true, 400, 0.099437166, 0.120234876, 0.2475, 0.975281606),
            (23, 17, 1, false, 391, 0.095825874, 0.119415149, 0.2425, 0.909936609),
            (23, 17, 1, true, 130, 0.097324217, 0.120614311, 0.235, 0.970998356),
        ] {
            let a = formula(width, height, 0);
            let other = formula(width, height, shift);
            let b: Vec<_> = a.iter().zip(&other).map(|(a, o)| [0, 1, 2].map(|c| 0.75 * a[c] + 0.25 * o[c])).collect();
            let covered = |i: usize| (i % width + i / width).is_multiple_of(3);
            let metrics = compare(&picture(width, &a, covered), &picture(width, &b, covered), masked).unwrap();
            assert_eq!((metrics.pixels, metrics.nan), (pixels, 0));
            for (name, found, expected) in [
                ("rms", metrics.rms, rms),
                ("rms_linear", metrics.rms_linear, rms_linear),
                ("max", metrics.max, max),
                ("ssim", metrics.ssim, ssim),
            ] {
                assert!((found - expected).abs() < 1e-6, "{name} of {width} x {height}: {found}, not {expected}");
            }
        }
    }

    #[test]
    fn a_picture_is_equal_to_itself() {
        let a = picture(40, &formula(40, 30, 3), |_| true);
        let metrics = compare(&a, &a, false).unwrap();
        assert_eq!((metrics.rms, metrics.rms_linear, metrics.max, metrics.flip), (0.0, 0.0, 0.0, 0.0));
        assert!((metrics.ssim - 1.0).abs() < 1e-12);
    }

    #[test]
    fn black_against_white_is_as_different_as_can_be() {
        let [black, white] = [0.0, 1.0].map(|value| picture(32, &[[value; 3]; 32 * 32], |_| true));
        let metrics = compare(&black, &white, false).unwrap();
        assert_eq!((metrics.rms, metrics.rms_linear, metrics.max), (1.0, 1.0, 1.0));
        // Without variance: (C1 / (1 + C1)).
        assert!((metrics.ssim - 1e-4 / 1.0001).abs() < 1e-9);
        // FLIP's largest colour difference is that of blue against green; black against white is near to it.
        assert!(metrics.flip > 0.95 && metrics.flip <= 1.0, "{}", metrics.flip);
    }

    #[test]
    fn flip_sees_a_small_difference_as_small_and_a_larger_one_as_larger() {
        let grey = |value: f64| picture(32, &[[value; 3]; 32 * 32], |_| true);
        let flip = |value: f64| compare(&grey(0.5), &grey(value), false).unwrap().flip;
        assert!(0.0 < flip(0.51) && flip(0.51) < flip(0.55) && flip(0.55) < flip(0.7) && flip(0.7) < 0.5);
    }

    #[test]
    fn nan_and_infinity_are_counted_and_compared_as_black() {
        let mut pixels = vec![[0.25, 0.25, 0.25, 1.0]; 144];
        let whole = Comparable::from_radiance(12, 12, &pixels, false, Display::default());
        (pixels[3][0], pixels[7][1], pixels[9][2]) = (f32::NAN, f32::INFINITY, f32::NEG_INFINITY);
        let broken = Comparable::from_radiance(12, 12, &pixels, false, Display::default());
        let metrics = compare(&broken, &whole, false).unwrap();
        assert_eq!(metrics.nan, 3);
        assert!((metrics.rms_linear - 0.25 * (3.0_f64 / 432.0).sqrt()).abs() < 1e-9);
        assert!((metrics.max - 0.25_f64.powf(1.0 / 2.2)).abs() < 1e-6);
        assert_eq!(compare(&broken, &broken, false).unwrap().nan, 6);
    }

    #[test]
    fn what_is_seen_in_the_background_does_not_matter_with_the_mask() {
        let surface = |i: usize| (i % 40).abs_diff(20) < 12 && (i / 40).abs_diff(15) < 10;
        let [a, mut b] = [0, 3].map(|shift| formula(40, 30, shift));
        let whole = picture(40, &b, surface);
        for (i, pixel) in b.iter_mut().enumerate().filter(|(i, _)| !surface(*i)) {
            *pixel = [i as f64 / 1200.0; 3];
        }
        let (a, b) = (picture(40, &a, surface), picture(40, &b, surface));
        assert_eq!(compare(&a, &whole, true).unwrap(), compare(&a, &b, true).unwrap());
        assert_ne!(compare(&a, &whole, false).unwrap().rms, compare(&a, &b, false).unwrap().rms);
        // It is enough that one picture knows.
        let opaque = Comparable { covered: None, ..b.clone() };
        assert_eq!(compare(&a, &opaque, true).unwrap(), compare(&a, &b, true).unwrap());
    }

    #[test]
    fn a_png_is_the_same_picture_as_the_exr_that_it_was_made_from_but_for_rounding() {
        let folder = tempfile::tempdir().unwrap();
        let display = Display { exposure: 2.0, gamma: 1.8 };
        let linear = |value: f64| (value.powf(1.8) / 2.0) as f32;
        let alphas = [1.0, 0.5, 0.0];
        let mut exr = Vec::new();
        let mut png = Vec::new();
        for (i, [r, g, b]) in formula(20, 20, 1).into_iter().enumerate() {
            let alpha = alphas[i % 3];
            exr.push([linear(r) * alpha, linear(g) * alpha, linear(b) * alpha, alpha]);
            png.extend([r, g, b, f64::from(alpha)].map(|value| (255.0 * value).round() as u8));
        }
        crate::picture::write_exr(&folder.path().join("a.exr"), 20, 20, &exr, true, &Default::default()).unwrap();
        crate::picture::write_png(&folder.path().join("a.png"), 20, 20, &png, true).unwrap();
        let [a, b] = ["a.exr", "a.png"]
            .map(|name| Comparable::from_picture(&read_image(&folder.path().join(name)).unwrap(), display));
        let metrics = compare(&a, &b, true).unwrap();
        assert_eq!(metrics.pixels, 267);
        // Half a step of 8 bits, and where alpha is 0.5 half a step of that too.
        assert!(metrics.max < 1.0 / 255.0 && metrics.rms_linear < 1e-3 && metrics.ssim > 0.999, "{metrics:?}");
    }

    #[test]
    fn pictures_that_cannot_be_compared_are_errors_that_say_why() {
        let of = |width: usize, height: usize| picture(width, &vec![[0.5; 3]; width * height], |i| i == 0);
        let reason = |a: &_, b: &_, mask| compare(a, b, mask).unwrap_err().to_string();
        assert!(reason(&of(20, 30), &of(30, 20), false).contains("20 x 30 and 30 x 20"));
        assert!(reason(&of(10, 30), &of(10, 30), false).contains("11 x 11"));
        assert!(compare(&of(11, 11), &of(11, 11), false).is_ok());
        assert!(reason(&of(20, 20), &of(20, 20), true).contains("no surface"));
        let opaque = Comparable { covered: None, ..of(20, 20) };
        assert!(reason(&opaque, &opaque, true).contains("alpha"));
    }
}
