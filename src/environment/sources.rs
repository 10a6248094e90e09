//! Small bright sources: suns and lamps, in which most of an environment's light may be.
//!
//! The tails of a lobe matter most under these, and tails are what few kernels fit worst. So they are cut out of what kernels look up,
//! and shaded by the BRDF itself.
use std::f64::consts::{PI, TAU};
use std::ops::Range;

use glam::{DMat2, DVec2, DVec3, Vec4, dvec2, dvec3};

use super::Environment;
use crate::brdf::luminance;
use crate::shader_constants::light_source;

/// Most sources of an environment, and most bright regions that it has them of.
pub const MAX_SOURCES: usize = light_source::MAX_SOURCE_NODES as usize / 2;
const MAX_REGIONS: usize = 12;

/// Pixels so many times brighter than the mean over the sphere of all that are not are of a source.
const BRIGHTNESS: f64 = 30.0;

/// What a region must have of all the light to be worth its cost.
const LEAST_SHARE: f64 = 0.001;

/// Standard deviation along the longer axis, in radians, down to which sources are divided: a third of a degree, so that no cell of
/// a measured table, of a degree and more, is left out.
const WIDEST_RAD: f64 = 0.006;

/// How far a source `away` from the mirrored view is from where the BRDF cannot be taken at a few points of it, because it is mirrored
/// towards the eye and wider than the lobe; in units of two standard deviations, `source_width`, of the source. All in radians.
/// Twin of `clearance` in glsl/methods/fitted.glsl.
pub fn clearance(away: f32, source_width: f32, lobe_radius: f32) -> f32 {
    (away + 4.0 * 2.6 * lobe_radius) / (2.0 * source_width)
}

/// A source: light around a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSource {
    /// The centroid of its light, unit.
    pub direction: DVec3,
    /// Its light's principal axes across that direction, the longer one first: as long as its standard deviation along each, in radians.
    pub axes: [DVec3; 2],
    /// Its radiance integrated over its solid angle, linear Rec. 709.
    pub power: DVec3,
}

/// The sources of an environment: each a tree, of halves of halves.
#[derive(Clone, Debug)]
pub struct SmallSources {
    /// Depth first: each lamp before its halves. A leaf ends at the next one.
    pub nodes: Vec<SourceNode>,
    /// Whether each pixel is of one of them.
    pub pixels: Vec<bool>,
}

/// A lamp, or a part of one.
#[derive(Clone, Copy, Debug)]
pub struct SourceNode {
    /// All of it as one source.
    pub source: LightSource,
    /// How many nodes it and all its parts are.
    pub size: usize,
}

impl LightSource {
    /// Standard deviation of its light along its longer axis, in radians.
    pub fn width_rad(&self) -> f64 {
        self.axes[0].length()
    }
}

/// `Source` in glsl/light_source.glsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct SourceRecord {
    /// Of its centroid; w: standard deviation along its longer axis, in radians.
    pub direction: Vec4,
    /// Across that, as long as its standard deviation along each; w of the first: how many nodes it and all its parts are.
    pub axes: [Vec4; 2],
    /// Radiance integrated over its solid angle, over a scale.
    pub power: Vec4,
}

