//! Irradiance maps: the environment convolved with what a diffuse base makes of the cosine. They take that part of a BRDF in one lookup.
//!
//! They are for environments without small bright sources: between the texels of a map their terminator would be a step, so
//! shading adds theirs exactly.
use std::ops::Range;

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use super::cube::{direction_of, face_of};
use super::{Environment, Pyramid};
use crate::brdf::BaseProfile;
use crate::error::{Error, Result};
use crate::progress::Observer;

/// Texels along the edge of a face: bilinear between them is good to h^2 / 4, 2.4e-4 of the largest value, without small sources.
const FACE_SIZE: usize = 64;

/// The light is gathered in cells of a cube map with faces of this size: 2 degrees, each with the centroid of its light.
const CELLS_SIZE: usize = 48;

/// Cells along the edge of a tile: so many are passed over as one where they are all below the horizon. Smaller ones leave fewer cells that
/// are summed for nothing, larger ones fewer to look at.
const TILE_SIZE: usize = 12;

/// Pixels are divided until there are so many columns: cells then have ten samples and more.
const FEWEST_COLUMNS: usize = 1024;

/// The light of a cell.
#[derive(Clone, Copy, Default)]
struct Cell {
    solid_angle: f32,
    power: Vec3,
    /// Mean directions, weighted by solid angle, and by the sum of the channels of power.
    middle: Vec3,
    centroid: Vec3,
}

/// Four cells side by side.
#[derive(Clone, Copy, Default)]
struct Block {
    centroid: [Vec4; 3],
    power: [Vec4; 3],
    middle: [Vec4; 3],
    solid_angle: Vec4,
}

impl Block {
    fn of(cells: &[Cell]) -> Self {
        let mut block = Self::default();
        for (lane, cell) in cells.iter().enumerate() {
            block.solid_angle[lane] = cell.solid_angle;
            for axis in 0..3 {
                block.centroid[axis][lane] = cell.centroid[axis];
                block.power[axis][lane] = cell.power[axis];
                block.middle[axis][lane] = cell.middle[axis];
            }
        }
        block
    }
}

/// The cells of a tile, and a cone that holds them.
struct Tile {
    axis: Vec3,
    sin: f32,
    blocks: Vec<Block>,
}

impl Tile {
    fn of(cells: &[Cell]) -> Self {
        let directions = || cells.iter().flat_map(|cell| [cell.middle, cell.centroid]);
        let axis = directions().sum::<Vec3>().normalize();
        let cos = directions().map(|direction| direction.dot(axis)).fold(1.0, f32::min);
        // Wider by a hundredth of a degree: more than single precision is off by.
        Self { axis, sin: (1.0 - cos * cos).sqrt() + 2e-4, blocks: cells.chunks(4).map(Block::of).collect() }
    }

    fn is_below(&self, normal: Vec3) -> bool {
        self.axis.dot(normal) < -self.sin
    }
}

const TERMS: usize = BaseProfile::TERMS;

/// Red, green and blue light times each power of its cosine to a normal, from the first on, and the same of light of radiance 1.
type Moments = [[f32; TERMS]; 4];

/// The moments of an environment's light for every normal: what its irradiance by any base is a sum of.
#[derive(Debug, PartialEq)]
pub struct LightMoments {
    texels: Vec<Moments>,
    terms: usize,
}

impl LightMoments {
    /// Those of `environment`, for bases of so many terms at most. The only error is that `observer` cancels it.
    pub fn of(environment: &Environment, terms: usize, observer: &dyn Observer) -> Result<Self> {
        let cells = gather(environment, observer)?;
        // Lambert's alone takes less than half of the time.
        match terms {
            ..=1 => Self::of_cells::<1>(&cells, observer),
            _ => Self::of_cells::<TERMS>(&cells, observer),
        }
    }

