//! Blurs an environment by the kernels that fitted threads look up, once at load: a graph of its own, a pass a level.
use super::{FrameGraph, read_buffer};
use crate::Result;
use crate::environment::{Pyramid, Step, VmfPyramid};
use crate::graph::{Access, BufferDesc, Executable};
use crate::vulkan::{Bindings, Buffer, BufferUse, ComputePipeline, Device, Frames, Groups, PipelineCache, compiled};
use ash::vk;
use bytemuck::{Pod, Zeroable};
use std::sync::Arc;

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Push {
    from_size: u32,
    size: u32,
    from_kernel: u32,
    kernel: u32,
}

/// The pyramid of vMF kernels of the environment whose box-filtered one is `source`, made on `device`.
///
/// # Errors
/// Whatever Vulkan refuses.
pub fn vmf_pyramid(device: &Arc<Device>, cache: &PipelineCache, source: &Pyramid) -> Result<VmfPyramid> {
    let pipeline = ComputePipeline::new(device, cache, &compiled::VMF_PYRAMID, &[])?;
    let texels = bytemuck::cast_slice(&source.levels[0]);
    let finest = Arc::new(Buffer::with_contents(device, "box", vk::BufferUsageFlags::STORAGE_BUFFER, texels)?);
    let mut graph = FrameGraph::new();
    let size_bytes = texels.len() as u64;
    let finest_handle = graph.import_buffer("box", BufferDesc { size_bytes }, Some(Access::StorageReadCompute), None);
    let mut imports = vec![(finest_handle, finest)];
    let (mut levels, mut targets) = (Vec::new(), Vec::new());
    for (index, step) in VmfPyramid::steps(source.face_size).iter().enumerate() {
        let size_bytes = (6 * step.size * step.size * size_of::<[f32; 3]>()) as u64;
        let from = step.from.map_or(finest_handle, |from| levels[from]);
        let level = graph.buffer(&format!("map_{index}"), BufferDesc { size_bytes });
        let mut pass = graph.pass(&format!("blur_{index}"));
        pass.read(from, Access::StorageReadCompute);
        let level = pass.write(level, Access::StorageWriteCompute);
        let (pipeline, step) = (&pipeline, *step);
        pass.record(Box::new(move |commands, resources| {
            let bindings =
                Bindings::new().buffer("Source", resources.buffer(from)).buffer("Destination", resources.buffer(level));
            let Step { from_kernel, from_size, size, kernel, .. } = step;
            let push = Push {
                from_size: from_size as u32,
                size: size as u32,
                from_kernel: from_kernel as u32,
                kernel: kernel as u32,
            };
            let groups = size.div_ceil(8) as u32;
            commands.dispatch(pipeline, &bindings, bytemuck::bytes_of(&push), Groups::Direct([groups, groups, 6]))
        }));
        levels.push(level);
        let name = format!("read_level_{index}");
        let usage = vk::BufferUsageFlags::TRANSFER_DST;
        let target = Arc::new(Buffer::new(device, &name, size_bytes, usage, BufferUse::Readback)?);
        let handle = graph.import_buffer(&name, BufferDesc { size_bytes }, None, Some(Access::HostRead));
        imports.push((handle, target.clone()));
        let copied = read_buffer(&mut graph, &name, level, handle);
        graph.output(copied);
        targets.push(target);
    }
    let executable = Executable::new(device, graph, &imports)?;
    let mut frames = Frames::new(device, "vmf_pyramid", 1)?;
    executable.execute(&mut frames)?;
    frames.wait()?;
    let level = |target: &Arc<Buffer>| bytemuck::pod_collect_to_vec(target.contents().unwrap_or_default());
    Ok(VmfPyramid::from_maps(source.face_size, targets.iter().map(level).collect()))
}
