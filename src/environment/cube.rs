//! The cube map: which face and where on it a direction falls, after the table in the Vulkan specification.
use std::f64::consts::PI;

use glam::DVec3;

/// The face that `direction` falls on, of +X -X +Y -Y +Z -Z, and s and t in [0, 1] there (Vulkan 1.3, "Cube Map Face Selection").
pub fn face_of(direction: DVec3) -> (usize, f64, f64) {
    let DVec3 { x, y, z } = direction;
    let size = direction.abs();
    // On an edge the specification prefers Z to Y and Y to X.
    let (face, s, t, major) = if size.z >= size.x && size.z >= size.y {
        if z < 0.0 { (5, -x, -y, size.z) } else { (4, x, -y, size.z) }
    } else if size.y >= size.x {
        if y < 0.0 { (3, x, -z, size.y) } else { (2, x, z, size.y) }
    } else if x < 0.0 {
        (1, z, -y, size.x)
    } else {
        (0, -z, -y, size.x)
    };
    (face, 0.5 * (s / major + 1.0), 0.5 * (t / major + 1.0))
}

/// The direction of the point (s, t) on the plane of `face`, unit; s and t outside [0, 1] go on in that plane.
pub fn direction_of(face: usize, s: f64, t: f64) -> DVec3 {
    point_of(face, s, t).normalize()
}

/// The point (s, t) on the plane of `face`, at distance 1 from the origin.
pub(super) fn point_of(face: usize, s: f64, t: f64) -> DVec3 {
    let (s, t) = (2.0 * s - 1.0, 2.0 * t - 1.0);
    match face {
        0 => DVec3::new(1.0, -t, -s),
        1 => DVec3::new(-1.0, -t, s),
        2 => DVec3::new(s, 1.0, t),
        3 => DVec3::new(s, -1.0, -t),
        4 => DVec3::new(s, -t, 1.0),
        _ => DVec3::new(-s, -t, -1.0),
    }
}

/// The coordinates of `d` along the axes of s and t of `face` and along the face's own.
pub(super) fn coordinates(face: usize, d: DVec3) -> DVec3 {
    match face {
        0 => DVec3::new(-d.z, -d.y, d.x),
        1 => DVec3::new(d.z, -d.y, -d.x),
        2 => DVec3::new(d.x, d.z, d.y),
        3 => DVec3::new(d.x, -d.z, -d.y),
        4 => DVec3::new(d.x, -d.y, d.z),
        _ => DVec3::new(-d.x, -d.y, -d.z),
    }
}

/// The solid angle of the texel around the unit `direction`, in sr: 4 / N^2 max(|x|, |y|, |z|)^3, the area on the cube of
/// half-side 1 times cosine over squared distance. A density: over the sphere its inverse integrates to 6 N^2.
pub fn texel_solid_angle(face_size: usize, direction: DVec3) -> f64 {
    4.0 / (face_size * face_size) as f64 * direction.abs().max_element().powi(3)
}

/// The exact solid angle of texel (column, row) of any face, in sr; six faces sum to 4 pi.
pub(super) fn exact_texel_solid_angle(face_size: usize, column: usize, row: usize) -> f64 {
    if face_size == 1 {
        return 4.0 * PI / 6.0;
    }
    // The solid angle of the rectangle from the face's centre to (x, y) on the plane at distance 1.
    let corner = |x: f64, y: f64| (x * y).atan2((x * x + y * y + 1.0).sqrt());
    let edge = |index: usize| 2.0 * index as f64 / face_size as f64 - 1.0;
    let (x0, x1, y0, y1) = (edge(column), edge(column + 1), edge(row), edge(row + 1));
    corner(x1, y1) - corner(x0, y1) - corner(x1, y0) + corner(x0, y0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn face_and_direction_are_inverse() {
        for face in 0..6 {
            for (s, t) in [(0.5, 0.5), (0.1, 0.7), (0.95, 0.02), (0.001, 0.999)] {
                let (found, s_found, t_found) = face_of(direction_of(face, s, t));
                assert_eq!(face, found);
                assert!((s - s_found).abs() < 1e-12 && (t - t_found).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn faces_look_along_their_axes_and_start_in_the_corners_that_vulkan_says() {
        let axes = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
        // Where the texel (0, 0) of each face lies.
        let corners = [
            (1.0, 1.0, 1.0),
            (-1.0, 1.0, -1.0),
            (-1.0, 1.0, -1.0),
            (-1.0, -1.0, 1.0),
            (-1.0, 1.0, 1.0),
            (1.0, 1.0, -1.0),
        ];
        for face in 0..6 {
            assert!((direction_of(face, 0.5, 0.5) - axes[face]).length() < 1e-15, "face {face}");
            let corner = DVec3::from(corners[face]).normalize();
            assert!((direction_of(face, 0.0, 0.0) - corner).length() < 1e-15, "face {face}");
        }
    }

    #[test]
    fn texel_solid_angles_sum_to_the_sphere() {
        for n in [1, 2, 16, 128] {
            let (mut exact, mut approximate) = (0.0, 0.0);
            for i in 0..n * n {
                let (column, row) = (i % n, i / n);
                exact += 6.0 * exact_texel_solid_angle(n, column, row);
                let direction = direction_of(0, (column as f64 + 0.5) / n as f64, (row as f64 + 0.5) / n as f64);
                approximate += 6.0 * texel_solid_angle(n, direction);
            }
            assert!((exact - 4.0 * PI).abs() < 1e-10, "{exact}");
            // The midpoint rule: its error falls as 1 / N^2.
            assert!((approximate / (4.0 * PI) - 1.0).abs() < 2.0 / (n * n) as f64, "{approximate}");
        }
    }
}
