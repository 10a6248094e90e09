//! The swapchain: images that go to the window, and whose turn it is.
//!
//! Its images hold display values. Tone mapping has applied the gamma that the user asked for, so the format is plain UNORM:
//! an sRGB format would encode them a second time. The colour space is the one that every window system has, in which
//! it shows the bytes as they are.
use super::device::{Device, Semaphores};
use super::error::{During, Result, VulkanError, bare_call, call};
use super::frames::Frames;
use super::image::{Image, ImageShape};
use super::surface::Surface;
use ash::{khr, vk};
use std::sync::Arc;

/// When finished frames reach the screen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PresentMode {
    /// At the next vertical blank, one after another: no tearing. Every device has it.
    #[default]
    Fifo,
    /// The same, but a late frame is shown at once, with tearing.
    FifoRelaxed,
    /// The newest at the next vertical blank: no tearing, and no waiting.
    Mailbox,
    /// At once, with tearing.
    Immediate,
}

impl PresentMode {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Fifo, Self::FifoRelaxed, Self::Mailbox, Self::Immediate];

    /// What the command line calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fifo => "fifo",
            Self::FifoRelaxed => "fifo-relaxed",
            Self::Mailbox => "mailbox",
            Self::Immediate => "immediate",
        }
    }

    fn raw(self) -> vk::PresentModeKHR {
        match self {
            Self::Fifo => vk::PresentModeKHR::FIFO,
            Self::FifoRelaxed => vk::PresentModeKHR::FIFO_RELAXED,
            Self::Mailbox => vk::PresentModeKHR::MAILBOX,
            Self::Immediate => vk::PresentModeKHR::IMMEDIATE,
        }
    }
}

/// An image whose turn it is to be drawn.
pub struct AcquiredImage {
    /// The image; its contents are undefined.
    pub image: Arc<Image>,
    /// What the submission that draws it waits for and signals.
    pub semaphores: Semaphores,
    index: u32,
}

/// What became of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Presented {
    /// It is on its way to the screen.
    Yes,
    /// The window has changed under it: draw it again.
    Again,
}

/// The images of a window, made anew whenever the window changes.
pub struct Swapchain {
    /// `None` while there is nothing to draw on: a window without area, a lost surface.
    current: Option<Current>,
    surface: Surface,
    format: vk::Format,
    mode: PresentMode,
    /// For each frame in flight, signalled when the image that it draws is free.
    free: Vec<vk::Semaphore>,
    next: usize,
    device: Arc<Device>,
    functions: khr::swapchain::Device,
}

/// The images at one size.
struct Current {
    raw: vk::SwapchainKHR,
    images: Vec<Arc<Image>>,
    /// For each image, signalled when it is drawn. Not one for each frame: presentation waits for it at a time that only
    /// the next turn of the same image tells to be over.
    drawn: Vec<vk::Semaphore>,
    /// Whether the window has changed since.
    stale: bool,
}

impl Swapchain {
    /// Formats of images that take display values as they are, what most windows have first.
    pub(crate) const FORMATS: [vk::Format; 5] = [
        vk::Format::B8G8R8A8_UNORM,
        vk::Format::R8G8B8A8_UNORM,
        vk::Format::A8B8G8R8_UNORM_PACK32,
        vk::Format::A2R10G10B10_UNORM_PACK32,
        vk::Format::A2B10G10R10_UNORM_PACK32,
    ];

    /// A swapchain of `surface` for so many frames in flight; it has images from the first turn on.
    ///
    /// # Errors
    /// A device that cannot present, or no memory left.
    pub fn new(device: &Arc<Device>, surface: Surface, mode: PresentMode, frames: usize) -> Result<Self> {
        surface.check_instance(&device.instance)?;
        let functions = device.swapchain.clone().ok_or_else(|| VulkanError::Unsuitable {
            device: device.description().name.clone(),
            feature: "VK_KHR_swapchain".to_owned(),
        })?;
        let (free, format) = (Vec::new(), Self::FORMATS[0]);
        let mut swapchain =
            Self { current: None, surface, format, mode, free, next: 0, device: device.clone(), functions };
        // Those that are there are destroyed with it where another cannot be made.
        for _ in 0..frames {
            swapchain.free.push(semaphore(device, "image is free")?);
        }
        swapchain.format = swapchain.available_format()?;
        swapchain.mode = swapchain.available(mode)?;
        Ok(swapchain)
    }

