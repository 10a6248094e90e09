//! The environment as the reference sees it: radiance of a direction, and directions drawn in proportion to radiance.
use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3, Vec3A};

use super::inversion::{find_step, invert_ramp};
use crate::environment::Environment;

/// Fewest strips from pole to pole: over a strip the sine of theta counts as constant in the pdf, within a few percent.
const MIN_STRIPS: usize = 256;

/// The function [`Environment::radiance`], tabulated to be fast, with a pdf proportional to it (mean of the channels).
///
/// The pdf over the picture is the bilinear function itself times the sine of theta, the latter constant over strips of rows.
/// So it is positive wherever any channel is, and what it misses is a factor close to 1 that the estimate knows exactly.
pub struct Light {
    width: usize,
    height: usize,
    /// With a border of one pixel: wrapped at the sides, repeated at the poles.
    texels: Vec<Vec3A>,
    /// For each row of pixels, the integral of its interpolated channel sum from column 0 to each column; width + 1 a row.
    columns: Vec<f64>,
    /// CDF over strips of equal height in theta: one more than there are strips.
    strips: Vec<f64>,
    /// Mean sine of theta over each strip divided by the integral of radiance so weighted: pdf over the picture by channel sum.
    strip_density: Vec<f64>,
}

/// A direction with the radiance that comes from it.
#[derive(Clone, Copy, Debug)]
pub struct LightSample {
    /// Unit.
    pub direction: DVec3,
    /// From that direction.
    pub radiance: DVec3,
    /// With which the direction is drawn, in 1/sr.
    pub pdf: f64,
}

impl Light {
    /// Tabulates `environment`.
    pub fn new(environment: &Environment) -> Self {
        let (width, height) = (environment.width, environment.height);
        let mut texels = Vec::with_capacity((width + 2) * (height + 2));
        for row in 0..height + 2 {
            let row = &environment.texels[row.saturating_sub(1).min(height - 1) * width..][..width];
            let padded = row[width - 1..].iter().chain(row).chain(&row[..1]);
            texels.extend(padded.map(|&texel| Vec3A::from_array(texel)));
        }
        let mut columns = Vec::with_capacity((width + 1) * height);
        for row in environment.texels.chunks_exact(width) {
            let mut sum = 0.0;
            columns.push(sum);
            for column in 0..width {
                sum += 0.5 * (channel_sum(row[column]) + channel_sum(row[(column + 1) % width]));
                columns.push(sum);
            }
        }
        // Strips end at all centres and edges of pixel rows, so that each lies between two neighbouring centres.
        let strip_count = 2 * height * MIN_STRIPS.div_ceil(2 * height);
        let edge = |edge: usize| edge as f64 / strip_count as f64;
        let mean_sine = |strip| {
            let [from, to] = [PI * edge(strip), PI * edge(strip + 1)];
            (from.cos() - to.cos()) / (to - from)
        };
        let strip_density: Vec<_> = (0..strip_count).map(mean_sine).collect();
        let mut light = Self { width, height, texels, columns, strips: vec![0.0], strip_density };
        for strip in 0..strip_count {
            let mean = 0.5 * (light.row_sum(strip, edge(strip)) + light.row_sum(strip, edge(strip + 1))) / width as f64;
            let mass = mean * light.strip_density[strip] / strip_count as f64;
            light.strips.push(light.strips[strip] + mass);
        }
        let total = light.strips[strip_count];
        if total > 0.0 {
            light.strips.iter_mut().for_each(|mass| *mass /= total);
            light.strip_density.iter_mut().for_each(|density| *density /= total);
        }
        light
    }

    /// Whether no light comes from anywhere.
    pub fn is_black(&self) -> bool {
        !self.strips.last().is_some_and(|&total| total > 0.0)
    }

    /// Radiance from unit `direction` and the pdf with which [`Self::sample`] draws it.
    #[inline]
    pub fn evaluate(&self, direction: DVec3) -> (DVec3, f64) {
        let sin_theta = (direction.x * direction.x + direction.z * direction.z).sqrt();
        let phi = direction.x.atan2(-direction.z);
        let u = if phi < 0.0 { phi / TAU + 1.0 } else { phi / TAU };
        let v = sin_theta.atan2(direction.y) / PI;
        let radiance = self.bilinear(u * self.width as f64 - 0.5, v * self.height as f64 - 0.5);
        let strip = ((v * self.strip_density.len() as f64) as usize).min(self.strip_density.len() - 1);
        (radiance, self.pdf(radiance, strip, sin_theta))
    }

