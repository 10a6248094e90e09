//! Directions in the tangent plane. Twin of glsl/tangent.glsl.
use glam::Vec3;

/// An axis orthogonal to unit `n`, for where nothing gives one. Twin of `any_tangent` (Duff et al. 2017).
pub fn any_tangent(n: Vec3) -> Vec3 {
    let s = if n.z >= 0.0 { 1.0 } else { -1.0 };
    let a = -1.0 / (s + n.z);
    Vec3::new(1.0 + s * n.x * n.x * a, s * n.x * n.y * a, -s * n.x)
}

/// What of `direction`, of any length, is orthogonal to unit `n`, as a unit vector. Twin of `tangent_along`.
pub fn tangent_along(direction: Vec3, n: Vec3) -> Vec3 {
    // The reasons for both bounds stand in the shader.
    let largest = direction.abs().max_element();
    let unit = if largest > 0.0 { (direction / largest).normalize() } else { n };
    let along = unit - unit.dot(n) * n;
    if along.length_squared() > 1e-6 { along.normalize() } else { any_tangent(n) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::threads::slice::fibonacci_lattice;

    #[test]
    fn tangents_are_unit_and_orthogonal_to_every_normal_whatever_they_go_by() {
        let normal = |uv: glam::DVec2| {
            let z = 2.0 * uv.x - 1.0;
            ((1.0 - z * z).sqrt() * glam::DVec2::from_angle(std::f64::consts::TAU * uv.y)).extend(z).as_vec3()
        };
        for n in fibonacci_lattice(500).map(normal).chain([Vec3::Z, Vec3::NEG_Z]) {
            for direction in [Vec3::X, Vec3::ZERO, n, 1e-30 * Vec3::Y, 1e30 * Vec3::ONE, n + 1e-4 * Vec3::Z] {
                let tangent = tangent_along(direction, n);
                assert!(tangent.is_normalized() && tangent.dot(n).abs() < 1e-4, "{direction} at {n}: {tangent}");
            }
        }
        assert!(tangent_along(Vec3::new(1e-20, 0.0, 1e-20), Vec3::Z).distance(Vec3::X) < 1e-6);
    }
}
