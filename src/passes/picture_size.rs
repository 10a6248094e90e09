//! How large a picture can be on a device.
use crate::method::Method;
use crate::scene::{ImageSettings, Scene};
use crate::vulkan::Device;
use crate::{Error, Result};

/// Whether `device` can render a picture as large as that of `scene`, which need not be prepared yet.
///
/// # Errors
/// More sub-pixels along a side than images of `device` can have, or more pixels than its shaders can list at 4 bytes each.
pub fn check_picture(device: &Device, Scene { image, shading, .. }: &Scene) -> Result<()> {
    let &ImageSettings { width, height, subpixels, .. } = image;
    check_cache_size(device, [width, height].map(|side| side.saturating_mul(subpixels)))?;
    let most = device.limits().max_storage_buffer_range / 4;
    // The reference draws the geometry cache alone.
    if u64::from(width) * u64::from(height) <= most.into() || shading.method == Method::Reference {
        return Ok(());
    }
    let problem = format!("is {width} x {height}, and shaders of this device list at most {most} pixels");
    Err(Error::input("image size", problem, "use a smaller size"))
}

/// An error for a geometry cache of so many columns and rows of sub-pixels, if images of `device` cannot be so large.
pub(crate) fn check_cache_size(device: &Device, [width, height]: [u32; 2]) -> Result<()> {
    let largest = device.limits().max_image_dimension2_d;
    if width.max(height) <= largest {
        return Ok(());
    }
    let problem = format!("needs {width} x {height} sub-pixels, this device's images have at most {largest} a side");
    Err(Error::input("image size", problem, "use a smaller size or fewer sub-pixels"))
}
