//! Device memory, and the buffers in it.
use super::deletion::Garbage;
use super::device::Device;
use super::error::{Result, VulkanError, bare_call, call};
use super::identity::Identity;
use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};
use std::sync::Arc;

/// A range of device memory that one or more objects are bound to.
pub struct Memory {
    // `None` only after drop has taken it.
    allocation: Option<Allocation>,
    /// The types that it may be of.
    memory_type_bits: u32,
    device: Arc<Device>,
}

impl Memory {
    /// Allocates device-local memory for transient objects that share it; `for_buffers` or for images, never both
    /// (so that `bufferImageGranularity` need not be thought of).
    ///
    /// # Errors
    /// No memory left.
    pub(crate) fn new(
        device: &Arc<Device>,
        name: &str,
        requirements: vk::MemoryRequirements,
        for_buffers: bool,
    ) -> Result<Arc<Self>> {
        Self::allocate(device, name, requirements, MemoryLocation::GpuOnly, for_buffers).map(Arc::new)
    }

    pub(super) fn allocate(
        device: &Arc<Device>,
        name: &str,
        requirements: vk::MemoryRequirements,
        location: MemoryLocation,
        linear: bool,
    ) -> Result<Self> {
        let allocation_scheme = AllocationScheme::GpuAllocatorManaged;
        let description = AllocationCreateDesc { name, requirements, location, linear, allocation_scheme };
        let failed = |cause: String| VulkanError::Memory { object: name.to_owned(), cause };
        bare_call("vkAllocateMemory", || Ok(())).map_err(|result| failed(format!("vkAllocateMemory: {result}")))?;
        device.check_memory_limit(requirements.size).map_err(failed)?;
        let allocation = device
            .with_allocator(|allocator| allocator.allocate(&description))
            .ok_or_else(|| failed("the device is closing".to_owned()))?
            .map_err(|cause| failed(cause.to_string()))?;
        let memory_type_bits = requirements.memory_type_bits;
        Ok(Self { allocation: Some(allocation), memory_type_bits, device: device.clone() })
    }

    /// The raw memory object and the position of `offset` in it, where an object of these `needs` has room.
    pub(super) fn place(
        &self,
        offset: u64,
        needs: vk::MemoryRequirements,
        object: &str,
    ) -> Result<(vk::DeviceMemory, u64)> {
        let refused = |problem: &str| VulkanError::unfit(object, problem);
        let allocation = self.allocation.as_ref().ok_or_else(|| refused("it was freed"))?;
        let end = offset.checked_add(needs.size);
        if end.is_none_or(|end| end > allocation.size())
            || !(allocation.offset() + offset).is_multiple_of(needs.alignment.max(1))
        {
            return Err(refused("it does not fit where it was placed"));
        }
        if needs.memory_type_bits & self.memory_type_bits != self.memory_type_bits {
            return Err(refused("its memory may be of a type that it cannot use"));
        }
        // SAFETY: the memory is only bound to, never freed or mapped, through this handle.
        Ok((unsafe { allocation.memory() }, allocation.offset() + offset))
    }