    /// The format of the images, one of [`Self::FORMATS`].
    pub(crate) fn format(&self) -> vk::Format {
        self.format
    }

    /// Red, green and blue of a texel of its images.
    pub(crate) fn rgb8(&self, texel: [u8; 4]) -> [u8; 3] {
        rgb8(self.format, texel)
    }

    /// Says that the window has changed: the next turn is one of images of its new size.
    pub fn window_changed(&mut self) {
        self.current.iter_mut().for_each(|current| current.stale = true);
    }

    /// The next image to draw, of about `size` in pixels (the window's; where the window system knows better, it decides).
    /// None while the window has no area, or more than an image can have, or the window system has no image to give: then it is worth asking
    /// again in a while.
    /// `frames` is waited for until it has a place for the frame.
    ///
    /// # Errors
    /// A lost device, no memory left, a window that is gone.
    pub(crate) fn turn(&mut self, frames: &Frames, size: [u32; 2]) -> Result<Option<AcquiredImage>> {
        // A surface may change again while its images are made; one that always does is not to hang the program.
        const ATTEMPTS: usize = 8;
        // Window systems that give no images back for hidden windows must not make the program hang.
        const PATIENCE_NS: u64 = 200_000_000;
        // Not only where images are made: those of a minimised window may be there still.
        if size.contains(&0) {
            return Ok(None);
        }
        for _ in 0..ATTEMPTS {
            if self.current.as_ref().is_none_or(|current| current.stale) && !self.renew(size)? {
                return Ok(None);
            }
            let Some(current) = &mut self.current else { return Ok(None) };
            // The frame that waited for this semaphore before has left the GPU.
            frames.wait_for_place()?;
            let free = self.free[self.next];
            // SAFETY: the semaphore is unsignalled and nothing waits for it, as said above.
            let acquire =
                || unsafe { self.functions.acquire_next_image(current.raw, PATIENCE_NS, free, vk::Fence::null()) };
            match bare_call("vkAcquireNextImageKHR", acquire) {
                Ok((index, suboptimal)) => {
                    // It can be drawn and shown; the one after it will fit again.
                    current.stale = suboptimal;
                    self.next = (self.next + 1) % self.free.len();
                    let semaphores = Semaphores { wait: Some(free), signal: Some(current.drawn[index as usize]) };
                    let image = current.images[index as usize].clone();
                    return Ok(Some(AcquiredImage { image, semaphores, index }));
                }
                Err(vk::Result::TIMEOUT | vk::Result::NOT_READY) => return Ok(None),
                Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => current.stale = true,
                Err(vk::Result::ERROR_SURFACE_LOST_KHR) => self.renew_surface()?,
                Err(result) => return Err(result).during("vkAcquireNextImageKHR", "window"),
            }
        }
        Ok(None)
    }

