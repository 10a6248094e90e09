//! Pass 2 of the paper (section 4.2): the radiance of every listed pixel, by its partition of the sample threads.
use super::{CameraRays, Counters, DeviceLight, Tiles, View};
use crate::brdf::{MaterialRecord, MerlTable, ThreadSetRecord};
use crate::graph::{BufferDesc, BufferHandle, FrameGraph, ImageDesc, ImageHandle};
use crate::memo::Keyed;
use crate::method::Method;
use crate::threads::{SliceTable, ThreadSets, Threads, WithThreads};
use crate::vulkan::{self, Bound, Buffer, ComputePipeline, Device, ImageKind, ImageShape, Sampler, SamplerKind};
use crate::{Error, Result};
use ash::vk;
use bytemuck::{Pod, Zeroable};
use std::sync::Arc;

/// Materials, their threads or CDFs, and their tables on the device.
pub struct DeviceMaterials {
    records: Buffer,
    threads: Option<Buffer>,
    slices: Option<Buffer>,
    tables: vulkan::Image,
    table_sampler: Sampler,
    /// Bit i: the BRDF of model i is evaluated.
    pub models_used: u32,
}

impl DeviceMaterials {
    /// Uploads what `method` looks up of `materials`, in the order of the indices that objects have; their BRDFs only if it
    /// `evaluates_brdf`. `finest_level` is level 0 of the blurred environment on the scale of kernels, if that is looked up.
    ///
    /// # Errors
    /// No device memory left, or more measured tables than a 3D image of the device holds.
    ///
    /// # Panics
    /// Threads of another kind than the method's: its shader would take one for the other.
    pub fn new<'m>(
        device: &Arc<Device>,
        method: Method,
        materials: impl IntoIterator<Item = WithThreads<'m>>,
        evaluates_brdf: bool,
        finest_level: Option<f32>,
    ) -> Result<Self> {
        let use_slices = method.lookups().slices;
        let mut records = Vec::new();
        let mut threads = ThreadWords { words: Vec::new(), finest_level };
        let mut slices: Vec<f32> = Vec::new();
        let mut tables = TableAtlas::default();
        let mut models_used = 0;
        for (brdf, thread_sets) in materials {
            let mut record = MaterialRecord::new(brdf);
            if let Some(table) = evaluates_brdf.then(|| brdf.table()).flatten() {
                record = record.with_table_at(tables.add(device, table)?);
            }
            if evaluates_brdf {
                models_used |= 1 << record.model;
            }
            if let Some(kind) = method.threads() {
                let kinds = thread_sets.map(|sets| sets.map(Threads::kind).both());
                assert_eq!(kinds, Some([kind; 2]), "threads of method {}", method.name());
            }
            if let Some(ThreadSets { pixel, subpixel }) = thread_sets {
                record.threads = threads.add(pixel);
                // Where sub-pixels need no others, they are the same ones.
                record.subpixel_threads =
                    if std::ptr::eq(pixel, subpixel) { record.threads } else { threads.add(subpixel) };
            }
            record.first_slice = slices.len() as u32;
            records.push(record);
            if use_slices {
                slices.extend(SliceTable::new(brdf).cdfs);
            }
        }
        let storage =
            |name, contents: &[u8]| Buffer::with_contents(device, name, vk::BufferUsageFlags::STORAGE_BUFFER, contents);
        let optional = |name, contents: &[u8]| (!contents.is_empty()).then(|| storage(name, contents)).transpose();
        Ok(Self {
            records: storage("materials", bytemuck::cast_slice(&records))?,
            threads: optional("threads", bytemuck::cast_slice(&threads.words))?,
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

/// The shader's buffer of threads.
struct ThreadWords {
    words: Vec<u32>,
    /// Level 0 of the blurred environment on the scale of kernels, if that is looked up.
    finest_level: Option<f32>,
}

impl ThreadWords {
    fn add(&mut self, threads: &Threads) -> ThreadSetRecord {
        let [row_count, count] = threads.size().map(|size| size as u32);
        let first = (self.words.len() / threads.device_element_words()) as u32;
        self.words.extend(threads.device_words());
        let sharp_count = threads.fitted().zip(self.finest_level).map(|(table, level)| table.sharp_count(level));
        ThreadSetRecord { first, count, row_count, sharp_count: sharp_count.unwrap_or(0) as u32 }
    }
}

/// All measured tables in one 3D image: side by side along theta_d (y) and theta_h (z), since phi_d (x) repeats.
#[derive(Default)]
struct TableAtlas(Vec<MerlTable>);

/// Texels of a table along phi_d, and along each of theta_d and theta_h.
const TABLE_WIDTH: usize = crate::brdf::merl::PHI_D_BINS;
const TABLE_SIDE: usize = crate::brdf::merl::THETA_D_BINS;

impl TableAtlas {
    /// Adds a table; returns its offset in y and z, in texels.
    fn add(&mut self, device: &Device, table: MerlTable) -> Result<[usize; 2]> {
        let per_axis = device.limits().max_image_dimension3_d as usize / TABLE_SIDE;
        let index = self.0.len();
        if index >= per_axis * per_axis {
            let problem =
                format!("has more measured materials than the {} that this device holds", per_axis * per_axis);
            return Err(Error::input("the scene", problem, "use fewer"));
        }
        self.0.push(table);
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
            for (line, source) in table.texels().chunks_exact(TABLE_WIDTH).enumerate() {
                let (y, z) = (y_0 + line % TABLE_SIDE, z_0 + line / TABLE_SIDE);
                let start = TABLE_WIDTH * (y + extent[1] * z);
                texels[start..start + TABLE_WIDTH].copy_from_slice(source);
            }
        }
        let bytes = if format == single {
            bytemuck::cast_slice(&texels).to_vec()
        } else {
            let half = texels
                .iter()
                .flat_map(|texel| texel.to_array().map(|value| half::f16::from_f32(value.min(65504.0))))
                .collect::<Vec<_>>();
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
    /// The variant of the shader for the method, the number of sub-pixels and the models that are evaluated.
    pub pipeline: Keyed<ComputePipeline>,
    /// What objects are made of.
    pub materials: Keyed<DeviceMaterials>,
    /// What lights them.
    pub light: Keyed<DeviceLight>,
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
    let Tiles { counters, tiles, pixels } = *tiles;
    let Shade { pipeline, materials, light, sampling } = shade;
    let format = vk::Format::R32G32B32A32_SFLOAT;
    let mut radiance = graph.kept_image("radiance", ImageDesc { format, width: view.width, height: view.height });
    graph.clear_image("clear_radiance", &mut radiance, [0.0; 4]);
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
