//! Lights of the built-in environments that are as small as pixels or have edges: each pixel gets the share of its solid angle that they
//! cover.
use std::f64::consts::{PI, TAU};

use glam::{DVec3, dvec3};
use rayon::prelude::*;

use super::{Environment, to_dvec3};

/// Light of one radiance around a direction.
pub(super) struct Light {
    /// Unit.
    pub centre: DVec3,
    pub shape: Shape,
    /// Linear Rec. 709.
    pub radiance: DVec3,
}

pub(super) enum Shape {
    /// All within this angle, in radians, of the centre.
    Disc(f64),
    /// An upright rectangle that faces the origin: [`upright_axes`] of its centre, and half its width and height on the plane at distance 1.
    Window { axes: [DVec3; 2], half_sides: [f64; 2] },
}

/// The unit vectors to the right and up on the plane that faces the origin from `centre`; towards the poles any.
pub(super) fn upright_axes(centre: DVec3) -> [DVec3; 2] {
    let right = centre.cross(DVec3::Y).normalize_or(DVec3::X);
    [right, right.cross(centre)]
}

impl Light {
    /// A window around `centre`, with these halves of its width and height.
    fn window(centre: DVec3, half_sides: [f64; 2], radiance: DVec3) -> Self {
        Self { centre, shape: Shape::Window { axes: upright_axes(centre), half_sides }, radiance }
    }

    /// Cosine of the angle from the centre within which all of it is.
    fn cos_reach(&self) -> f64 {
        match self.shape {
            Shape::Disc(radius) => radius.cos(),
            Shape::Window { half_sides: [x, y], .. } => 1.0 / (1.0 + x * x + y * y).sqrt(),
        }
    }

    fn covers(&self, direction: DVec3) -> bool {
        let along = direction.dot(self.centre);
        match self.shape {
            Shape::Disc(radius) => along > radius.cos(),
            Shape::Window { axes, half_sides } => {
                let is_within = |(axis, half): (DVec3, f64)| direction.dot(axis).abs() < half * along;
                along > 0.0 && axes.into_iter().zip(half_sides).all(is_within)
            }
        }
    }
}

/// Adds lights to an environment.
pub(super) fn with_lights(environment: &Environment, lights: &[Light]) -> Environment {
    const SUBPIXELS: usize = 16;
    // Pixels whose centre is farther than that from what a light covers hold nothing of it.
    let two_rows = TAU / environment.height as f64;
    let cos_reaches: Vec<f64> =
        lights.iter().map(|light| (light.cos_reach().acos() + two_rows).min(PI).cos()).collect();
    let directions = environment.directions((0..environment.width).map(|column| column as f64));
    let of_pixel = |(column, row): (f64, f64), centre: DVec3| {
        let near = lights.iter().zip(&cos_reaches).filter(|(light, reach)| centre.dot(light.centre) > **reach);
        let mut covered: Vec<_> = near.map(|(light, _)| (light, 0.0)).collect();
        if covered.is_empty() {
            return DVec3::ZERO;
        }
        let offset = |index: usize| (index as f64 + 0.5) / SUBPIXELS as f64 - 0.5;
        let mut all = 0.0;
        for sample in 0..SUBPIXELS * SUBPIXELS {
            let direction =
                environment.direction(column + offset(sample % SUBPIXELS), row + offset(sample / SUBPIXELS));
            let sin_theta = direction.x.hypot(direction.z);
            all += sin_theta;
            covered.iter_mut().for_each(|(light, sum)| *sum += if light.covers(direction) { sin_theta } else { 0.0 });
        }
        covered.into_iter().map(|(light, sum)| light.radiance * (sum / all)).sum()
    };
    let of_row = |row| {
        let centres = directions.of_row(row as f64).enumerate();
        centres.map(move |(column, centre)| of_pixel((column as f64, row as f64), centre))
    };
    let added: Vec<DVec3> = (0..environment.height).into_par_iter().flat_map_iter(of_row).collect();
    let lit = environment.texels.iter().zip(added).map(|(texel, light)| to_dvec3(texel) + light);
    environment.with_texels(lit.map(|radiance| radiance.as_vec3().to_array()).collect())
}

