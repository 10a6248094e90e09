//! The surface: what a window is to Vulkan.
use super::error::{During, Result, VulkanError};
use super::instance::Instance;
use ash::{khr, vk};
use raw_window_handle::{HasDisplayHandle, HasWindowHandle};
use std::sync::Arc;

/// A window, as far as Vulkan needs to know.
pub trait Window: HasDisplayHandle + HasWindowHandle + Send + Sync {}
impl<W: HasDisplayHandle + HasWindowHandle + Send + Sync> Window for W {}

/// Presents to one window, which it keeps alive.
pub struct Surface {
    pub(super) raw: vk::SurfaceKHR,
    pub(super) functions: khr::surface::Instance,
    window: Arc<dyn Window>,
    instance: Arc<Instance>,
}

impl Surface {
    /// The surface of `window`, whose display `instance` was made for.
    ///
    /// # Errors
    /// A window that is gone, or a display that the driver does not present to.
    pub fn new(instance: &Arc<Instance>, window: Arc<dyn Window>) -> Result<Self> {
        let functions = khr::surface::Instance::new(&instance.entry, &instance.raw);
        let raw = Self::make(instance, &*window)?;
        Ok(Self { raw, functions, window, instance: instance.clone() })
    }

    fn make(instance: &Instance, window: &dyn Window) -> Result<vk::SurfaceKHR> {
        let gone = |_| vk::Result::ERROR_SURFACE_LOST_KHR;
        let display = window.display_handle().map_err(gone).during("vkCreateSurfaceKHR", "window")?.as_raw();
        let handle = window.window_handle().map_err(gone).during("vkCreateSurfaceKHR", "window")?.as_raw();
        // SAFETY: both handles are alive, and stay so as long as the window, which the surface keeps.
        unsafe { ash_window::create_surface(&instance.entry, &instance.raw, display, handle, None) }
            .during("vkCreateSurfaceKHR", "window")
    }

    /// Makes it anew after it was lost; no swapchain may be left.
    pub(super) fn renew(&mut self) -> Result<()> {
        // A window has one surface at a time. The null handle may be destroyed like any other if making another fails.
        let lost = std::mem::replace(&mut self.raw, vk::SurfaceKHR::null());
        // SAFETY: the caller has destroyed its swapchains.
        unsafe { self.functions.destroy_surface(lost, None) };
        self.raw = Self::make(&self.instance, &*self.window)?;
        Ok(())
    }

    /// An error for a surface of another instance than `instance`.
    pub(super) fn check_instance(&self, instance: &Arc<Instance>) -> Result<()> {
        if Arc::ptr_eq(&self.instance, instance) {
            return Ok(());
        }
        Err(VulkanError::unfit("window", "its surface is of another Vulkan instance"))
    }

    /// Whether queues of this family can present to it.
    pub(super) fn is_supported(&self, physical: vk::PhysicalDevice, queue_family: u32) -> bool {
        // SAFETY: the device is of this instance, as was checked before; the surface is alive.
        let supported = unsafe { self.functions.get_physical_device_surface_support(physical, queue_family, self.raw) };
        supported.unwrap_or(false)
    }
}

impl Drop for Surface {
    fn drop(&mut self) {
        // SAFETY: a swapchain owns its surface and is destroyed before it.
        unsafe { self.functions.destroy_surface(self.raw, None) };
    }
}