    fn of_cells<const N: usize>(cells: &[Cell], observer: &dyn Observer) -> Result<Self> {
        let tiles: Vec<_> = tiles(cells).iter().map(|cells| Tile::of(cells)).collect();
        let mut texels = vec![Moments::default(); 6 * FACE_SIZE * FACE_SIZE];
        texels.par_chunks_mut(FACE_SIZE).enumerate().try_for_each(|(row, texels)| {
            observer.check()?;
            for (column, texel) in texels.iter_mut().enumerate() {
                let middle = |index: usize| (index as f64 + 0.5) / FACE_SIZE as f64;
                let normal = direction_of(row / FACE_SIZE, middle(column), middle(row % FACE_SIZE)).as_vec3();
                for (texel, terms) in texel.iter_mut().zip(moments::<N>(&tiles, normal)) {
                    texel[..N].copy_from_slice(&terms);
                }
            }
            Ok::<_, Error>(())
        })?;
        Ok(Self { texels, terms: N })
    }

    /// How many powers of the cosine there are.
    pub fn terms(&self) -> usize {
        self.terms
    }

    /// For each normal red, green, blue and constant light times these powers.
    pub fn values(&self) -> impl Iterator<Item = f32> {
        self.texels.iter().flatten().flat_map(|powers| &powers[..self.terms]).copied()
    }

    /// The moments that have these values; none where they are too many or too few, or of no such number of powers.
    pub fn of_values(terms: usize, values: impl ExactSizeIterator<Item = f32>) -> Option<Self> {
        const TEXELS: usize = 6 * FACE_SIZE * FACE_SIZE;
        if ![1, TERMS].contains(&terms) || values.len() != TEXELS * 4 * terms {
            return None;
        }
        let mut texels = vec![Moments::default(); TEXELS];
        let places = texels.iter_mut().flatten().flat_map(|powers| &mut powers[..terms]);
        places.zip(values).for_each(|(place, value)| *place = value);
        Some(Self { texels, terms })
    }

    /// Irradiance over pi by a base of this profile, which has no more terms: a cube map of one level.
    pub fn irradiance(&self, profile: &BaseProfile) -> Pyramid {
        debug_assert!(profile.terms() <= self.terms);
        let BaseProfile(profile) = profile;
        let texel = |moments: &Moments| {
            let sum = |moments: &[f32; TERMS]| moments.iter().zip(profile).map(|(moment, term)| moment * term).sum();
            let [red, green, blue, constant]: [f32; 4] = moments.each_ref().map(sum);
            // Over what a constant gives, which is pi but for the size of the cells: constants stay as they are.
            [red, green, blue].map(|light| light / constant)
        };
        Pyramid { face_size: FACE_SIZE, levels: vec![self.texels.iter().map(texel).collect()] }
    }
}

/// What of the light in `tiles` reaches a surface of this normal, by the first powers of its cosine.
fn moments<const N: usize>(tiles: &[Tile], normal: Vec3) -> [[f32; N]; 4] {
    let cosines = |[x, y, z]: [Vec4; 3]| (normal.x * x + normal.y * y + normal.z * z).max(Vec4::ZERO);
    let mut sums = [[Vec4::ZERO; N]; 4];
    let [red, green, blue, constant] = &mut sums;
    for tile in tiles.iter().filter(|tile| !tile.is_below(normal)) {
        for block in &tile.blocks {
            let cosines = cosines(block.centroid);
            let mut powers = cosines;
            for term in 0..N {
                red[term] += powers * block.power[0];
                green[term] += powers * block.power[1];
                blue[term] += powers * block.power[2];
                powers *= cosines;
            }
        }
        for block in &tile.blocks {
            let cosines = cosines(block.middle);
            let mut powers = cosines * block.solid_angle;
            for term in constant.iter_mut() {
                *term += powers;
                powers *= cosines;
            }
        }
    }
    sums.map(|terms| terms.map(Vec4::element_sum))
}

