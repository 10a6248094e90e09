//! Images and samplers.
use super::deletion::Garbage;
use super::device::Device;
use super::error::{Result, VulkanError, call};
use super::identity::Identity;
use super::memory::Memory;
use ash::vk;
use std::sync::Arc;

/// How an image is addressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageKind {
    /// Two-dimensional.
    Plane,
    /// Three-dimensional.
    Volume,
    /// Six square faces, sampled by direction.
    Cube,
    /// So many of these, sampled by direction and number.
    Cubes(u32),
}

/// Whether images of this format are depth attachments rather than colour attachments.
pub fn is_depth(format: vk::Format) -> bool {
    use vk::Format as F;
    let combined = matches!(format, F::D16_UNORM_S8_UINT | F::D24_UNORM_S8_UINT | F::D32_SFLOAT_S8_UINT);
    combined || matches!(format, F::D16_UNORM | F::X8_D24_UNORM_PACK32 | F::D32_SFLOAT)
}

/// Size, format and kind of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageShape {
    /// Format of a texel.
    pub format: vk::Format,
    /// Width, height and depth of level 0 in texels.
    pub extent: [u32; 3],
    /// Mip levels.
    pub levels: u32,
    /// How it is addressed.
    pub kind: ImageKind,
}

impl ImageShape {
    /// A plain two-dimensional image with one level.
    pub fn plane(format: vk::Format, width: u32, height: u32) -> Self {
        Self { format, extent: [width, height, 1], levels: 1, kind: ImageKind::Plane }
    }

    fn layers(&self) -> u32 {
        match self.kind {
            ImageKind::Plane | ImageKind::Volume => 1,
            ImageKind::Cube => 6,
            ImageKind::Cubes(count) => 6 * count,
        }
    }

    fn view_type(&self) -> vk::ImageViewType {
        match self.kind {
            ImageKind::Plane => vk::ImageViewType::TYPE_2D,
            ImageKind::Volume => vk::ImageViewType::TYPE_3D,
            ImageKind::Cube => vk::ImageViewType::CUBE,
            ImageKind::Cubes(_) => vk::ImageViewType::CUBE_ARRAY,
        }
    }

    /// Bytes of `level` in a buffer, tightly packed; none of a format whose texels neither go to buffers nor come from there.
    pub(crate) fn level_bytes(&self, level: u32) -> Option<u64> {
        let vk::Extent3D { width, height, depth } = self.extent_at(level);
        let texels = u64::from(width) * u64::from(height) * u64::from(depth) * u64::from(self.layers());
        self.texel_bytes().map(|bytes| texels * bytes)
    }

    /// Bytes of a texel, of the formats whose texels go to buffers or come from there.
    fn texel_bytes(&self) -> Option<u64> {
        match self.format {
            vk::Format::R8G8B8A8_UNORM
            | vk::Format::B8G8R8A8_UNORM
            | vk::Format::A8B8G8R8_UNORM_PACK32
            | vk::Format::A2R10G10B10_UNORM_PACK32
            | vk::Format::A2B10G10R10_UNORM_PACK32 => Some(4),
            vk::Format::R32G32_UINT | vk::Format::R16G16B16A16_SFLOAT => Some(8),
            vk::Format::R32G32B32A32_SFLOAT => Some(16),
            _ => None,
        }
    }

    /// Colour or depth.
    pub(super) fn aspect(&self) -> vk::ImageAspectFlags {
        if is_depth(self.format) { vk::ImageAspectFlags::DEPTH } else { vk::ImageAspectFlags::COLOR }
    }

    /// All levels and layers.
    pub(super) fn whole(&self) -> vk::ImageSubresourceRange {
        vk::ImageSubresourceRange::default()
            .aspect_mask(self.aspect())
            .level_count(self.levels)
            .layer_count(self.layers())
    }

    /// One level of all layers, for copies.
    pub(super) fn level(&self, level: u32) -> vk::ImageSubresourceLayers {
        vk::ImageSubresourceLayers::default().aspect_mask(self.aspect()).mip_level(level).layer_count(self.layers())
    }

    /// Extent of `level`.
    pub(super) fn extent_at(&self, level: u32) -> vk::Extent3D {
        let [width, height, depth] = self.extent.map(|size| (size >> level).max(1));
        vk::Extent3D { width, height, depth }
    }
}

