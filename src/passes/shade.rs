//! Pass 2 of the paper (section 4.2): the radiance of every listed pixel, by its partition of the sample threads.
use super::{CameraRays, Counters, DeviceLight, Tiles, View};
use crate::brdf::{Brdf, half_vector_width};
use crate::graph::{BufferDesc, BufferHandle, FrameGraph, ImageHandle};
use crate::method::Method;
use crate::threads::{Sample, SliceTable, Threads};
use crate::vulkan::{
    self, Bound, Buffer, ComputePipeline, Device, ImageKind, ImageShape, PipelineCache, Sampler, SamplerKind,
};
use crate::{Error, Result};
use ash::vk;
use bytemuck::{Pod, Zeroable};
use std::sync::Arc;

/// `Material` in glsl/material.glsl.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct MaterialRecord {
    parameters: [f32; 12],
    model: u32,
    first_thread: u32,
    thread_count: u32,
    row_count: u32,
    first_slice: u32,
    lobe_width: f32,
    padding: [u32; 2],
}

/// Materials, their threads or CDFs, and their tables on the device.
pub struct DeviceMaterials {
    records: Buffer,
    threads: Option<Buffer>,
    slices: Option<Buffer>,
    tables: vulkan::Image,
    table_sampler: Sampler,
    /// Bit i: the BRDF of model i is evaluated.
    models_used: u32,
}

impl DeviceMaterials {
    /// Uploads what `method` looks up of `materials`, in the order of the indices that objects have; their BRDFs only if it
    /// `evaluates_brdf`.
    ///
    /// # Errors
    /// No device memory left, or more measured tables than a 3D image of the device holds.
    ///
    /// # Panics
    /// Threads of another kind than the method's: its shader would take one for the other.
    pub fn new<'m>(
        device: &Arc<Device>,
        method: Method,
        materials: impl IntoIterator<Item = (&'m Brdf, Option<&'m Threads>)>,
        evaluates_brdf: bool,
    ) -> Result<Self> {
        let use_slices = method.shader()?.declares("Slices")?;
        let mut records = Vec::new();
        let mut threads: Vec<u32> = Vec::new();
        let mut slices: Vec<f32> = Vec::new();
        let mut tables = TableAtlas::default();
        let mut models_used = 0;
        for (brdf, thread_table) in materials {
            let mut parameters = brdf.gpu_parameters();
            if let Some(table) = brdf.table().filter(|_| evaluates_brdf) {
                // glsl/brdf/merl.glsl reads its place in the atlas from a.xy.
                parameters[..2].copy_from_slice(&tables.add(device, table.texels())?.map(|texels| texels as f32));
            }
            if evaluates_brdf {
                models_used |= 1 << brdf.model_index();
            }
            if let Some(kind) = method.threads() {
                assert_eq!(thread_table.map(Threads::kind), Some(kind), "threads of method {}", method.name());
            }
            let [row_count, thread_count] = thread_table.map_or([0, 0], Threads::size);
            records.push(MaterialRecord {
                parameters,
                model: brdf.model_index(),
                first_thread: (threads.len() / words_a_thread(thread_table)) as u32,
                thread_count: thread_count as u32,
                row_count: row_count as u32,
                first_slice: slices.len() as u32,
                lobe_width: half_vector_width(brdf) as f32,
                padding: [0; 2],
            });
            if let Some(table) = thread_table {
                append_threads(&mut threads, table);
            }
            if use_slices {
                slices.extend(SliceTable::new(brdf).cdfs);
            }
        }
        let storage =
            |name, contents: &[u8]| Buffer::with_contents(device, name, vk::BufferUsageFlags::STORAGE_BUFFER, contents);
        let optional = |name, contents: &[u8]| (!contents.is_empty()).then(|| storage(name, contents)).transpose();
        Ok(Self {
            records: storage("materials", bytemuck::cast_slice(&records))?,
            threads: optional("threads", bytemuck::cast_slice(&threads))?,
            slices: optional("slices", bytemuck::cast_slice(&slices))?,
            tables: tables.upload(device)?,
            table_sampler: Sampler::new(device, "brdf tables", SamplerKind::WrappedLinear)?,
            models_used,
        })
    }
}

