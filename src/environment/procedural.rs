//! The built-in environments: a soft sky, the same with a small sun, a studio with area lights, halls of many lamps, and the white
//! furnace.

use glam::DVec3;
use rayon::prelude::*;

use super::lights::{Light, Shape, upright_axes, windows_and_bulbs, with_lights};
use super::{Environment, RepairCounts};
use crate::error::{Error, Result};

/// Width and height of those that are not constant.
const SIZE: (usize, usize) = (1024, 512);

/// Towards the sun of `sky` (where it only glows) and `sun`: 34 degrees up, to the left behind the default camera's back.
const SUN_DIRECTION: DVec3 = DVec3::new(-0.55, 0.56, 0.62);
/// Angular radius of the sun of `sun`: three times the real one, so that a picture of 1024 x 512 can hold it.
const SUN_RADIUS_DEG: f64 = 0.75;
/// Radiance of its disc. Times 5.4e-4 sr it sheds 1.3 times the light (luminance) of the sky above the horizon.
const SUN_RADIANCE: DVec3 = DVec3::new(7600.0, 6500.0, 5000.0);

/// The names that [`Environment::builtin`] takes.
pub fn builtin_names() -> &'static [&'static str] {
    &["sky", "studio", "sun", "lamps-10", "lamps-70", "lamps-500", "white"]
}

impl Environment {
    /// A built-in environment: `sky` (soft gradient over ground), `sun` (the same with a small sun), `studio` (area lights in
    /// a dark room), `lamps-10`, `lamps-70` and `lamps-500` (so many windows and bulbs around a dark hall) or `white` (radiance 1
    /// everywhere: the furnace).
    pub fn builtin(name: &str) -> Result<Self> {
        let lamps = |count| with_lights(&procedural(name, SIZE, hall), &windows_and_bulbs(count));
        match name {
            "sky" => Ok(procedural(name, SIZE, sky)),
            "sun" => Ok(with_lights(&procedural(name, SIZE, sky), &[sun()])),
            "studio" => Ok(procedural(name, SIZE, studio)),
            "lamps-10" => Ok(lamps(10)),
            "lamps-70" => Ok(lamps(70)),
            "lamps-500" => Ok(lamps(500)),
            "white" => Ok(procedural(name, (4, 2), |_| DVec3::ONE)),
            _ => Err(Error::input(
                format!("environment `{name}`"),
                "is not built in",
                Environment::FILES.remedy_for(name),
            )),
        }
    }
}

/// The picture of a function of direction, sampled at the pixel centres: functions here are smooth over a pixel.
fn procedural(name: &str, (width, height): (usize, usize), radiance: impl Fn(DVec3) -> DVec3 + Sync) -> Environment {
    let environment = Environment::new(name.into(), width, height, Vec::new(), RepairCounts::default());
    let directions = environment.directions((0..width).map(|column| column as f64));
    let of_row = |row| directions.of_row(row as f64).map(|direction| radiance(direction).as_vec3().to_array());
    environment.with_texels((0..height).into_par_iter().flat_map_iter(of_row).collect())
}

/// Blue above, pale at the horizon, warm round the sun's place; matt ground below.
fn sky(direction: DVec3) -> DVec3 {
    let height = direction.y;
    let towards_sun = direction.dot(SUN_DIRECTION.normalize());
    let zenith = DVec3::new(0.10, 0.24, 0.60);
    let horizon = DVec3::new(0.78, 0.86, 0.95);
    // Air mass grows towards the horizon; so does the share of white.
    let air = zenith.lerp(horizon, (-4.5 * height.max(0.0)).exp());
    let lobe = |sharpness: f64| (sharpness * (towards_sun - 1.0)).exp();
    let glow = DVec3::new(1.0, 0.78, 0.42) * (0.30 * lobe(5.0) + 0.75 * lobe(45.0));
    let ground = DVec3::new(0.21, 0.18, 0.145) * (0.65 + 0.35 * (3.0 * height.min(0.0)).exp());
    // Four degrees of haze between ground and sky.
    ground.lerp(air + glow, smoothstep(-0.06, 0.01, height))
}

/// The sun of `sun`.
fn sun() -> Light {
    Light { centre: SUN_DIRECTION.normalize(), shape: Shape::Disc(SUN_RADIUS_DEG.to_radians()), radiance: SUN_RADIANCE }
}

