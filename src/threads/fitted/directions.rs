//! The directions that Gaussians are fitted to, and f cos there: a fit to the BRDF itself (Green, Kautz and Durand 2007), as the lights that
//! threads are fitted to have no width.
use std::f64::consts::PI;

use glam::DVec3;

use super::lights::{LANES, POINTS, TestLights};
use crate::threads::slice::{Slice, fibonacci_lattice, on_sphere};

impl TestLights {
    /// About `count` directions, half in the `lobes` of `slice` and half all over the sphere: below the horizon kernels are to have nothing.
    /// The squares of residuals count by the solid angle that a direction stands for, so that their sum is an integral.
    pub fn directions([slice, lobes]: &[Slice; 2], count: usize) -> Self {
        let half = (count / 2).next_multiple_of(LANES / 2);
        let anywhere = fibonacci_lattice(half).map(on_sphere);
        let directions: Vec<DVec3> = lobes.points(half).chain(anywhere).collect();
        let f_cos = |w: &DVec3| if w.z > 0.0 { slice.f_cos(*w) } else { DVec3::ZERO };
        let f_cos: Vec<_> = directions.iter().map(f_cos).collect();
        let weight = |w: &DVec3| (half as f64 * (0.25 / PI + lobes.pdf(*w))).recip().sqrt();
        let weights: Vec<_> = directions.iter().map(weight).collect();
        Self::weighted(slice, &directions, &weights, &f_cos, POINTS..POINTS + 1, &|j| directions[j].z.max(0.0) / PI)
    }
}
