//! Cones, equations (5) and (6): how wide a sample has to look around itself to see its share of the pdf.
use glam::DVec3;

use super::slice::Slice;

/// Points that stand for one share of the mass: the resolution at which a cone's mass is known (about 1 / POINTS_PER_SHARE).
const POINTS_PER_SHARE: usize = 32;

/// Finds sigma, the angular radius in radians around a direction that holds 1/m of the pdf's mass.
///
/// The pdf is stood for by 32 m points of equal mass, so sigma is the distance to the 32nd nearest.
pub struct Cones {
    // Single precision and one array per coordinate: the search is a plain loop over all points, which the compiler
    // vectorises. Differences of unit vectors are good to 1e-7 rad, far below any sigma.
    x: Vec<f32>,
    y: Vec<f32>,
    z: Vec<f32>,
}

impl Cones {
    /// For `count` samples of `slice`.
    pub fn new(slice: &Slice, count: usize) -> Self {
        let points: Vec<_> = slice.points(POINTS_PER_SHARE * count).map(|point| point.as_vec3()).collect();
        Self {
            x: points.iter().map(|point| point.x).collect(),
            y: points.iter().map(|point| point.y).collect(),
            z: points.iter().map(|point| point.z).collect(),
        }
    }

    /// sigma around `s` in radians. `guess` is a previous sigma of a place nearby, or infinity: it only saves time.
    pub fn sigma(&self, s: DVec3, guess: f64) -> f64 {
        let s = s.as_vec3();
        let distance2 = |i: usize| {
            let (x, y, z) = (self.x[i] - s.x, self.y[i] - s.y, self.z[i] - s.z);
            x * x + y * y + z * z
        };
        let mut distances: Vec<f32> = (0..self.x.len()).map(distance2).collect();
        // Sorting out far points first leaves next to nothing to select from.
        let near2 = (2.25 * guess * guess) as f32;
        let near: Vec<f32> = distances.iter().copied().filter(|&distance2| distance2 < near2).collect();
        if near.len() >= POINTS_PER_SHARE {
            distances = near;
        }
        let (_, nth, _) = distances.select_nth_unstable_by(POINTS_PER_SHARE - 1, f32::total_cmp);
        // From chord to angle. Coincident points must not make a cone of no width: 1e-7 is the coordinates' precision.
        2.0 * (0.5 * f64::from(*nth).sqrt()).min(1.0).asin().max(1e-7)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::SeenBrdf;
    use crate::threads::test_materials;

    #[test]
    fn a_cone_holds_its_share_of_the_mass() {
        const COUNT: usize = 40;
        for (name, brdf) in test_materials::all() {
            let slice = Slice::new(&SeenBrdf::from_all_around(&brdf), 0.6);
            let cones = Cones::new(&slice, COUNT);
            for s in slice.points(5) {
                let sigma = cones.sigma(s, f64::INFINITY);
                assert_eq!(cones.sigma(s, 0.9 * sigma), sigma);
                // Integrate the pdf over the cone by the midpoint rule in (angle, azimuth) about s.
                let tangent = s.any_orthonormal_vector();
                let (steps, mut mass) = (200, 0.0);
                for i in 0..steps {
                    let angle = (f64::from(i) + 0.5) / f64::from(steps) * sigma;
                    for j in 0..steps {
                        let azimuth = (f64::from(j) + 0.5) / f64::from(steps) * std::f64::consts::TAU;
                        let side = tangent * azimuth.cos() + s.cross(tangent) * azimuth.sin();
                        mass += slice.pdf(s * angle.cos() + side * angle.sin()) * angle.sin();
                    }
                }
                mass *= sigma * std::f64::consts::TAU / f64::from(steps * steps);
                let share = mass * COUNT as f64;
                assert!((0.85..1.15).contains(&share), "{name} at {s}: {share}");
            }
        }
    }
}
