//! An anisotropic BRDF that shaders do not evaluate, as a table over half and difference vectors. Twin: glsl/brdf/tabulated_anisotropic.glsl.
//!
//! x is the lobe's long axis. The half vector is given by tan(theta_h / 2) (cos phi_h, sin phi_h), each coordinate on a logarithmic axis of
//! its own, with a knee in the lobe's width along it: so a long lobe has as many nodes across as along. Light is given by the difference vector d, w_i in the
//! frame of h, to which the shading frame is brought by the least rotation that takes n to h: unlike one about n and one across it, it is
//! continuous where h is n. The axes of d are tan(theta_d / 2), as in `tabulated.rs`, and phi_d as d_x / (|d_x| + |d_y|). No lookup takes an
//! arc tangent.
//!
//! f is the same for d and -d where it is reciprocal, so d_y is not negative. If it is not there is a second side, for d_y that is negative. What
//! is stored, and nodes below the horizon: as in `tabulated.rs`.
//!
//! Texels have four dimensions in an image of three: for each node along h_y there is a slab of phi_d x theta_d x h_x. Three slabs lie side by side
//! along y, where [`MADE_TABLE_SIZE`] has room for them, the rest behind them.
use glam::{DVec2, DVec3, dvec2, dvec3};

use crate::brdf::made_table::{
    FROM_HORIZON, KNEE_THETA_D, MADE_TABLE_SIZE, MadeTable, around, exponential, logarithmic, nodes_per_doubling,
    of_half_tangent, stored_cosine,
};
use crate::brdf::{Model, Parameters};
use crate::error::{Error, Result};

/// Slabs side by side.
pub(crate) const SLABS: usize = 3;

/// Nodes along tan(theta_d / 2).
const ROWS: usize = MADE_TABLE_SIZE[1] / SLABS;

const _: () = {
    use crate::shader_constants::tabulated_anisotropic as glsl;
    assert!(glsl::LAST_COLUMN == (MADE_TABLE_SIZE[0] - 1) as f32 && glsl::ROWS == ROWS as f32);
    assert!(glsl::SLABS == SLABS as f32 && glsl::RECIPROCAL_KNEE as f64 * KNEE_THETA_D == 1.0);
};

/// A BRDF as shaders look it up. Cheap to clone.
#[derive(Clone, Debug)]
pub struct TabulatedAnisotropic {
    table: MadeTable,
    grid: AnisotropicGrid,
}

/// Where nodes lie.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AnisotropicGrid {
    /// Along h_x, and along h_y: an odd multiple of [`SLABS`], so that h = n is a node.
    pub tangents: usize,
    /// tan(theta_h / 2) below which nodes are equally spaced rather than by factors: along h_x and h_y.
    pub knees: [f64; 2],
    /// Of the lobe, from the tangent: x of the table.
    pub long_axis: DVec2,
    /// Whether f stays what it is when light and view change places.
    pub is_reciprocal: bool,
}

impl AnisotropicGrid {
    fn sides(&self) -> usize {
        if self.is_reciprocal { 1 } else { 2 }
    }

    /// Texels of a side along z.
    fn layers(&self) -> usize {
        self.tangents * self.tangents / SLABS
    }

    /// The side of a pair of directions, and its position there in nodes: along phi_d, theta_d, h_x and h_y.
    fn position(&self, w_i: DVec3, w_o: DVec3) -> (usize, [f64; 4]) {
        let own =
            |w: DVec3| DVec2::new(self.long_axis.dot(w.truncate()), self.long_axis.perp_dot(w.truncate())).extend(w.z);
        let (w_i, w_o) = (own(w_i), own(w_o));
        let h = (w_i + w_o).normalize();
        let cos_theta_d = w_i.dot(h);
        let tangent = h.truncate() / (1.0 + h.z);
        let d = w_i.truncate() - (w_i.z + cos_theta_d) * tangent;
        let is_turned = d.y < 0.0;
        let d = if is_turned { -d } else { d };
        let sum = d.x.abs() + d.y;
        let phi_d = if sum > 0.0 { 0.5 - 0.5 * d.x / sum } else { 0.5 };
        let theta_d = logarithmic((1.0 - d.length() / (1.0 + cos_theta_d)).clamp(0.0, 1.0), KNEE_THETA_D);
        let middle = (self.tangents / 2) as f64;
        let along = |t: f64, knee: f64| middle + middle * logarithmic(t.abs().min(1.0), knee).copysign(t);
        let [columns, rows] = [MADE_TABLE_SIZE[0], ROWS].map(|count| (count - 1) as f64);
        let [knee_x, knee_y] = self.knees;
        let position = [columns * phi_d, rows * theta_d, along(tangent.x, knee_x), along(tangent.y, knee_y)];
        (usize::from(is_turned && !self.is_reciprocal), position)
    }

