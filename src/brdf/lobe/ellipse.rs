//! Azimuths of half vectors that suit a long lobe: those of an ellipse.
use glam::{DVec2, dvec2};

use super::{LobeShape, azimuths_across};

/// What spaces azimuths of the half vector: a ring crosses a long lobe within few degrees of its long axis.
///
/// It is as narrow as the root of the lobe's narrowness: wide rings cross GGX's lobe within that narrowness, in radians, small ones evenly, and
/// the sums over both converge equally fast then.
#[derive(Clone, Copy, Debug)]
pub struct Ellipse {
    narrowness: f64,
    long_axis: DVec2,
}

impl Ellipse {
    /// For this lobe.
    pub fn of(lobe: &LobeShape) -> Self {
        Self { narrowness: lobe.narrowness.sqrt(), long_axis: lobe.long_axis }
    }

    /// The same turned by an angle in radians.
    pub fn turned(self, angle: f64) -> Self {
        Self { long_axis: DVec2::from_angle(angle).rotate(self.long_axis), ..self }
    }

    /// How many azimuths suit it, `least` or more.
    pub fn azimuths(self, least: usize) -> usize {
        azimuths_across(self.narrowness, least)
    }

    /// The direction at the angle of a unit vector of a circle, and by how much steps are wider there than the circle's.
    pub fn of_circle(self, circle: DVec2) -> (DVec2, f64) {
        let point = dvec2(circle.x, self.narrowness * circle.y);
        (self.long_axis.rotate(point.normalize()), self.narrowness / point.length_squared())
    }

    /// The point of the circle, of any length, for a direction of any length.
    pub fn circle_of(self, direction: DVec2) -> DVec2 {
        let point = dvec2(direction.dot(self.long_axis), self.long_axis.perp_dot(direction));
        dvec2(self.narrowness * point.x, point.y)
    }
}
