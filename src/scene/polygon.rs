//! Polygons as triangles.
use earcut::Earcut;
use earcut::utils3d::project3d_to_2d;
use glam::DVec3;

/// The triangles that a polygon consists of, as places of their corners in it, turning as it does. None of fewer than three corners.
///
/// A fan around the first corner if all of the polygon is seen from there, as every convex one is; of another its ears are cut off one by one
/// (Meisters, Polygons have ears, 1975). One that crosses itself becomes some triangles.
pub(super) fn triangles_of(polygon: &[DVec3]) -> Vec<[usize; 3]> {
    let fan: Vec<_> = (2..polygon.len()).map(|last| [0, last - 1, last]).collect();
    let area = |[a, b, c]: [usize; 3]| (polygon[b] - polygon[a]).cross(polygon[c] - polygon[a]);
    let normal: DVec3 = fan.iter().map(|&triangle| area(triangle)).sum();
    if fan.iter().all(|&triangle| area(triangle).dot(normal) >= 0.0) {
        return fan;
    }
    // From the first corner, such that the crate's normal, too, is of the polygon and not of where it is.
    let around_first: Vec<_> = polygon.iter().map(|corner| (corner - polygon[0]).to_array()).collect();
    let (mut flat, mut corners) = (Vec::new(), Vec::<usize>::new());
    if !project3d_to_2d(&around_first, polygon.len(), &mut flat) {
        return fan;
    }
    Earcut::new().earcut(flat, &[], &mut corners);
    let turned = |&[a, b, c]: &[usize; 3]| if area([a, b, c]).dot(normal) < 0.0 { [a, c, b] } else { [a, b, c] };
    corners.as_chunks().0.iter().map(turned).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DQuat, DVec2};

    fn area(polygon: &[DVec3], [a, b, c]: [usize; 3]) -> DVec3 {
        0.5 * (polygon[b] - polygon[a]).cross(polygon[c] - polygon[a])
    }

    /// Corners of an outline in a plane that is tilted and away from the origin.
    fn tilted(outline: &[[f64; 2]]) -> Vec<DVec3> {
        let turn = DQuat::from_rotation_x(0.7) * DQuat::from_rotation_y(2.0);
        outline.iter().map(|&place| turn * DVec2::from(place).extend(0.0) + DVec3::new(5.0, -3.0, 2.0)).collect()
    }

    #[test]
    fn a_polygon_is_covered_once_from_whichever_corner_it_starts_and_whichever_way_it_turns() {
        let l: &[[f64; 2]] = &[[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
        let comb: &[[f64; 2]] =
            &[[0.0, 0.0], [5.0, 0.0], [5.0, 3.0], [4.0, 3.0], [4.0, 1.0], [3.0, 1.0], [3.0, 3.0], [0.0, 3.0]];
        let dart: &[[f64; 2]] = &[[0.0, 0.0], [2.0, 1.0], [0.0, 2.0], [0.5, 1.0]];
        for (outline, size) in [(l, 3.0), (comb, 13.0), (dart, 1.5)] {
            for (first, is_turned) in (0..outline.len()).flat_map(|first| [(first, false), (first, true)]) {
                let mut polygon = tilted(outline);
                polygon.rotate_left(first);
                if is_turned {
                    polygon.reverse();
                }
                let triangles = triangles_of(&polygon);
                assert_eq!(triangles.len(), polygon.len() - 2);
                // Areas add up and all face the same way, so nothing is covered twice or from behind.
                let all: DVec3 = triangles.iter().map(|&triangle| area(&polygon, triangle)).sum();
                let sizes: f64 = triangles.iter().map(|&triangle| area(&polygon, triangle).length()).sum();
                assert!(
                    (sizes - size).abs() < 1e-9 && (all.length() - size).abs() < 1e-9,
                    "{first} {is_turned}: {sizes}"
                );
                let outwards = tilted(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
                let side = area(&outwards, [0, 1, 2]).dot(all);
                assert!((side < 0.0) == is_turned, "{first} {is_turned}");
            }
        }
    }

    #[test]
    fn convex_ones_are_fans_and_those_without_an_area_are_no_trouble() {
        let square = tilted(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
        assert_eq!(triangles_of(&square), [[0, 1, 2], [0, 2, 3]]);
        assert!(triangles_of(&square[..2]).is_empty() && triangles_of(&[]).is_empty());
        let crossed = tilted(&[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]);
        let line = tilted(&[[0.0, 0.0], [1.0, 0.0], [3.0, 0.0], [2.0, 0.0]]);
        for polygon in [crossed, line, vec![DVec3::ONE; 5], vec![DVec3::splat(1e30), DVec3::ZERO, DVec3::X, DVec3::Y]] {
            assert!(triangles_of(&polygon).as_flattened().iter().all(|&corner| corner < polygon.len()));
        }
    }
}
