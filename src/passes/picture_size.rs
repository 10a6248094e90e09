//! How large a picture can be on a device.
use super::classify::longest_list_bytes;
use crate::method::Method;
use crate::scene::{ImageSettings, Scene};
use crate::vulkan::Device;
use crate::{Error, Result};

/// Whether `device` can render a picture as large as that of `scene`, which need not be prepared yet.
///
/// # Errors
/// More sub-pixels along a side than `device` draws, or more pixels than its shaders can list.
pub fn check_picture(device: &Device, Scene { image, shading, .. }: &Scene) -> Result<()> {
    let &ImageSettings { width, height, subpixels, .. } = image;
    check_cache_size(device, [width, height].map(|side| side.saturating_mul(subpixels)))?;
    // The reference draws the geometry cache alone.
    if shading.method == Method::Reference {
        return Ok(());
    }
    check_lists(device, [width, height], 1)
}

/// An error for a picture of so many columns and rows by so many shaders, if its lists are longer than what shaders of `device` see in a buffer.
pub(crate) fn check_lists(device: &Device, size_px: [u32; 2], shaders: usize) -> Result<()> {
    let most = u64::from(device.limits().max_storage_buffer_range);
    let bytes = longest_list_bytes(size_px, shaders);
    if bytes <= most {
        return Ok(());
    }
    let [width, height] = size_px;
    let problem =
        format!("is {width} x {height}: its pixels take {bytes} bytes to list, this device's shaders see {most}");
    Err(Error::input("image size", problem, "use a smaller size"))
}

/// An error for a geometry cache of so many columns and rows of sub-pixels, if `device` does not draw so large ones.
pub(crate) fn check_cache_size(device: &Device, [width, height]: [u32; 2]) -> Result<()> {
    let largest = device.longest_target_side();
    if width.max(height) <= largest {
        return Ok(());
    }
    let problem = format!("needs {width} x {height} sub-pixels, this device draws at most {largest} a side");
    Err(Error::input("image size", problem, "use a smaller size or fewer sub-pixels"))
}
