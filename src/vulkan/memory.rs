//! Memory and what lives in it: buffers, images, samplers, and getting data there and back.
use super::Result;
use super::device::{Device, Garbage};
use super::error::{During, VulkanError};
use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};
use std::sync::Arc;

/// A range of device memory that one or more objects are bound to.
pub struct Memory {
    // `None` only after drop has taken it.
    allocation: Option<Allocation>,
    device: Arc<Device>,
}

impl Memory {
    /// Allocates device-local memory for transient objects that share it; `for_buffers` or for images, never both
    /// (so that `bufferImageGranularity` need not be thought of).
    ///
    /// # Errors
    /// No memory left.
    pub fn new(
        device: &Arc<Device>,
        name: &str,
        requirements: vk::MemoryRequirements,
        for_buffers: bool,
    ) -> Result<Arc<Self>> {
        Self::allocate(device, name, requirements, MemoryLocation::GpuOnly, for_buffers).map(Arc::new)
    }

    fn allocate(
        device: &Arc<Device>,
        name: &str,
        requirements: vk::MemoryRequirements,
        location: MemoryLocation,
        linear: bool,
    ) -> Result<Self> {
        let allocation_scheme = AllocationScheme::GpuAllocatorManaged;
        let description = AllocationCreateDesc { name, requirements, location, linear, allocation_scheme };
        let failed = |cause: String| VulkanError::Memory { object: name.to_owned(), cause };
        let allocation = device
            .with_allocator(|allocator| allocator.allocate(&description))
            .ok_or_else(|| failed("the device is closing".to_owned()))?
            .map_err(|cause| failed(cause.to_string()))?;
        Ok(Self { allocation: Some(allocation), device: device.clone() })
    }

    /// The raw memory object and the position of `offset` in it.
    fn place(&self, offset: u64) -> (vk::DeviceMemory, u64) {
        self.allocation.as_ref().map_or((vk::DeviceMemory::null(), 0), |allocation| {
            // SAFETY: the memory is only bound to, never freed or mapped, through this handle.
            (unsafe { allocation.memory() }, allocation.offset() + offset)
        })
    }
}

impl Drop for Memory {
    fn drop(&mut self) {
        if let Some(allocation) = self.allocation.take() {
            self.device.delete_later(Garbage::Memory(allocation));
        }
    }
}

/// Where a buffer's memory is and who touches it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BufferUse {
    /// Fast for the GPU, out of the CPU's reach.
    Device,
    /// Written by the CPU, read by the GPU.
    Upload,
    /// Written by the GPU, read by the CPU.
    Readback,
}

/// A buffer and, unless it is transient, its own memory.
pub struct Buffer {
    pub(super) raw: vk::Buffer,
    /// Size in bytes.
    pub size_bytes: u64,
    name: String,
    // After `raw`, which `drop` queues first.
    memory: Option<Arc<Memory>>,
    device: Arc<Device>,
}

impl Buffer {
    /// A buffer with memory of its own; its contents are undefined.
    ///
    /// # Errors
    /// No memory left.
    pub fn new(
        device: &Arc<Device>,
        name: &str,
        size_bytes: u64,
        usage: vk::BufferUsageFlags,
        place: BufferUse,
    ) -> Result<Self> {
        let mut buffer = Self::unbound(device, name, size_bytes, usage)?;
        let location = match place {
            BufferUse::Device => MemoryLocation::GpuOnly,
            BufferUse::Upload => MemoryLocation::CpuToGpu,
            BufferUse::Readback => MemoryLocation::GpuToCpu,
        };
        let memory = Memory::allocate(device, name, buffer.requirements(), location, true)?;
        buffer.bind(&Arc::new(memory), 0)?;
        Ok(buffer)
    }

    /// A device-local buffer that holds `contents`.
    ///
    /// # Errors
    /// No memory left, or a failing submission.
    pub fn with_contents(
        device: &Arc<Device>,
        name: &str,
        usage: vk::BufferUsageFlags,
        contents: &[u8],
    ) -> Result<Self> {
        let usage = usage | vk::BufferUsageFlags::TRANSFER_DST;
        let buffer = Self::new(device, name, contents.len() as u64, usage, BufferUse::Device)?;
        let staging = Self::staging(device, name, contents)?;
        device.submit_and_wait("upload", |commands| {
            commands.copy_buffer(&staging, &buffer);
            Ok(())
        })?;
        Ok(buffer)
    }

