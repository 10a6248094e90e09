//! Adaptive quadrature over the sphere: cells are split where that changes the integral most.
use std::collections::BinaryHeap;

use glam::{DVec3, Vec3};
use rustc_hash::{FxBuildHasher, FxHashMap};

use super::light::{CellPlace, FINE_NODES, FIRST_LEVEL, LAST_LEVEL, Light, NODES, NodePlace, interpolate};

/// Room for nodes to start with: few pixels have more.
const USUAL_NODES: usize = 3000;

/// The part of a cell's change that its parts' errors are at least, shared out as their light is: under a lamp, where few nodes
/// count, changes vanish by chance.
const LEAST_LEFT: f64 = 1.0 / 8.0;

/// The part of the greatest `g` at its nodes by which a polynomial may miss one that is 0 on one side of a line through the cell and
/// rises evenly from it on the other.
const MISSED_AT_HORIZON: f64 = 1.0 / 8.0;

/// An estimate of the integral of radiance times `g` over the sphere, that can be made better.
pub struct Cubature<'a, G, H> {
    light: &'a Light<'a>,
    g: G,
    /// Whether a horizon crosses a cell: `g` has a kink there.
    has_horizon: H,
    /// What `g` was found to be at nodes: most are shared by neighbouring cells.
    known: FxHashMap<NodePlace, DVec3>,
    /// The estimate, up to what [`Self::sum`] rounds away.
    pub integral: DVec3,
    /// The sum over cells of the squares of their errors, per channel; the same.
    pub squares: DVec3,
    cells: Vec<Cell>,
    /// How much a cell matters, as the bits of a number that is not negative, and which it is.
    worst: BinaryHeap<(u64, usize)>,
}

/// A cell that is not split yet.
#[derive(Clone, Copy)]
struct Cell {
    place: CellPlace,
    /// The integral over it.
    integral: DVec3,
    /// How much the integral over the cell changed when the cell was made.
    change: DVec3,
    /// Estimated error of the integral over the cell, squared.
    squares: DVec3,
}

impl<'a, G: Fn(&[DVec3]) -> Vec<DVec3>, H: Fn(CellPlace) -> bool> Cubature<'a, G, H> {
    /// The estimate from cells of the first level, each split once, and on while `must_split` says so.
    pub fn new(light: &'a Light, g: G, has_horizon: H, must_split: impl Fn(CellPlace) -> bool) -> Self {
        let (integral, squares) = (DVec3::ZERO, DVec3::ZERO);
        let (known, worst) = (FxHashMap::with_capacity_and_hasher(USUAL_NODES, FxBuildHasher), BinaryHeap::new());
        let mut cubature = Self { light, g, has_horizon, known, integral, squares, cells: vec![], worst };
        let mut waiting: Vec<Cell> = CellPlace::all(FIRST_LEVEL).map(|place| cubature.first_cell(place)).collect();
        while let Some(cell) = waiting.pop() {
            for part in cubature.parts(cell) {
                if part.place.level < LAST_LEVEL && must_split(part.place) {
                    waiting.push(part)
                } else {
                    cubature.keep(part, DVec3::ONE)
                }
            }
        }
        cubature.sum();
        cubature
    }

    /// Sums cells anew. What a split changes is added to sums as long as cells are split, and before a near-mirror and a sun are resolved
    /// they may be 1e16 times what is left in the end.
    pub fn sum(&mut self) {
        (self.integral, self.squares) =
            self.cells.iter().fold((DVec3::ZERO, DVec3::ZERO), |(integral, squares), cell| {
                (integral + cell.integral, squares + cell.squares)
            });
    }

    /// Whether no cell can be split.
    pub fn is_exhausted(&self) -> bool {
        self.worst.is_empty()
    }

    /// Splits the cell that matters most, if one is left, where channels have these weights in the errors' squares.
    pub fn refine(&mut self, channel_weights: DVec3) {
        let Some((_, index)) = self.worst.pop() else { return };
        // It stays in the list, as nothing.
        let cell = self.cells[index];
        (self.cells[index].integral, self.cells[index].squares) = (DVec3::ZERO, DVec3::ZERO);
        self.integral -= cell.integral;
        self.squares = (self.squares - cell.squares).max(DVec3::ZERO);
        for part in self.parts(cell) {
            self.integral += part.integral;
            self.squares += part.squares;
            self.keep(part, channel_weights);
        }
    }

    /// How many cells there are.
    pub fn len(&self) -> usize {
        self.cells.len()
    }

    /// How often `g` was evaluated.
    pub fn evaluations(&self) -> usize {
        self.known.len()
    }

    fn first_cell(&mut self, place: CellPlace) -> Cell {
        let values = self.values(place.nodes::<NODES>());
        let weights = self.light.weights(place);
        let values = values.as_flattened();
        let integral = weights.iter().zip(values).map(|(weight, value)| weight.as_dvec3() * *value).sum();
        Cell { place, integral, change: DVec3::ZERO, squares: DVec3::ZERO }
    }

    /// Splits a cell: the estimate changes by what its polynomial misses at the new nodes, and that is the parts' error (F37).
    fn parts(&mut self, cell: Cell) -> [Cell; 4] {
        let values = self.values(cell.place.nodes::<FINE_NODES>());
        let interpolated = interpolate(&values);
        let weights = cell.place.parts().map(|part| self.light.weights(part).map(Vec3::as_dvec3));
        let light = weights.map(|weights| weights.iter().map(|weight| weight.abs()).sum::<DVec3>());
        let whole_light = light.iter().sum::<DVec3>().max(DVec3::splat(f64::MIN_POSITIVE));
        let mut part = 0;
        cell.place.parts().map(|place| {
            let (left, top) = (part % 2 * (NODES - 1), part / 2 * (NODES - 1));
            let (mut integral, mut change, mut most) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
            for (i, weight) in weights[part].iter().enumerate() {
                let (row, column) = (top + i / NODES, left + i % NODES);
                integral += *weight * values[row][column];
                most = most.max(values[row][column]);
                // What cancels here by chance may not do so within the part.
                change += (*weight * (values[row][column] - interpolated[row][column])).abs();
            }
            let missed = if (self.has_horizon)(place) { MISSED_AT_HORIZON * light[part] * most } else { DVec3::ZERO };
            let error = change.max(LEAST_LEFT * light[part] / whole_light * cell.change).max(missed);
            part += 1;
            Cell { place, integral, change, squares: error * error }
        })
    }

    /// `g` at nodes.
    fn values<const N: usize>(&mut self, nodes: [[(NodePlace, DVec3); N]; N]) -> [[DVec3; N]; N] {
        let mut values = [[DVec3::ZERO; N]; N];
        let (mut new, mut directions) = (Vec::with_capacity(N * N), Vec::with_capacity(N * N));
        for ((place, direction), value) in nodes.as_flattened().iter().zip(values.as_flattened_mut()) {
            match self.known.get(place) {
                Some(known) => *value = *known,
                None => {
                    new.push((*place, value));
                    directions.push(*direction);
                }
            }
        }
        for ((place, value), found) in new.into_iter().zip((self.g)(&directions)) {
            *value = found;
            self.known.insert(place, found);
        }
        values
    }

    fn keep(&mut self, cell: Cell, channel_weights: DVec3) {
        let matters = cell.squares.dot(channel_weights);
        if matters > 0.0 && cell.place.level < LAST_LEVEL {
            self.worst.push((matters.to_bits(), self.cells.len()));
        }
        self.cells.push(cell);
    }
}