/// The cells of each tile.
fn tiles(cells: &[Cell]) -> Vec<Vec<Cell>> {
    const TILES: usize = CELLS_SIZE / TILE_SIZE;
    let tile = |tile: usize| {
        let (face, row, column) = (tile / TILES / TILES, tile / TILES % TILES * TILE_SIZE, tile % TILES * TILE_SIZE);
        let rows = (row..row + TILE_SIZE).map(|row| (face * CELLS_SIZE + row) * CELLS_SIZE + column);
        rows.flat_map(|start| &cells[start..start + TILE_SIZE]).copied().collect()
    };
    (0..6 * TILES * TILES).map(tile).collect()
}

/// The light of `environment` in cells.
fn gather(environment: &Environment, observer: &dyn Observer) -> Result<Vec<Cell>> {
    // In so many parts, summed in their order: the same on any number of cores.
    const PARTS: usize = 16;
    // At least 2: radiance is bilinear between the centres of pixels, so these alone would not tell how wide it is.
    let times = |pixels: usize, fewest: usize| fewest.div_ceil(pixels).max(2);
    let times = [times(environment.width, FEWEST_COLUMNS), times(environment.height, FEWEST_COLUMNS / 2)];
    let rows = times[1] * environment.height;
    let part = |part: usize| gather_rows(environment, times, part * rows / PARTS..(part + 1) * rows / PARTS, observer);
    let parts: Vec<_> = (0..PARTS).into_par_iter().map(part).collect::<Result<_>>()?;
    let cell = |index: usize| {
        let mut sum = Cell::default();
        for cell in parts.iter().map(|cells: &Vec<Cell>| cells[index]) {
            sum.solid_angle += cell.solid_angle;
            sum.power += cell.power;
            sum.middle += cell.middle;
            sum.centroid += cell.centroid;
        }
        let middle = sum.middle.normalize_or_zero();
        // In double precision, since the square of its length may be no number in single. Where there is no light, any place will do.
        let centroid = sum.centroid.as_dvec3().try_normalize().map_or(middle, |centroid| centroid.as_vec3());
        Cell { middle, centroid, ..sum }
    };
    Ok((0..6 * CELLS_SIZE * CELLS_SIZE).map(cell).collect())
}

/// That of these rows of pixels, each divided into `times` along its two axes; means are yet to be divided by their weights.
fn gather_rows(
    environment: &Environment,
    times: [usize; 2],
    rows: Range<usize>,
    observer: &dyn Observer,
) -> Result<Vec<Cell>> {
    let mut cells = vec![Cell::default(); 6 * CELLS_SIZE * CELLS_SIZE];
    let edge = |row: usize| (std::f64::consts::PI * row as f64 / (times[1] * environment.height) as f64).cos();
    let place = |index: usize, times: usize| (index as f64 + 0.5) / times as f64 - 0.5;
    let columns: Vec<_> = (0..times[0] * environment.width).map(|column| place(column, times[0])).collect();
    let directions = environment.directions(columns.iter().copied());
    for row in rows {
        observer.check()?;
        let solid_angle = std::f64::consts::TAU / (times[0] * environment.width) as f64 * (edge(row) - edge(row + 1));
        let row = place(row, times[1]);
        for (&column, direction) in columns.iter().zip(directions.of_row(row)) {
            let light = (solid_angle * environment.radiance_at(column, row)).as_vec3();
            let (face, s, t) = face_of(direction);
            let index = |x: f64| ((x * CELLS_SIZE as f64) as usize).min(CELLS_SIZE - 1);
            let cell = &mut cells[(face * CELLS_SIZE + index(t)) * CELLS_SIZE + index(s)];
            let direction = direction.as_vec3();
            cell.solid_angle += solid_angle as f32;
            cell.middle += solid_angle as f32 * direction;
            cell.power += light;
            cell.centroid += light.element_sum() * direction;
        }
    }
    Ok(cells)
}

#[cfg(test)]
mod tests {
    use super::super::tests::environment;
    use super::super::to_dvec3;
    use super::*;
    use crate::farthest::Farthest;
    use glam::DVec3;

    /// About that of a plastic.
    const COATED: BaseProfile = BaseProfile([0.0, 3.0, -3.0, 1.5, -0.4, 0.1]);