impl SmallSources {
    /// Those of `environment`.
    pub fn of(environment: &Environment) -> Self {
        let total = 4.0 * std::f64::consts::PI * luminance(environment.mean_radiance());
        let by_power = |a: &Part, b: &Part| luminance(b.source.power).total_cmp(&luminance(a.source.power));
        let regions = bright_regions(environment, threshold(environment));
        let lights = PixelLights::of(environment);
        let mut found: Vec<_> = regions.into_iter().filter_map(|pixels| Part::new(&lights, pixels)).collect();
        found.retain(|part| luminance(part.source.power) >= LEAST_SHARE * total);
        found.sort_by(by_power);
        found.truncate(MAX_REGIONS);
        let is_wide = |part: &Part| part.source.width_rad() > WIDEST_RAD && part.pixels.len() > 1;
        let lamp_count = found.len();
        let mut halves: Vec<Range<usize>> = vec![0..0; lamp_count];
        let mut leaf_count = lamp_count;
        while leaf_count < MAX_SOURCES {
            let wide = (0..found.len()).filter(|&i| halves[i].is_empty() && is_wide(&found[i]));
            // The one whose shape matters most goes first.
            let Some(widest) = wide.max_by(|&a, &b| found[a].spread().total_cmp(&found[b].spread())) else { break };
            let first = found.len();
            found.extend(found[widest].halves(&lights));
            halves[widest] = first..found.len();
            halves.resize(found.len(), 0..0);
            leaf_count += halves[widest].len() - 1;
        }
        let mut pixels = vec![false; environment.texels.len()];
        found[..lamp_count].iter().flat_map(|lamp| &lamp.pixels).for_each(|&pixel| pixels[pixel] = true);
        let mut nodes = Vec::new();
        (0..lamp_count).for_each(|lamp| add_tree(lamp, &found, &halves, &mut nodes));
        Self { nodes, pixels }
    }

    /// The sources that are not divided.
    pub fn leaves(&self) -> impl Iterator<Item = &LightSource> {
        self.nodes.iter().filter(|node| node.size == 1).map(|node| &node.source)
    }

    /// The nodes as shaders have them, their power over `scale`.
    pub fn records(&self, scale: f32) -> Vec<SourceRecord> {
        let record = |&SourceNode { source: LightSource { direction, axes: [longer, shorter], power }, size }: &_| {
            SourceRecord {
                direction: direction.extend(longer.length()).as_vec4(),
                axes: [longer.extend(size as f64).as_vec4(), shorter.extend(0.0).as_vec4()],
                power: (power / f64::from(scale)).extend(0.0).as_vec4(),
            }
        };
        self.nodes.iter().map(record).collect()
    }

    /// The words of `Sources` in glsl/light_source.glsl: the number of nodes, and their records.
    pub fn device_words(&self, scale: f32) -> Vec<u32> {
        // Structures are aligned to 16 bytes.
        let mut words = vec![self.nodes.len() as u32, 0, 0, 0];
        words.extend(self.records(scale).into_iter().flat_map(bytemuck::cast::<_, [u32; 16]>));
        // A uniform buffer has the size that the shader says: of trees of halves, all nodes are less than twice the leaves.
        words.resize(4 + 16 * 2 * MAX_SOURCES, 0);
        words
    }
}

/// Adds node `index` and all its parts, which `halves` has for each of `found`.
fn add_tree(index: usize, found: &[Part], halves: &[Range<usize>], nodes: &mut Vec<SourceNode>) {
    let place = nodes.len();
    nodes.push(SourceNode { source: found[index].source, size: 1 });
    halves[index].clone().for_each(|half| add_tree(half, found, halves, nodes));
    nodes[place].size = nodes.len() - place;
}

/// [`BRIGHTNESS`] times the mean luminance over the sphere, to which what is brighter adds nothing: one lamp that outshines all others does
/// not hide them.
fn threshold(environment: &Environment) -> f64 {
    let mean_below = |threshold: f64| {
        let rows = environment.texels.chunks_exact(environment.width).enumerate();
        let pixels = rows.flat_map(|(row, texels)| {
            // Once a row: it takes as long as many pixels.
            let solid_angle = environment.weight_solid_angle(row);
            texels.iter().map(move |texel| {
                let radiance = luminance(super::to_dvec3(texel));
                if radiance > threshold { 0.0 } else { solid_angle * radiance }
            })
        });
        pixels.sum::<f64>() / (4.0 * std::f64::consts::PI)
    };
    // Each threshold is below the last one.
    const ROUNDS: usize = 8;
    (0..ROUNDS).fold(f64::INFINITY, |threshold, _| BRIGHTNESS * mean_below(threshold))
}

