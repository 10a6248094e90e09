//! Copies, clears and blits. The graph's barriers order them and set the layouts.
use super::commands::Commands;
use super::error::{Result, VulkanError};
use super::image::Image;
use super::memory::Buffer;
use ash::vk::{self, BufferUsageFlags, ImageUsageFlags};

const SOURCE: vk::ImageLayout = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
const TARGET: vk::ImageLayout = vk::ImageLayout::TRANSFER_DST_OPTIMAL;

impl Commands {
    /// Sets a whole buffer to zero.
    pub(crate) fn clear_buffer(&mut self, buffer: &Buffer) -> Result<()> {
        buffer.check(&self.device, BufferUsageFlags::TRANSFER_DST, 0)?;
        // SAFETY: the buffer is alive and made to be filled.
        unsafe { self.device.raw.cmd_fill_buffer(self.raw, buffer.raw, 0, vk::WHOLE_SIZE, 0) };
        Ok(())
    }

    /// Copies all of `source` to the start of `target`, as far as it has room.
    pub(crate) fn copy_buffer(&mut self, source: &Buffer, target: &Buffer) -> Result<()> {
        source.check(&self.device, BufferUsageFlags::TRANSFER_SRC, 0)?;
        target.check(&self.device, BufferUsageFlags::TRANSFER_DST, 0)?;
        let region = [vk::BufferCopy::default().size(source.size_bytes().min(target.size_bytes()))];
        // SAFETY: both are alive, made to be copied from and to, and large enough.
        unsafe { self.device.raw.cmd_copy_buffer(self.raw, source.raw, target.raw, &region) };
        Ok(())
    }

    /// Scales level 0 of `source` to `area` (left, top, width, height) of `target`, bilinearly where their sizes differ; formats
    /// are converted. Of what lies outside of the target nothing is drawn.
    pub(crate) fn blit(&mut self, source: &Image, target: &Image, area: [u32; 4]) -> Result<()> {
        source.check(&self.device, ImageUsageFlags::TRANSFER_SRC)?;
        target.check(&self.device, ImageUsageFlags::TRANSFER_DST)?;
        let [left, top, width, height] = area;
        let [target_width, target_height, _] = target.shape.extent;
        let [source_width, source_height, _] = source.shape.extent;
        let (shown_width, shown_height) =
            (width.min(target_width.saturating_sub(left)), height.min(target_height.saturating_sub(top)));
        if shown_width == 0 || shown_height == 0 {
            return Ok(());
        }
        let part = |side: u32, shown: u32, of: u32| (u64::from(side) * u64::from(shown) / u64::from(of)).max(1) as i32;
        let corner = |x: u32, y: u32| vk::Offset3D { x: x as i32, y: y as i32, z: 0 };
        let source_end = vk::Offset3D {
            x: part(source_width, shown_width, width),
            y: part(source_height, shown_height, height),
            z: 1,
        };
        let region = [vk::ImageBlit::default()
            .src_subresource(source.shape.level(0))
            .src_offsets([corner(0, 0), source_end])
            .dst_subresource(target.shape.level(0))
            .dst_offsets([corner(left, top), vk::Offset3D { z: 1, ..corner(left + shown_width, top + shown_height) }])];
        let filter =
            if [source_width, source_height] == [width, height] { vk::Filter::NEAREST } else { vk::Filter::LINEAR };
        // SAFETY: both are alive and made for it, and the regions are within the images, as computed above.
        unsafe { self.device.raw.cmd_blit_image(self.raw, source.raw, SOURCE, target.raw, TARGET, &region, filter) };
        Ok(())
    }

    /// Fills level 0 of `image` with a colour.
    pub(crate) fn clear_image(&mut self, image: &Image, color: [f32; 4]) -> Result<()> {
        image.check(&self.device, ImageUsageFlags::TRANSFER_DST)?;
        if image.shape.aspect() != vk::ImageAspectFlags::COLOR {
            return Err(VulkanError::unfit(image.name(), "it has depth, no colour"));
        }
        let color = vk::ClearColorValue { float32: color };
        // SAFETY: the image is alive, of colour, and made to be written.
        unsafe { self.device.raw.cmd_clear_color_image(self.raw, image.raw, TARGET, &color, &[image.shape.whole()]) };
        Ok(())
    }

    /// Copies level 0 of `source` into `target`, tightly packed.
    pub(crate) fn copy_image_to_buffer(&mut self, source: &Image, target: &Buffer) -> Result<()> {
        source.check(&self.device, ImageUsageFlags::TRANSFER_SRC)?;
        target.check(&self.device, BufferUsageFlags::TRANSFER_DST, source.level_bytes(0)?)?;
        let region = [vk::BufferImageCopy::default()
            .image_subresource(source.shape.level(0))
            .image_extent(source.shape.extent_at(0))];
        // SAFETY: both are alive and made for it, and the buffer was found to have room for the image.
        unsafe { self.device.raw.cmd_copy_image_to_buffer(self.raw, source.raw, SOURCE, target.raw, &region) };
        Ok(())
    }
}
