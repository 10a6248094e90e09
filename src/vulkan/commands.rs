//! Recording: one pass after another, with descriptors bound by the names that the GLSL gives them.
use super::device::Device;
use super::error::{During, Result, VulkanError};
use super::image::{Image, Sampler};
use super::memory::Buffer;
use super::pipeline::{ComputePipeline, GraphicsPipeline, Pipeline};
use super::shader::{Shader, ShaderStage};
use ash::vk;
use std::sync::Arc;

/// Passes that a frame can time; more are recorded, but not timed.
pub(super) const MAX_TIMED_PASSES: u32 = 64;

/// What a binding refers to.
enum Bound<'a> {
    Buffer(&'a Buffer),
    /// Sampled or storage, as the shader declares it.
    Image(&'a Image),
    Sampled(&'a Image, &'a Sampler),
}

/// The resources of one dispatch or draw, by their names in the shader.
#[derive(Default)]
pub struct Bindings<'a>(Vec<(&'a str, Bound<'a>)>);

impl<'a> Bindings<'a> {
    /// None yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// A storage or uniform buffer.
    pub fn buffer(mut self, name: &'a str, buffer: &'a Buffer) -> Self {
        self.0.push((name, Bound::Buffer(buffer)));
        self
    }

    /// An image read by `texelFetch` or as a storage image.
    pub fn image(mut self, name: &'a str, image: &'a Image) -> Self {
        self.0.push((name, Bound::Image(image)));
        self
    }

    /// An image with its sampler.
    pub fn sampled(mut self, name: &'a str, image: &'a Image, sampler: &'a Sampler) -> Self {
        self.0.push((name, Bound::Sampled(image, sampler)));
        self
    }
}

/// How many workgroups a dispatch has.
pub enum Groups<'a> {
    /// Known now.
    Direct([u32; 3]),
    /// Three u32 at this byte offset of a buffer that an earlier pass has written.
    Indirect(&'a Buffer, u64),
}

/// A colour target of a draw: cleared first.
pub struct ColorTarget<'a> {
    /// Where to draw.
    pub image: &'a Image,
    /// What it is cleared to; integer formats take the bits as they are.
    pub clear: [u32; 4],
}

/// The depth target of a draw: cleared first, contents not kept afterwards.
pub struct DepthTarget<'a> {
    /// Where to draw.
    pub image: &'a Image,
    /// What it is cleared to.
    pub clear: f32,
}

/// A command buffer being recorded.
pub struct Commands {
    pub(super) device: Arc<Device>,
    pub(super) raw: vk::CommandBuffer,
    descriptor_pool: vk::DescriptorPool,
    queries: Option<vk::QueryPool>,
    timed: Vec<String>,
}

impl Commands {
    pub(super) fn new(
        device: &Arc<Device>,
        raw: vk::CommandBuffer,
        descriptor_pool: vk::DescriptorPool,
        queries: Option<vk::QueryPool>,
    ) -> Self {
        Self { device: device.clone(), raw, descriptor_pool, queries, timed: Vec::new() }
    }

    pub(super) fn into_timed_passes(self) -> Vec<String> {
        self.timed
    }

    /// Records `pass` between two timestamps, under a label of its name.
    ///
    /// # Errors
    /// What `pass` returns.
    pub fn timed_pass<E>(
        &mut self,
        name: &str,
        pass: impl FnOnce(&mut Self) -> std::result::Result<(), E>,
    ) -> std::result::Result<(), E> {
        let label = std::ffi::CString::new(name).unwrap_or_default();
        let device = self.device.clone();
        if let Some(debug) = &device.debug {
            let info = vk::DebugUtilsLabelEXT::default().label_name(&label);
            // SAFETY: the command buffer is recording; the label is ended below.
            unsafe { debug.cmd_begin_debug_utils_label(self.raw, &info) };
        }
        // Both wait for all work before them, so that passes are timed one by one even where they could overlap.
        let timed = self.timed.len() < MAX_TIMED_PASSES as usize && self.queries.is_some();
        let first_query = 2 * self.timed.len() as u32;
        if timed {
            self.timed.push(name.to_owned());
            self.write_timestamp(first_query);
        }
        let result = pass(self);
        if timed {
            self.write_timestamp(first_query + 1);
        }
        if let Some(debug) = &device.debug {
            // SAFETY: begun above.
            unsafe { debug.cmd_end_debug_utils_label(self.raw) };
        }
        result
    }

