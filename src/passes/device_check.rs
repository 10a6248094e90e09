//! Has a device do once what shading relies on: lookups in cube maps and tables, half floats, atomics.
use super::cube_borders::WayAround;
use super::light::DevicePyramid;
use super::{Readbacks, texels};
use crate::Result;
use crate::environment::Pyramid;
use crate::graph::{Access, BufferDesc, DeviceResource, FrameGraph};
use crate::vulkan::{
    self, Buffer, ComputePipeline, Device, ImageKind, ImageShape, PipelineCache, Sampler, SamplerKind, compiled,
};
use ash::vk;
use bytemuck::{Pod, Zeroable};
use glam::Vec4;
use half::f16;
use std::sync::Arc;

/// A table in three dimensions, looked up as those of BRDFs are: wrapped along the first, clamped along the others.
pub struct Volume {
    /// Texels along each axis.
    pub extent: [u32; 3],
    /// Texels, the first axis fastest.
    pub texels: Vec<Vec4>,
}

/// What a device is asked.
pub struct Questions {
    /// One that fits half floats.
    pub cube: Pyramid,
    /// One that does not.
    pub wide_cube: Pyramid,
    /// A table.
    pub volume: Volume,
    /// Where both cube maps are looked up: a direction of any length, and the level.
    pub directions: Vec<Vec4>,
    /// Where the table is: coordinates, 0 to 1 from edge to edge.
    pub places: Vec<Vec4>,
    /// Half floats, four of which are unpacked at a time.
    pub halves: Vec<[f16; 4]>,
}

/// What it answers.
#[derive(Clone, Debug)]
pub struct Answers {
    /// Of the cube map, for each direction.
    pub cube: Vec<Vec4>,
    /// Of the wide one.
    pub wide_cube: Vec<Vec4>,
    /// Of the table, for each place.
    pub volume: Vec<Vec4>,
    /// The numbers.
    pub halves: Vec<Vec4>,
    /// The sum of i + 1 over the indices i of all questions, by atomics within workgroups and then among them.
    pub total: u32,
    /// The largest i + 1.
    pub largest: u32,
    /// The indices in the order in which they came.
    pub order: Vec<u32>,
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Push {
    cube_end: u32,
    wide_cube_end: u32,
    volume_end: u32,
    half_end: u32,
}

/// What `device` answers to `questions`, its cube maps uploaded by `way_around`.
///
/// # Errors
/// Whatever Vulkan refuses.
pub fn ask(
    device: &Arc<Device>,
    cache: &PipelineCache,
    questions: &Questions,
    way_around: Option<WayAround>,
) -> Result<Answers> {
    let pipeline = ComputePipeline::new(device, cache, &compiled::DEVICE_CHECK, &[])?;
    let upload =
        |name, pyramid: &Pyramid| DevicePyramid::new(device, name, pyramid, pyramid.radiance_scale(), way_around);
    let (cube, wide_cube) = (upload("asked cube", &questions.cube)?, upload("asked wide cube", &questions.wide_cube)?);
    let volume = upload_volume(device, &questions.volume)?;
    let sampler = Sampler::new(device, "asked table", SamplerKind::WrappedLinear)?;
    let (list, push) = questions.list();
    let (count, storage) = (push.half_end, vk::BufferUsageFlags::STORAGE_BUFFER);
    let list = Buffer::with_contents(device, "questions", storage, bytemuck::cast_slice(&list))?;
    let zeros = vec![0_u8; size_of::<u32>() * (3 + count as usize)];
    let usage = storage | vk::BufferUsageFlags::TRANSFER_SRC;
    let counts = Arc::new(Buffer::with_contents(device, "counts", usage, &zeros)?);

    let mut graph = FrameGraph::new();
    let mut answers = graph.buffer("answers", BufferDesc { size_bytes: list.size_bytes() });
    let counts_desc = BufferDesc { size_bytes: counts.size_bytes() };
    let mut counts_handle = graph.import_buffer("counts", counts_desc, Some(Access::StorageWriteCompute), None);
    let counts_import = (counts_handle.into(), DeviceResource::Buffer(counts.clone()));
    graph
        .compute("device_check", &pipeline)
        .sampled("cube", &cube.image, &cube.sampler)
        .sampled("wide_cube", &wide_cube.image, &wide_cube.sampler)
        .sampled("volume", &volume, &sampler)
        .bind("Questions", &list)
        .write("Answers", &mut answers)
        .modify("counts", &mut counts_handle)
        .push(&push)
        .cover([count, 1, 1]);
    let mut readbacks = Readbacks::new(device, graph);
    readbacks.imports.push(counts_import);
    let answered = readbacks.buffer("answers", answers, list.size_bytes())?;
    let counted = readbacks.buffer("counts", counts_handle, counts.size_bytes())?;
    readbacks.run("device check")?;

    let answered: Vec<Vec4> = texels(Some(&answered));
    let of = |start: u32, end: u32, scale: f32| -> Vec<Vec4> {
        answered[start as usize..end as usize].iter().map(|answer| scale * answer).collect()
    };
    let counted: Vec<u32> = texels(Some(&counted));
    Ok(Answers {
        cube: of(0, push.cube_end, cube.scale),
        wide_cube: of(push.cube_end, push.wide_cube_end, wide_cube.scale),
        volume: of(push.wide_cube_end, push.volume_end, 1.0),
        halves: of(push.volume_end, push.half_end, 1.0),
        total: counted[0],
        largest: counted[1],
        order: counted[3..].to_vec(),
    })
}

impl Questions {
    /// All of them one after another, and where each kind ends.
    fn list(&self) -> (Vec<Vec4>, Push) {
        let bits = |halves: &[f16; 4]| -> Vec4 {
            let pair =
                |i: usize| f32::from_bits(u32::from(halves[i].to_bits()) | u32::from(halves[i + 1].to_bits()) << 16);
            Vec4::new(pair(0), pair(2), 0.0, 0.0)
        };
        let halves: Vec<_> = self.halves.iter().map(bits).collect();
        let list = [&self.directions[..], &self.directions, &self.places, &halves].concat();
        let cube_end = self.directions.len() as u32;
        let volume_end = 2 * cube_end + self.places.len() as u32;
        let push = Push { cube_end, wide_cube_end: 2 * cube_end, volume_end, half_end: list.len() as u32 };
        (list, push)
    }
}

/// In half precision, as tables of BRDFs are.
fn upload_volume(device: &Arc<Device>, volume: &Volume) -> Result<vulkan::Image> {
    let halves: Vec<_> = volume.texels.iter().map(|texel| texel.to_array().map(f16::from_f32)).collect();
    let format = vk::Format::R16G16B16A16_SFLOAT;
    let shape = ImageShape { format, extent: volume.extent, levels: 1, kind: ImageKind::Volume };
    Ok(vulkan::Image::with_texels(device, "asked table", shape, &[bytemuck::cast_slice(&halves).to_vec()])?)
}
