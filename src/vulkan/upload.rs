//! Upload: buffers and images that are made with their contents.
use super::commands::Commands;
use super::device::Device;
use super::error::{Result, VulkanError};
use super::frames::Frames;
use super::image::{Image, ImageShape};
use super::memory::{Buffer, BufferUse, Memory};
use ash::vk;
use gpu_allocator::MemoryLocation;
use std::sync::Arc;

/// Records commands, submits them and waits until they are done.
fn submit_and_wait(device: &Arc<Device>, record: impl FnOnce(&mut Commands) -> Result<()>) -> Result<()> {
    let mut frames = Frames::new(device, "upload", 1)?;
    frames.record(record)?;
    frames.wait()
}

impl Buffer {
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
        let staging = staging(device, name, contents)?;
        // That the CPU waits makes what was written available; to be visible to later frames it takes a barrier.
        let to_all = vk::MemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::COPY)
            .src_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
            .dst_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            .dst_access_mask(vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE);
        submit_and_wait(device, |commands| {
            commands.copy_buffer(&staging, &buffer)?;
            commands.barriers(&[], &[], &[to_all]);
            Ok(())
        })?;
        Ok(buffer)
    }
}

impl Image {
    /// An image that holds `levels` (texels of each level, layer by layer), ready to be sampled by any shader.
    ///
    /// # Errors
    /// No memory left, a failing submission, or levels of other sizes than `shape` says.
    pub fn with_texels(device: &Arc<Device>, name: &str, shape: ImageShape, levels: &[Vec<u8>]) -> Result<Self> {
        let usage = vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST;
        let mut image = Self::unbound(device, name, shape, usage)?;
        let memory = Memory::allocate(device, name, image.requirements(), MemoryLocation::GpuOnly, false)?;
        image.bind(&Arc::new(memory), 0)?;
        let staging: Vec<_> = levels.iter().map(|texels| staging(device, name, texels)).collect::<Result<_>>()?;
        submit_and_wait(device, |commands| commands.upload_image(&image, &staging))?;
        Ok(image)
    }
}

/// A buffer that the CPU has filled with `contents`, to copy from.
fn staging(device: &Arc<Device>, name: &str, contents: &[u8]) -> Result<Buffer> {
    let name = format!("{name} (staging)");
    let mut buffer = Buffer::unbound(device, &name, contents.len() as u64, vk::BufferUsageFlags::TRANSFER_SRC)?;
    let mut memory = Memory::allocate(device, &name, buffer.requirements(), MemoryLocation::CpuToGpu, true)?;
    let mapped = memory.mapped().ok_or_else(|| VulkanError::Memory {
        object: name.clone(),
        cause: "the driver's upload memory cannot be mapped".to_owned(),
    })?;
    mapped[..contents.len()].copy_from_slice(contents);
    buffer.bind(&Arc::new(memory), 0)?;
    Ok(buffer)
}

impl Commands {
    /// Fills every level of a new image and leaves it ready to be sampled.
    fn upload_image(&mut self, image: &Image, levels: &[Buffer]) -> Result<()> {
        image.check(&self.device, vk::ImageUsageFlags::TRANSFER_DST | vk::ImageUsageFlags::SAMPLED)?;
        let is_of_size = |(level, texels): (u32, &Buffer)| Ok(image.level_bytes(level)? == texels.size_bytes());
        let fitting = (0..).zip(levels).map(is_of_size).collect::<Result<Vec<_>>>()?;
        if fitting.len() != image.shape.levels as usize || fitting.contains(&false) {
            return Err(VulkanError::unfit(image.name(), "its texels are not as many as it has"));
        }
        let to_transfer = vk::ImageMemoryBarrier2::default()
            .image(image.raw)
            .subresource_range(image.shape.whole())
            .dst_stage_mask(vk::PipelineStageFlags2::COPY)
            .dst_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
            .new_layout(vk::ImageLayout::TRANSFER_DST_OPTIMAL);
        self.barriers(&[to_transfer], &[], &[]);
        for (level, texels) in (0..).zip(levels) {
            let region = [vk::BufferImageCopy::default()
                .image_subresource(image.shape.level(level))
                .image_extent(image.shape.extent_at(level))];
            let layout = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
            // SAFETY: both are alive until the caller has waited; the buffer was found to be as large as the level.
            unsafe { self.device.raw.cmd_copy_buffer_to_image(self.raw, texels.raw, image.raw, layout, &region) };
        }
        let to_shaders = vk::ImageMemoryBarrier2::default()
            .image(image.raw)
            .subresource_range(image.shape.whole())
            .src_stage_mask(vk::PipelineStageFlags2::COPY)
            .src_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
            .dst_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            .dst_access_mask(vk::AccessFlags2::SHADER_SAMPLED_READ)
            .old_layout(vk::ImageLayout::TRANSFER_DST_OPTIMAL)
            .new_layout(vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL);
        self.barriers(&[to_shaders], &[], &[]);
        Ok(())
    }
}
