//! A BRDF that shaders do not evaluate, as a table over tan(theta_h / 2), tan(theta_d / 2) and |cos phi_d|. Twin: glsl/brdf/tabulated.glsl.
//!
//! Half and difference angles are Rusinkiewicz's (1998). A BRDF that is isotropic, reciprocal and the same in a mirror is a function
//! of |cos phi_d|, since phi_d, phi_d + 180 degrees and -phi_d are then the same. All three coordinates are algebraic: no lookup takes an
//! arc tangent. Nodes lie where coordinates are 0 and 1, so a lobe's peak is a node, and between them
//! - linearly in |cos phi_d|, in which both cosines to the normal are linear, and so the edges of shadows and horizon,
//! - logarithmically in 1 - tan(theta_d / 2) above a knee: near the normal that goes with theta_d, by steps of 3 degrees, and towards grazing
//!   angles with cos theta_d, by whose powers f grows,
//! - logarithmically in tan(theta_h / 2) above a knee in the lobe's width: equally many nodes for each doubling of the angle.
//!
//! What is stored is f (n . w_i + n . w_o) / 2 = f cos theta_h cos theta_d, which stays finite where both directions graze, in
//! half precision. Nodes below the horizon hold what is found above it at the same theta_h and theta_d. How many nodes, and what error
//! they leave: `tabulate.rs`.
//!
//! Of a BRDF that is not reciprocal, as measured ones are not, there are two such tables, one behind the other: for light that is farther
//! from the normal than the view, and for light that is nearer. They hold f (n . w_i), which is what was measured.
use std::f64::consts::LN_2;
use std::sync::Arc;

use glam::{DVec3, Vec3, dvec3};
use half::f16;
use rayon::prelude::*;

use super::{Model, Parameters};
use crate::error::{Error, Result};

/// 1 - tan(theta_d / 2) below which nodes are equally spaced rather than by factors.
const KNEE_THETA_D: f64 = 0.2;

/// Nodes stay this far, in parts of the cosine, from the horizon, where some BRDFs are infinite.
const FROM_HORIZON: f64 = 1e-2;

/// What the greatest value is stored as. Half precision then keeps eleven bits of all that is above a billionth of it.
const GREATEST_TEXEL: f64 = 6e4;

/// A BRDF as shaders look it up. Cheap to clone.
#[derive(Clone)]
pub struct Tabulated {
    /// Values over `scale`, index (|cos phi_d|) + nodes[0] ((cos theta_d) + nodes[1] (tan(theta_h / 2) + nodes[2] side)); the fourth channel
    /// is not used.
    texels: Arc<[[f16; 4]]>,
    grid: Grid,
    /// 1/sr: what a texel of 1 stands for.
    scale: f64,
}

/// Where nodes lie.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Grid {
    /// Along |cos phi_d|, 1 - tan(theta_d / 2) and tan(theta_h / 2); at least two each.
    pub nodes: [usize; 3],
    /// tan(theta_h / 2) below which nodes are equally spaced rather than by factors.
    pub knee: f64,
    /// Whether f stays what it is when light and view change places. Otherwise there is a second side, for light that is nearer to the
    /// normal than the view.
    pub is_reciprocal: bool,
}

impl Grid {
    /// Those of one side.
    pub fn cells(&self) -> usize {
        self.nodes.iter().product()
    }

    fn sides(&self) -> usize {
        if self.is_reciprocal { 1 } else { 2 }
    }

    /// The cosine by which f is multiplied in the table.
    fn cosine(&self, w_i: DVec3, w_o: DVec3) -> f64 {
        if self.is_reciprocal { 0.5 * (w_i.z + w_o.z) } else { w_i.z }
    }

    /// The side of a pair of directions, and its position there in nodes, from 0 to nodes - 1.
    fn position(&self, w_i: DVec3, w_o: DVec3) -> (usize, DVec3) {
        let h = (w_i + w_o).normalize();
        let sin_theta_h = (h.x * h.x + h.y * h.y).sqrt();
        // The azimuth of a half vector at the pole is arbitrary.
        let (x, y) = if sin_theta_h > 0.0 { (h.x / sin_theta_h, h.y / sin_theta_h) } else { (1.0, 0.0) };
        // w_i in a frame with h as its pole.
        let along = h.z * (w_i.x * x + w_i.y * y) - sin_theta_h * w_i.z;
        let across = w_i.y * x - w_i.x * y;
        let square = along * along + across * across;
        let cos_phi_d = if square > 0.0 { along.abs() / square.sqrt() } else { 0.0 };
        let unit = dvec3(
            cos_phi_d.min(1.0),
            logarithmic((1.0 - square.sqrt() / (1.0 + w_i.dot(h))).clamp(0.0, 1.0), KNEE_THETA_D),
            logarithmic((sin_theta_h / (1.0 + h.z)).min(1.0), self.knee),
        );
        let side = usize::from(!self.is_reciprocal && along < 0.0);
        (side, unit * DVec3::from_array(self.nodes.map(|count| (count - 1) as f64)))
    }

    /// The directions w_i and w_o at a node of the first side, moved above the horizon; on the second one they change places.
    fn directions(&self, node: [usize; 3]) -> (DVec3, DVec3) {
        let [p, c, t] = std::array::from_fn(|axis| node[axis] as f64 / (self.nodes[axis] - 1) as f64);
        let half_tangent = 1.0 - exponential(c, KNEE_THETA_D).clamp(1e-3, 1.0);
        let (sin_theta_d, cos_theta_d) = of_half_tangent(half_tangent);
        let tangent = exponential(t, self.knee).min(1.0 - 1e-6);
        let (sin_theta_h, cos_theta_h) = of_half_tangent(tangent);
        // n . w = cos theta_h cos theta_d -+ tan(theta_h / 2) `along`.
        let most = (1.0 - FROM_HORIZON) * cos_theta_h * cos_theta_d / sin_theta_h;
        let along = (sin_theta_d * p).min(most);
        let across = (sin_theta_d * sin_theta_d - along * along).max(0.0).sqrt();
        let direction = |along: f64, across: f64| {
            let x = cos_theta_h * along + sin_theta_h * cos_theta_d;
            dvec3(x, across, cos_theta_h * cos_theta_d - sin_theta_h * along)
        };
        (direction(along, across), direction(-along, -across))
    }
}