    /// Writes the time at which everything recorded so far has finished.
    fn write_timestamp(&mut self, query: u32) {
        let Some(queries) = self.queries else { return };
        let stage = vk::PipelineStageFlags2::ALL_COMMANDS;
        // SAFETY: the query was reset at the start of this frame and is written once in it.
        unsafe { self.device.synchronization2.cmd_write_timestamp2(self.raw, stage, queries, query) };
    }

    /// Runs a compute shader.
    ///
    /// # Errors
    /// A binding or push constant that the shader does not declare, or one that it declares and is not given.
    pub fn dispatch(
        &mut self,
        pipeline: &ComputePipeline,
        bindings: &Bindings,
        push_constants: &[u8],
        groups: Groups,
    ) -> Result<()> {
        self.bind(&pipeline.0, vk::PipelineBindPoint::COMPUTE, bindings)?;
        self.push(&pipeline.0, push_constants)?;
        // SAFETY: pipeline and descriptors are bound; the resources are kept alive by the deletion queue.
        unsafe {
            match groups {
                Groups::Direct([x, y, z]) => self.device.raw.cmd_dispatch(self.raw, x, y, z),
                Groups::Indirect(buffer, offset) => self.device.raw.cmd_dispatch_indirect(self.raw, buffer.raw, offset),
            }
        }
        Ok(())
    }