/// An image with a view of all of it.
pub struct Image {
    pub(super) raw: vk::Image,
    pub(super) view: vk::ImageView,
    /// Size, format and kind.
    pub(crate) shape: ImageShape,
    usage: vk::ImageUsageFlags,
    name: String,
    pub(super) identity: Identity,
    memory: Option<Arc<Memory>>,
    /// Whether it is destroyed with the swapchain that it is of, not by itself.
    of_swapchain: bool,
    device: Arc<Device>,
}

impl Image {
    /// An image without memory or view: [`Image::bind`] it before use.
    ///
    /// # Errors
    /// A size or format that the driver refuses.
    pub(crate) fn unbound(
        device: &Arc<Device>,
        name: &str,
        shape: ImageShape,
        usage: vk::ImageUsageFlags,
    ) -> Result<Self> {
        let [width, height, depth] = shape.extent;
        let (flags, kind) = match shape.kind {
            ImageKind::Plane => (vk::ImageCreateFlags::empty(), vk::ImageType::TYPE_2D),
            ImageKind::Volume => (vk::ImageCreateFlags::empty(), vk::ImageType::TYPE_3D),
            ImageKind::Cube | ImageKind::Cubes(_) => (vk::ImageCreateFlags::CUBE_COMPATIBLE, vk::ImageType::TYPE_2D),
        };
        check_shape(device, name, shape, kind, usage, flags)?;
        let info = vk::ImageCreateInfo::default()
            .flags(flags)
            .image_type(kind)
            .format(shape.format)
            .extent(vk::Extent3D { width, height, depth })
            .mip_levels(shape.levels)
            .array_layers(shape.layers())
            .samples(vk::SampleCountFlags::TYPE_1)
            .usage(usage);
        // SAFETY: the device was found to have such images; destroyed through the deletion queue.
        let raw = call("vkCreateImage", name, || unsafe { device.raw.create_image(&info, None) })?;
        device.set_name(raw, name);
        let view = vk::ImageView::null();
        let (name, device) = (name.to_owned(), device.clone());
        Ok(Self { raw, view, shape, usage, name, identity: Identity::new(), memory: None, of_swapchain: false, device })
    }

    /// An image that a swapchain owns, which has to outlive it.
    #[cfg(feature = "viewer")]
    pub(super) fn of_swapchain(
        device: &Arc<Device>,
        name: &str,
        shape: ImageShape,
        usage: vk::ImageUsageFlags,
        raw: vk::Image,
    ) -> Result<Self> {
        let (view, memory, name, device) = (vk::ImageView::null(), None, name.to_owned(), device.clone());
        let identity = Identity::new();
        let mut image = Self { raw, view, shape, usage, name, identity, memory, of_swapchain: true, device };
        image.make_view()?;
        Ok(image)
    }

    /// Its debug name.
    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// An error for an image that is not of `device`, or lacks some `needed` usage.
    pub(super) fn check(&self, device: &Device, needed: vk::ImageUsageFlags) -> Result<()> {
        device.check_same(&self.device, &self.name)?;
        if self.usage.contains(needed) {
            return Ok(());
        }
        Err(VulkanError::unfit(&self.name, format!("it was not made to be used as {needed:?}")))
    }

    /// Bytes of `level` in a buffer, tightly packed.
    pub(super) fn level_bytes(&self, level: u32) -> Result<u64> {
        let unknown =
            || VulkanError::unfit(&self.name, format!("it is of format {:?}, which is not copied", self.shape.format));
        self.shape.level_bytes(level).ok_or_else(unknown)
    }

    /// What memory it needs.
    pub(crate) fn requirements(&self) -> vk::MemoryRequirements {
        // SAFETY: plain query of a live image.
        unsafe { self.device.raw.get_image_memory_requirements(self.raw) }
    }

    /// Gives it the memory at `offset`, once, and makes its view.
    ///
    /// # Errors
    /// Memory that it has already, or that is not as it requires.
    pub(crate) fn bind(&mut self, memory: &Arc<Memory>, offset: u64) -> Result<()> {
        if self.memory.is_some() {
            return Err(VulkanError::unfit(&self.name, "it has memory already"));
        }
        let (raw_memory, offset) = memory.place(offset, self.requirements(), &self.name)?;
        // SAFETY: the image has no memory yet, and the range, which `memory` keeps alive, is as it requires.
        call("vkBindImageMemory", &self.name, || unsafe {
            self.device.raw.bind_image_memory(self.raw, raw_memory, offset)
        })?;
        self.memory = Some(memory.clone());
        self.make_view()
    }