/// Sine and cosine of the angle whose half has this tangent.
fn of_half_tangent(tangent: f64) -> (f64, f64) {
    let square = tangent * tangent;
    (2.0 * tangent / (1.0 + square), (1.0 - square) / (1.0 + square))
}

/// 0 to 1 for `x` of 0 to 1: linear below the knee, logarithmic above.
fn logarithmic(x: f64, knee: f64) -> f64 {
    (x / knee).ln_1p() / knee.recip().ln_1p()
}

/// The inverse of [`logarithmic`].
fn exponential(x: f64, knee: f64) -> f64 {
    knee * (x * knee.recip().ln_1p()).exp_m1()
}

impl Tabulated {
    /// Nodes along |cos phi_d| and along 1 - tan(theta_d / 2): of all tables alike, so that an image packs them without gaps.
    pub const NODES: [usize; 2] = [17, 75];

    /// The table of `f` on `grid`.
    pub(super) fn of(f: &(impl Fn(DVec3, DVec3) -> DVec3 + Sync), grid: Grid) -> Self {
        let value = |index: usize| {
            let [columns, rows, layers] = grid.nodes;
            let node = [index % columns, index / columns % rows, index / columns / rows % layers];
            let (lower, higher) = grid.directions(node);
            let (w_i, w_o) = if index < grid.cells() { (lower, higher) } else { (higher, lower) };
            f(w_i, w_o) * grid.cosine(w_i, w_o)
        };
        let values: Vec<DVec3> = (0..grid.sides() * grid.cells()).into_par_iter().map(value).collect();
        let greatest = values.iter().fold(0.0, |greatest: f64, value| greatest.max(value.max_element()));
        // A table that is black has any scale.
        let scale = if greatest > 0.0 { greatest / GREATEST_TEXEL } else { 1.0 };
        let texel = |value: &DVec3| (*value / scale).extend(1.0).to_array().map(f16::from_f64);
        let texels = values.iter().map(texel).collect();
        Self { texels, grid, scale }
    }

    /// Number of texels along x, y and z of a 3D texture: |cos phi_d|, 1 - tan(theta_d / 2), tan(theta_h / 2), of both sides if there are two.
    pub fn size(&self) -> [usize; 3] {
        let [x, y, z] = self.grid.nodes;
        [x, y, z * self.grid.sides()]
    }

    /// The texels, x fastest. Between them one interpolates linearly.
    pub fn texels(&self) -> &Arc<[[f16; 4]]> {
        &self.texels
    }

    /// What glsl/brdf/tabulated.glsl reads of a table whose first texel lies at this y and z in the atlas.
    pub fn parameters_at(&self, [y, z]: [usize; 2]) -> [f32; 12] {
        let Grid { nodes, knee, is_reciprocal } = self.grid;
        let per_doubling = |count: usize, knee: f64| (count - 1) as f64 * LN_2 / knee.recip().ln_1p();
        let numbers = [
            (nodes[0] - 1) as f64,
            per_doubling(nodes[1], KNEE_THETA_D),
            per_doubling(nodes[2], knee),
            2.0 * self.scale,
            KNEE_THETA_D.recip(),
            knee.recip(),
            y as f64,
            z as f64,
            if is_reciprocal { 0.0 } else { nodes[2] as f64 },
        ];
        std::array::from_fn(|i| numbers.get(i).map_or(0.0, |number| *number as f32))
    }
}

impl std::fmt::Debug for Tabulated {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("Tabulated")
            .field("grid", &self.grid)
            .field("scale", &self.scale)
            .finish_non_exhaustive()
    }
}

impl Model for Tabulated {
    const HAS_PARAMETERS: bool = false;

    fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
        let (side, position) = self.grid.position(w_i, w_o);
        let position = position.to_array();
        let [columns, rows, _] = self.grid.nodes;
        let first: [usize; 3] = std::array::from_fn(|axis| (position[axis] as usize).min(self.grid.nodes[axis] - 2));
        let [x, y, z] = std::array::from_fn(|axis| (position[axis] - first[axis] as f64) as f32);
        let start = first[0] + columns * (first[1] + rows * first[2]) + side * self.grid.cells();
        let texel = |place: usize| Vec3::from_slice(&self.texels[place].map(f16::to_f32));
        let line = |offset: usize| texel(start + offset).lerp(texel(start + offset + 1), x);
        let plane = |offset: usize| line(offset).lerp(line(offset + columns), y);
        let value = plane(0).lerp(plane(columns * rows), z);
        value.as_dvec3() * (self.scale / self.grid.cosine(w_i, w_o))
    }

    fn from_parameters(_: &mut Parameters) -> Result<Self> {
        Err(Error::input("model `tabulated`", "is made by the program", "choose another model"))
    }

    fn hash_content(&self, hasher: &mut blake3::Hasher) {
        super::hash_numbers(hasher, [self.scale, self.grid.knee]);
        super::hash_numbers(hasher, self.grid.nodes.map(|count| count as f64));
        super::hash_numbers(hasher, [self.grid.sides() as f64]);
        hasher.update(bytemuck::cast_slice(&self.texels));
    }
}
