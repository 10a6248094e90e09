//! The way of the albedo between the two last rows: towards the horizon some BRDFs grow without bound. Twin of glsl/threads/rim.glsl.
use std::f64::consts::FRAC_PI_2;

use glam::DVec3;

use super::theta_o;
use crate::brdf::{MAX_THETA_O_DEG, luminance};
use crate::shader_constants::rim;

/// The power of albedos that change evenly, or by too little to tell.
pub use crate::shader_constants::rim::EVEN;

/// The powers that are looked for. `ward` by Dür has -1, the original one -1/2, lobes that set 0.6 to 1.2. What turns within the last degree
/// is of none, and the bounds keep it from running away.
pub const POWERS: [f64; 2] = [-2.0, 4.0];

/// Half-way an even change may be off by so much of the albedo: less than threads of most materials err by.
const LEAST_BEND: f64 = 5e-3;

/// From here to 0, where the way has no limit in single precision, powers count as this.
const LEAST_POWER: f64 = 0.02;

/// The angle of the last row to the horizon, of which 1 is a right angle.
const LAST_TO_HORIZON: f64 = 1.0 - MAX_THETA_O_DEG / 90.0;

const _: () = assert!((rim::LAST_TO_HORIZON as f64 / LAST_TO_HORIZON - 1.0).abs() < 1e-6);

/// The power, in that of the angle to the horizon, by which the albedo goes from the last row but one to the last: the one that is right
/// half-way. `albedos` are those of rows, and `albedo` is that of a view angle in radians.
pub fn rim_power(albedos: &[DVec3], albedo: impl FnOnce(f64) -> DVec3) -> f32 {
    let rows = albedos.len();
    let &[.., before, last] = albedos else { return EVEN };
    let middle = 0.5 * (theta_o(rows - 2, rows) + theta_o(rows - 1, rows));
    let [before_albedo, middle_albedo, last_albedo] = [before, albedo(middle), last].map(luminance);
    // Not of a NaN.
    let bends = (0.5 * (before_albedo + last_albedo) - middle_albedo).abs() > LEAST_BEND * middle_albedo;
    if !bends {
        return EVEN;
    }
    let part = (middle_albedo - before_albedo) / (last_albedo - before_albedo);
    let t = 1.0 - (1.0 - middle / FRAC_PI_2) * (rows - 1) as f64;
    let [mut low, mut high] = POWERS;
    // The part grows with the power.
    for _ in 0..24 {
        let power = 0.5 * (low + high);
        if towards_last(t, rows, power) < part { low = power } else { high = power }
    }
    away_from_0(0.5 * (low + high)) as f32
}

/// Twin of `towards_row_above`.
pub fn towards_row_above(row: f32, rows: usize, rim_power: f32) -> f32 {
    let t = row.fract();
    if rim_power == EVEN || row <= rows as f32 - 2.0 {
        return t;
    }
    towards_last(t.into(), rows, rim_power.into()) as f32
}

/// How far an albedo of this power is on its way from the last row but one of `rows` to the last, where the view is the part `t` of it.
pub fn towards_last(t: f64, rows: usize, power: f64) -> f64 {
    let last = LAST_TO_HORIZON * (rows - 1) as f64;
    let power = away_from_0(power);
    (1.0 - (1.0 - t).max(last).powf(power)) / (1.0 - last.powf(power))
}

/// Whether [`rim_power`] may be this.
pub fn is_rim_power(power: f32) -> bool {
    (POWERS[0] as f32..=POWERS[1] as f32).contains(&power) && f64::from(power.abs()) > 0.9 * LEAST_POWER
}

fn away_from_0(power: f64) -> f64 {
    if power.abs() < LEAST_POWER { LEAST_POWER.copysign(power) } else { power }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn power_of(albedo: impl Fn(f64) -> f64) -> f32 {
        let albedo = |theta_o: f64| DVec3::splat(albedo((FRAC_PI_2 - theta_o).to_degrees()));
        rim_power(&Vec::from_iter((0..91).map(|row| albedo(theta_o(row, 91)))), albedo)
    }

    #[test]
    fn powers_of_the_angle_to_the_horizon_are_found() {
        for power in [-1.5, -1.0, -0.5, 0.3, 0.6, 1.5, 3.0] {
            let found = power_of(|deg| 0.2 + 0.1 * deg.powf(power));
            assert!((f64::from(found) - power).abs() < 1e-3, "{found} instead of {power}");
            let way = |deg: f64| (deg.powf(power) - 1.0) / (0.01f64.powf(power) - 1.0);
            for t in [0.0, 0.3, 0.7, 0.95, 0.99] {
                assert!((towards_last(t, 91, power) - way(1.0 - t)).abs() < 1e-9, "{power} at {t}");
            }
            assert_eq!(towards_last(1.0, 91, power), 1.0);
        }
    }

    #[test]
    fn even_dark_and_odd_albedos_have_a_sound_power() {
        assert_eq!(power_of(|deg| 0.3 + 0.1 * deg), EVEN);
        assert_eq!(power_of(|_| 0.0), EVEN);
        assert_eq!(power_of(|_| f64::NAN), EVEN);
        assert_eq!(rim_power(&[DVec3::ONE], |_| DVec3::ONE), EVEN);
        // It turns half-way: no power does.
        let found = power_of(|deg| (deg - 0.4).powi(2));
        assert!(POWERS[0] as f32 <= found && found <= POWERS[1] as f32, "{found}");
        assert!(power_of(|deg| deg.ln() + 9.0).abs() < 0.03);
    }
}
