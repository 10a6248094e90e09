//! Blurs an environment by the kernels that fitted threads look up, once at load: a graph of its own, a pass a level.
use super::{FrameGraph, Readbacks, texels};
use crate::Result;
use crate::environment::{Kernel, Pyramid, Step, VmfPyramid};
use crate::graph::{Access, BufferDesc, Executable, Object};
use crate::vulkan::{Bindings, Buffer, ComputePipeline, Device, Frames, Groups, PipelineCache, compiled};
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
    let finest_texels = bytemuck::cast_slice(&source.levels[0]);
    let finest = Arc::new(Buffer::with_contents(device, "box", vk::BufferUsageFlags::STORAGE_BUFFER, finest_texels)?);
    let mut graph = FrameGraph::new();
    let size_bytes = finest_texels.len() as u64;
    let finest_handle = graph.import_buffer("box", BufferDesc { size_bytes }, Some(Access::StorageReadCompute), None);
    let steps = VmfPyramid::steps(source.face_size);
    let mut maps = Vec::new();
    for (index, step) in steps.iter().enumerate() {
        let from = step.from.map_or(finest_handle, |from| maps[from]);
        let size_bytes = size_bytes_of(step);
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
        maps.push(level);
    }
    // The others have served.
    let levels = steps.iter().zip(maps).enumerate().filter(|(_, (step, _))| step.kernel == Kernel::Vmf);
    let mut readbacks = Readbacks::new(device, graph);
    readbacks.imports.push((finest_handle.into(), Object::Buffer(finest)));
    let targets =
        levels.map(|(index, (step, map))| readbacks.buffer(&format!("read_map_{index}"), map, size_bytes_of(step)));
    let targets = targets.collect::<Result<Vec<_>>>()?;
    let Readbacks { graph, imports, .. } = readbacks;
    let executable = Executable::new(device, graph, &imports)?;
    let mut frames = Frames::new(device, "vmf_pyramid", 1)?;
    executable.execute(&mut frames)?;
    frames.wait()?;
    let levels = targets.iter().map(|target| texels(Some(target))).collect();
    Ok(VmfPyramid { levels: Pyramid { face_size: source.face_size, levels } })
}

/// Size of the map that a step makes.
fn size_bytes_of(step: &Step) -> u64 {
    (6 * step.size * step.size * size_of::<[f32; 3]>()) as u64
}
