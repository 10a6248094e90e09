//! Copies what the CPU wants to see into memory that it can read.
use crate::Result;
use crate::graph::{
    Access, BufferDesc, BufferHandle, DeviceResource, Executable, FrameGraph, Handle, ImageDesc, ImageHandle,
};
use crate::vulkan::{self, BufferUse, Device, Frames, PassTime};
use ash::vk;
use std::sync::Arc;

/// What names of passes begin with that only copy results into memory that the CPU reads.
const PREFIX: &str = "read_";

impl PassTime {
    /// Whether the pass is one of [`Readbacks`]: it only copies results into memory that the CPU reads.
    pub fn is_readback(&self) -> bool {
        self.name.starts_with(PREFIX)
    }

    /// Time on the GPU of all `passes` but these, in milliseconds.
    pub fn ms_but_readbacks(passes: &[Self]) -> f64 {
        passes.iter().filter(|pass| !pass.is_readback()).map(|pass| pass.gpu_ms).sum()
    }
}

/// Adds copies into host memory to a graph.
pub struct Readbacks<'a, 'd> {
    /// With the copies that were asked for so far.
    pub graph: FrameGraph<'a>,
    device: &'d Arc<Device>,
    /// What its execution is given.
    pub imports: Vec<(Handle, DeviceResource)>,
}

impl<'a, 'd> Readbacks<'a, 'd> {
    /// For a graph that is otherwise complete.
    pub fn new(device: &'d Arc<Device>, graph: FrameGraph<'a>) -> Self {
        Self { graph, device, imports: Vec::new() }
    }

    /// Executes the graph once, and waits for it.
    ///
    /// # Errors
    /// Whatever Vulkan refuses; errors name the work as `name`.
    pub fn run(self, name: &str) -> Result<()> {
        let Self { graph, device, imports } = self;
        let executable = Executable::new(device, graph, &imports)?;
        let mut frames = Frames::new(device, name, 1)?;
        executable.execute(&mut frames)?;
        Ok(frames.wait()?)
    }

    /// Imports a buffer that the CPU will read after the frame.
    fn target(&mut self, name: &str, size_bytes: u64) -> Result<(BufferHandle, Arc<vulkan::Buffer>)> {
        let usage = vk::BufferUsageFlags::TRANSFER_DST;
        let target = Arc::new(vulkan::Buffer::new(self.device, name, size_bytes, usage, BufferUse::Readback)?);
        let handle = self.graph.import_buffer(name, BufferDesc { size_bytes }, None, Some(Access::HostRead));
        self.imports.push((handle.into(), DeviceResource::Buffer(target.clone())));
        Ok((handle, target))
    }

    /// The memory that `source` will be copied to.
    ///
    /// # Errors
    /// No memory left.
    pub fn buffer(&mut self, name: &str, source: BufferHandle, size_bytes: u64) -> Result<Arc<vulkan::Buffer>> {
        let pass = format!("{PREFIX}{name}");
        let (mut handle, target) = self.target(&format!("{pass}_target"), size_bytes)?;
        self.graph.copy_buffer(&pass, source, &mut handle);
        self.graph.output(handle);
        Ok(target)
    }

    /// The memory that `source` will be copied to; none if it is not wanted.
    ///
    /// # Errors
    /// No memory left.
    pub fn image(&mut self, name: &str, source: ImageHandle, wanted: bool) -> Result<Option<Arc<vulkan::Buffer>>> {
        if !wanted {
            return Ok(None);
        }
        let shape = |desc: ImageDesc| vulkan::ImageShape::plane(desc.format, desc.width, desc.height);
        // What is not copied, executing the graph tells.
        let bytes = self.graph.image_desc(source).and_then(|desc| shape(desc).level_bytes(0)).unwrap_or(1);
        let pass = format!("{PREFIX}{name}");
        let (mut handle, target) = self.target(&format!("{pass}_target"), bytes)?;
        self.graph.copy_image(&pass, source, &mut handle);
        self.graph.output(handle);
        Ok(Some(target))
    }
}

/// The contents of a buffer that was read back; empty if it was not wanted.
pub fn texels<T: bytemuck::Pod>(buffer: Option<&vulkan::Buffer>) -> Vec<T> {
    let bytes = buffer.and_then(|buffer| buffer.contents()).unwrap_or_default();
    bytemuck::pod_collect_to_vec(bytes)
}
