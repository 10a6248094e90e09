//! Recording: one pass after another, with descriptors bound by the names that the GLSL gives them.
//!
//! What is recorded here and in the files above has its sizes and usages checked. Two things cannot be: that barriers order
//! accesses and set layouts, and that what is recorded stays alive until it is submitted. Both are what the frame graph
//! is for, so only this crate records commands.
use super::device::Device;
use super::error::{Result, call};
use super::identity::Identity;
use super::image::{Image, Sampler};
use super::memory::Buffer;
use super::pipeline::{ComputePipeline, Pipeline};
use super::shader::Binding;
use ash::vk;
use std::sync::Arc;

/// Passes that a frame can time; more are recorded, but not timed.
pub(super) const MAX_TIMED_PASSES: u32 = 64;

/// What a binding refers to.
#[derive(Clone, Copy)]
pub enum Bound<'a> {
    /// A storage or uniform buffer.
    Buffer(&'a Buffer),
    /// An image read by `texelFetch`, or a storage image.
    Image(&'a Image),
    /// An image with its sampler.
    Sampled(&'a Image, &'a Sampler),
}

impl<'a> From<&'a Buffer> for Bound<'a> {
    fn from(buffer: &'a Buffer) -> Self {
        Self::Buffer(buffer)
    }
}

impl<'a> From<&'a Image> for Bound<'a> {
    fn from(image: &'a Image) -> Self {
        Self::Image(image)
    }
}

impl Bound<'_> {
    /// Which objects these are.
    pub(crate) fn identity(&self) -> (Identity, Option<Identity>) {
        match self {
            Self::Buffer(buffer) => (buffer.identity, None),
            Self::Image(image) => (image.identity, None),
            Self::Sampled(image, sampler) => (image.identity, Some(sampler.identity)),
        }
    }
}

