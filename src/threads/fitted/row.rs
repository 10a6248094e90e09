//! What a fit makes of a row: the threads of one view.
use glam::DVec3;

use super::kernel::Kernel;

/// A fitted row.
#[derive(Clone)]
pub(super) struct Row {
    pub kernels: Vec<Kernel>,
    pub albedo: DVec3,
    /// What is left of the error, relative to the answers (F23).
    pub relative_error: f64,
}