    /// What is in it, where the CPU can reach it.
    pub(super) fn mapped(&mut self) -> Option<&mut [u8]> {
        self.allocation.as_mut()?.mapped_slice_mut()
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
    /// Written by the GPU, read by the CPU.
    Readback,
}

/// A buffer and, unless it is transient, its own memory.
pub struct Buffer {
    pub(super) raw: vk::Buffer,
    size_bytes: u64,
    usage: vk::BufferUsageFlags,
    name: String,
    pub(super) identity: Identity,
    // After `raw`, which `drop` queues first.
    memory: Option<Arc<Memory>>,
    device: Arc<Device>,
}

impl Buffer {
    /// What buffers can be used as: all that Vulkan has without further extensions.
    const USAGES: vk::BufferUsageFlags = vk::BufferUsageFlags::from_raw(
        vk::BufferUsageFlags::TRANSFER_SRC.as_raw()
            | vk::BufferUsageFlags::TRANSFER_DST.as_raw()
            | vk::BufferUsageFlags::UNIFORM_BUFFER.as_raw()
            | vk::BufferUsageFlags::STORAGE_BUFFER.as_raw()
            | vk::BufferUsageFlags::INDEX_BUFFER.as_raw()
            | vk::BufferUsageFlags::VERTEX_BUFFER.as_raw()
            | vk::BufferUsageFlags::INDIRECT_BUFFER.as_raw(),
    );

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
            BufferUse::Readback => MemoryLocation::GpuToCpu,
        };
        let memory = Memory::allocate(device, name, buffer.requirements(), location, true)?;
        buffer.bind(&Arc::new(memory), 0)?;
        Ok(buffer)
    }

    /// A buffer without memory: [`Buffer::bind`] it before use.
    ///
    /// # Errors
    /// A size of zero, or one that the driver refuses.
    pub(crate) fn unbound(
        device: &Arc<Device>,
        name: &str,
        size_bytes: u64,
        usage: vk::BufferUsageFlags,
    ) -> Result<Self> {
        if size_bytes == 0 || usage.is_empty() || !Self::USAGES.contains(usage) {
            return Err(VulkanError::unfit(name, format!("no buffer has {size_bytes} bytes for {usage:?}")));
        }
        let most = device.most_buffer_bytes;
        if size_bytes > most {
            let problem = format!("it has {size_bytes} bytes, and buffers of this device have {most} at most");
            return Err(VulkanError::unfit(name, problem));
        }
        let info = vk::BufferCreateInfo::default().size(size_bytes).usage(usage);
        // SAFETY: the size is one that the device has, usage is valid on every device; destroyed through the deletion queue.
        let raw = call("vkCreateBuffer", name, || unsafe { device.raw.create_buffer(&info, None) })?;
        device.set_name(raw, name);
        let (name, identity, device) = (name.to_owned(), Identity::new(), device.clone());
        Ok(Self { raw, size_bytes, usage, name, identity, memory: None, device })
    }

    /// Its size in bytes.
    pub fn size_bytes(&self) -> u64 {
        self.size_bytes
    }

    /// An error for a buffer that is not of `device`, lacks some `needed` usage, or the bytes before `end`.
    pub(super) fn check(&self, device: &Device, needed: vk::BufferUsageFlags, end: u64) -> Result<()> {
        device.check_same(&self.device, &self.name)?;
        if !self.usage.contains(needed) {
            return Err(VulkanError::unfit(&self.name, format!("it was not made to be used as {needed:?}")));
        }
        if end > self.size_bytes {
            let problem = format!("it has {} bytes, where {end} are needed", self.size_bytes);
            return Err(VulkanError::unfit(&self.name, problem));
        }
        Ok(())
    }

    /// An error for one of which shaders, which see `most_bytes` of a buffer, would not see all.
    pub(super) fn check_is_seen(&self, most_bytes: u32) -> Result<()> {
        if self.size_bytes <= u64::from(most_bytes) {
            return Ok(());
        }
        let problem = format!(
            "it has {} bytes, and shaders of this device see {most_bytes} of a buffer; \
             a smaller size, fewer sub-pixels or fewer materials need less",
            self.size_bytes
        );
        Err(VulkanError::unfit(&self.name, problem))
    }

    /// What memory it needs.
    pub(crate) fn requirements(&self) -> vk::MemoryRequirements {
        // SAFETY: plain query of a live buffer.
        unsafe { self.device.raw.get_buffer_memory_requirements(self.raw) }
    }

    /// Gives it the memory at `offset`, once.
    ///
    /// # Errors
    /// Memory that it has already, or that is not as it requires.
    pub(crate) fn bind(&mut self, memory: &Arc<Memory>, offset: u64) -> Result<()> {
        if self.memory.is_some() {
            return Err(VulkanError::unfit(&self.name, "it has memory already"));
        }
        let (raw_memory, offset) = memory.place(offset, self.requirements(), &self.name)?;
        // SAFETY: the buffer has no memory yet, and the range, which `memory` keeps alive, is as it requires.
        call("vkBindBufferMemory", &self.name, || unsafe {
            self.device.raw.bind_buffer_memory(self.raw, raw_memory, offset)
        })?;
        self.memory = Some(memory.clone());
        Ok(())
    }

    /// The contents of a [`BufferUse::Readback`] buffer whose writers have finished; `None` if it is not one.
    pub(crate) fn contents(&self) -> Option<&[u8]> {
        let mapped = self.memory.as_ref()?.allocation.as_ref()?.mapped_slice()?;
        mapped.get(..self.size_bytes as usize)
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        self.device.delete_later(Garbage::Buffer(self.raw));
    }
}