    fn make_view(&mut self) -> Result<()> {
        let info = vk::ImageViewCreateInfo::default()
            .image(self.raw)
            .view_type(self.shape.view_type())
            .format(self.shape.format)
            .subresource_range(self.shape.whole());
        // SAFETY: the image is alive and has memory; the view is destroyed with it.
        self.view =
            call("vkCreateImageView", &self.name, || unsafe { self.device.raw.create_image_view(&info, None) })?;
        self.device.set_name(self.view, &self.name);
        Ok(())
    }
}

/// An error for an image that the device cannot have.
fn check_shape(
    device: &Device,
    name: &str,
    shape: ImageShape,
    kind: vk::ImageType,
    usage: vk::ImageUsageFlags,
    flags: vk::ImageCreateFlags,
) -> Result<()> {
    let refused = || VulkanError::unfit(name, format!("this device has no image of {shape:?} for {usage:?}"));
    if usage.is_empty() {
        return Err(refused());
    }
    let (instance, physical, tiling) = (&device.instance.raw, device.physical, vk::ImageTiling::OPTIMAL);
    // SAFETY: plain query about this instance's physical device.
    let limits = call("vkGetPhysicalDeviceImageFormatProperties", name, || unsafe {
        instance.get_physical_device_image_format_properties(physical, shape.format, kind, tiling, usage, flags)
    })?;
    let [width, height, depth] = shape.extent;
    let most = [limits.max_extent.width, limits.max_extent.height, limits.max_extent.depth];
    let has_extent = shape.extent.iter().zip(most).all(|(size, most)| (1..=most).contains(size));
    let levels = width.max(height).max(depth).max(1).ilog2() + 1;
    let has_levels = (1..=levels.min(limits.max_mip_levels)).contains(&shape.levels);
    let is_square = width == height || matches!(shape.kind, ImageKind::Plane | ImageKind::Volume);
    let has_layers = (1..=limits.max_array_layers).contains(&shape.layers()) && is_square;
    // An image takes no less than its texels do.
    let has_bytes = shape.level_bytes(0).is_none_or(|bytes| bytes <= limits.max_resource_size);
    if has_extent && has_levels && has_layers && has_bytes { Ok(()) } else { Err(refused()) }
}

impl Drop for Image {
    fn drop(&mut self) {
        self.device.delete_later(Garbage::ImageView(self.view));
        if !self.of_swapchain {
            self.device.delete_later(Garbage::Image(self.raw));
        }
    }
}

/// How a sampler treats coordinates outside of [0, 1] and between texels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SamplerKind {
    /// Trilinear, clamped at the edges: cube maps.
    Trilinear,
    /// Bilinear, repeating in the first coordinate and clamped in the others: lat-long maps, tables periodic in phi.
    WrappedLinear,
}

/// A sampler.
pub struct Sampler {
    pub(super) raw: vk::Sampler,
    pub(super) identity: Identity,
    pub(super) device: Arc<Device>,
}

impl Sampler {
    /// Makes one.
    ///
    /// # Errors
    /// The driver's limit of samplers is reached.
    pub fn new(device: &Arc<Device>, name: &str, kind: SamplerKind) -> Result<Self> {
        let clamp = vk::SamplerAddressMode::CLAMP_TO_EDGE;
        let (address_u, mipmaps) = match kind {
            SamplerKind::Trilinear => (clamp, vk::SamplerMipmapMode::LINEAR),
            SamplerKind::WrappedLinear => (vk::SamplerAddressMode::REPEAT, vk::SamplerMipmapMode::NEAREST),
        };
        let info = vk::SamplerCreateInfo::default()
            .mag_filter(vk::Filter::LINEAR)
            .min_filter(vk::Filter::LINEAR)
            .mipmap_mode(mipmaps)
            .address_mode_u(address_u)
            .address_mode_v(clamp)
            .address_mode_w(clamp)
            .max_lod(vk::LOD_CLAMP_NONE);
        // SAFETY: plain creation; destroyed through the deletion queue.
        let raw = call("vkCreateSampler", name, || unsafe { device.raw.create_sampler(&info, None) })?;
        device.set_name(raw, name);
        Ok(Self { raw, identity: Identity::new(), device: device.clone() })
    }
}

impl Drop for Sampler {
    fn drop(&mut self) {
        self.device.delete_later(Garbage::Sampler(self.raw));
    }
}
