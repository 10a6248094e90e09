//! Which part of the picture objects may be in: what is drawn, cleared and sorted; the rest of it sees no surface.
use super::View;
use crate::shader_constants::tiles::TILE_SIDE;
use glam::{DVec2, DVec3};
use std::cmp::Ordering;

/// A rectangle of whole tiles in the picture, at least one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    /// Column and row of the first tile.
    pub first_tile: [u32; 2],
    /// Those after the last.
    pub end_tile: [u32; 2],
}

/// A corner of a box around an object, as seen from the eye.
#[derive(Clone, Copy, Debug)]
pub struct Corner {
    /// Where it is.
    pub from_eye: DVec3,
    /// How far to the side single precision, in which vertices are drawn, may put a vertex there; along the view by as much, or in
    /// proportion to its distance.
    pub error: f64,
}

/// Devices move corners of triangles to fractions of a pixel; a whole one is more than that.
const MARGIN_PX: f64 = 1.0;

/// Boxes with corners that are not this far before the eye, of their distance, may be anywhere: small errors of a vertex are large ones on the
/// picture there, and behind the eye there is no place on it. So are errors that are more than this part of the distance.
const MIN_DEPTH: f64 = 0.01;

impl Region {
    /// All of the picture.
    pub fn whole(view: &View) -> Self {
        Self { first_tile: [0; 2], end_tile: tiles(view) }
    }

    /// Where boxes with these corners are in the picture.
    pub fn of_boxes(view: &View, corners: impl IntoIterator<Item = Corner>) -> Self {
        let (right, up, forward) = view.camera.basis();
        let half_size = view.half_size();
        let size_px = DVec2::new(f64::from(view.width), f64::from(view.height));
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for Corner { from_eye, error } in corners {
            let depth = from_eye.dot(forward);
            let least_depth = (MIN_DEPTH * from_eye.length()).max(error / MIN_DEPTH);
            // A NaN is not before the eye.
            if depth.partial_cmp(&least_depth) != Some(Ordering::Greater) {
                return Self::whole(view);
            }
            let px = 0.5 * size_px / (depth * half_size);
            let place = 0.5 * size_px + px * DVec2::new(from_eye.dot(right), -from_eye.dot(up));
            // Off to the side, and off in depth, which moves what is beside the axis in proportion.
            let margin = MARGIN_PX + px * error * (1.0 + from_eye.length() / depth);
            (low, high) = (low.min(place - margin), high.max(place + margin));
        }
        let end = tiles(view);
        let tile_px = f64::from(TILE_SIDE);
        // Without corners, or with all of them beside the picture, the first tile stands for nothing.
        let (first, last) = ((low / tile_px).floor().to_array(), (high / tile_px).ceil().to_array());
        let first_tile = [0, 1].map(|axis| (first[axis].max(0.0) as u32).min(end[axis] - 1));
        let end_tile = [0, 1].map(|axis| (last[axis].max(0.0) as u32).clamp(first_tile[axis] + 1, end[axis]));
        Self { first_tile, end_tile }
    }

    /// Left, top, width and height in sub-pixels of `view`.
    pub fn subpixels(&self, view: &View) -> [u32; 4] {
        let size = [view.width, view.height];
        let first = [0, 1].map(|axis| self.first_tile[axis] * TILE_SIDE);
        let end = [0, 1].map(|axis| (self.end_tile[axis] * TILE_SIDE).min(size[axis]));
        [first[0], first[1], end[0] - first[0], end[1] - first[1]].map(|pixels| pixels * view.subpixels)
    }

    /// Columns and rows of tiles.
    pub fn tiles(&self) -> [u32; 2] {
        [0, 1].map(|axis| self.end_tile[axis] - self.first_tile[axis])
    }
}