/// How many workgroups a dispatch has.
#[derive(Clone, Copy)]
pub(crate) enum Groups<'a> {
    /// Known now.
    Direct([u32; 3]),
    /// Three u32 at this byte offset of a buffer that an earlier pass has written.
    Indirect(&'a Buffer, u64),
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
    pub(crate) fn timed_pass<E>(
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
    /// What is bound or pushed is not what the shader declares; more workgroups than the device runs.
    pub(crate) fn dispatch(
        &mut self,
        pipeline: &ComputePipeline,
        bindings: &[(&str, Bound)],
        push_constants: &[u8],
        groups: Groups,
    ) -> Result<()> {
        match groups {
            Groups::Direct(counts) => {
                let most = self.device.limits().max_compute_work_group_count;
                if counts.iter().zip(most).any(|(count, most)| *count > most) {
                    let problem = format!("{counts:?} workgroups, the device runs at most {most:?}");
                    return Err(pipeline.0.refuse(problem));
                }
            }
            Groups::Indirect(buffer, offset) => {
                buffer.check(&self.device, vk::BufferUsageFlags::INDIRECT_BUFFER, offset.saturating_add(12))?;
                if offset % 4 != 0 {
                    return Err(pipeline.0.refuse(format!("arguments at byte {offset}, which is no multiple of 4")));
                }
            }
        }
        self.bind(&pipeline.0, vk::PipelineBindPoint::COMPUTE, bindings)?;
        self.push(&pipeline.0, push_constants)?;
        // SAFETY: pipeline, descriptors and all push constants were set just above, the counts and the range of the arguments
        // checked; whoever records keeps the resources until the submission.
        unsafe {
            match groups {
                Groups::Direct([x, y, z]) => self.device.raw.cmd_dispatch(self.raw, x, y, z),
                Groups::Indirect(buffer, offset) => self.device.raw.cmd_dispatch_indirect(self.raw, buffer.raw, offset),
            }
        }
        Ok(())
    }

    /// An image barrier over all of `image`, for the frame graph.
    pub(crate) fn image_barrier<'a>(image: &Image) -> vk::ImageMemoryBarrier2<'a> {
        vk::ImageMemoryBarrier2::default().image(image.raw).subresource_range(image.shape.whole())
    }

    /// A buffer barrier over all of `buffer`, for the frame graph.
    pub(crate) fn buffer_barrier<'a>(buffer: &Buffer) -> vk::BufferMemoryBarrier2<'a> {
        vk::BufferMemoryBarrier2::default().buffer(buffer.raw).size(vk::WHOLE_SIZE)
    }

    /// Records barriers in one call.
    pub(crate) fn barriers(
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

    pub(super) fn push(&mut self, pipeline: &Pipeline, push_constants: &[u8]) -> Result<()> {
        if push_constants.len() != pipeline.push_constant_bytes as usize {
            let (given, wanted) = (push_constants.len(), pipeline.push_constant_bytes);
            return Err(pipeline.refuse(format!("{given} bytes of push constants given, {wanted} declared")));
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
    pub(super) fn bind(
        &mut self,
        pipeline: &Pipeline,
        point: vk::PipelineBindPoint,
        bindings: &[(&str, Bound)],
    ) -> Result<()> {
        self.device.check_same(&pipeline.device, pipeline.name)?;
        // SAFETY: the pipeline is alive, and of this device.
        unsafe { self.device.raw.cmd_bind_pipeline(self.raw, point, pipeline.raw) };
        if let Some((name, _)) = bindings.iter().find(|(name, _)| !pipeline.bindings.contains_key(*name)) {
            return Err(pipeline.refuse(format!("it declares no binding {name}")));
        }
        if pipeline.bindings.is_empty() {
            return Ok(());
        }
        let layouts = [pipeline.set_layout];
        let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(self.descriptor_pool).set_layouts(&layouts);
        // SAFETY: the pool belongs to the frame being recorded.
        let set = call("vkAllocateDescriptorSets", pipeline.name, || unsafe {
            self.device.raw.allocate_descriptor_sets(&info)
        })?[0];
        for (name, declared) in &pipeline.bindings {
            let given = bindings.iter().find(|(given, _)| given == name);
            let (_, bound) = given.ok_or_else(|| pipeline.refuse(format!("binding {name} is not given")))?;
            self.describe(pipeline, set, name, *declared, bound)?;
        }
        // SAFETY: the set was made for this pipeline's layout.
        unsafe { self.device.raw.cmd_bind_descriptor_sets(self.raw, point, pipeline.layout, 0, &[set], &[]) };
        Ok(())
    }

    /// Writes one descriptor of a set that is not yet in use.
    fn describe(
        &self,
        pipeline: &Pipeline,
        set: vk::DescriptorSet,
        name: &str,
        declared: Binding,
        bound: &Bound,
    ) -> Result<()> {
        use vk::{BufferUsageFlags as B, DescriptorType as D, ImageLayout as L, ImageUsageFlags as I};
        let write =
            vk::WriteDescriptorSet::default().dst_set(set).dst_binding(declared.index).descriptor_type(declared.kind);
        let limits = self.device.limits();
        let of_buffer = |buffer: &Buffer, usage, most_bytes: u32| {
            buffer.check(&self.device, usage, 0)?;
            buffer.check_is_seen(most_bytes)?;
            Ok([vk::DescriptorBufferInfo::default().buffer(buffer.raw).range(vk::WHOLE_SIZE)])
        };
        let of_image = |image: &Image, usage, layout| {
            image.check(&self.device, usage)?;
            Ok(vk::DescriptorImageInfo::default().image_view(image.view).image_layout(layout))
        };
        let (buffers, images);
        let write = match (bound, declared.kind) {
            (Bound::Buffer(buffer), D::STORAGE_BUFFER) => {
                buffers = of_buffer(buffer, B::STORAGE_BUFFER, limits.max_storage_buffer_range)?;
                write.buffer_info(&buffers)
            }
            (Bound::Buffer(buffer), D::UNIFORM_BUFFER) => {
                buffers = of_buffer(buffer, B::UNIFORM_BUFFER, limits.max_uniform_buffer_range)?;
                write.buffer_info(&buffers)
            }
            (Bound::Image(image), D::STORAGE_IMAGE) => {
                images = [of_image(image, I::STORAGE, L::GENERAL)?];
                write.image_info(&images)
            }
            (Bound::Image(image), D::SAMPLED_IMAGE) => {
                images = [of_image(image, I::SAMPLED, L::SHADER_READ_ONLY_OPTIMAL)?];
                write.image_info(&images)
            }
            (Bound::Sampled(image, sampler), D::COMBINED_IMAGE_SAMPLER) => {
                self.device.check_same(&sampler.device, name)?;
                images = [of_image(image, I::SAMPLED, L::SHADER_READ_ONLY_OPTIMAL)?.sampler(sampler.raw)];
                write.image_info(&images)
            }
            (_, kind) => return Err(pipeline.refuse(format!("binding {name} is declared as {kind:?}"))),
        };
        // SAFETY: the set is fresh and not yet in use; what it refers to is alive, made for that use, and the infos outlive
        // the call.
        unsafe { self.device.raw.update_descriptor_sets(&[write], &[]) };
        Ok(())
    }
}
