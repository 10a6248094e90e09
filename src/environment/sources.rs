//! Small bright sources: suns and lamps, in which most of an environment's light may be.
//!
//! The tails of a lobe matter most under these, and tails are what few kernels fit worst. So for them shading adds what the fit
//! lacks: power times (BRDF less fit). They stay in the pyramid, but are left out of the irradiance map.
use glam::{DMat3, DVec3};

use super::Environment;
use crate::brdf::luminance;

/// Most sources of an environment.
pub const MAX_SOURCES: usize = 8;

/// Pixels so many times brighter than the mean are of a source.
const BRIGHTNESS: f64 = 30.0;

/// What a source must have of all the light to be worth its cost.
const LEAST_SHARE: f64 = 0.003;

/// Standard deviation along an axis, in radians, above which a source is divided in two.
const WIDEST_RAD: f64 = 0.05;

/// A source: light around a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Source {
    /// The centroid of its light, unit.
    pub direction: DVec3,
    /// Standard deviation of its light along an axis, in radians.
    pub width_rad: f64,
    /// Its radiance integrated over its solid angle, linear Rec. 709.
    pub power: DVec3,
}

/// The sources of an environment.
#[derive(Clone, Debug)]
pub struct SmallSources {
    /// The most powerful first, at most [`MAX_SOURCES`].
    pub list: Vec<Source>,
    /// Whether each pixel is of one of them.
    pub pixels: Vec<bool>,
}

impl SmallSources {
    /// Those of `environment`.
    pub fn of(environment: &Environment) -> Self {
        let mean = luminance(environment.mean_radiance());
        let total = 4.0 * std::f64::consts::PI * mean;
        let mut found = Vec::new();
        for pixels in bright_regions(environment, BRIGHTNESS * mean) {
            divide(environment, pixels, &mut found);
        }
        found.retain(|(source, _)| luminance(source.power) >= LEAST_SHARE * total);
        found.sort_by(|(a, _), (b, _)| luminance(b.power).total_cmp(&luminance(a.power)));
        found.truncate(MAX_SOURCES);
        let mut pixels = vec![false; environment.texels.len()];
        found.iter().flat_map(|(_, own)| own).for_each(|&pixel| pixels[pixel] = true);
        Self { list: found.into_iter().map(|(source, _)| source).collect(), pixels }
    }
}

/// Connected pixels above `threshold`, with the first column next to the last.
fn bright_regions(environment: &Environment, threshold: f64) -> Vec<Vec<usize>> {
    let (width, height) = (environment.width, environment.height);
    let is_bright = |pixel: usize| luminance(super::to_dvec3(&environment.texels[pixel])) > threshold;
    let mut seen = vec![false; width * height];
    let mut regions = Vec::new();
    for first in 0..width * height {
        if seen[first] || !is_bright(first) {
            continue;
        }
        seen[first] = true;
        let (mut region, mut next) = (vec![first], 0);
        while next < region.len() {
            let (column, row) = (region[next] % width, region[next] / width);
            next += 1;
            for (right, down) in [(1, 1), (1, 0), (1, 2), (0, 0), (0, 1), (0, 2), (2, 1), (2, 0), (2, 2)] {
                let Some(row) = (row + down).checked_sub(1).filter(|row| *row < height) else { continue };
                let pixel = row * width + (column + width + right - 1) % width;
                if !seen[pixel] && is_bright(pixel) {
                    seen[pixel] = true;
                    region.push(pixel);
                }
            }
        }
        regions.push(region);
    }
    regions
}

/// Adds the source of these pixels with them, or those of parts that are small enough.
fn divide(environment: &Environment, pixels: Vec<usize>, found: &mut Vec<(Source, Vec<usize>)>) {
    let light = |pixel: usize| {
        let (column, row) = (pixel % environment.width, pixel / environment.width);
        let power = environment.weight_solid_angle(row) * super::to_dvec3(&environment.texels[pixel]);
        (environment.direction(column as f64, row as f64), power)
    };
    let (mut power, mut moment) = (DVec3::ZERO, DVec3::ZERO);
    for (direction, of_pixel) in pixels.iter().map(|&pixel| light(pixel)) {
        power += of_pixel;
        moment += luminance(of_pixel) * direction;
    }
    let total = luminance(power);
    let Some(centre) = moment.try_normalize() else { return };
    // The light of a pixel is a tent as wide as two: variance 1/6 of its area.
    let pixel_variance = environment.solid_angle(pixels[0] / environment.width) / 6.0;
    let mut covariance = DMat3::ZERO;
    for (direction, of_pixel) in pixels.iter().map(|&pixel| light(pixel)) {
        let away = direction - centre;
        covariance += (luminance(of_pixel) / total) * DMat3::from_cols(away * away.x, away * away.y, away * away.z);
    }
    let trace = covariance.x_axis.x + covariance.y_axis.y + covariance.z_axis.z;
    let width_rad = (0.5 * trace + pixel_variance).sqrt();
    if width_rad <= WIDEST_RAD || pixels.len() < 2 {
        found.push((Source { direction: centre, width_rad, power }, pixels));
        return;
    }
    // Across the longest axis, which powers of the matrix converge to.
    let mut axis = DVec3::new(0.6, 0.5, 0.4);
    for _ in 0..30 {
        axis = (covariance * axis).normalize_or(DVec3::X);
    }
    let (one, other): (Vec<_>, Vec<_>) =
        pixels.into_iter().partition(|&pixel| (light(pixel).0 - centre).dot(axis) > 0.0);
    for part in [one, other].into_iter().filter(|part| !part.is_empty()) {
        divide(environment, part, found);
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::environment;
    use super::*;

    #[test]
    fn a_sun_is_found_where_it_is_with_all_its_power() {
        for (column, row) in [(0, 20), (127, 33), (64, 0), (30, 63)] {
            let map = environment(128, 64, |x, y| [if (x, y) == (column, row) { 1e6 } else { 1.0 }; 3]);
            let found = SmallSources::of(&map).list;
            assert_eq!(found.len(), 1, "{column} {row}");
            assert!(found[0].direction.dot(map.direction(column as f64, row as f64)) > 1.0 - 1e-9);
            let power = 1e6 * map.weight_solid_angle(row);
            assert!((found[0].power.x / power - 1.0).abs() < 1e-9);
            assert!(found[0].width_rad < 0.03);
        }
    }

    #[test]
    fn soft_light_has_no_sources_and_a_bright_strip_has_several() {
        assert!(SmallSources::of(&environment(64, 32, |x, y| [(x % 5 + y % 7) as f32; 3])).list.is_empty());
        assert!(SmallSources::of(&environment(8, 4, |_, _| [0.0; 3])).list.is_empty());
        let strip = environment(256, 128, |x, y| [if y == 64 && (100..120).contains(&x) { 5e3 } else { 0.1 }; 3]);
        let found = SmallSources::of(&strip).list;
        assert!((2..=MAX_SOURCES).contains(&found.len()), "{found:?}");
        assert!(found.iter().all(|source| source.width_rad <= WIDEST_RAD));
    }
}