    /// The direction at `uv` in (0, 1)^2. Its pdf is 0 where the picture is black throughout.
    pub fn sample(&self, uv: DVec2) -> LightSample {
        let (strip, rest) = find_step(self.strip_density.len(), uv.y, |edge| self.strips[edge]);
        let strip_count = self.strip_density.len() as f64;
        let edges = [strip as f64 / strip_count, (strip + 1) as f64 / strip_count];
        let v = (strip as f64 + invert_ramp(edges.map(|v| self.row_sum(strip, v)), rest)) / strip_count;

        let (above, below, t) = self.rows(strip, v);
        let prefix = |column: usize| {
            let [a, b] = [above, below].map(|row| self.columns[row * (self.width + 1) + column]);
            a + t * (b - a)
        };
        let (column, rest) = find_step(self.width, uv.x, prefix);
        let y = v * self.height as f64 - 0.5;
        let ends = [column, column + 1].map(|column| channel_sum(self.bilinear(column as f64, y).to_array()));
        let x = column as f64 + invert_ramp(ends, rest);

        let (sin_theta, cos_theta) = (PI * v).sin_cos();
        let (sin_phi, cos_phi) = (TAU * (x + 0.5) / self.width as f64).sin_cos();
        let radiance = self.bilinear(x, y);
        LightSample {
            direction: DVec3::new(sin_theta * sin_phi, cos_theta, -sin_theta * cos_phi),
            radiance,
            pdf: self.pdf(radiance, strip, sin_theta),
        }
    }

    /// In 1/sr: the pdf over the picture by the solid angle of the picture, 2 pi^2 sin(theta). At the very poles it is infinite,
    /// and such a sample counts nothing.
    fn pdf(&self, radiance: DVec3, strip: usize, sin_theta: f64) -> f64 {
        radiance.element_sum() * self.strip_density[strip] / (2.0 * PI * PI * sin_theta)
    }

    /// Bilinear at column `x` in [-0.5, width] and row `y` in [-0.5, height - 0.5]; whole numbers are pixel centres.
    /// Single precision, as texels are: 1e-7 of the brightest of the four.
    #[inline]
    fn bilinear(&self, x: f64, y: f64) -> DVec3 {
        // + 1 for the border, which also makes truncation the floor.
        let (x, y) = (x + 1.0, y + 1.0);
        let (column, row) = ((x as usize).min(self.width), (y as usize).min(self.height));
        let above = row * (self.width + 2) + column;
        let below = above + self.width + 2;
        let t = (x - column as f64) as f32;
        let above = self.texels[above].lerp(self.texels[above + 1], t);
        let below = self.texels[below].lerp(self.texels[below + 1], t);
        above.lerp(below, (y - row as f64) as f32).as_dvec3()
    }

    /// The rows of pixels between whose centres v in `strip` lies, and how far it is from the first to the second.
    fn rows(&self, strip: usize, v: f64) -> (usize, usize, f64) {
        // Two half-rows of pixels lie between two centres; the first and the last half have only one centre beside them.
        let half_row = strip * 2 * self.height / self.strip_density.len();
        let (above, below) = (half_row.div_ceil(2), half_row.div_ceil(2) + 1);
        let t = v * self.height as f64 + 0.5 - above as f64;
        (above.saturating_sub(1), (below - 1).min(self.height - 1), t.clamp(0.0, 1.0))
    }

    /// The interpolated channel sum, summed over the row at v in `strip`.
    fn row_sum(&self, strip: usize, v: f64) -> f64 {
        let (above, below, t) = self.rows(strip, v);
        let [above, below] = [above, below].map(|row| self.columns[row * (self.width + 1) + self.width]);
        above + t * (below - above)
    }
}

fn channel_sum<T: Into<f64> + Copy>(texel: [T; 3]) -> f64 {
    texel[0].into() + texel[1].into() + texel[2].into()
}

#[cfg(test)]
mod tests {
    use super::super::points::point;
    use super::*;
    use crate::environment::tests::environment;

    #[test]
    fn radiance_is_the_environments_and_samples_know_their_own() {
        for (width, height) in [(1, 1), (2, 1), (1, 7), (9, 5), (40, 300)] {
            let map = environment(width, height, |column, row| {
                [(column * 7 % 5) as f32, (row * 3 % 7) as f32, if column == row { 1e4 } else { 0.0 }]
            });
            let light = Light::new(&map);
            for i in 0..500 {
                let p = point(1, i);
                let (cos_theta, phi) = (2.0 * p.x - 1.0, TAU * p.y);
                let sin_theta = (1.0 - cos_theta * cos_theta).sqrt();
                let direction = DVec3::new(sin_theta * phi.cos(), cos_theta, sin_theta * phi.sin());
                let error = light.evaluate(direction).0 - map.radiance(direction);
                assert!(
                    error.abs().max_element() < 1e-6 * map.max_radiance(),
                    "{width} x {height} {direction}: {error}"
                );

                let sample = light.sample(p);
                let (radiance, pdf) = light.evaluate(sample.direction);
                assert!(((radiance - sample.radiance) / sample.radiance.element_sum()).abs().max_element() < 1e-6);
                assert!((pdf / sample.pdf - 1.0).abs() < 1e-6, "{width} x {height}: {pdf} {}", sample.pdf);
            }
        }
    }

    #[test]
    fn the_mean_of_radiance_by_pdf_is_the_light_as_a_whole() {
        let map = environment(11, 6, |column, row| [(column + row) as f32, 1.0, if column == 3 { 50.0 } else { 0.1 }]);
        let light = Light::new(&map);
        let count = 1 << 14;
        let mean =
            (0..count).map(|i| light.sample(point(5, i))).map(|sample| sample.radiance / sample.pdf).sum::<DVec3>()
                / f64::from(count);
        let exact = map.mean_radiance() * 4.0 * PI;
        assert!(((mean - exact) / exact).abs().max_element() < 1e-3, "{mean} {exact}");
    }
}