impl DeviceMaterials {
    /// All of it, by name in the shader; the last two as the method declares them.
    fn bindings(&self) -> Vec<(&'static str, Bound<'_>)> {
        let tables = Bound::Sampled(&self.tables, &self.table_sampler);
        let optional = [("Threads", &self.threads), ("Slices", &self.slices)];
        let optional = optional.into_iter().filter_map(|(name, buffer)| Some((name, Bound::from(buffer.as_ref()?))));
        [("Materials", Bound::from(&self.records)), ("brdf_tables", tables)].into_iter().chain(optional).collect()
    }
}

/// Words of an element of the buffer of threads, as their shader declares it: a vec4, or a word.
fn words_a_thread(threads: Option<&Threads>) -> usize {
    if matches!(threads, Some(Threads::Paper(_))) { 4 } else { 1 }
}

/// Appends `threads` as their shader reads them: glsl/methods/paper.glsl, glsl/methods/fitted.glsl.
fn append_threads(words: &mut Vec<u32>, threads: &Threads) {
    match threads {
        Threads::Fitted(table) => {
            for (row, cosine_part) in table.cosine_part.iter().enumerate() {
                words.extend(cosine_part.map(f32::to_bits));
                words.extend(table.row(row).iter().flat_map(|kernel| kernel.0));
            }
        }
        Threads::Paper(table) => {
            for (row, [red, green, blue]) in table.albedo.iter().copied().enumerate() {
                words.extend([red, green, blue, 0.0].map(f32::to_bits));
                let thread = |sample: &Sample| sample.direction().as_vec3().extend(sample.p.log2()).to_array();
                words.extend(table.row(row).iter().flat_map(thread).map(f32::to_bits));
            }
        }
    }
}

/// All measured tables in one 3D image: side by side along theta_d (y) and theta_h (z), since phi_d (x) repeats.
#[derive(Default)]
struct TableAtlas<'a>(Vec<&'a [glam::Vec4]>);

/// Texels of a table along phi_d, and along each of theta_d and theta_h.
const TABLE_WIDTH: usize = crate::brdf::merl::PHI_D_BINS;
const TABLE_SIDE: usize = crate::brdf::merl::THETA_D_BINS;

impl<'a> TableAtlas<'a> {
    /// Adds a table; returns its offset in y and z, in texels.
    fn add(&mut self, device: &Device, texels: &'a [glam::Vec4]) -> Result<[usize; 2]> {
        let per_axis = device.limits().max_image_dimension3_d as usize / TABLE_SIDE;
        let index = self.0.len();
        if index >= per_axis * per_axis {
            let problem =
                format!("has more measured materials than the {} that this device holds", per_axis * per_axis);
            return Err(Error::input("the scene", problem, "use fewer"));
        }
        self.0.push(texels);
        Ok([index % per_axis, index / per_axis].map(|place| place * TABLE_SIDE))
    }

    /// The image; a single empty texel if there is no table, since the shader's binding needs something.
    fn upload(&self, device: &Arc<Device>) -> Result<vulkan::Image> {
        let single = vk::Format::R32G32B32A32_SFLOAT;
        let format = if device.filters_linearly(single) { single } else { vk::Format::R16G16B16A16_SFLOAT };
        let per_axis = device.limits().max_image_dimension3_d as usize / TABLE_SIDE;
        let (columns, rows) = (self.0.len().min(per_axis), self.0.len().div_ceil(per_axis));
        let extent = match self.0.len() {
            0 => [1, 1, 1],
            _ => [TABLE_WIDTH, TABLE_SIDE * columns, TABLE_SIDE * rows],
        };
        let mut texels = vec![glam::Vec4::ZERO; extent.iter().product()];
        for (index, table) in self.0.iter().enumerate() {
            let (y_0, z_0) = (index % per_axis * TABLE_SIDE, index / per_axis * TABLE_SIDE);
            for (line, source) in table.chunks_exact(TABLE_WIDTH).enumerate() {
                let (y, z) = (y_0 + line % TABLE_SIDE, z_0 + line / TABLE_SIDE);
                let start = TABLE_WIDTH * (y + extent[1] * z);
                texels[start..start + TABLE_WIDTH].copy_from_slice(source);
            }
        }
        let bytes = if format == single {
            bytemuck::cast_slice(&texels).to_vec()
        } else {
            let half = texels.iter().flat_map(|texel| texel.to_array().map(half::f16::from_f32)).collect::<Vec<_>>();
            bytemuck::cast_slice(&half).to_vec()
        };
        let extent = extent.map(|size| size as u32);
        let shape = ImageShape { format, extent, levels: 1, kind: ImageKind::Volume };
        Ok(vulkan::Image::with_texels(device, "brdf tables", shape, &[bytes])?)
    }
}

