//! Forces between samples, equations (8) to (10): they push each other apart until their cones cover the pdf evenly.
use std::f64::consts::PI;

use glam::DVec3;
use rayon::prelude::*;

use super::MIN_COS;
use super::cones::Cones;
use super::slice::Slice;
use crate::error::Result;
use crate::progress::Observer;

/// Equation (9): strength of the force at x = distance / sum of the cones' radii.
pub fn strength(x: f64) -> f64 {
    if x <= 0.1 {
        9.0
    } else if x <= 1.0 {
        1.0 / x - 1.0
    } else {
        0.0
    }
}

/// Equation (10): unit tangent at `x` that points away from `y`; zero where they coincide.
pub fn tangent_away(x: DVec3, y: DVec3) -> DVec3 {
    x.cross(x.cross(y)).normalize_or_zero()
}

/// Equation (8): the force on sample `i`, by all others and by all mirror images below the horizon.
///
/// The published forces know no horizon and would push samples out of the hemisphere. Images repel with the cone of their
/// original, which is the boundary condition "nothing flows through the plane": a sample meets its own image when
/// it comes closer to the horizon than its cone is wide.
fn force(i: usize, samples: &[DVec3], sigma: &[f64]) -> DVec3 {
    let (s_i, sigma_i) = (samples[i], sigma[i]);
    let mut total = DVec3::ZERO;
    for (j, (&s_j, &sigma_j)) in samples.iter().zip(sigma).enumerate() {
        let reach = sigma_i + sigma_j;
        // The chord is shorter than the angle, so whoever is beyond reach by the chord is beyond by the angle.
        let distance2 = s_i.distance_squared(s_j);
        if j != i && distance2 < reach * reach {
            total += push(s_i, s_j, distance2, reach, i < j);
        }
        // |s_i - image|^2 = |s_i - s_j|^2 + 4 z_i z_j
        let image2 = distance2 + 4.0 * s_i.z * s_j.z;
        if image2 < reach * reach {
            total += push(s_i, DVec3::new(s_j.x, s_j.y, -s_j.z), image2, reach, false);
        }
    }
    total
}

/// One term of equation (8).
fn push(s_i: DVec3, s_j: DVec3, distance2: f64, reach: f64, is_first: bool) -> DVec3 {
    let angle = 2.0 * (0.5 * distance2.sqrt()).min(1.0).asin();
    let away = tangent_away(s_i, s_j);
    if away == DVec3::ZERO {
        // Coincident samples have no direction apart: send them opposite ways.
        let side = s_i.any_orthonormal_vector();
        return strength(0.0) * if is_first { side } else { -side };
    }
    strength(angle / reach) * away
}

