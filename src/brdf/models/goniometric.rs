//! A measured BRDF as a table over the angles of light and view to the normal, the azimuth between them, and that of the light.
//!
//! What goniometers measure. Between nodes f is linear in each of the four angles; nodes that were not measured have no weight. Beyond
//! the first and the last angle to the normal it is as there. Since one of the azimuths is that between light and view, what does not
//! change when the material is turned is exactly so between nodes too, and a highlight keeps its shape from node to node. f is reciprocal
//! only as far as measured.
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use glam::{DVec3, Vec3, Vec4};

use crate::brdf::models::MOST_MEASURED;
use crate::brdf::{Model, Parameters, theta};
use crate::error::{Error, Result};

/// A measured BRDF. Cheap to clone.
#[derive(Clone)]
pub struct Goniometric {
    /// (rgb, 1), or zeros where nothing was measured; index turn + turns (azimuth + azimuths (theta_o + thetas (theta_i))).
    nodes: Arc<[Vec4]>,
    axes: Axes,
    fingerprint: blake3::Hash,
}

/// The angles of a table, in radians. Azimuths are counter-clockwise, seen from outside.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Axes {
    /// To the normal, of light and of view.
    pub thetas: Nodes,
    /// From the light to the view: all around, or to pi only. Beyond, light and view change places.
    pub azimuths: Nodes,
    /// From the tangent to the light: all around.
    pub turns: Nodes,
}

/// Nodes of an angle, in radians, at equal steps.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nodes {
    pub count: usize,
    pub first: f64,
    pub step: f64,
    /// Whether the first comes after the last.
    pub is_circle: bool,
}

impl Nodes {
    /// Those at the middles of `count` bins, from 0 to pi / 2 or to pi.
    pub fn of_bins(count: usize, range: f64) -> Self {
        let step = range / count as f64;
        Self { count, first: 0.5 * step, step, is_circle: false }
    }

    /// The same all around.
    pub fn of_bins_around(count: usize) -> Self {
        Self { is_circle: true, ..Self::of_bins(count, TAU) }
    }

    /// The node before `angle` and the one after, and the weight of each; beyond the ends both are the same.
    fn around(&self, angle: f64) -> [(usize, f32); 2] {
        let position = (angle - self.first) / self.step;
        let position = match self.is_circle {
            true => position.rem_euclid(self.count as f64),
            false => position.clamp(0.0, (self.count - 1) as f64),
        };
        let low = position as usize;
        let weight = (position - low as f64) as f32;
        let node = |node: usize| if self.is_circle { node % self.count } else { node.min(self.count - 1) };
        [(node(low), 1.0 - weight), (node(low + 1), weight)]
    }
}

impl Goniometric {
    /// The table of what was measured at the nodes of theta_i, theta_o, azimuth and turn; what is negative counts as
    /// 0. The error is that all is black, or nothing was measured.
    pub(crate) fn of(axes: Axes, measured: impl Fn([usize; 4]) -> Option<Vec3>) -> Result<Self, String> {
        let [thetas, azimuths, turns] = [axes.thetas, axes.azimuths, axes.turns].map(|nodes| nodes.count);
        let value = |index: usize| {
            let line = index / turns;
            let node = [line / azimuths / thetas, line / azimuths % thetas, line % azimuths, index % turns];
            measured(node).map_or(Vec4::ZERO, |rgb| rgb.clamp(Vec3::ZERO, Vec3::splat(MOST_MEASURED)).extend(1.0))
        };
        let nodes: Arc<[Vec4]> = (0..thetas * thetas * azimuths * turns).map(value).collect();
        if !nodes.iter().any(|node| node.truncate().max_element() > 0.0) {
            return Err("holds nothing but zero or invalid cells".into());
        }
        let mut hasher = blake3::Hasher::new();
        crate::brdf::hash_numbers(&mut hasher, nodes.iter().flat_map(|node| node.to_array()).map(f64::from));
        for Nodes { count, first, step, is_circle } in [axes.thetas, axes.azimuths, axes.turns] {
            crate::brdf::hash_numbers(&mut hasher, [count as f64, first, step, f64::from(u8::from(is_circle))]);
        }
        Ok(Self { nodes, axes, fingerprint: hasher.finalize() })
    }
}

impl std::fmt::Debug for Goniometric {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("Goniometric").field("fingerprint", &self.fingerprint).finish_non_exhaustive()
    }
}

impl Model for Goniometric {
    const HAS_PARAMETERS: bool = false;

    fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
        let Axes { thetas, azimuths, turns } = self.axes;
        // Of a direction along the normal the azimuth is arbitrary; here it is 0.
        let phi = |w: DVec3| w.y.atan2(w.x);
        let between = |w_i: DVec3, w_o: DVec3| (phi(w_o) - phi(w_i)).rem_euclid(TAU);
        let is_missing = between(w_i, w_o) > PI && !azimuths.is_circle;
        let (w_i, w_o) = if is_missing { (w_o, w_i) } else { (w_i, w_o) };

        let theta = |w: DVec3| thetas.around(theta(w));
        let (theta_i, theta_o) = (theta(w_i), theta(w_o));
        let (azimuth, turn) = (azimuths.around(between(w_i, w_o)), turns.around(phi(w_i)));
        let mut sum = Vec4::ZERO;
        for (i, weight_i) in theta_i {
            for (o, weight_o) in theta_o {
                for (azimuth, weight_azimuth) in azimuth {
                    let line = turns.count * (azimuth + azimuths.count * (o + thetas.count * i));
                    let [first, second] = turn.map(|(turn, weight)| weight * self.nodes[line + turn]);
                    sum += weight_i * weight_o * weight_azimuth * (first + second);
                }
            }
        }
        if sum.w > 0.0 { sum.truncate().as_dvec3() / f64::from(sum.w) } else { DVec3::ZERO }
    }

    fn is_reciprocal(&self) -> bool {
        false
    }

    fn from_parameters(_: &mut Parameters) -> Result<Self> {
        let remedy = "name the file with file = \"....dat\" or \"....bin\" instead";
        Err(Error::input("model `goniometric`", "has no parameters", remedy))
    }

    fn hash_content(&self, hasher: &mut blake3::Hasher) {
        hasher.update(self.fingerprint.as_bytes());
    }
}
