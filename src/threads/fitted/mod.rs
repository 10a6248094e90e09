//! Fitted threads.
pub mod cells;
pub mod generate;
pub mod kernel;
pub mod lights;
pub mod solve;
mod table;
#[cfg(test)]
mod tests;

pub use generate::generate;
pub use table::{FittedTable, PackedKernel, UnpackedKernel};

/// Most fitted threads that a table can have.
pub const MAX_COUNT: usize = 128;
