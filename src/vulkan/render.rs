//! Rendering: triangles into a colour and a depth target, both cleared first.
use super::commands::{Bound, Commands};
use super::error::{Result, VulkanError};
use super::image::Image;
use super::pipeline::GraphicsPipeline;
use super::triangles::Triangles;
use ash::vk;

/// A colour target of a draw: cleared first.
pub(crate) struct ColorTarget<'a> {
    /// Where to draw.
    pub image: &'a Image,
    /// What it is cleared to; integer formats take the bits as they are.
    pub clear: [u32; 4],
}

/// The depth target of a draw: cleared first, contents not kept afterwards.
pub(crate) struct DepthTarget<'a> {
    /// Where to draw.
    pub image: &'a Image,
    /// What it is cleared to.
    pub clear: f32,
}

impl Commands {
    /// Clears the targets and draws into them, each mesh with its push constants and all with these `bindings`. Where there is an `area` (left, top,
    /// width, height), they may hold anything beyond it afterwards.
    ///
    /// # Errors
    /// Targets that `pipeline` was not made for, or that differ in size; an area that is empty or beyond them; meshes, bindings or push constants
    /// that are not what its shaders declare.
    pub(crate) fn render<'d>(
        &mut self,
        pipeline: &GraphicsPipeline,
        color: &ColorTarget,
        depth: &DepthTarget,
        area: Option<[u32; 4]>,
        bindings: &[(&str, Bound)],
        draws: impl Iterator<Item = (&'d Triangles, &'d [u8])>,
    ) -> Result<()> {
        self.check_targets(pipeline, color.image, depth.image)?;
        let [width, height, _] = color.image.shape.extent;
        let area = area_within(color.image, area)?;
        let cleared = if self.device.clears_parts() { area } else { area_within(color.image, None)? };
        let colors = [vk::RenderingAttachmentInfo::default()
            .image_view(color.image.view)
            .image_layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)
            .load_op(vk::AttachmentLoadOp::CLEAR)
            .store_op(vk::AttachmentStoreOp::STORE)
            .clear_value(vk::ClearValue { color: vk::ClearColorValue { uint32: color.clear } })];
        let depth_stencil = vk::ClearDepthStencilValue { depth: depth.clear, stencil: 0 };
        let depth_attachment = vk::RenderingAttachmentInfo::default()
            .image_view(depth.image.view)
            .image_layout(vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL)
            .load_op(vk::AttachmentLoadOp::CLEAR)
            .store_op(vk::AttachmentStoreOp::DONT_CARE)
            .clear_value(vk::ClearValue { depth_stencil });
        let info = vk::RenderingInfo::default()
            .render_area(cleared)
            .layer_count(1)
            .color_attachments(&colors)
            .depth_attachment(&depth_attachment);
        let viewport =
            vk::Viewport { width: width as f32, height: height as f32, max_depth: 1.0, ..Default::default() };
        // SAFETY: the views are alive, of the formats that the pipeline was made for and of the size drawn; ended below.
        unsafe {
            self.device.dynamic_rendering.cmd_begin_rendering(self.raw, &info);
            self.device.raw.cmd_set_viewport(self.raw, 0, &[viewport]);
            self.device.raw.cmd_set_scissor(self.raw, 0, &[area]);
        }
        let result = self.draw(pipeline, bindings, draws);
        // SAFETY: begun above.
        unsafe { self.device.dynamic_rendering.cmd_end_rendering(self.raw) };
        result
    }

    fn draw<'d>(
        &mut self,
        pipeline: &GraphicsPipeline,
        bindings: &[(&str, Bound)],
        draws: impl Iterator<Item = (&'d Triangles, &'d [u8])>,
    ) -> Result<()> {
        self.bind(&pipeline.layouts, vk::PipelineBindPoint::GRAPHICS, bindings)?;
        for (triangles, push_constants) in draws {
            self.device.check_same(triangles.device(), "mesh")?;
            if triangles.strides != pipeline.strides {
                return Err(pipeline.layouts.refuse("the mesh has other attributes than the vertex shader"));
            }
            self.push(&pipeline.layouts, push_constants)?;
            let buffers: Vec<_> = triangles.attributes().map(|buffer| buffer.raw).collect();
            let offsets = vec![0; buffers.len()];
            // SAFETY: called while rendering; the buffers are those of the pipeline's attributes, and all indices are of vertices.
            unsafe {
                self.device.raw.cmd_bind_vertex_buffers(self.raw, 0, &buffers, &offsets);
                self.device.raw.cmd_bind_index_buffer(self.raw, triangles.indices.raw, 0, vk::IndexType::UINT32);
                self.device.raw.cmd_draw_indexed(self.raw, triangles.index_count, 1, 0, 0, 0);
            }
        }
        Ok(())
    }

    /// An error where `pipeline` cannot draw into these.
    fn check_targets(&self, pipeline: &GraphicsPipeline, color: &Image, depth: &Image) -> Result<()> {
        color.check(&self.device, vk::ImageUsageFlags::COLOR_ATTACHMENT)?;
        depth.check(&self.device, vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT)?;
        if pipeline.colors != [color.shape.format] || pipeline.depth != depth.shape.format {
            return Err(pipeline.layouts.refuse("it draws into targets of other formats"));
        }
        if color.shape.extent != depth.shape.extent {
            return Err(VulkanError::unfit(depth.name(), "it is not of the size of what is drawn with it"));
        }
        Ok(())
    }
}

/// `area` of `image`, all of it if there is none.
fn area_within(image: &Image, area: Option<[u32; 4]>) -> Result<vk::Rect2D> {
    let [image_width, image_height, _] = image.shape.extent;
    let [left, top, width, height] = area.unwrap_or([0, 0, image_width, image_height]);
    let fits = |start: u32, size: u32, whole: u32| size > 0 && start.checked_add(size).is_some_and(|end| end <= whole);
    if !(fits(left, width, image_width) && fits(top, height, image_height)) {
        return Err(VulkanError::unfit(image.name(), "the area that is drawn is empty or beyond it"));
    }
    let offset = vk::Offset2D { x: left as i32, y: top as i32 };
    Ok(vk::Rect2D { offset, extent: vk::Extent2D { width, height } })
}
