//! Where the lobe of a BRDF may be, and how narrow it is there: so that no cell of the quadrature hides it between its nodes.
use std::f64::consts::FRAC_PI_2;

use glam::{DVec2, DVec3};

use crate::brdf::{Brdf, LobeShape, MAX_THETA_O_DEG, lobe_radius, theta};

/// View angles at which lobes are looked for: some models have them at grazing views only.
const VIEWS_DEG: [f64; 8] = [0.0, 30.0, 60.0, 75.0, 85.0, 88.0, 89.5, MAX_THETA_O_DEG];

/// A long lobe is followed along its arc for so many of its lengths: of GGX's, which has the longest tails, 0.2 % is beyond.
const LENGTHS: f64 = 16.0;

/// Below this cosine of the view, at 75 degrees and beyond, any lobe is a long one to directions: across the plane of incidence they move
/// by cos theta_d of what they do within it.
const GRAZING_COS: f64 = 0.26;

/// The least cosine between light and half vector: half of that of the last view, where the light is on the horizon.
const LEAST_COS_THETA_D: f64 = 8e-5;

/// What is so many half edges from the middle of a cell counts as in it: a lobe beside a cell is in it in part.
const NEARLY: f64 = 2.0;

/// The half vectors of a lobe: about the normal, or of an anisotropic BRDF about an arc through the normal.
pub struct Lobe {
    /// The radius at each of [`VIEWS_DEG`], in radians.
    radii: [f64; VIEWS_DEG.len()],
    is_isotropic: bool,
    /// The width across the long axis over the one along it.
    narrowness: f64,
    /// In the tangent plane, a unit vector.
    long_axis: DVec2,
    /// The tangent of the arc's angle to the normal where it ends: 0 of an isotropic BRDF.
    most_slope: f64,
}

impl Lobe {
    pub fn of(brdf: &Brdf) -> Self {
        let LobeShape { is_isotropic, narrowness, long_axis, .. } = LobeShape::of(brdf);
        let radii = VIEWS_DEG.map(|theta_o_deg| lobe_radius(brdf, theta_o_deg.to_radians()));
        let narrowest = radii.iter().copied().fold(FRAC_PI_2, f64::min);
        let most_slope = if is_isotropic { 0.0 } else { LENGTHS * narrowest / narrowness };
        Self { radii, is_isotropic, narrowness, long_axis, most_slope }
    }

    /// It as seen from unit `w_o`, which is in the frame of the surface: with the least radius at the view angles beside that of `w_o`.
    pub fn seen_from(&self, w_o: DVec3) -> SeenLobe {
        let Self { radii, is_isotropic, narrowness, long_axis, most_slope } = *self;
        let theta_o_deg = theta(w_o).to_degrees();
        let next = VIEWS_DEG.iter().position(|&view| view > theta_o_deg).unwrap_or(VIEWS_DEG.len() - 1);
        let radius = radii[next].min(radii[next - 1]);
        let (long_axis, most_slope) = match is_isotropic && w_o.z <= GRAZING_COS {
            // In the plane of incidence.
            true => (w_o.truncate().normalize(), LENGTHS * radius),
            false => (long_axis, most_slope),
        };
        SeenLobe { w_o, radius, is_isotropic, narrowness, long_axis, most_slope }
    }
}

/// A lobe as a view sees it: the directions that its half vectors mirror the view into.
pub struct SeenLobe {
    w_o: DVec3,
    /// Of half vectors, in radians.
    radius: f64,
    is_isotropic: bool,
    narrowness: f64,
    long_axis: DVec2,
    /// The tangent of the arc's angle to the normal where it ends: 0 of a lobe that is not followed.
    most_slope: f64,
}

impl SeenLobe {
    /// Whether part of it may hide between the nodes of a cell: the cell is wider than the lobe, and holds part of it, or nearly so.
    /// `middle` is that of the cell, and `half_edges` go from there to the middles of two edges; all in the frame of the surface.
    pub fn may_hide(&self, middle: DVec3, half_edges: [DVec3; 2]) -> bool {
        let Self { is_isotropic, narrowness, long_axis, most_slope, .. } = *self;
        // Along the half vector. In the lobe it has nothing across the long axis, and not too much along it.
        let sum = middle + self.w_o;
        // How far a coordinate goes from the middle of the cell to its edges, with the curvature of the sphere.
        let sagitta = 0.5 * half_edges.map(DVec3::length_squared).iter().sum::<f64>();
        let spread = |axis: DVec3| {
            half_edges.map(|edge| edge.dot(axis).abs()).iter().sum::<f64>() + sagitta * middle.dot(axis).abs()
        };
        let [along, across] = [long_axis, long_axis.perp()].map(|axis| axis.extend(0.0));
        let [along_spread, across_spread, up_spread] = [along, across, DVec3::Z].map(spread);
        let nearest = (sum.dot(along).abs() - NEARLY * along_spread).max(0.0);
        let highest = sum.z + NEARLY * up_spread;
        let holds_it = middle.z + NEARLY * up_spread > 0.0
            && sum.dot(across).abs() < NEARLY * across_spread
            && nearest <= most_slope * highest;
        if !holds_it {
            return false;
        }
        // Reflection doubles angles, but across the plane of incidence shrinks them by the cosine.
        let cos_theta_d = (0.5 * sum.length()).max(LEAST_COS_THETA_D);
        // Tails widen as they fall: GGX's are as wide as contours of 1 + (h_x / alpha_x)^2 + (h_y / alpha_y)^2.
        let radius = self.radius.max(narrowness * nearest / highest);
        let widest = if is_isotropic { across_spread.max(along_spread) } else { across_spread };
        widest > radius * cos_theta_d
    }
}