/// Moves `samples` along their forces (F2) until they settle, or for `iterations` steps; `fixed` ones stay where they are.
pub fn settle(
    slice: &Slice,
    samples: &mut [DVec3],
    fixed: Option<usize>,
    iterations: usize,
    observer: &dyn Observer,
) -> Result<()> {
    /// Part of its cone's radius that a sample moves under a force of 1.
    const STEP: f64 = 0.05;
    /// No sample moves further than this part of its radius at once: forces hold only nearby.
    const LONGEST_STEP: f64 = 0.3;
    /// Settled: no sample moves by more than this part of its radius any more.
    const SETTLED: f64 = 0.003;
    /// Cones change slowly, and finding them costs more than the forces.
    const STEPS_PER_CONE: usize = 5;
    /// A sample keeps to where the pdf is at least this part of its mean over the sample's cone. Outside a lobe with an edge
    /// cones only grow, and the force would drive a sample away for good.
    const LEAST_DENSITY: f64 = 0.05;

    let cones = Cones::new(slice, samples.len());
    let mut sigma = vec![f64::INFINITY; samples.len()];
    // Small sets are not worth handing out one by one.
    let grain = 16;
    for iteration in 0..iterations {
        observer.check()?;
        if iteration % STEPS_PER_CONE == 0 {
            let guess = std::mem::take(&mut sigma);
            let both = samples.par_iter().zip(&guess).with_min_len(grain);
            sigma = both.map(|(&s, &guess)| cones.sigma(s, guess)).collect();
        }
        let moved: Vec<(DVec3, f64)> = (0..samples.len())
            .into_par_iter()
            .with_min_len(grain)
            .map(|i| {
                let s = samples[i];
                if fixed == Some(i) {
                    return (s, 0.0);
                }
                let step = (STEP * force(i, samples, &sigma)).clamp_length_max(LONGEST_STEP);
                let next = (s + sigma[i] * step).normalize();
                let cone_sr = 4.0 * PI * (0.5 * sigma[i]).sin().powi(2);
                let mean_density = 1.0 / (samples.len() as f64 * cone_sr);
                let density = slice.pdf(next);
                let is_inside = density >= LEAST_DENSITY * mean_density || density > slice.pdf(s);
                if is_inside && next.z > MIN_COS { (next, step.length()) } else { (s, 0.0) }
            })
            .collect();
        let longest = moved.iter().map(|(_, step)| *step).fold(0.0, f64::max);
        for (sample, (next, _)) in samples.iter_mut().zip(moved) {
            *sample = next;
        }
        if longest < SETTLED {
            break;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{Brdf, SeenBrdf};

    #[test]
    fn strength_is_equation_9() {
        assert_eq!([0.0, 0.05, 0.1, 0.5, 1.0, 1.5].map(strength), [9.0, 9.0, 9.0, 1.0, 0.0, 0.0]);
        assert!((strength(0.1 + 1e-12) - 9.0).abs() < 1e-9);
    }

    #[test]
    fn tangent_points_away_and_is_a_unit_tangent() {
        let (x, y) = (DVec3::new(0.6, 0.0, 0.8), DVec3::new(0.0, 0.6, 0.8));
        let away = tangent_away(x, y);
        assert!(away.dot(x).abs() < 1e-12 && (away.length() - 1.0).abs() < 1e-12);
        assert!((x + 1e-3 * away).angle_between(y) > x.angle_between(y));
        assert_eq!(tangent_away(x, x), DVec3::ZERO);
    }

    #[test]
    fn forces_between_two_samples_are_opposite_and_images_hold_the_horizon() {
        let samples = [DVec3::new(0.1, 0.0, 1.0).normalize(), DVec3::new(-0.1, 0.0, 1.0).normalize()];
        let (a, b) = (force(0, &samples, &[0.2, 0.2]), force(1, &samples, &[0.2, 0.2]));
        assert!(a.x > 0.0 && (a.x + b.x).abs() < 1e-12 && (a.z - b.z).abs() < 1e-12);
        let low = [DVec3::new(1.0, 0.0, 0.05).normalize()];
        assert!(force(0, &low, &[0.2]).z > 0.0);
        assert_eq!(force(0, &low, &[0.01]), DVec3::ZERO);
    }

    #[test]
    fn crowded_samples_spread_and_stay_above_the_horizon() {
        let brdf = Brdf::builtin("clay").unwrap();
        let slice = Slice::new(&SeenBrdf::from_all_around(&brdf), 0.5);
        // All within a degree, two of them equal.
        let mut samples: Vec<DVec3> =
            (0..20).map(|i| DVec3::new(1e-3 * f64::from(i % 19), 1e-3 * f64::from(i % 7), 1.0).normalize()).collect();
        settle(&slice, &mut samples, None, 1000, &()).unwrap();
        let nearest = |i: usize| {
            let others = samples.iter().enumerate().filter(|(j, _)| *j != i);
            others.map(|(_, s)| s.angle_between(samples[i])).fold(f64::INFINITY, f64::min)
        };
        // 20 cones over the hemisphere are about 18 degrees wide; neighbours end up a radius apart or more.
        for (i, s) in samples.iter().enumerate() {
            assert!(s.z > 0.0 && nearest(i).to_degrees() > 15.0, "{i}: {s}, {}", nearest(i).to_degrees());
        }
    }
}