/// Columns and rows of tiles of the picture.
fn tiles(view: &View) -> [u32; 2] {
    [view.width, view.height].map(|pixels| pixels.div_ceil(TILE_SIDE))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Camera;

    fn exact(from_eye: DVec3) -> Corner {
        Corner { from_eye, error: 0.0 }
    }

    fn view() -> View {
        let camera = Camera {
            eye: DVec3::new(1.0, 2.0, 3.0),
            target: DVec3::new(0.0, 1.0, -4.0),
            up: DVec3::Y,
            fov_y_deg: 30.0,
        };
        let (width, height, subpixels) = (403, 203, 2);
        View { camera, width, height, subpixels, rotation_deg: 0.0, intensity: 1.0, exposure: 1.0, gamma: 1.0 }
    }

    /// The pixel that sees a point from the eye, if it is before it.
    fn pixel_of(view: &View, point: DVec3) -> Option<DVec2> {
        let (right, up, forward) = view.camera.basis();
        let half_height = 15f64.to_radians().tan();
        let depth = point.dot(forward);
        let [x, y] = [right, up].map(|axis| point.dot(axis) / depth / half_height);
        let height = f64::from(view.height);
        (depth > 0.0).then(|| DVec2::new(x * height / 2.0 + f64::from(view.width) / 2.0, (1.0 - y) * height / 2.0))
    }

    #[test]
    fn each_point_of_a_box_is_in_its_region_and_regions_are_no_larger_than_boxes() {
        let view = view();
        let (mut seen, mut tight) = (0, 0);
        for i in 0..3000 {
            // Boxes of all sizes all around.
            let part = |k: usize| (i * k % 997) as f64 / 997.0;
            let centre = 10.0 * DVec3::new(part(331) - 0.5, part(517) - 0.5, part(709) - 0.7);
            let half = DVec3::new(part(97), part(193), part(389)) * 3.0;
            let corner = |k: usize| {
                centre + half * DVec3::from([0, 1, 2].map(|axis| f64::from((k >> axis & 1) as u8) * 2.0 - 1.0))
            };
            let region = Region::of_boxes(&view, (0..8).map(corner).map(exact));
            let [left, top, width, height] = region.subpixels(&view).map(|subpixels| f64::from(subpixels) / 2.0);
            for k in 0..200 {
                let at = |m: usize| (k * m % 199) as f64 / 99.0 - 1.0;
                let Some(pixel) = pixel_of(&view, centre + half * DVec3::new(at(3), at(17), at(71))) else { continue };
                if pixel.x < 0.0 || pixel.y < 0.0 || pixel.x >= 403.0 || pixel.y >= 203.0 {
                    continue;
                }
                seen += 1;
                let is_within = pixel.x >= left && pixel.y >= top && pixel.x < left + width && pixel.y < top + height;
                assert!(is_within, "{centre} {half}: {pixel} is not in {region:?}");
            }
            let whole = Region::whole(&view);
            if let Some(corners) = (0..8).map(|k| pixel_of(&view, corner(k))).collect::<Option<Vec<_>>>()
                && region != whole
            {
                // A tile, and the margin.
                let low = corners.iter().copied().fold(DVec2::INFINITY, DVec2::min).min(DVec2::new(403.0, 203.0));
                assert!(left + 9.0 >= low.x && top + 9.0 >= low.y, "{centre} {half}: {region:?}");
                tight += 1;
            }
        }
        assert!(seen > 10_000 && tight > 500, "{seen} {tight}");
    }

    #[test]
    fn what_is_behind_the_eye_or_undefined_may_be_anywhere_and_nothing_is_one_tile() {
        let view = view();
        let (_, _, forward) = view.camera.basis();
        let whole = Region::whole(&view);
        assert_eq!((whole.tiles(), whole.subpixels(&view)), ([51, 26], [0, 0, 806, 406]));
        for corners in [vec![forward, -forward], vec![DVec3::ZERO], vec![forward, DVec3::NAN]] {
            assert_eq!(Region::of_boxes(&view, corners.into_iter().map(exact)), whole);
        }
        assert_eq!(Region::of_boxes(&view, [Corner { from_eye: forward, error: 0.02 }]), whole);
        assert_eq!(Region::of_boxes(&view, []).tiles(), [1, 1]);
        // Right of the picture and below it.
        let (right, up, _) = view.camera.basis();
        for beside in [forward + 2.0 * right, forward - 2.0 * up, forward + 2.0 * up, forward - 2.0 * right] {
            let [columns, rows] = Region::of_boxes(&view, [exact(beside)]).tiles();
            assert!(columns == 1 || rows == 1, "{beside}");
        }
    }

    #[test]
    fn where_vertices_may_be_off_there_is_room_for_them() {
        let view = view();
        let (right, up, forward) = view.camera.basis();
        // From edge to edge of a tile, which is 0.021 wide there.
        for (error, step) in
            [0.0, 1e-4, 1e-3, 9e-3].into_iter().flat_map(|error| (0..16).map(move |step| (error, step)))
        {
            let beside = 0.0013 * f64::from(step);
            let at = forward + (0.1 + beside) * right - (0.05 + beside) * up;
            let [left, top, width, height] = Region::of_boxes(&view, [Corner { from_eye: at, error }])
                .subpixels(&view)
                .map(|subpixels| f64::from(subpixels) / 2.0);
            for k in 0..200 {
                let turn = |m: usize| (k * m) as f64;
                let off = DVec3::new(turn(3).sin(), turn(17).cos(), turn(71).sin()).normalize() * error;
                let pixel = pixel_of(&view, at + off).expect("a point before the eye");
                assert!(
                    pixel.x >= left && pixel.x < left + width && pixel.y >= top && pixel.y < top + height,
                    "{error} {pixel}"
                );
            }
        }
    }
}