/// How a method samples: nothing that would need another shader.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sampling {
    /// Threads of a pixel, or samples of methods that have none.
    pub count: u32,
    /// What the random numbers of those start from.
    pub seed: u64,
}

/// What the pass is made of.
#[derive(Clone)]
pub struct Shade {
    pipeline: Arc<ComputePipeline>,
    /// What objects are made of.
    pub materials: Arc<DeviceMaterials>,
    /// What lights them.
    pub light: Arc<DeviceLight>,
    /// How many threads or samples, and which random numbers.
    pub sampling: Sampling,
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Push {
    camera: CameraRays,
    size_px: [u32; 2],
    kind: u32,
    face_size: f32,
    rotation: [f32; 2],
    radiance_scale: f32,
    sample_count: u32,
    seed: [u32; 2],
}

impl Push {
    fn new(view: &View, sampling: &Sampling, light: &DeviceLight, kind: u32) -> Self {
        Self {
            camera: view.camera_rays(),
            size_px: [view.width, view.height],
            kind,
            face_size: light.face_size(),
            rotation: view.rotation(),
            radiance_scale: view.intensity as f32 * light.radiance_scale(),
            sample_count: sampling.count,
            seed: [sampling.seed as u32, (sampling.seed >> 32) as u32],
        }
    }
}

impl Shade {
    /// Compiles the variant of the shader for `method`, with the models that `materials` use.
    ///
    /// # Errors
    /// A driver that cannot compile it, or a method that has no shader.
    pub fn new(
        device: &Arc<Device>,
        cache: &PipelineCache,
        method: Method,
        sampling: Sampling,
        subpixels: u32,
        materials: Arc<DeviceMaterials>,
        light: Arc<DeviceLight>,
    ) -> Result<Self> {
        let constants = [("SUBPIXELS", subpixels), ("MODELS_USED", materials.models_used)];
        let pipeline = Arc::new(ComputePipeline::new(device, cache, method.shader()?, &constants)?);
        Ok(Self { pipeline, materials, light, sampling })
    }
}

/// What shading leaves.
#[derive(Clone, Copy)]
pub struct Shaded {
    /// Linear radiance times coverage, and coverage.
    pub radiance: ImageHandle,
    /// Number of lookups in the environment that were made: a u64.
    pub lookups: BufferHandle,
}

/// Shades the pixels that `tiles` lists: interior ones with one sum shared by all sub-pixels, then those at edges.
pub fn shade<'a>(
    graph: &mut FrameGraph<'a>,
    shade: &'a Shade,
    geometry: ImageHandle,
    tiles: &Tiles,
    view: &View,
) -> Shaded {
    let Tiles { counters, tiles, pixels, mut radiance } = *tiles;
    let Shade { pipeline, materials, light, sampling } = shade;
    let mut lookups = graph.buffer("lookups", BufferDesc { size_bytes: size_of::<u64>() as u64 });
    graph.clear_buffer("clear_lookups", &mut lookups);
    let dispatch = |kind| (Counters::arguments_of(kind), Push::new(view, sampling, light, kind));
    graph
        .compute("shade", pipeline)
        .read("geometry", geometry)
        .read("counters", counters)
        .read("tile_list", tiles)
        .read("pixel_list", pixels)
        .modify("radiance", &mut radiance)
        .modify("all_lookups", &mut lookups)
        .bind_all(materials.bindings())
        .bind_all(light.bindings())
        .indirect(counters, [0, 1].map(dispatch));
    Shaded { radiance, lookups }
}