    /// A buffer that the CPU has filled with `contents`, to copy from.
    fn staging(device: &Arc<Device>, name: &str, contents: &[u8]) -> Result<Self> {
        let name = format!("{name} (staging)");
        let mut buffer = Self::unbound(device, &name, contents.len() as u64, vk::BufferUsageFlags::TRANSFER_SRC)?;
        let mut memory = Memory::allocate(device, &name, buffer.requirements(), MemoryLocation::CpuToGpu, true)?;
        let mapped = memory.allocation.as_mut().and_then(|allocation| allocation.mapped_slice_mut());
        let mapped = mapped.ok_or_else(|| VulkanError::Memory {
            object: name.clone(),
            cause: "the driver's upload memory cannot be mapped".to_owned(),
        })?;
        mapped[..contents.len()].copy_from_slice(contents);
        buffer.bind(&Arc::new(memory), 0)?;
        Ok(buffer)
    }

    /// A buffer without memory: [`Buffer::bind`] it before use.
    ///
    /// # Errors
    /// A size of zero, or one that the driver refuses.
    pub fn unbound(device: &Arc<Device>, name: &str, size_bytes: u64, usage: vk::BufferUsageFlags) -> Result<Self> {
        let info = vk::BufferCreateInfo::default().size(size_bytes).usage(usage);
        // SAFETY: plain creation; destroyed through the deletion queue.
        let raw = unsafe { device.raw.create_buffer(&info, None) }.during("vkCreateBuffer", name)?;
        device.set_name(raw, name);
        Ok(Self { raw, size_bytes, name: name.to_owned(), memory: None, device: device.clone() })
    }

    /// What memory it needs.
    pub fn requirements(&self) -> vk::MemoryRequirements {
        // SAFETY: plain query of a live buffer.
        unsafe { self.device.raw.get_buffer_memory_requirements(self.raw) }
    }

    /// Gives it memory, once.
    ///
    /// # Errors
    /// No memory left.
    pub fn bind(&mut self, memory: &Arc<Memory>, offset: u64) -> Result<()> {
        let (raw_memory, offset) = memory.place(offset);
        // SAFETY: an unbound buffer and a live range that the caller sized by `requirements`; kept alive by `memory`.
        unsafe { self.device.raw.bind_buffer_memory(self.raw, raw_memory, offset) }
            .during("vkBindBufferMemory", &self.name)?;
        self.memory = Some(memory.clone());
        Ok(())
    }

    /// The contents of a [`BufferUse::Readback`] buffer whose writers have finished; `None` if it is not one.
    pub fn contents(&self) -> Option<&[u8]> {
        let mapped = self.memory.as_ref()?.allocation.as_ref()?.mapped_slice()?;
        mapped.get(..self.size_bytes as usize)
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        self.device.delete_later(Garbage::Buffer(self.raw));
    }
}

/// How an image is addressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageKind {
    /// Two-dimensional.
    Plane,
    /// Three-dimensional.
    Volume,
    /// Six square faces, sampled by direction.
    Cube,
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
        if self.kind == ImageKind::Cube { 6 } else { 1 }
    }

    fn view_type(&self) -> vk::ImageViewType {
        match self.kind {
            ImageKind::Plane => vk::ImageViewType::TYPE_2D,
            ImageKind::Volume => vk::ImageViewType::TYPE_3D,
            ImageKind::Cube => vk::ImageViewType::CUBE,
        }
    }

    /// Colour or depth.
    pub(super) fn aspect(&self) -> vk::ImageAspectFlags {
        match self.format {
            vk::Format::D16_UNORM | vk::Format::D32_SFLOAT | vk::Format::X8_D24_UNORM_PACK32 => {
                vk::ImageAspectFlags::DEPTH
            }
            _ => vk::ImageAspectFlags::COLOR,
        }
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
    pub shape: ImageShape,
    name: String,
    memory: Option<Arc<Memory>>,
    /// Whether it is destroyed with the swapchain that it is of, not by itself.
    of_swapchain: bool,
    device: Arc<Device>,
}

