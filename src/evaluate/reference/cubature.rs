//! Adaptive quadrature over the sphere: cells are split where that changes the integral most.
use std::collections::BinaryHeap;

use glam::DVec3;

use super::light::{CELL_NODES, CellPlace, FINE_NODES, FIRST_LEVEL, LAST_LEVEL, Light, NODES, interpolate};

/// An estimate of the integral of radiance times `g` over the sphere, that can be made better.
pub struct Cubature<'a, G> {
    light: &'a Light<'a>,
    g: G,
    /// The estimate.
    pub integral: DVec3,
    /// The sum over cells of the squares of their errors, per channel.
    pub squares: DVec3,
    /// How often `g` was evaluated.
    pub evaluations: u64,
    cells: Vec<Cell>,
    /// How much a cell matters, as the bits of a number that is not negative, and which it is.
    worst: BinaryHeap<(u64, usize)>,
}

/// A cell that is not split yet.
struct Cell {
    place: CellPlace,
    /// g at the nodes.
    values: [DVec3; CELL_NODES],
    /// Estimated error of the integral over the cell, squared.
    squares: DVec3,
}

impl<'a, G: Fn(DVec3) -> DVec3> Cubature<'a, G> {
    /// The estimate from cells of the first level, each split once, and on while `must_split` says so.
    pub fn new(light: &'a Light, g: G, must_split: impl Fn(CellPlace) -> bool) -> Self {
        let (integral, squares) = (DVec3::ZERO, DVec3::ZERO);
        let mut cubature =
            Self { light, g, integral, squares, evaluations: 0, cells: vec![], worst: BinaryHeap::new() };
        let mut waiting: Vec<Cell> = CellPlace::all(FIRST_LEVEL).map(|place| cubature.first_cell(place)).collect();
        while let Some(cell) = waiting.pop() {
            cubature.squares -= cell.squares;
            for part in cubature.parts(&cell) {
                if must_split(part.place) { waiting.push(part) } else { cubature.keep(part, DVec3::ONE) }
            }
        }
        cubature
    }

    /// Splits the cell that matters most, where channels have these weights in the errors' squares; whether there was one left.
    pub fn refine(&mut self, channel_weights: DVec3) -> bool {
        let Some((_, index)) = self.worst.pop() else { return false };
        // Its place is taken by one of its parts.
        let cell = std::mem::replace(&mut self.cells[index].squares, DVec3::ZERO);
        self.squares = (self.squares - cell).max(DVec3::ZERO);
        let (place, values) = (self.cells[index].place, self.cells[index].values);
        for part in self.parts(&Cell { place, values, squares: DVec3::ZERO }) {
            self.keep(part, channel_weights);
        }
        true
    }

    /// How many cells there are.
    pub fn len(&self) -> usize {
        self.cells.len()
    }

    fn first_cell(&mut self, place: CellPlace) -> Cell {
        let directions = place.directions::<NODES>();
        let values = std::array::from_fn(|i| (self.g)(directions[i / NODES][i % NODES]));
        let weights = self.light.weights(place);
        self.integral += weights.iter().zip(&values).map(|(weight, value)| weight.as_dvec3() * *value).sum::<DVec3>();
        self.evaluations += CELL_NODES as u64;
        Cell { place, values, squares: DVec3::ZERO }
    }

    /// Splits `cell`: the estimate changes by what its polynomial misses at the new nodes, and that is the parts' error.
    fn parts(&mut self, cell: &Cell) -> [Cell; 4] {
        let mut values = interpolate(&cell.values);
        let mut missed = [[DVec3::ZERO; FINE_NODES]; FINE_NODES];
        for (j, row) in cell.place.directions::<FINE_NODES>().iter().enumerate() {
            for (i, direction) in row.iter().enumerate() {
                // The others are nodes of the cell itself.
                if i % 2 == 1 || j % 2 == 1 {
                    let value = (self.g)(*direction);
                    missed[j][i] = value - values[j][i];
                    values[j][i] = value;
                }
            }
        }
        self.evaluations += (FINE_NODES * FINE_NODES - CELL_NODES) as u64;
        let mut part = 0;
        cell.place.parts().map(|place| {
            let (left, top) = (part % 2 * (NODES - 1), part / 2 * (NODES - 1));
            part += 1;
            let mut error = DVec3::ZERO;
            for (i, weight) in self.light.weights(place).iter().enumerate() {
                let change = weight.as_dvec3() * missed[top + i / NODES][left + i % NODES];
                self.integral += change;
                // What cancels here by chance may not do so within the part.
                error += change.abs();
            }
            let squares = error * error;
            self.squares += squares;
            Cell { place, values: std::array::from_fn(|i| values[top + i / NODES][left + i % NODES]), squares }
        })
    }

    fn keep(&mut self, cell: Cell, channel_weights: DVec3) {
        let matters = cell.squares.dot(channel_weights);
        if matters > 0.0 && cell.place.level < LAST_LEVEL {
            self.worst.push((matters.to_bits(), self.cells.len()));
        }
        self.cells.push(cell);
    }
}
