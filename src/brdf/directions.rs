//! Angles and mirror images of directions, in the shading frame.
use glam::DVec3;

/// The angle between `w` and the normal, in radians, to the last digits near the normal too.
pub fn theta(w: DVec3) -> f64 {
    w.truncate().length().atan2(w.z)
}

/// The direction that the facet `half_vector` mirrors `w` into, as long as `w`.
pub fn reflect(w: DVec3, half_vector: DVec3) -> DVec3 {
    2.0 * w.dot(half_vector) * half_vector - w
}
