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
use glam::{DVec3, dvec3};

use crate::brdf::made_table::{
    FROM_HORIZON, KNEE_THETA_D, MADE_TABLE_SIZE, MadeTable, around, exponential, logarithmic, nodes_per_doubling,
    of_half_tangent, stored_cosine,
};
use crate::brdf::{Model, Parameters};
use crate::error::{Error, Result};

/// A BRDF as shaders look it up. Cheap to clone.
#[derive(Clone, Debug)]
pub struct Tabulated {
    /// f (n . w_i + n . w_o) / 2 in 1/sr; index (|cos phi_d|) + 17 ((1 - tan(theta_d / 2)) + 75 (tan(theta_h / 2) + tangents side)).
    table: MadeTable,
    grid: Grid,
}

/// Where nodes lie: [`MADE_TABLE_SIZE`] along |cos phi_d| and 1 - tan(theta_d / 2).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Grid {
    /// Nodes along tan(theta_h / 2), at least two.
    pub tangents: usize,
    /// tan(theta_h / 2) below which nodes are equally spaced rather than by factors.
    pub knee: f64,
    /// Whether f stays what it is when light and view change places. Otherwise there is a second side, for light that is nearer to the
    /// normal than the view.
    pub is_reciprocal: bool,
}

impl Grid {
    fn sides(&self) -> usize {
        if self.is_reciprocal { 1 } else { 2 }
    }

    fn nodes(&self) -> [usize; 3] {
        let [columns, rows] = MADE_TABLE_SIZE;
        [columns, rows, self.tangents]
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
        (side, unit * DVec3::from_array(self.nodes().map(|count| (count - 1) as f64)))
    }

    /// The directions w_i and w_o at a node of the first side, moved above the horizon; on the second one they change places.
    fn directions(&self, node: [usize; 3]) -> (DVec3, DVec3) {
        let nodes = self.nodes();
        let [p, c, t] = std::array::from_fn(|axis| node[axis] as f64 / (nodes[axis] - 1) as f64);
        let half_tangent = 1.0 - exponential(c, KNEE_THETA_D).clamp(1e-3, 1.0);
        let (sin_theta_d, cos_theta_d) = of_half_tangent(half_tangent);
        let tangent = exponential(t, self.knee).min(1.0 - 1e-6);
        let (sin_theta_h, cos_theta_h) = of_half_tangent(tangent);
        // n . w = cos theta_h cos theta_d -+ sin theta_h `along`.
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

impl Tabulated {
    /// The table of `f` on `grid`.
    pub(crate) fn of(f: &(impl Fn(DVec3, DVec3) -> DVec3 + Sync), grid: Grid) -> Self {
        let [columns, rows, layers] = grid.nodes();
        let value = |index: usize| {
            let (side, layer) = (index / columns / rows / layers, index / columns / rows % layers);
            let (lower, higher) = grid.directions([index % columns, index / columns % rows, layer]);
            let (w_i, w_o) = if side == 0 { (lower, higher) } else { (higher, lower) };
            f(w_i, w_o) * stored_cosine(w_i, w_o, grid.is_reciprocal)
        };
        Self { table: MadeTable::of(grid.sides() * columns * rows * layers, value), grid }
    }

    /// What shaders look up.
    pub(crate) fn table(&self) -> &MadeTable {
        &self.table
    }

    /// What glsl/brdf/tabulated.glsl reads of a table whose first texel lies at this y and z in the atlas.
    pub(crate) fn parameters_at(&self, [y, z]: [usize; 2]) -> [f32; 12] {
        let Grid { tangents, knee, is_reciprocal } = self.grid;
        let [columns, rows] = MADE_TABLE_SIZE;
        let numbers = [
            (columns - 1) as f64,
            nodes_per_doubling(rows, KNEE_THETA_D),
            nodes_per_doubling(tangents, knee),
            2.0 * self.table.scale,
            KNEE_THETA_D.recip(),
            knee.recip(),
            y as f64,
            z as f64,
            if is_reciprocal { 0.0 } else { tangents as f64 },
        ];
        std::array::from_fn(|i| numbers.get(i).map_or(0.0, |number| *number as f32))
    }
}

impl Model for Tabulated {
    const HAS_PARAMETERS: bool = false;

    fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
        let (side, position) = self.grid.position(w_i, w_o);
        let [(x, x_part), (y, y_part), (z, z_part)] = {
            let (position, nodes) = (position.to_array(), self.grid.nodes());
            std::array::from_fn(|axis| around(position[axis], nodes[axis]))
        };
        let part = dvec3(x_part, y_part, z_part).as_vec3();
        let value = self.table.between([x, y, z + side * self.grid.tangents], part);
        value / stored_cosine(w_i, w_o, self.grid.is_reciprocal)
    }

    fn from_parameters(_: &mut Parameters) -> Result<Self> {
        Err(Error::input("model `tabulated`", "is made by the program", "choose another model"))
    }

    fn hash_content(&self, hasher: &mut blake3::Hasher) {
        let Grid { tangents, knee, is_reciprocal } = self.grid;
        crate::brdf::hash_numbers(hasher, [tangents as f64, knee, f64::from(u8::from(is_reciprocal))]);
        self.table.hash_content(hasher);
    }
}