/// Pixels above `threshold` that touch, at corners too; the first column is next to the last.
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

/// A source with its pixels.
struct Part {
    source: LightSource,
    pixels: Vec<usize>,
}

impl Part {
    /// Of these pixels; none if they are black.
    fn new(lights: &PixelLights, pixels: Vec<usize>) -> Option<Self> {
        let (mut power, mut moment) = (DVec3::ZERO, DVec3::ZERO);
        for (direction, of_pixel) in pixels.iter().map(|&pixel| lights.light(pixel)) {
            power += of_pixel;
            moment += luminance(of_pixel) * direction;
        }
        let total = luminance(power);
        let centre = moment.try_normalize()?;
        let (x, y) = centre.any_orthonormal_pair();
        let mut covariance = DMat2::ZERO;
        for &pixel in &pixels {
            let (direction, of_pixel) = lights.light(pixel);
            for away in [direction].into_iter().chain(lights.tent(pixel)) {
                let away = dvec2(away.dot(x), away.dot(y));
                covariance += (luminance(of_pixel) / total) * DMat2::from_cols(away * away.x, away * away.y);
            }
        }
        let axes = principal_axes(covariance).map(|axis| axis.x * x + axis.y * y);
        Some(Self { source: LightSource { direction: centre, axes, power }, pixels })
    }

    /// [`spread`] of its light along its longer axis.
    fn spread(&self) -> f64 {
        spread(luminance(self.source.power), self.source.width_rad().powi(2))
    }

    /// Both sides of the cut across its longer axis that leaves the least spread.
    fn halves(&self, lights: &PixelLights) -> Vec<Self> {
        let LightSource { direction: centre, axes: [longer, _], .. } = self.source;
        let pixel = |&pixel: &usize| {
            let (direction, power) = lights.light(pixel);
            ((direction - centre).dot(longer), luminance(power), pixel)
        };
        let mut along: Vec<_> = self.pixels.iter().map(pixel).collect();
        along.sort_by(|(a, ..), (b, ..)| a.total_cmp(b));
        // Power and its moments along the axis, up to each pixel.
        let moments = along.iter().scan(DVec3::ZERO, |sum, &(place, power, _)| {
            *sum += power * dvec3(1.0, place, place * place);
            Some(*sum)
        });
        let moments: Vec<_> = moments.collect();
        let all = moments[moments.len() - 1];
        let spread_of = |moments: DVec3| {
            let [power, first, second] = moments.to_array();
            // Beside the brightest pixels the rest may be lost in rounding.
            if power > 0.0 { spread(power, (second / power - (first / power).powi(2)).max(0.0)) } else { 0.0 }
        };
        let spreads = moments[..moments.len() - 1].iter().map(|&one| spread_of(one) + spread_of(all - one));
        let cut = spreads.enumerate().min_by(|(_, a), (_, b)| a.total_cmp(b)).map_or(0, |(last, _)| last + 1);
        let (one, other) = along.split_at(cut);
        let part = |side: &[(f64, f64, usize)]| Self::new(lights, side.iter().map(|&(.., pixel)| pixel).collect());
        [one, other].into_iter().filter_map(part).collect()
    }
}

/// Where the light of single pixels is: each a tent as wide as two of them along its row and along its column, as lookups blend them.
struct PixelLights<'a> {
    environment: &'a Environment,
    /// Of each row the centroid of its pixels' light and its standard deviation along the column, in rows. Towards the poles a tent has more
    /// solid angle on its far side, and beyond the middles of the first and the last row it goes on as high as there.
    rows: Vec<[f64; 2]>,
}