    /// Of T over cosine-weighted directions.
    fn mean(BaseProfile(terms): &BaseProfile) -> f64 {
        terms.iter().enumerate().map(|(power, term)| 2.0 * f64::from(*term) / (power as f64 + 2.0)).sum()
    }

    #[test]
    fn a_constant_stays_as_it_is_however_few_pixels_it_has_and_however_bright_it_is() {
        // In single precision the squares of such light are rounded to one of few numbers, or infinite.
        let [dim, bright] = [1.4e-20, 1e25];
        let sizes = [(1, 1), (3, 2), (64, 32), (1, 300), (300, 1)].map(|size| (size, 1.0));
        for ((width, height), light) in sizes.into_iter().chain([((16, 8), dim), ((16, 8), bright)]) {
            let expected = light * Vec3::new(1.0, 0.1, 7.0);
            let map = environment(width, height, |_, _| expected.to_array());
            let moments = LightMoments::of(&map, TERMS, &()).unwrap();
            let irradiance = [BaseProfile::EVEN, COATED].map(|base| moments.irradiance(&base));
            for texel in irradiance.iter().flat_map(|map| &map.levels[0]) {
                assert!((Vec3::from(*texel) / expected - 1.0).farthest() < 1e-5, "{texel:?}");
            }
        }
    }

    #[test]
    fn lamberts_base_has_the_same_irradiance_whether_or_not_light_is_gathered_for_others() {
        let map = environment(128, 64, |x, y| [((x * 7 + y * 3) % 13) as f32, if y < 9 { 50.0 } else { 0.0 }, 1.0]);
        let [alone, among] = [1, TERMS].map(|terms| LightMoments::of(&map, terms, &()).unwrap());
        assert_eq!(alone.irradiance(&BaseProfile::EVEN).levels, among.irradiance(&BaseProfile::EVEN).levels);
        assert_eq!([BaseProfile::EVEN, COATED].map(|base| base.terms()), [1, TERMS]);
    }

    #[test]
    fn lookups_and_sources_together_are_the_integral_of_the_cosine() {
        let map = environment(128, 64, |x, y| {
            let spot = if (x, y) == (70, 20) { 4e3 } else { 0.5 };
            [1.0 + ((x * 7 + y * 3) % 13) as f32, spot, (y / 20) as f32]
        });
        let sources = map.small_sources();
        let sources: Vec<_> = sources.leaves().collect();
        assert_eq!(sources.len(), 1);
        let moments = LightMoments::of(&map.part(false), TERMS, &()).unwrap();
        let irradiance = [BaseProfile::EVEN, COATED].map(|base| (base, moments.irradiance(&base)));
        for (i, (base, irradiance)) in (0..200).flat_map(|i| irradiance.iter().map(move |of_base| (i, of_base))) {
            let z: f64 = 1.0 - (f64::from(i) + 0.5) / 100.0;
            let angle = f64::from(i) * 2.4;
            let n = DVec3::new(angle.cos() * (1.0 - z * z).sqrt(), z, angle.sin() * (1.0 - z * z).sqrt());
            let mut truth = DVec3::ZERO;
            for row in 0..map.height {
                for column in 0..map.width {
                    let cos = n.dot(map.direction(column as f64, row as f64)).max(0.0);
                    let answer = cos * f64::from(base.at(cos as f32));
                    let solid_angle = map.weight_solid_angle(row);
                    truth += answer * solid_angle * to_dvec3(&map.texels[row * map.width + column]);
                }
            }
            let cos = n.dot(sources[0].direction).max(0.0);
            let of_source = sources[0].power * cos * f64::from(base.at(cos as f32)) / mean(base);
            let found = irradiance.lookup(n.as_vec3(), 0.0).as_dvec3() * std::f64::consts::PI + of_source;
            // A texel at the edge of the hemisphere is half in it.
            truth /= mean(base);
            let error = ((found - truth) / truth.max(DVec3::splat(1.0))).farthest();
            assert!(error < 2e-3, "{n}: {found}, not {truth}");
        }
    }
}