    /// Sends the image of `turn` to the screen, when what was submitted to draw it has finished.
    ///
    /// # Errors
    /// A lost device.
    pub(crate) fn present(&mut self, turn: AcquiredImage) -> Result<Presented> {
        let Some(current) = &mut self.current else { return Ok(Presented::Again) };
        let wait: Vec<_> = turn.semaphores.signal.into_iter().collect();
        let (swapchains, indices) = ([current.raw], [turn.index]);
        let info = vk::PresentInfoKHR::default().wait_semaphores(&wait).swapchains(&swapchains).image_indices(&indices);
        // SAFETY: the queue is held exclusively; the image was acquired for this turn and is in the layout for presenting.
        let present = || self.device.with_queue(|queue| unsafe { self.functions.queue_present(queue, &info) });
        match bare_call("vkQueuePresentKHR", present) {
            Ok(suboptimal) => {
                current.stale |= suboptimal;
                Ok(Presented::Yes)
            }
            Err(vk::Result::ERROR_OUT_OF_DATE_KHR) => {
                current.stale = true;
                Ok(Presented::Again)
            }
            Err(vk::Result::ERROR_SURFACE_LOST_KHR) => {
                self.renew_surface()?;
                Ok(Presented::Again)
            }
            Err(result) => Err(result).during("vkQueuePresentKHR", "window"),
        }
    }

    /// Makes the surface anew, for windows that survive the loss of theirs.
    fn renew_surface(&mut self) -> Result<()> {
        tracing::info!("the window's surface was lost; making another");
        self.discard();
        self.surface.renew()
    }

    /// Makes the images anew for the window as it is now. False if it has no area, or more than an image can have, or lost its surface meanwhile.
    fn renew(&mut self, size: [u32; 2]) -> Result<bool> {
        let capabilities = match self.capabilities() {
            Err(VulkanError::Call { result: vk::Result::ERROR_SURFACE_LOST_KHR, .. }) => {
                self.renew_surface()?;
                self.capabilities()?
            }
            other => other?,
        };
        let vk::SurfaceCapabilitiesKHR { current_extent, min_image_extent, max_image_extent, .. } = capabilities;
        let longest = self.device.longest_target_side();
        // Where the images decide the size of the window (Wayland), the extent is said to be undefined.
        let extent = match current_extent.width {
            u32::MAX => vk::Extent2D {
                width: size[0].clamp(min_image_extent.width, max_image_extent.width.min(longest)),
                height: size[1].clamp(min_image_extent.height, max_image_extent.height.min(longest)),
            },
            _ => current_extent,
        };
        if extent.width == 0 || extent.height == 0 || extent.width.max(extent.height) > longest {
            self.discard();
            return Ok(false);
        }
        let usage = Self::USAGE & capabilities.supported_usage_flags;
        let raw = match self.create(&capabilities, extent, usage) {
            Err(VulkanError::Call { result: vk::Result::ERROR_SURFACE_LOST_KHR, .. }) => {
                self.renew_surface()?;
                return Ok(false);
            }
            other => other?,
        };
        // SAFETY: plain query of the swapchain just made.
        let images = unsafe { self.functions.get_swapchain_images(raw) };
        let shape = ImageShape::plane(self.format, extent.width, extent.height);
        let mut current = Current { raw, images: Vec::new(), drawn: Vec::new(), stale: false };
        let filled = images.during("vkGetSwapchainImagesKHR", "window").and_then(|images| {
            for image in images {
                current.images.push(Arc::new(Image::of_swapchain(&self.device, "window", shape, usage, image)?));
                current.drawn.push(semaphore(&self.device, "image is drawn")?);
            }
            Ok(())
        });
        if let Err(error) = filled {
            self.destroy(current);
            return Err(error);
        }
        tracing::debug!("swapchain: {} images of {} x {}", current.images.len(), extent.width, extent.height);
        self.current = Some(current);
        Ok(true)
    }