impl<'a> PixelLights<'a> {
    fn of(environment: &'a Environment) -> Self {
        // Places and weights of Gauss and Legendre on each side of a tent, where it is smooth.
        let gauss = [(-0.6_f64.sqrt(), 5.0), (0.0, 8.0), (0.6_f64.sqrt(), 5.0)];
        let last = environment.height as f64 - 1.0;
        let of_row = |row: usize| {
            let row = row as f64;
            let sides = [(row - 1.0).max(-0.5) - row, (row + 1.0).min(last + 0.5) - row];
            let moments = sides.into_iter().flat_map(|end| gauss.map(|(place, weight)| (end, place, weight)));
            let moments = moments.map(|(end, place, weight)| {
                let away = 0.5 * end * (1.0 + place);
                let tent = 1.0 - ((row + away).clamp(0.0, last) - row).abs();
                let sin_theta = (PI * (row + away + 0.5) / (last + 1.0)).sin();
                weight * end.abs() * tent * sin_theta * dvec3(1.0, away, away * away)
            });
            let [all, first, second] = moments.sum::<DVec3>().to_array();
            [row + first / all, (second / all - (first / all).powi(2)).sqrt()]
        };
        Self { environment, rows: (0..environment.height).map(of_row).collect() }
    }

    /// Direction and power of a pixel.
    fn light(&self, pixel: usize) -> (DVec3, DVec3) {
        let (column, row) = (pixel % self.environment.width, pixel / self.environment.width);
        let power = self.environment.weight_solid_angle(row) * super::to_dvec3(&self.environment.texels[pixel]);
        (self.environment.direction(column as f64, self.rows[row][0]), power)
    }

    /// Along its row and along its column, as long as the standard deviation of its light, in radians.
    fn tent(&self, pixel: usize) -> [DVec3; 2] {
        let (direction, _) = self.light(pixel);
        let [of_column, of_row] = [TAU / self.environment.width as f64, PI / self.environment.height as f64];
        // Along the parallel, as long as the sine of the angle to the pole. Of a tent of this half width the variance is a sixth of its square.
        let along_row = dvec3(-direction.z, 0.0, direction.x);
        let along_column = along_row.cross(direction).normalize();
        let [_, deviation_rows] = self.rows[pixel / self.environment.width];
        [along_row * of_column / 6_f64.sqrt(), along_column * of_row * deviation_rows]
    }
}

/// How much is lost where light of this power and variance counts as one source. Not in proportion to its power: beside a narrow lobe dim edges
/// of a lamp are as bright on a display as its core, which is cut off at white.
fn spread(power: f64, variance: f64) -> f64 {
    power.sqrt() * variance
}

/// The eigenvectors of a covariance, as long as the standard deviation along them, the longer one first.
fn principal_axes(covariance: DMat2) -> [DVec2; 2] {
    let (sum, difference) = (covariance.x_axis.x + covariance.y_axis.y, covariance.x_axis.x - covariance.y_axis.y);
    let angle = 0.5 * (2.0 * covariance.x_axis.y).atan2(difference);
    let half_spread = 0.5 * difference.hypot(2.0 * covariance.x_axis.y);
    let along = DVec2::from_angle(angle);
    [(along, 0.5 * sum + half_spread), (along.perp(), 0.5 * sum - half_spread)]
        .map(|(axis, variance)| variance.max(0.0).sqrt() * axis)
}

#[cfg(test)]
mod tests {
    use super::super::tests::environment;
    use super::*;

    /// The centroid of the light of a pixel of a map that is 1 elsewhere, and its standard deviation, in rows, as lookups have it.
    fn along_column(map: &Environment, column: usize, row: usize) -> [f64; 2] {
        const STEPS: usize = 20_000;
        let places = (0..STEPS).map(|i| row as f64 - 1.0 + 2.0 * (i as f64 + 0.5) / STEPS as f64);
        let light = places.filter(|at| (-0.5..map.height as f64 - 0.5).contains(at)).map(|at| {
            let direction = map.direction(column as f64, at);
            (map.radiance(direction).x - 1.0) * direction.x.hypot(direction.z) * dvec3(1.0, at, at * at)
        });
        let [all, first, second] = light.sum::<DVec3>().to_array();
        [first / all, (second / all - (first / all).powi(2)).sqrt()]
    }