/// Evening in a hall: what its lamps leave.
fn hall(direction: DVec3) -> DVec3 {
    DVec3::new(0.05, 0.045, 0.04).lerp(DVec3::new(0.16, 0.17, 0.19), smoothstep(-0.6, 0.9, direction.y))
}

/// A dark room, and in it a large warm key light, a cool strip, a rim light and the glow of the ceiling.
fn studio(direction: DVec3) -> DVec3 {
    let height = direction.y;
    let wall = DVec3::new(0.060, 0.064, 0.072).lerp(DVec3::new(0.020, 0.021, 0.024), smoothstep(-0.1, 0.9, height));
    // The floor fades into the wall as a paper sweep does, brightest below the lights.
    let floor = DVec3::new(0.15, 0.142, 0.133) * (0.35 + 0.65 * smoothstep(-1.0, -0.1, height));
    let room = wall.lerp(floor, smoothstep(0.04, -0.30, height));
    let lights = [
        // Centre, half width and half height (tangents of angles), softness of the edge, roundness, radiance.
        (DVec3::new(-0.62, 0.62, 0.60), DVec3::new(0.42, 0.34, 0.07), DVec3::new(9.5, 8.7, 7.6)),
        (DVec3::new(0.93, 0.22, 0.18), DVec3::new(0.10, 0.62, 0.05), DVec3::new(4.6, 5.4, 6.8)),
        (DVec3::new(-0.30, 0.50, -0.85), DVec3::new(0.50, 0.07, 0.05), DVec3::new(5.5, 5.2, 5.0)),
    ];
    let ceiling =
        DVec3::new(0.80, 0.85, 0.95) * (7.0 * (direction.dot(DVec3::new(0.25, 0.97, 0.10).normalize()) - 1.0)).exp();
    lights.into_iter().fold(room + ceiling, |radiance, (centre, shape, light)| {
        radiance + light * area_light(direction, centre.normalize(), shape.x, shape.y, shape.z)
    })
}

/// Coverage in [0, 1] by a rectangle that faces the origin from `centre`, upright: half its width and height on the plane at
/// distance 1, and the width of its soft edge.
fn area_light(direction: DVec3, centre: DVec3, half_width: f64, half_height: f64, softness: f64) -> f64 {
    let distance = direction.dot(centre);
    if distance <= 0.0 {
        return 0.0;
    }
    let [right, up] = upright_axes(centre);
    let x = direction.dot(right).abs() / distance - half_width;
    let y = direction.dot(up).abs() / distance - half_height;
    // Distance to the rectangle's edge, negative inside; corners outside are round.
    let outside = x.max(0.0).hypot(y.max(0.0)) + x.max(y).min(0.0);
    smoothstep(softness, -softness, outside)
}

/// 0 at `from`, 1 at `to` (which may be the smaller), smooth between.
fn smoothstep(from: f64, to: f64, value: f64) -> f64 {
    let t = ((value - from) / (to - from)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::farthest::Farthest;

    #[test]
    fn every_built_in_can_be_made_and_is_radiance() {
        for name in builtin_names() {
            let environment = Environment::builtin(name).unwrap();
            assert_eq!(environment.texels.len(), environment.width * environment.height);
            assert!(environment.texels.iter().flatten().all(|value| value.is_finite() && *value >= 0.0), "{name}");
        }
        let error = Environment::builtin("moon").unwrap_err().to_string();
        assert!(error.contains("moon") && error.contains("studio"), "{error}");
    }

    #[test]
    fn the_furnace_is_white() {
        let white = Environment::builtin("white").unwrap();
        assert_eq!((white.mean_radiance(), white.max_radiance()), (DVec3::ONE, 1.0));
    }

    #[test]
    fn the_sun_sheds_the_light_of_its_disc() {
        let (sky, sun) = (Environment::builtin("sky").unwrap(), Environment::builtin("sun").unwrap());
        let shed = (sun.mean_radiance() - sky.mean_radiance()) * 4.0 * PI;
        let disc_sr = 2.0 * PI * (1.0 - SUN_RADIUS_DEG.to_radians().cos());
        let error = (shed / (SUN_RADIANCE * disc_sr) - 1.0).farthest();
        assert!(error < 2e-3, "{error}");
        assert!((sun.radiance(SUN_DIRECTION).x / SUN_RADIANCE.x - 1.0).abs() < 1e-3);
    }
}
