//! Directions in proportion to the environment's light. Twin of glsl/light_sampling.glsl.
use std::f32::consts::{PI, TAU};

use glam::{Vec3, Vec4};

use super::{Point, random::to_unit};
use crate::environment::{Alias, LightMap};

/// A number in (-1, 1) with density 1 - |x|. Twin of `tent`.
fn tent(u: f32) -> f32 {
    if u < 0.5 { (2.0 * u).sqrt() - 1.0 } else { 1.0 - (2.0 - 2.0 * u).sqrt() }
}

/// A direction; its density is [`light_pdf`] of what the map holds there. Twin of `sample_light`.
fn sample_light(map: &LightMap, aliases: &[Alias], bits: [u32; 4]) -> Vec3 {
    let pixel = ((u64::from(bits[0]) * aliases.len() as u64) >> 32) as usize;
    let alias = aliases[pixel];
    let pixel = if bits[1] < alias.threshold { pixel } else { alias.other as usize };
    let u = to_unit(bits);
    let x = ((pixel % map.width) as f32 + 0.5 + tent(u.z)) / map.width as f32;
    let y = ((pixel / map.width) as f32 + 0.5 + tent(u.w)).abs() / map.height as f32;
    let y = if y > 1.0 { 2.0 - y } else { y };
    let (phi, theta) = (TAU * x, PI * y);
    Vec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos())
}

/// Density in 1/sr of [`sample_light`] at `d`, where the map holds `texel`. Twin of `light_pdf`.
pub(super) fn light_pdf(texel: Vec4, d: Vec3) -> f32 {
    texel.w / (2.0 * PI * PI * d.x.hypot(d.z)).max(2e-6)
}

impl Point<'_> {
    pub(super) fn sample_light(&self, bits: [u32; 4]) -> Vec3 {
        sample_light(self.map(), &self.twin.aliases, bits)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::{Environment, RepairCounts};
    use crate::shading::random::random_bits;
    use glam::{DVec3, UVec2};

    /// Dark but for a few bright pixels, one of them at a pole and one at the wrap.
    fn map() -> LightMap {
        let (width, height) = (24, 12);
        let mut texels = vec![[0.2, 0.1, 0.3]; width * height];
        for (column, row, radiance) in [(5, 0, 30.0), (23, 6, 50.0), (0, 11, 20.0), (12, 3, 0.0), (13, 3, 0.0)] {
            texels[row * width + column] = [radiance; 3];
        }
        LightMap::new(&Environment::new("test".into(), width, height, texels, RepairCounts::default()))
    }

    #[test]
    fn the_density_is_that_of_the_drawn_directions() {
        // Chi-square over cells of the sphere: cells of equal angles, density integrated by midpoints.
        let map = map();
        let aliases = map.aliases();
        const CELLS: (usize, usize) = (20, 10);
        let (draws, grid) = (400_000, 24);
        let mut seen = vec![0.0; CELLS.0 * CELLS.1];
        for i in 0..draws {
            let d = sample_light(&map, &aliases, random_bits(UVec2::ZERO, i, 0));
            let (u, v) = (d.x.atan2(-d.z) / TAU + 0.5, d.y.clamp(-1.0, 1.0).acos() / PI);
            let cell = |x: f32, count: usize| ((x * count as f32) as usize).min(count - 1);
            seen[cell(v, CELLS.1) * CELLS.0 + cell(u, CELLS.0)] += 1.0;
        }
        let (mut chi_square, mut total) = (0.0, 0.0);
        for (i, count) in seen.iter().enumerate() {
            let mut mass = 0.0;
            for j in 0..grid * grid {
                let middle = |cell: usize, step: usize, count: usize| {
                    (cell as f64 + (step as f64 + 0.5) / grid as f64) / count as f64
                };
                let phi = (middle(i % CELLS.0, j % grid, CELLS.0) - 0.5) * std::f64::consts::TAU;
                let theta = middle(i / CELLS.0, j / grid, CELLS.1) * std::f64::consts::PI;
                let d = DVec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos());
                let area = 2.0 * std::f64::consts::PI.powi(2) * theta.sin() / (seen.len() * grid * grid) as f64;
                mass += f64::from(light_pdf(map.texel(d.as_vec3()), d.as_vec3())) * area;
            }
            let expected = mass * f64::from(draws);
            chi_square += (count - expected) * (count - expected) / expected;
            total += mass;
        }
        assert!((total - 1.0).abs() < 2e-3, "the density integrates to {total}");
        let freedom = (seen.len() - 1) as f64;
        assert!(chi_square < freedom + 4.5 * (2.0 * freedom).sqrt(), "chi square {chi_square} of {freedom}");
    }
}