    #[test]
    fn a_sun_is_found_where_it_is_with_all_its_power() {
        for (column, row) in [(0, 20), (127, 33), (64, 0), (30, 63)] {
            let map = environment(128, 64, |x, y| [if (x, y) == (column, row) { 1e6 } else { 1.0 }; 3]);
            let found = SmallSources::of(&map);
            let found: Vec<_> = found.leaves().collect();
            assert_eq!(found.len(), 1, "{column} {row}");
            let [centroid, _] = along_column(&map, column, row);
            let centroid = map.direction(column as f64, centroid);
            assert!(found[0].direction.dot(centroid) > 1.0 - 1e-9, "{column} {row}: {} {centroid}", found[0].direction);
            let power = 1e6 * map.weight_solid_angle(row);
            assert!((found[0].power.x / power - 1.0).abs() < 1e-9);
            assert!(found[0].width_rad() < 0.03);
        }
    }

    #[test]
    fn a_lamp_of_one_pixel_is_as_long_and_as_wide_as_its_pixel() {
        for (width, height, row) in [(1024, 512, 5), (1024, 512, 256), (256, 512, 300)] {
            let map = environment(width, height, |x, y| [if (x, y) == (7, y) && y == row { 1e6 } else { 1.0 }; 3]);
            let sources = SmallSources::of(&map);
            let source = &sources.nodes[0].source;
            let [centroid, deviation] = along_column(&map, 7, row);
            let theta = PI * (centroid + 0.5) / height as f64;
            let along_column = PI / height as f64 * deviation * 6_f64.sqrt();
            let along_row = TAU * theta.sin() / width as f64;
            let expected = [along_column.max(along_row), along_column.min(along_row)];
            for (axis, side) in source.axes.iter().zip(expected) {
                assert!((axis.length() * 6_f64.sqrt() / side - 1.0).abs() < 1e-6, "{width} x {height}: {axis}, {side}");
            }
            let longer_is_vertical = source.axes[0].y.abs() > 0.5 * source.axes[0].length() * theta.sin();
            assert_eq!(longer_is_vertical, along_column > along_row, "{width} x {height}, row {row}");
        }
    }