/// So many windows and bulbs of all sizes and colours, all around: what cuts most light out as sources, and leaves the rest of it to kernels.
/// The more there are, the smaller, so that they shed about as much light.
pub(super) fn windows_and_bulbs(count: usize) -> Vec<Light> {
    // Powers of the inverse of the root of x^7 = x + 1: steps by which points fill a cube of six dimensions evenly, like the golden ratio's
    // in one (Roberts 2018, "The Unreasonable Effectiveness of Quasirandom Sequences").
    let steps: [f64; 6] = std::array::from_fn(|i| 1.112_775_684_278_705_5_f64.powi(-(i as i32 + 1)));
    let smaller = (10.0 / count as f64).powf(0.4);
    let light = |index: usize| {
        let [height, turn, size, aspect, colour, brightness] =
            steps.map(|step| (0.5 + (index as f64 + 1.0) * step).fract());
        let from_to = |from: f64, to: f64, t: f64| from * (to / from).powf(t);
        let y = 1.0 - 2.0 * height;
        let (sin, cos) = (TAU * turn).sin_cos();
        let across = (1.0 - y * y).sqrt();
        let centre = dvec3(across * cos, y, across * sin);
        let warm_to_cool = dvec3(1.0, 0.72, 0.42).lerp(dvec3(0.72, 0.88, 1.1), colour);
        let radiance = |radiance: f64| warm_to_cool * radiance * from_to(0.25, 4.0, brightness);
        // Every third is a bulb.
        if index % 3 == 2 {
            let shape = Shape::Disc(smaller * from_to(0.2, 3.0, size).to_radians());
            return Light { centre, shape, radiance: radiance(from_to(2000.0, 100.0, size)) };
        }
        let side = smaller * from_to(0.03, 0.4, size);
        let stretch = from_to(0.4, 2.5, aspect).sqrt();
        Light::window(centre, [side * stretch, side / stretch], radiance(from_to(40.0, 8.0, size)))
    };
    (0..count).map(light).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::RepairCounts;
    use crate::farthest::Farthest;

    #[test]
    fn a_window_sheds_the_light_of_its_solid_angle_wherever_it_is() {
        let [x, y] = [0.3_f64, 0.05];
        let solid_angle_sr = 4.0 * (x * y / ((1.0 + x * x) * (1.0 + y * y)).sqrt()).asin();
        for centre in [DVec3::X, DVec3::Y, DVec3::new(0.3, -0.8, 0.5).normalize()] {
            let black = Environment::new("black".into(), 256, 128, vec![[0.0; 3]; 256 * 128], RepairCounts::default());
            let light = Light::window(centre, [x, y], dvec3(1.0, 2.0, 3.0));
            let shed = with_lights(&black, &[light]).mean_radiance() * 4.0 * PI / solid_angle_sr;
            // 16 x 16 samples a pixel of an edge.
            assert!((shed / dvec3(1.0, 2.0, 3.0) - 1.0).farthest() < 4e-3, "{centre}: {shed}");
        }
    }

    #[test]
    fn lights_are_as_many_as_asked_for_apart_and_bright() {
        for count in [10, 500] {
            let lights = windows_and_bulbs(count);
            assert_eq!(lights.len(), count);
            for (i, light) in lights.iter().enumerate() {
                assert!(
                    light.centre.is_normalized() && light.radiance.min_element() > 0.5,
                    "{count}: {}",
                    light.centre
                );
                let nearest = lights[..i].iter().map(|other| other.centre.distance(light.centre)).fold(2.0, f64::min);
                assert!(nearest > 0.1 / (count as f64).sqrt(), "{count}: {nearest}");
            }
        }
    }
}