    /// A swapchain in the place of the current one, which is destroyed.
    fn create(
        &mut self,
        capabilities: &vk::SurfaceCapabilitiesKHR,
        extent: vk::Extent2D,
        usage: vk::ImageUsageFlags,
    ) -> Result<vk::SwapchainKHR> {
        // One more than the least, so that drawing does not wait for the window system to give one back.
        let most = if capabilities.max_image_count == 0 { u32::MAX } else { capabilities.max_image_count };
        let old = self.current.take();
        let (opaque, supported) = (vk::CompositeAlphaFlagsKHR::OPAQUE, capabilities.supported_composite_alpha);
        // Every surface supports one; windows are drawn opaque, so any shows the same.
        let lowest = vk::CompositeAlphaFlagsKHR::from_raw(supported.as_raw() & supported.as_raw().wrapping_neg());
        let composite = if supported.contains(opaque) { opaque } else { lowest };
        let info = vk::SwapchainCreateInfoKHR::default()
            .surface(self.surface.raw)
            .min_image_count((capabilities.min_image_count + 1).min(most))
            .image_format(self.format)
            .image_color_space(COLOR_SPACE)
            .image_extent(extent)
            .image_array_layers(1)
            .image_usage(usage)
            .pre_transform(capabilities.current_transform)
            .composite_alpha(composite)
            .present_mode(self.mode.raw())
            // Screenshots read what is behind other windows, too.
            .clipped(false)
            .old_swapchain(old.as_ref().map_or(vk::SwapchainKHR::null(), |old| old.raw));
        // SAFETY: the surface is alive; the old swapchain is destroyed after this, and not used before.
        let raw = bare_call("vkCreateSwapchainKHR", || unsafe { self.functions.create_swapchain(&info, None) });
        if let Some(old) = old {
            self.destroy(old);
        }
        let raw = raw.during("vkCreateSwapchainKHR", "window")?;
        self.device.set_name(raw, "window");
        Ok(raw)
    }

    /// The picture is blitted into its images, the panel is drawn over it. Only screenshots read them, and are all that a window
    /// system without that use lacks.
    const USAGE: vk::ImageUsageFlags = vk::ImageUsageFlags::from_raw(
        vk::ImageUsageFlags::COLOR_ATTACHMENT.as_raw()
            | vk::ImageUsageFlags::TRANSFER_DST.as_raw()
            | vk::ImageUsageFlags::TRANSFER_SRC.as_raw(),
    );

    fn capabilities(&self) -> Result<vk::SurfaceCapabilitiesKHR> {
        let Surface { raw, functions, .. } = &self.surface;
        // SAFETY: the device is of the surface's instance, as was checked when this was made.
        call("vkGetPhysicalDeviceSurfaceCapabilitiesKHR", "window", || unsafe {
            functions.get_physical_device_surface_capabilities(self.device.physical, *raw)
        })
    }

    /// The first of the formats that the window has; an error where it cannot be given display values as they are.
    fn available_format(&self) -> Result<vk::Format> {
        let Surface { raw, functions, .. } = &self.surface;
        // SAFETY: the device is of the surface's instance, as was checked when this was made.
        let of_window = unsafe { functions.get_physical_device_surface_formats(self.device.physical, *raw) }
            .during("vkGetPhysicalDeviceSurfaceFormatsKHR", "window")?;
        let has = |wanted: &vk::Format| {
            let is_it = |has: &vk::SurfaceFormatKHR| (has.format, has.color_space) == (*wanted, COLOR_SPACE);
            of_window.iter().any(is_it) && self.can_be_blitted_to(*wanted)
        };
        Self::FORMATS.into_iter().find(has).ok_or_else(|| VulkanError::Unsuitable {
            device: self.device.description().name.clone(),
            feature: format!("windows of one of the formats {:?}", Self::FORMATS),
        })
    }

    /// Whether a picture can be blitted into images of `format`, and a panel drawn over it.
    fn can_be_blitted_to(&self, format: vk::Format) -> bool {
        // SAFETY: plain query of the device's own physical device.
        let properties =
            unsafe { self.device.instance.raw.get_physical_device_format_properties(self.device.physical, format) };
        let needed = vk::FormatFeatureFlags::BLIT_DST | vk::FormatFeatureFlags::COLOR_ATTACHMENT_BLEND;
        properties.optimal_tiling_features.contains(needed)
    }

