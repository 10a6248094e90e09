//! The environment filtered by GGX lobes, as engines prefilter it for the split sum (Karis 2013): seen along the normal, n = v = r.
use glam::DVec3;
use rayon::prelude::*;

use super::Pyramid;
use super::cube::direction_of;
use crate::brdf::ggx_lobe;
use crate::error::Result;
use crate::progress::Observer;
use crate::shader_constants::split_sum;

/// Texels along the edge of a face of level 0, at least: the last level has one. Twice as many as the source has, up to the most.
const FEWEST_TEXELS: usize = 64;
const MOST_TEXELS: usize = 256;

/// roughness_alpha of level 0: its lobe is as wide as three texels of a face of 256. Each level has twice that of the one before, up to 1.
pub const FINEST_ALPHA: f64 = split_sum::FINEST_ALPHA as f64;
const LEVELS: usize = 1 + split_sum::COARSEST_LEVEL as usize;

/// Samples of a texel: rings of equal mass, times as many azimuths. Lookups are as wide as what they stand for, so wide lobes, whose rings lie
/// further apart, need more.
fn rings(level: usize) -> usize {
    8 + 4 * level
}

/// Texels along the edge of a face of each level, where level 0 has `face_size`; none of a level that is less than a texel.
pub(super) fn sizes(face_size: usize) -> Vec<usize> {
    (0..LEVELS).map(|level| face_size >> level).filter(|size| *size > 0).collect()
}

/// The level of that pyramid whose lobe has this roughness.
pub fn level_of_alpha(roughness_alpha: f32) -> f32 {
    (roughness_alpha / FINEST_ALPHA as f32).log2().clamp(0.0, (LEVELS - 1) as f32)
}

/// The sum over l of L(l) (n . l) over that of (n . l), for l drawn by GGX about each texel's n: Karis's prefiltered map, from the
/// box-filtered `source`.
///
/// # Errors
/// Cancelled by `observer`.
pub fn ggx_pyramid(source: &Pyramid, observer: &dyn Observer) -> Result<Pyramid> {
    let face_size = (2 * source.face_size).clamp(FEWEST_TEXELS, MOST_TEXELS);
    let level = |(level, size): (usize, usize)| {
        let taps = ggx_lobe(FINEST_ALPHA * (1 << level) as f64, rings(level));
        let total: f64 = taps.iter().map(|tap| tap.weight).sum();
        let texel = |index: usize| {
            let (face, row, column) = (index / (size * size), index / size % size, index % size);
            let centre = |i: usize| (i as f64 + 0.5) / size as f64;
            let z = direction_of(face, centre(column), centre(row));
            let (x, y) = z.any_orthonormal_pair();
            let sum: DVec3 = taps
                .iter()
                .map(|tap| {
                    let direction = (tap.direction.x * x + tap.direction.y * y + tap.direction.z * z).as_vec3();
                    let level = source.level_of(tap.solid_angle_sr as f32, direction);
                    tap.weight * source.lookup(direction, level).as_dvec3()
                })
                .sum();
            (sum / total).as_vec3().to_array()
        };
        let row_of_texels = |start: usize| -> Result<Vec<[f32; 3]>> {
            observer.check()?;
            Ok((start..start + size).map(texel).collect())
        };
        let rows: Vec<_> =
            (0..6 * size * size).into_par_iter().step_by(size).map(row_of_texels).collect::<Result<_>>()?;
        Ok(rows.concat())
    };
    Ok(Pyramid { face_size, levels: sizes(face_size).into_iter().enumerate().map(level).collect::<Result<_>>()? })
}

#[cfg(test)]
mod tests {
    use super::super::Environment;
    use super::super::tests::environment;
    use super::*;
    use glam::Vec3;

    #[test]
    fn constant_light_stays_as_it_is_and_a_hemisphere_is_half_at_its_edge() {
        let white = Pyramid::box_filtered(&environment(8, 4, |_, _| [0.5, 1.0, 2.0]));
        for level in ggx_pyramid(&white, &()).unwrap().levels {
            assert!(level.iter().all(|texel| Vec3::from(*texel).abs_diff_eq(Vec3::new(0.5, 1.0, 2.0), 1e-5)));
        }
        let upper: Environment = environment(64, 32, |_, y| [f64::from(u32::from(y < 16)) as f32; 3]);
        let pyramid = ggx_pyramid(&Pyramid::box_filtered(&upper), &()).unwrap();
        // Coarse levels have few texels: between them they are off.
        for (level, tolerance) in [(0.0, 0.02), (3.0, 0.02), (5.0, 0.05)] {
            let [up, side, down] = [Vec3::Y, Vec3::X, -Vec3::Y].map(|d| pyramid.lookup(d, level).x);
            assert!(
                (up - 1.0).abs() < tolerance && (side - 0.5).abs() < tolerance && down.abs() < tolerance,
                "{level}: {up} {side} {down}"
            );
        }
    }

    #[test]
    fn levels_double_roughness() {
        assert_eq!([0.001, 1.0 / 64.0, 0.25, 1.0].map(level_of_alpha), [0.0, 0.0, 4.0, 6.0]);
    }
}