impl Image {
    /// An image that holds `levels` (texels of each level, layer by layer), ready to be sampled by any shader.
    ///
    /// # Errors
    /// No memory left, or a failing submission.
    pub fn with_texels(device: &Arc<Device>, name: &str, shape: ImageShape, levels: &[Vec<u8>]) -> Result<Self> {
        let usage = vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST;
        let mut image = Self::unbound(device, name, shape, usage)?;
        let memory = Memory::allocate(device, name, image.requirements(), MemoryLocation::GpuOnly, false)?;
        image.bind(&Arc::new(memory), 0)?;
        let staging: Vec<_> =
            levels.iter().map(|texels| Buffer::staging(device, name, texels)).collect::<Result<_>>()?;
        device.submit_and_wait("upload", |commands| {
            commands.upload_image(&image, &staging);
            Ok(())
        })?;
        Ok(image)
    }

    /// An image without memory or view: [`Image::bind`] it before use.
    ///
    /// # Errors
    /// A size or format that the driver refuses.
    pub fn unbound(device: &Arc<Device>, name: &str, shape: ImageShape, usage: vk::ImageUsageFlags) -> Result<Self> {
        let [width, height, depth] = shape.extent;
        let (flags, kind) = match shape.kind {
            ImageKind::Plane => (vk::ImageCreateFlags::empty(), vk::ImageType::TYPE_2D),
            ImageKind::Volume => (vk::ImageCreateFlags::empty(), vk::ImageType::TYPE_3D),
            ImageKind::Cube => (vk::ImageCreateFlags::CUBE_COMPATIBLE, vk::ImageType::TYPE_2D),
        };
        let info = vk::ImageCreateInfo::default()
            .flags(flags)
            .image_type(kind)
            .format(shape.format)
            .extent(vk::Extent3D { width, height, depth })
            .mip_levels(shape.levels)
            .array_layers(shape.layers())
            .samples(vk::SampleCountFlags::TYPE_1)
            .usage(usage);
        // SAFETY: plain creation; destroyed through the deletion queue.
        let raw = unsafe { device.raw.create_image(&info, None) }.during("vkCreateImage", name)?;
        device.set_name(raw, name);
        let view = vk::ImageView::null();
        let (name, device) = (name.to_owned(), device.clone());
        Ok(Self { raw, view, shape, name, memory: None, of_swapchain: false, device })
    }

    /// An image that a swapchain owns, which has to outlive it.
    #[cfg(feature = "viewer")]
    pub(super) fn of_swapchain(device: &Arc<Device>, name: &str, shape: ImageShape, raw: vk::Image) -> Result<Self> {
        let (view, memory, name, device) = (vk::ImageView::null(), None, name.to_owned(), device.clone());
        let mut image = Self { raw, view, shape, name, memory, of_swapchain: true, device };
        image.make_view()?;
        Ok(image)
    }

    /// What memory it needs.
    pub fn requirements(&self) -> vk::MemoryRequirements {
        // SAFETY: plain query of a live image.
        unsafe { self.device.raw.get_image_memory_requirements(self.raw) }
    }

    /// Gives it memory, once, and makes its view.
    ///
    /// # Errors
    /// No memory left.
    pub fn bind(&mut self, memory: &Arc<Memory>, offset: u64) -> Result<()> {
        let (raw_memory, offset) = memory.place(offset);
        // SAFETY: an unbound image and a live range that the caller sized by `requirements`; kept alive by `memory`.
        unsafe { self.device.raw.bind_image_memory(self.raw, raw_memory, offset) }
            .during("vkBindImageMemory", &self.name)?;
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
            unsafe { self.device.raw.create_image_view(&info, None) }.during("vkCreateImageView", &self.name)?;
        self.device.set_name(self.view, &self.name);
        Ok(())
    }
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
    device: Arc<Device>,
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
        let raw = unsafe { device.raw.create_sampler(&info, None) }.during("vkCreateSampler", name)?;
        device.set_name(raw, name);
        Ok(Self { raw, device: device.clone() })
    }
}

impl Drop for Sampler {
    fn drop(&mut self) {
        self.device.delete_later(Garbage::Sampler(self.raw));
    }
}
