//! The true picture that all others are measured against.
use std::sync::Arc;

use crate::error::{Error, Result};
use crate::prepare::Prepared;
use crate::threads::Observer;
use crate::vulkan::Device;

/// Equation (1) for every sub-pixel, as exact as asked for.
#[derive(Clone, Debug)]
pub struct ReferencePicture {
    /// RGBA, linear radiance times coverage, row by row from the top left, as
    /// [`Rendering::radiance`](crate::pipeline::Rendering::radiance) has it.
    pub radiance: Vec<[f32; 4]>,
    /// How far it is from the truth at most, by its own estimate, in display values.
    pub error_estimate: f64,
}

/// The true picture of `prepared`, whatever its method and threads, within `tolerance` of display values.
///
/// # Errors
/// The reference is not built in.
pub fn reference_picture(
    _prepared: &Prepared,
    _device: &Arc<Device>,
    _tolerance: f64,
    _observer: &dyn Observer,
) -> Result<ReferencePicture> {
    // To connect: crate::evaluate::reference::reference(prepared, device, tolerance, observer), and the struct above is its
    // result.
    Err(Error::input("bench error", "the reference is not built in yet", "use a version that has --method reference"))
}