    #[test]
    fn a_lamp_across_the_first_column_is_one() {
        let map = environment(128, 64, |x, y| [if [0, 127].contains(&x) && y == 30 { 1e5 } else { 1.0 }; 3]);
        let nodes = SmallSources::of(&map).nodes;
        let LightSource { direction, power, .. } = nodes[0].source;
        assert_eq!(nodes[0].size, nodes.len());
        assert!(direction.distance(map.direction(-0.5, 30.0)) < 1e-3, "{direction}");
        assert!((power.x / (2e5 * map.weight_solid_angle(30)) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn the_brightest_lamps_are_sources_as_far_as_there_is_room_and_sparks_are_none() {
        let lamp = |x: usize, y: usize| x.is_multiple_of(8) && y.is_multiple_of(8);
        let number = |x: usize, y: usize| x / 8 + y / 8 * 16;
        // At the same height they are the brighter the farther to the right.
        let map = environment(128, 64, |x, y| [if lamp(x, y) { 1e4 + number(x, y) as f32 } else { 1.0 }; 3]);
        let sources = SmallSources::of(&map);
        assert_eq!((sources.leaves().count(), sources.nodes.len()), (MAX_REGIONS, MAX_REGIONS));
        let taken = |x: usize| sources.pixels[32 * 128 + x];
        assert!(
            (0..128).all(|x| taken(x) == (lamp(x, 32) && x >= 8 * (16 - MAX_REGIONS))),
            "the equator's are largest"
        );
        assert_eq!(sources.device_words(1.0).len(), 4 + 16 * 2 * MAX_SOURCES);
        // Thirty times brighter than all around, but a thousandth of a sun.
        let spark = |x: usize, y: usize| if lamp(x, y) { 100.0 } else { 1.0 };
        let sparks = environment(128, 64, |x, y| [if (x, y) == (12, 36) { 1e6 } else { spark(x, y) }; 3]);
        assert_eq!(SmallSources::of(&sparks).nodes.len(), 1);
    }

    #[test]
    fn a_lamp_is_divided_where_the_halves_have_the_least_spread() {
        // Along the horizon, brightest at its left end: the middle of its light is not the best cut.
        let radiance = |x: usize| if x < 63 { 3e4 } else { 3e3 / (x - 60) as f32 };
        let map = environment(256, 128, |x, y| [if y == 64 && (60..76).contains(&x) { radiance(x) } else { 0.1 }; 3]);
        let SmallSources { nodes, .. } = SmallSources::of(&map);
        let power = |columns: Range<usize>| columns.map(|x| f64::from(radiance(x))).sum::<f64>();
        let spread_of = |columns: Range<usize>| {
            let mean = |of: &dyn Fn(f64) -> f64| {
                columns.clone().map(|x| f64::from(radiance(x)) * of(x as f64)).sum::<f64>() / power(columns.clone())
            };
            let middle = mean(&|x| x);
            spread(power(columns.clone()), mean(&|x| (x - middle).powi(2)))
        };
        let spread_at = |cut: usize| spread_of(60..cut) + spread_of(cut..76);
        let best = (61..76).min_by(|&a, &b| spread_at(a).total_cmp(&spread_at(b))).unwrap();
        let halves = [1, 1 + nodes[1].size].map(|node| nodes[node].source.power.x / map.weight_solid_angle(64));
        for expected in [power(60..best), power(best..76)] {
            assert!(halves.iter().any(|half| (half / expected - 1.0).abs() < 1e-6), "{halves:?}, not {expected}");
        }
        assert!(spread_at(best) < 0.9 * spread_at(62), "the middle of the light would do as well");
    }

    #[test]
    fn soft_light_has_no_sources_and_a_bright_strip_has_several() {
        assert!(SmallSources::of(&environment(64, 32, |x, y| [(x % 5 + y % 7) as f32; 3])).nodes.is_empty());
        assert!(SmallSources::of(&environment(8, 4, |_, _| [0.0; 3])).nodes.is_empty());
        // More pixels than there may be sources: some are of two, side by side along the horizon.
        let strip = environment(256, 128, |x, y| [if y == 64 && (100..160).contains(&x) { 5e3 } else { 0.1 }; 3]);
        let sources = SmallSources::of(&strip);
        let found: Vec<_> = sources.leaves().collect();
        assert_eq!((sources.nodes.len(), found.len()), (2 * MAX_SOURCES - 1, MAX_SOURCES));
        for (i, node) in sources.nodes.iter().enumerate().filter(|(_, node)| node.size > 1) {
            let [one, other] = [i + 1, i + 1 + sources.nodes[i + 1].size].map(|half| sources.nodes[half]);
            assert_eq!(node.size, 1 + one.size + other.size);
            assert!((one.source.power + other.source.power).distance(node.source.power) < 1e-9);
        }
        // A pixel's side is 2 pi / 256; the standard deviation of its tent, sqrt(1/6) of that.
        let pixel = std::f64::consts::TAU / 256.0 / 6f64.sqrt();
        for source in &found {
            let [longer, shorter] = source.axes;
            assert!((shorter.length() / pixel - 1.0).abs() < 0.01, "{source:?}");
            assert!(longer.length() < 1.01 * pixel || longer.normalize().y.abs() < 1e-3, "{source:?}");
        }
        assert!(found.iter().any(|source| source.width_rad() > 1.1 * pixel));
        let power: f64 = found.iter().map(|source| source.power.x).sum();
        assert!((power / (60.0 * 5e3 * strip.weight_solid_angle(64)) - 1.0).abs() < 1e-9);
    }
}