    /// Clears the targets and draws into them what `draw` records.
    ///
    /// # Errors
    /// What `draw` returns.
    pub fn render(
        &mut self,
        color: &ColorTarget,
        depth: &DepthTarget,
        draw: impl FnOnce(&mut Self) -> Result<()>,
    ) -> Result<()> {
        let [width, height, _] = color.image.shape.extent;
        let area = vk::Rect2D { offset: vk::Offset2D::default(), extent: vk::Extent2D { width, height } };
        let colors = [vk::RenderingAttachmentInfo::default()
            .image_view(color.image.view)
            .image_layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)
            .load_op(vk::AttachmentLoadOp::CLEAR)
            .store_op(vk::AttachmentStoreOp::STORE)
            .clear_value(vk::ClearValue { color: vk::ClearColorValue { uint32: color.clear } })];
        let depth_attachment = vk::RenderingAttachmentInfo::default()
            .image_view(depth.image.view)
            .image_layout(vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL)
            .load_op(vk::AttachmentLoadOp::CLEAR)
            .store_op(vk::AttachmentStoreOp::DONT_CARE)
            .clear_value(vk::ClearValue {
                depth_stencil: vk::ClearDepthStencilValue { depth: depth.clear, stencil: 0 },
            });
        let info = vk::RenderingInfo::default()
            .render_area(area)
            .layer_count(1)
            .color_attachments(&colors)
            .depth_attachment(&depth_attachment);
        let viewport =
            vk::Viewport { width: width as f32, height: height as f32, max_depth: 1.0, ..Default::default() };
        // SAFETY: the views are alive and in the layouts named above, by the caller's barriers; ended below.
        unsafe {
            self.device.dynamic_rendering.cmd_begin_rendering(self.raw, &info);
            self.device.raw.cmd_set_viewport(self.raw, 0, &[viewport]);
            self.device.raw.cmd_set_scissor(self.raw, 0, &[area]);
        }
        let result = draw(self);
        // SAFETY: begun above.
        unsafe { self.device.dynamic_rendering.cmd_end_rendering(self.raw) };
        result
    }

    /// Draws indexed triangles, inside of [`Commands::render`].
    ///
    /// # Errors
    /// Push constants of another size than the shaders declare.
    pub fn draw(
        &mut self,
        pipeline: &GraphicsPipeline,
        push_constants: &[u8],
        vertices: &[&Buffer],
        indices: &Buffer,
        index_count: u32,
    ) -> Result<()> {
        self.bind(&pipeline.0, vk::PipelineBindPoint::GRAPHICS, &Bindings::new())?;
        self.push(&pipeline.0, push_constants)?;
        let buffers: Vec<_> = vertices.iter().map(|buffer| buffer.raw).collect();
        let offsets = vec![0; buffers.len()];
        // SAFETY: rendering is on; the buffers are kept alive by the deletion queue; indices were checked by the mesh.
        unsafe {
            self.device.raw.cmd_bind_vertex_buffers(self.raw, 0, &buffers, &offsets);
            self.device.raw.cmd_bind_index_buffer(self.raw, indices.raw, 0, vk::IndexType::UINT32);
            self.device.raw.cmd_draw_indexed(self.raw, index_count, 1, 0, 0, 0);
        }
        Ok(())
    }

    /// Sets a whole buffer to zero.
    pub fn clear_buffer(&mut self, buffer: &Buffer) {
        // SAFETY: the buffer is alive, with transfer usage, and not in use by the barriers before.
        unsafe { self.device.raw.cmd_fill_buffer(self.raw, buffer.raw, 0, vk::WHOLE_SIZE, 0) };
    }

    /// Copies all of `source` to the start of `target`.
    pub fn copy_buffer(&mut self, source: &Buffer, target: &Buffer) {
        let region = [vk::BufferCopy::default().size(source.size_bytes().min(target.size_bytes()))];
        // SAFETY: both are alive and large enough.
        unsafe { self.device.raw.cmd_copy_buffer(self.raw, source.raw, target.raw, &region) };
    }

    /// Scales level 0 of `source` to `area` (left, top, width, height) of `target`, bilinearly where their sizes differ; formats
    /// are converted. Of what lies outside of the target nothing is drawn.
    pub fn blit(&mut self, source: &Image, target: &Image, [left, top, width, height]: [u32; 4]) {
        let [target_width, target_height, _] = target.shape.extent;
        let [source_width, source_height, _] = source.shape.extent;
        let (shown_width, shown_height) =
            (width.min(target_width.saturating_sub(left)), height.min(target_height.saturating_sub(top)));
        if shown_width == 0 || shown_height == 0 {
            return;
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
        let layouts = [vk::ImageLayout::TRANSFER_SRC_OPTIMAL, vk::ImageLayout::TRANSFER_DST_OPTIMAL];
        // SAFETY: both are alive, the caller's barriers set the layouts, the regions are within the images.
        unsafe {
            self.device.raw.cmd_blit_image(self.raw, source.raw, layouts[0], target.raw, layouts[1], &region, filter);
        }
    }

    /// Fills level 0 of `image`, in transfer-destination layout, with a colour.
    pub fn clear_image(&mut self, image: &Image, color: [f32; 4]) {
        let (color, layout) = (vk::ClearColorValue { float32: color }, vk::ImageLayout::TRANSFER_DST_OPTIMAL);
        // SAFETY: the image is alive, the caller's barriers set the layout.
        unsafe { self.device.raw.cmd_clear_color_image(self.raw, image.raw, layout, &color, &[image.shape.whole()]) };
    }

    /// Copies level 0 of `source`, in transfer-source layout, into `target`, tightly packed.
    pub fn copy_image_to_buffer(&mut self, source: &Image, target: &Buffer) {
        let region = [vk::BufferImageCopy::default()
            .image_subresource(source.shape.level(0))
            .image_extent(source.shape.extent_at(0))];
        let layout = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
        // SAFETY: both are alive, the buffer was sized for the image, the caller's barriers set the layout.
        unsafe { self.device.raw.cmd_copy_image_to_buffer(self.raw, source.raw, layout, target.raw, &region) };
    }

    /// An image barrier over all of `image`, for the frame graph.
    pub fn image_barrier<'a>(image: &Image) -> vk::ImageMemoryBarrier2<'a> {
        vk::ImageMemoryBarrier2::default().image(image.raw).subresource_range(image.shape.whole())
    }

    /// A buffer barrier over all of `buffer`, for the frame graph.
    pub fn buffer_barrier<'a>(buffer: &Buffer) -> vk::BufferMemoryBarrier2<'a> {
        vk::BufferMemoryBarrier2::default().buffer(buffer.raw).size(vk::WHOLE_SIZE)
    }

    /// Records barriers in one call.
    pub fn barriers(
        &mut self,
        images: &[vk::ImageMemoryBarrier2],
        buffers: &[vk::BufferMemoryBarrier2],
        memory: &[vk::MemoryBarrier2],
    ) {
        if images.is_empty() && buffers.is_empty() && memory.is_empty() {
            return;
        }
        let info = vk::DependencyInfo::default()
            .image_memory_barriers(images)
            .buffer_memory_barriers(buffers)
            .memory_barriers(memory);
        // SAFETY: recorded outside of rendering, on live handles.
        unsafe { self.device.synchronization2.cmd_pipeline_barrier2(self.raw, &info) };
    }

    fn push(&mut self, pipeline: &Pipeline, push_constants: &[u8]) -> Result<()> {
        if push_constants.len() != pipeline.push_constant_bytes as usize {
            let (given, wanted) = (push_constants.len(), pipeline.push_constant_bytes);
            return Err(refuse(pipeline, format!("{given} bytes of push constants given, {wanted} declared")));
        }
        if !push_constants.is_empty() {
            // SAFETY: size and stages are those of the layout.
            unsafe {
                self.device.raw.cmd_push_constants(self.raw, pipeline.layout, pipeline.stages, 0, push_constants);
            }
        }
        Ok(())
    }

    /// Binds the pipeline and a fresh descriptor set.
    fn bind(&mut self, pipeline: &Pipeline, point: vk::PipelineBindPoint, bindings: &Bindings) -> Result<()> {
        // SAFETY: the pipeline is alive.
        unsafe { self.device.raw.cmd_bind_pipeline(self.raw, point, pipeline.raw) };
        for (name, _) in &bindings.0 {
            if !pipeline.bindings.contains_key(*name) {
                return Err(refuse(pipeline, format!("it declares no binding {name}")));
            }
        }
        if pipeline.bindings.is_empty() {
            return Ok(());
        }
        let layouts = [pipeline.set_layout];
        let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(self.descriptor_pool).set_layouts(&layouts);
        // SAFETY: the pool belongs to the frame being recorded.
        let set = unsafe { self.device.raw.allocate_descriptor_sets(&info) }
            .during("vkAllocateDescriptorSets", pipeline.name)?[0];
        for (name, declared) in &pipeline.bindings {
            let given = bindings.0.iter().find(|(given, _)| given == name);
            let (_, bound) = given.ok_or_else(|| refuse(pipeline, format!("binding {name} is not given")))?;
            let write = vk::WriteDescriptorSet::default()
                .dst_set(set)
                .dst_binding(declared.index)
                .descriptor_type(declared.kind);
            let layout = match declared.kind {
                vk::DescriptorType::STORAGE_IMAGE => vk::ImageLayout::GENERAL,
                _ => vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
            };
            let (buffers, images);
            let write = match (bound, declared.kind) {
                (Bound::Buffer(buffer), vk::DescriptorType::STORAGE_BUFFER | vk::DescriptorType::UNIFORM_BUFFER) => {
                    buffers = [vk::DescriptorBufferInfo::default().buffer(buffer.raw).range(vk::WHOLE_SIZE)];
                    write.buffer_info(&buffers)
                }
                (Bound::Image(image), vk::DescriptorType::STORAGE_IMAGE | vk::DescriptorType::SAMPLED_IMAGE) => {
                    images = [vk::DescriptorImageInfo::default().image_view(image.view).image_layout(layout)];
                    write.image_info(&images)
                }
                (Bound::Sampled(image, sampler), vk::DescriptorType::COMBINED_IMAGE_SAMPLER) => {
                    images = [vk::DescriptorImageInfo::default()
                        .image_view(image.view)
                        .sampler(sampler.raw)
                        .image_layout(layout)];
                    write.image_info(&images)
                }
                (_, kind) => return Err(refuse(pipeline, format!("binding {name} is declared as {kind:?}"))),
            };
            // SAFETY: the set is fresh and not yet in use; the infos outlive the call.
            unsafe { self.device.raw.update_descriptor_sets(&[write], &[]) };
        }
        // SAFETY: the set was made for this pipeline's layout.
        unsafe { self.device.raw.cmd_bind_descriptor_sets(self.raw, point, pipeline.layout, 0, &[set], &[]) };
        Ok(())
    }
}

fn refuse(pipeline: &Pipeline, problem: String) -> VulkanError {
    Shader { name: pipeline.name, stage: ShaderStage::Compute, spirv: &[] }.refuse(problem)
}
