//! Fitted threads: kernels of the environment's pyramid that answer any light as the BRDF does.
//!
//! | | module |
//! |---|---|
//! | kernels, and how they overlap lights | [`kernel`] |
//! | the lights that they are fitted to | [`lights`] |
//! | the directions that Gaussians are fitted to instead | `directions` |
//! | what takes what kernels leave | `base` |
//! | where the fit of the first row starts | [`cells`] |
//! | how kernels answer them | [`answers`] |
//! | the fit of one row | [`solve`] |
//! | what it makes | `row` |
//! | of all rows | [`generate()`] |
//! | sets of them, for sub-pixels | [`ThreadSettings::for_picture`](super::ThreadSettings::for_picture) |
//! | of an edited BRDF, at once and coarsely | [`draft()`] |
//! | what the edit does to all rows | `edit` |
//! | what a fit leaves, under other lights | [`validation_error`] |
//! | where kernels give way to the BRDF beside lamps | [`GivingWay`] |
//! | as stored, 12 bytes a thread and row, and looked up, 16 | [`FittedTable`] |
pub mod answers;
mod base;
pub mod cells;
mod directions;
mod draft;
mod edit;
mod generate;
mod giving_way;
pub mod kernel;
pub mod lights;
mod row;
mod sets;
pub mod solve;
mod stray;
mod table;
#[cfg(test)]
mod tests;
mod validate;

pub use draft::draft;
pub use generate::generate;
pub use giving_way::GivingWay;
pub use sets::{NEARLY_FLAT_RAD, place_of_sum, sums_of_pixel};
pub(super) use sets::{count_and_sets, shared_deviation};
pub use table::{FittedTable, PackedKernel, UnpackedKernel, UsedThreads};
pub use validate::validation_error;

/// Most fitted threads that a table can have.
pub const MAX_COUNT: usize = 128;