    /// `wanted` where the device has it for this window, else the one that every device has.
    fn available(&self, wanted: PresentMode) -> Result<PresentMode> {
        let Surface { raw, functions, .. } = &self.surface;
        // SAFETY: the device is of the surface's instance, as was checked when this was made.
        let modes = unsafe { functions.get_physical_device_surface_present_modes(self.device.physical, *raw) }
            .during("vkGetPhysicalDeviceSurfacePresentModesKHR", "window")?;
        if modes.contains(&wanted.raw()) {
            return Ok(wanted);
        }
        let has: Vec<_> =
            PresentMode::ALL.iter().filter(|mode| modes.contains(&mode.raw())).map(|mode| mode.name()).collect();
        tracing::warn!("--present-mode {}: this window has only {}; using fifo", wanted.name(), has.join(", "));
        Ok(PresentMode::Fifo)
    }

    /// Lets the images go, once nothing uses them.
    fn discard(&mut self) {
        if let Some(current) = self.current.take() {
            self.destroy(current);
        }
    }

    fn destroy(&self, Current { raw, images, drawn, .. }: Current) {
        // Their views go first, and presentation has to be over, which the timeline of submissions does not tell.
        drop(images);
        if let Err(error) = self.device.wait_idle() {
            tracing::error!("{error}");
        }
        // SAFETY: the queue is idle, so nothing draws or presents these.
        unsafe {
            drawn.into_iter().for_each(|semaphore| self.device.raw.destroy_semaphore(semaphore, None));
            self.functions.destroy_swapchain(raw, None);
        }
    }
}

impl Drop for Swapchain {
    fn drop(&mut self) {
        self.discard();
        if let Err(error) = self.device.wait_idle() {
            tracing::error!("{error}");
        }
        // SAFETY: the queue is idle, so nothing waits for these.
        self.free.iter().for_each(|semaphore| unsafe { self.device.raw.destroy_semaphore(*semaphore, None) });
    }
}

/// Display values are what the window system shows as they are.
const COLOR_SPACE: vk::ColorSpaceKHR = vk::ColorSpaceKHR::SRGB_NONLINEAR;

/// Red, green and blue of a texel of `format`, one of [`Swapchain::FORMATS`].
fn rgb8(format: vk::Format, texel: [u8; 4]) -> [u8; 3] {
    let word = u32::from_le_bytes(texel);
    let of_10_bits = |low: u32| (((word >> low & 0x3ff) * 255 + 511) / 1023) as u8;
    match format {
        vk::Format::B8G8R8A8_UNORM => [texel[2], texel[1], texel[0]],
        vk::Format::A2R10G10B10_UNORM_PACK32 => [20, 10, 0].map(of_10_bits),
        vk::Format::A2B10G10R10_UNORM_PACK32 => [0, 10, 20].map(of_10_bits),
        _ => [texel[0], texel[1], texel[2]],
    }
}

fn semaphore(device: &Device, name: &str) -> Result<vk::Semaphore> {
    // SAFETY: plain creation; destroyed with the swapchain.
    let raw = unsafe { device.raw.create_semaphore(&vk::SemaphoreCreateInfo::default(), None) }
        .during("vkCreateSemaphore", name)?;
    device.set_name(raw, name);
    Ok(raw)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texels_of_every_format_are_read_as_red_green_and_blue() {
        let [r, g, b] = [255_u32, 128, 0];
        let to_10_bits = |value: u32| (value * 1023 + 127) / 255;
        let packed =
            |[low, middle, high]: [u32; 3]| to_10_bits(low) | to_10_bits(middle) << 10 | to_10_bits(high) << 20;
        for (format, word) in Swapchain::FORMATS.into_iter().zip([
            b | g << 8 | r << 16,
            r | g << 8 | b << 16,
            r | g << 8 | b << 16,
            packed([b, g, r]),
            packed([r, g, b]),
        ]) {
            assert_eq!(rgb8(format, (word | 3 << 30).to_le_bytes()), [r, g, b].map(|value| value as u8), "{format:?}");
        }
    }
}