    /// The directions w_i and w_o at a node of the first side, moved above the horizon; on the second one they change places.
    fn directions(&self, node: [usize; 4]) -> (DVec3, DVec3) {
        let unit = |axis: usize, count: usize| node[axis] as f64 / (count - 1) as f64;
        let half_tangent = 1.0 - exponential(unit(1, ROWS), KNEE_THETA_D).clamp(1e-3, 1.0);
        let (sin_theta_d, cos_theta_d) = of_half_tangent(half_tangent);
        let along = |axis: usize| {
            let u = 2.0 * unit(axis, self.tangents) - 1.0;
            exponential(u.abs(), self.knees[axis - 2]).copysign(u)
        };
        let tangent = dvec2(along(2), along(3)).clamp_length_max(1.0 - 1e-6);
        let (sin_theta_h, cos_theta_h) = of_half_tangent(tangent.length());
        // The azimuth of a half vector at the pole is arbitrary.
        let azimuth = tangent.normalize_or(DVec2::X);
        // d_x / (|d_x| + |d_y|).
        let c = 1.0 - 2.0 * unit(0, MADE_TABLE_SIZE[0]);
        let d = sin_theta_d * dvec2(c, 1.0 - c.abs()).normalize();
        // n . w = cos theta_h cos theta_d -+ sin theta_h (d along the azimuth of h).
        let most = (1.0 - FROM_HORIZON) * cos_theta_h * cos_theta_d / sin_theta_h;
        let (radial, across) = (d.dot(azimuth), azimuth.perp_dot(d));
        let radial_above = radial.clamp(-most, most);
        let across_above = (sin_theta_d * sin_theta_d - radial_above * radial_above).max(0.0).sqrt().copysign(across);
        let direction = |radial: f64, across: f64| {
            let x = cos_theta_h * radial + sin_theta_h * cos_theta_d;
            let in_plane = x * azimuth + across * azimuth.perp();
            // Back to the shading frame.
            self.long_axis.rotate(in_plane).extend(cos_theta_h * cos_theta_d - sin_theta_h * radial)
        };
        (direction(radial_above, across_above), direction(-radial_above, -across_above))
    }
}

impl TabulatedAnisotropic {
    /// The table of `f` on `grid`.
    pub(crate) fn of(f: &(impl Fn(DVec3, DVec3) -> DVec3 + Sync), grid: AnisotropicGrid) -> Self {
        let [columns, rows] = MADE_TABLE_SIZE;
        let (tangents, layers) = (grid.tangents, grid.layers());
        let value = |index: usize| {
            let (row, layer) = (index / columns % rows, index / columns / rows);
            let (side, layer) = (layer / layers, layer % layers);
            let h_y = SLABS * (layer / tangents) + row / ROWS;
            let (lower, higher) = grid.directions([index % columns, row % ROWS, layer % tangents, h_y]);
            let (w_i, w_o) = if side == 0 { (lower, higher) } else { (higher, lower) };
            f(w_i, w_o) * stored_cosine(w_i, w_o, grid.is_reciprocal)
        };
        Self { table: MadeTable::of(grid.sides() * columns * rows * layers, value), grid }
    }

    /// What shaders look up.
    pub(crate) fn table(&self) -> &MadeTable {
        &self.table
    }

    /// What glsl/brdf/tabulated_anisotropic.glsl reads of a table whose first texel lies at this y and z in the atlas.
    pub(crate) fn parameters_at(&self, [y, z]: [usize; 2]) -> [f32; 12] {
        let AnisotropicGrid { tangents, knees, long_axis, is_reciprocal } = self.grid;
        let [per_doubling_x, per_doubling_y] = knees.map(|knee| nodes_per_doubling(tangents / 2 + 1, knee));
        [
            long_axis.x,
            long_axis.y,
            per_doubling_x,
            per_doubling_y,
            knees[0].recip(),
            knees[1].recip(),
            y as f64,
            z as f64,
            if is_reciprocal { 0.0 } else { self.grid.layers() as f64 },
            (tangents / 2) as f64,
            nodes_per_doubling(ROWS, KNEE_THETA_D),
            2.0 * self.table.scale,
        ]
        .map(|number| number as f32)
    }
}

impl Model for TabulatedAnisotropic {
    const HAS_PARAMETERS: bool = false;

    fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
        let (side, [phi_d, theta_d, h_x, h_y]) = self.grid.position(w_i, w_o);
        let AnisotropicGrid { tangents, is_reciprocal, .. } = self.grid;
        let (x, x_part) = around(phi_d, MADE_TABLE_SIZE[0]);
        let (y, y_part) = around(theta_d, ROWS);
        let (z, z_part) = around(h_x, tangents);
        let (slab, slab_part) = around(h_y, tangents);
        let part = dvec3(x_part, y_part, z_part).as_vec3();
        let of_slab = |slab: usize| {
            let layer = z + tangents * (slab / SLABS) + side * self.grid.layers();
            self.table.between([x, y + ROWS * (slab % SLABS), layer], part)
        };
        of_slab(slab).lerp(of_slab(slab + 1), slab_part) / stored_cosine(w_i, w_o, is_reciprocal)
    }

    fn from_parameters(_: &mut Parameters) -> Result<Self> {
        Err(Error::input("model `tabulated_anisotropic`", "is made by the program", "choose another model"))
    }

    fn hash_content(&self, hasher: &mut blake3::Hasher) {
        let AnisotropicGrid { tangents, knees, long_axis, is_reciprocal } = self.grid;
        let numbers =
            [tangents as f64, knees[0], knees[1], long_axis.x, long_axis.y, f64::from(u8::from(is_reciprocal))];
        crate::brdf::hash_numbers(hasher, numbers);
        self.table.hash_content(hasher);
    }
}
