//! Blurs an environment by the kernels that fitted threads look up, once at load.
//!
//! In many short submissions, since a device without a second queue (such as a processor) draws no frame until a submission has ended,
//! and so that it can be cancelled.
use super::{Readbacks, texels};
use crate::Result;
use crate::environment::{BlurKernel, BlurStep, Pyramid, VmfPyramid};
use crate::graph::{Access, BufferDesc, DeviceResource, Executable, FrameGraph};
use crate::progress::{Observer, Parts};
use crate::vulkan::{Buffer, BufferUse, ComputePipeline, Device, Frames, PipelineCache, compiled};
use ash::vk;
use bytemuck::{Pod, Zeroable};
use std::cell::Cell;
use std::sync::Arc;

/// Maps with smaller faces are made at once; in larger ones a submission is a row of workgroups of one face.
const SMALLEST_DIVIDED: usize = 64;

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Push {
    from_size: u32,
    size: u32,
    from_kernel: u32,
    kernel: u32,
    first_row: u32,
    first_face: u32,
}

/// The pyramid of vMF kernels of the environment whose box-filtered one is `source`, made on `device`. `observer` hears of submissions.
///
/// # Errors
/// Whatever Vulkan refuses; cancelled.
pub fn vmf_pyramid(
    device: &Arc<Device>,
    cache: &PipelineCache,
    source: &Pyramid,
    observer: &dyn Observer,
) -> Result<VmfPyramid> {
    let pipeline = ComputePipeline::new(device, cache, &compiled::VMF_PYRAMID, &[])?;
    let finest_texels = bytemuck::cast_slice(&source.levels[0]);
    let storage = vk::BufferUsageFlags::STORAGE_BUFFER;
    let finest = Arc::new(Buffer::with_contents(device, "box", storage, finest_texels)?);
    let steps = VmfPyramid::steps(source.face_size);
    let total = steps.iter().map(|step| parts(&pipeline, step.size).count()).sum();
    let submissions = Parts::new(total, observer);
    let (mut maps, mut levels) = (Vec::new(), Vec::new());
    for step in &steps {
        let usage = storage | vk::BufferUsageFlags::TRANSFER_SRC;
        let map = Arc::new(Buffer::new(device, "vmf_map", size_bytes_of(step), usage, BufferUse::Device)?);
        let from = step.from.map_or(&finest, |from| &maps[from]);
        blur(device, &pipeline, step, from, &map, &submissions)?;
        // The others have served.
        if step.kernel == BlurKernel::Vmf {
            levels.push(read_back(device, &map)?);
        }
        maps.push(map);
    }
    Ok(VmfPyramid { levels: Pyramid { face_size: source.face_size, levels } })
}

/// First row and first face of each part of a map with faces of `size`.
fn parts(pipeline: &ComputePipeline, size: usize) -> impl Iterator<Item = [u32; 2]> + use<> {
    let group_rows = pipeline.group_size()[1];
    let (rows, faces) = if size < SMALLEST_DIVIDED { (1, 1) } else { ((size as u32).div_ceil(group_rows), 6) };
    (0..faces).flat_map(move |face| (0..rows).map(move |row| [row * group_rows, face]))
}

/// Makes the map of `step` part by part.
fn blur(
    device: &Arc<Device>,
    pipeline: &ComputePipeline,
    step: &BlurStep,
    from: &Arc<Buffer>,
    map: &Arc<Buffer>,
    submissions: &Parts,
) -> Result<()> {
    let part = Cell::new([0; 2]);
    let BlurStep { from_kernel, from_size, size, kernel, .. } = *step;
    let mut graph = FrameGraph::new();
    let mut import = |name: &str, buffer: &Arc<Buffer>| {
        let desc = BufferDesc { size_bytes: buffer.size_bytes() };
        graph.import_buffer(name, desc, Some(Access::StorageWriteCompute), None)
    };
    let (source, mut target) = (import("source", from), import("vmf_map", map));
    let imports =
        [(source.into(), DeviceResource::Buffer(from.clone())), (target.into(), DeviceResource::Buffer(map.clone()))];
    let size_u32 = size as u32;
    graph
        .compute("blur", pipeline)
        .read("Source", source)
        .modify("Destination", &mut target)
        .push_later(|| {
            let [first_row, first_face] = part.get();
            let (from_kernel, kernel) = (from_kernel as u32, kernel as u32);
            Push { from_size: from_size as u32, size: size_u32, from_kernel, kernel, first_row, first_face }
        })
        // One row of workgroups, or all of all faces.
        .cover(if size < SMALLEST_DIVIDED { [size_u32, size_u32, 6] } else { [size_u32, 1, 1] });
    graph.output(target);
    let executable = Executable::new(device, graph, &imports)?;
    let mut frames = Frames::new(device, "vmf_pyramid", 1)?;
    for place in parts(pipeline, size) {
        part.set(place);
        executable.execute(&mut frames)?;
        frames.wait()?;
        submissions.advance()?;
    }
    Ok(())
}

/// The texels of `map`.
fn read_back(device: &Arc<Device>, map: &Arc<Buffer>) -> Result<Vec<[f32; 3]>> {
    let mut graph = FrameGraph::new();
    let desc = BufferDesc { size_bytes: map.size_bytes() };
    let handle = graph.import_buffer("vmf_map", desc, Some(Access::StorageWriteCompute), None);
    let mut readbacks = Readbacks::new(device, graph);
    readbacks.imports.push((handle.into(), DeviceResource::Buffer(map.clone())));
    let target = readbacks.buffer("map", handle, map.size_bytes())?;
    readbacks.run("vmf_pyramid")?;
    Ok(texels(Some(&target)))
}

/// Size of the map that a step makes.
fn size_bytes_of(step: &BlurStep) -> u64 {
    (6 * step.size * step.size * size_of::<[f32; 3]>()) as u64
}
