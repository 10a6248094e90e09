//! The irradiance map: the environment convolved with the cosine, which takes the part of every BRDF that is like Lambert's in one lookup.
//!
//! Small bright sources are left out of it: between the texels of a map their terminator would be a step, so shading adds
//! theirs exactly.
use glam::Vec3;
use rayon::prelude::*;

use super::cube::{direction_of, face_of};
use super::{Environment, Pyramid, SmallSources, to_dvec3};

/// Texels along the edge of a face: bilinear between them is good to 1e-4 of the largest value, without small sources.
const FACE_SIZE: usize = 64;

/// The light is gathered in cells of a cube map with faces of this size: 2 degrees, each with the centroid of its light.
const CELLS_SIZE: usize = 48;

/// Irradiance over pi without `sources`, for every normal: a cube map of one level.
pub fn irradiance_map(environment: &Environment, sources: &SmallSources) -> Pyramid {
    let mut cells = vec![(Vec3::ZERO, Vec3::ZERO); 6 * CELLS_SIZE * CELLS_SIZE];
    for (row, texels) in environment.texels.chunks_exact(environment.width).enumerate() {
        let solid_angle = environment.weight_solid_angle(row);
        for (column, texel) in texels.iter().enumerate() {
            if sources.pixels[row * environment.width + column] {
                continue;
            }
            let direction = environment.direction(column as f64, row as f64);
            let (face, s, t) = face_of(direction);
            let cell = |x: f64| ((x * CELLS_SIZE as f64) as usize).min(CELLS_SIZE - 1);
            let (power, centroid) = &mut cells[(face * CELLS_SIZE + cell(t)) * CELLS_SIZE + cell(s)];
            let light = (solid_angle * to_dvec3(texel)).as_vec3();
            *power += light;
            *centroid += light.element_sum() * direction.as_vec3();
        }
    }
    cells.retain(|(power, _)| *power != Vec3::ZERO);
    cells.iter_mut().for_each(|(power, centroid)| {
        *power *= std::f32::consts::FRAC_1_PI;
        *centroid = centroid.normalize_or_zero();
    });
    let irradiance = |texel: usize| {
        let middle = |index: usize| (index as f64 + 0.5) / FACE_SIZE as f64;
        let (face, row, column) = (texel / FACE_SIZE / FACE_SIZE, texel / FACE_SIZE % FACE_SIZE, texel % FACE_SIZE);
        let n = direction_of(face, middle(column), middle(row)).as_vec3();
        let sum: Vec3 = cells.iter().map(|(power, centroid)| n.dot(*centroid).max(0.0) * *power).sum();
        sum.to_array()
    };
    let texels = (0..6 * FACE_SIZE * FACE_SIZE).into_par_iter().map(irradiance).collect();
    Pyramid { face_size: FACE_SIZE, levels: vec![texels] }
}

#[cfg(test)]
mod tests {
    use super::super::tests::environment;
    use super::*;
    use glam::DVec3;

    #[test]
    fn lookups_and_sources_together_are_the_integral_of_the_cosine() {
        let map = environment(128, 64, |x, y| {
            let spot = if (x, y) == (70, 20) { 4e3 } else { 0.5 };
            [1.0 + ((x * 7 + y * 3) % 13) as f32, spot, (y / 20) as f32]
        });
        let sources = SmallSources::of(&map);
        assert_eq!(sources.list.len(), 1);
        let irradiance = irradiance_map(&map, &sources);
        for i in 0..200 {
            let z: f64 = 1.0 - (f64::from(i) + 0.5) / 100.0;
            let angle = f64::from(i) * 2.4;
            let n = DVec3::new(angle.cos() * (1.0 - z * z).sqrt(), z, angle.sin() * (1.0 - z * z).sqrt());
            let mut truth = DVec3::ZERO;
            for row in 0..map.height {
                for column in 0..map.width {
                    let cos = n.dot(map.direction(column as f64, row as f64)).max(0.0);
                    let solid_angle = map.weight_solid_angle(row);
                    truth += cos * solid_angle * to_dvec3(&map.texels[row * map.width + column]);
                }
            }
            let of_source = sources.list[0].power * n.dot(sources.list[0].direction).max(0.0);
            let found = irradiance.lookup(n.as_vec3(), 0.0).as_dvec3() * std::f64::consts::PI + of_source;
            // A texel at the edge of the hemisphere is half in it.
            let error = ((found - truth) / truth.max(DVec3::splat(1.0))).abs().max_element();
            assert!(error < 2e-3, "{n}: {found}, not {truth}");
        }
    }
}
