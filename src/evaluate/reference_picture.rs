//! The true picture that all others are measured against.
use std::sync::Arc;

use super::reference::{ReferenceSettings, reference};
use crate::error::Result;
use crate::memo::Round;
use crate::prepare::Prepared;
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
/// Whatever Vulkan refuses, or cancelled.
pub fn reference_picture(
    prepared: &Prepared,
    device: &Arc<Device>,
    settings: &ReferenceSettings,
    round: &Round,
) -> Result<ReferencePicture> {
    let image = reference(prepared, device, settings, round)?;
    Ok(ReferencePicture { radiance: image.radiance, error_estimate: image.error_estimate })
}
