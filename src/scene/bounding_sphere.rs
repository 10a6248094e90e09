//! Spheres that hold meshes and objects.
use glam::DVec3;

/// A sphere that holds something.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundingSphere {
    /// Its centre.
    pub centre: DVec3,
    /// Its radius, in the unit of length of its space.
    pub radius: f64,
}

impl BoundingSphere {
    /// One around `spheres`: the centre of their box, and the radius that reaches the farthest.
    pub fn around(spheres: &[Self]) -> Self {
        let low = spheres.iter().fold(DVec3::INFINITY, |low, sphere| low.min(sphere.centre - sphere.radius));
        let high = spheres.iter().fold(DVec3::NEG_INFINITY, |high, sphere| high.max(sphere.centre + sphere.radius));
        let centre = (low + high) / 2.0;
        let reach = |sphere: &Self| sphere.centre.distance(centre) + sphere.radius;
        Self { centre, radius: spheres.iter().map(reach).fold(0.0, f64::max) }
    }
}
