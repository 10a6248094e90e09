//! The environment as shaders look it up and draw from it: radiance, sampling density, alias table.
use glam::{Vec3, Vec4};
use rayon::prelude::*;

use super::Environment;
use crate::brdf::luminance;

/// The lat-long map with the density by which light is sampled: a pixel is drawn in proportion to its luminance times the
/// integral of its bilinear weight, then a point under that weight. The density is thus bilinear between pixels, as radiance
/// is: it is stored with it, and it is zero only where the environment is black.
#[derive(Clone, Debug)]
pub struct LightMap {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Radiance, and density over the unit square (u, v) or whether it is a small source's, at pixel centres, row by row from the top.
    pub texels: Vec<[f32; 4]>,
}

/// One column of Walker's alias table: it stands for a pixel below `threshold` (of 2^32) and for `other` above.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Alias {
    /// Probability of staying, times 2^32.
    pub threshold: u32,
    /// The pixel otherwise.
    pub other: u32,
}

impl LightMap {
    /// The map of `environment`. A wholly black one is drawn from uniformly over the sphere.
    pub fn new(environment: &Environment) -> Self {
        let (width, height) = (environment.width, environment.height);
        let black = environment.max_radiance() == 0.0;
        let areas: Vec<_> = (0..height).map(|row| environment.weight_solid_angle(row)).collect();
        let mass = |i: usize| {
            let luminance = if black { 1.0 } else { luminance(super::to_dvec3(&environment.texels[i])) };
            luminance * areas[i / width]
        };
        let masses: Vec<f64> = (0..width * height).into_par_iter().map(mass).collect();
        // A mean of 1 is a density over the unit square.
        let scale = masses.len() as f64 / masses.iter().sum::<f64>();
        let texels = environment.texels.iter().zip(&masses);
        let texels = texels.map(|(&[r, g, b], mass)| [r, g, b, (mass * scale) as f32]).collect();
        Self { width, height, texels }
    }

    /// The map of `environment`, with the pixels of small sources marked by 1 where densities would be, and all others by 0.
    pub fn with_sources_marked(environment: &Environment) -> Self {
        let texels = environment.texels.iter().zip(&environment.small_sources().pixels);
        let texels = texels.map(|(&[r, g, b], &is_source)| [r, g, b, f32::from(u8::from(is_source))]).collect();
        Self { width: environment.width, height: environment.height, texels }
    }

    /// The alias table over the pixels (Vose 1991).
    pub fn aliases(&self) -> Vec<Alias> {
        let mut remaining: Vec<f64> = self.texels.iter().map(|texel| f64::from(texel[3])).collect();
        let mean = remaining.iter().sum::<f64>() / remaining.len() as f64;
        remaining.iter_mut().for_each(|mass| *mass /= mean);
        let (mut small, mut large): (Vec<usize>, Vec<usize>) =
            (0..remaining.len()).partition(|&pixel| remaining[pixel] < 1.0);
        // Those that rounding leaves over at the end have a mass of 1 but for rounding.
        let stay = |pixel: usize| Alias { threshold: u32::MAX, other: pixel as u32 };
        let mut aliases: Vec<Alias> = (0..remaining.len()).map(stay).collect();
        while let (Some(poor), Some(&rich)) = (small.pop(), large.last()) {
            aliases[poor] = Alias { threshold: (remaining[poor] * 2.0_f64.powi(32)) as u32, other: rich as u32 };
            remaining[rich] -= 1.0 - remaining[poor];
            if remaining[rich] < 1.0 {
                large.pop();
                small.push(rich);
            }
        }
        aliases
    }

    /// The four pixels around the unit direction `d`, with their weights. Twin of `environment_corners` in glsl/environment_map.glsl.
    pub fn corners(&self, d: Vec3) -> [(f32, Vec4); 4] {
        let sin_theta = d.x.hypot(d.z);
        let phi = d.x.atan2(-d.z);
        let theta = sin_theta.atan2(d.y);
        let x = phi / std::f32::consts::TAU * self.width as f32 - 0.5;
        let y = theta / std::f32::consts::PI * self.height as f32 - 0.5;
        let left = (x.floor() as isize).rem_euclid(self.width as isize) as usize;
        let right = (left + 1) % self.width;
        let row = |y: f32| (y.max(0.0) as usize).min(self.height - 1);
        let (top, bottom) = (row(y.floor()), row(y.floor() + 1.0));
        let texel = |column: usize, row: usize| Vec4::from(self.texels[row * self.width + column]);
        let (t, u) = (x - x.floor(), y - y.floor());
        [
            ((1.0 - t) * (1.0 - u), texel(left, top)),
            (t * (1.0 - u), texel(right, top)),
            ((1.0 - t) * u, texel(left, bottom)),
            (t * u, texel(right, bottom)),
        ]
    }

    /// Radiance and density from the unit direction `d`. Twin of `environment_texel` in glsl/environment_map.glsl.
    pub fn texel(&self, d: Vec3) -> Vec4 {
        self.corners(d).into_iter().map(|(weight, texel)| weight * texel).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::environment;
    use super::*;
    use crate::farthest::Farthest;

    #[test]
    fn the_map_is_the_environment() {
        let sky = environment(13, 6, |column, row| [(column * 7 % 5) as f32, row as f32, 1.0]);
        let map = LightMap::new(&sky);
        for i in 0..2000 {
            let z = 1.0 - (i as f64 + 0.5) / 1000.0;
            let angle = 2.4 * i as f64;
            let direction = glam::DVec3::new(angle.cos() * (1.0 - z * z).sqrt(), z, angle.sin() * (1.0 - z * z).sqrt());
            let error = map.texel(direction.as_vec3()).truncate().as_dvec3() - sky.radiance(direction);
            assert!(error.farthest() < 1e-4, "{direction}: {error}");
        }
    }

    #[test]
    fn aliases_draw_every_pixel_in_proportion_to_its_density() {
        for (width, height) in [(1, 1), (4, 2), (64, 32)] {
            let sky =
                environment(width, height, |x, y| [if (x, y) == (3, 1) { 1e6 } else { (x % 3) as f32 }, 0.1, 0.0]);
            let map = LightMap::new(&sky);
            let mut drawn = vec![0.0; map.texels.len()];
            for (pixel, alias) in map.aliases().iter().enumerate() {
                let stay = f64::from(alias.threshold) / 2.0_f64.powi(32);
                drawn[pixel] += stay;
                drawn[alias.other as usize] += 1.0 - stay;
            }
            for (pixel, texel) in map.texels.iter().enumerate() {
                assert!((drawn[pixel] - f64::from(texel[3])).abs() <= 1e-6 * drawn[pixel] + 1e-9, "{pixel}");
            }
        }
    }

    #[test]
    fn a_black_environment_can_be_drawn_from() {
        let map = LightMap::new(&environment(8, 4, |_, _| [0.0; 3]));
        assert!(map.texels.iter().all(|texel| texel[3] > 0.0));
    }
}
