//! What shading looks up of materials, on the device: records, threads, CDFs or split sums, and tables of BRDFs.
use super::brdf_atlas::BrdfAtlas;
use crate::Result;
use crate::brdf::{Brdf, LobeShape, MADE_TABLE_SIZE, MaterialRecord, ThreadTableRecord, merl};
use crate::method::Method;
use crate::threads::{FittedTable, SliceTable, SplitSum, Threads};
use crate::vulkan::{self, Bound, Buffer, Device, Sampler, SamplerKind};
use ash::vk;
use std::sync::Arc;

/// Materials, their threads, CDFs or split sums, and their tables on the device.
pub struct DeviceMaterials {
    records: Buffer,
    threads: Option<Buffer>,
    slices: Option<Buffer>,
    /// What the method's shader calls them.
    slices_name: &'static str,
    measured_tables: vulkan::Image,
    made_tables: vulkan::Image,
    table_sampler: Sampler,
}

/// A material as shading needs it.
#[derive(Clone, Copy)]
pub struct ShadedMaterial<'a> {
    /// What it is.
    pub brdf: &'a Brdf,
    /// Its lobe.
    pub lobe: &'a LobeShape,
    /// Its threads, for methods that have any.
    pub threads: Option<&'a Threads>,
    /// Which irradiance map these look up.
    pub base_map: usize,
    /// Its table, if it [has one](Brdf::has_table) and shaders evaluate it.
    pub table: Option<&'a Brdf>,
    /// Its CDFs, for methods that draw by them.
    pub slices: Option<&'a SliceTable>,
    /// Its split sum, for the method of this name.
    pub split_sum: Option<&'a SplitSum>,
}

impl DeviceMaterials {
    /// Uploads what `method` looks up of `materials`, in the order of the indices that objects have; their BRDFs only if it
    /// `evaluates_brdf`. `finest_level` is level 0 of the blurred environment on the scale of kernels, if that is looked up.
    ///
    /// # Errors
    /// No device memory left, or more tables than a 3D image of the device holds.
    ///
    /// # Panics
    /// Threads of another kind than the method's, since its shader would take one for the other; no table where one is looked up.
    pub fn new<'m>(
        device: &Arc<Device>,
        method: Method,
        materials: impl IntoIterator<Item = ShadedMaterial<'m>>,
        evaluates_brdf: bool,
        finest_level: Option<f32>,
    ) -> Result<Self> {
        let lookups = method.lookups();
        let mut records = Vec::new();
        let mut threads = DeviceThreads { elements: Vec::new(), finest_level };
        let mut slices: Vec<f32> = Vec::new();
        let [phi_d, theta_d, _] = merl::DEVICE_TABLE_SIZE;
        let mut measured = BrdfAtlas::new([phi_d, theta_d]);
        let mut made = BrdfAtlas::new(MADE_TABLE_SIZE);
        for ShadedMaterial { brdf, lobe, threads: own_threads, base_map, table, slices: own_slices, split_sum } in
            materials
        {
            let mut record = MaterialRecord::new(brdf, lobe);
            if evaluates_brdf && brdf.has_table() {
                let table = table.expect("a table of a BRDF that shaders look up");
                let place = match table {
                    Brdf::MerlTable(table) => measured.add(device, table.device_texels())?,
                    _ => made.add(device, table.made_table().expect("a table that was made").texels().clone())?,
                };
                record = record.with_table_at(table, place);
            }
            if let Some(kind) = method.threads() {
                assert_eq!(own_threads.map(Threads::kind), Some(kind), "threads of method {}", method.name());
            }
            if let Some(own_threads) = own_threads {
                record = own_threads.in_record(record, lobe);
                record.base_map = base_map as u32;
                [record.threads, record.subpixel_threads] = threads.add(own_threads);
            }
            record.first_slice = slices.len() as u32;
            if let Some(table) = own_slices {
                record.threads.azimuth_count = table.azimuths as u32;
                slices.extend(&table.cdfs);
            }
            if let Some(split_sum) = split_sum {
                record.rim_power = split_sum.rim_power;
                slices.extend(split_sum.device_floats());
            }
            records.push(record);
        }
        let storage =
            |name, contents: &[u8]| Buffer::with_contents(device, name, vk::BufferUsageFlags::STORAGE_BUFFER, contents);
        let optional = |name, contents: &[u8]| (!contents.is_empty()).then(|| storage(name, contents)).transpose();
        Ok(Self {
            records: storage("materials", bytemuck::cast_slice(&records))?,
            threads: optional("threads", bytemuck::cast_slice(&threads.elements))?,
            slices: optional("slices", bytemuck::cast_slice(&slices))?,
            slices_name: if lookups.split_sum { "SplitSums" } else { "Slices" },
            measured_tables: measured.upload(device, "measured BRDFs")?,
            made_tables: made.upload(device, "tabulated BRDFs")?,
            table_sampler: Sampler::new(device, "brdf tables", SamplerKind::WrappedLinear)?,
        })
    }

    /// All of it, by name in the shader; the last two as the method declares them.
    pub(super) fn bindings(&self) -> Vec<(&'static str, Bound<'_>)> {
        let tables = [("brdf_tables", &self.measured_tables), ("made_brdf_tables", &self.made_tables)];
        let tables = tables.map(|(name, image)| (name, Bound::Sampled(image, &self.table_sampler)));
        let optional = [("Threads", &self.threads), (self.slices_name, &self.slices)];
        let optional = optional.into_iter().filter_map(|(name, buffer)| Some((name, Bound::from(buffer.as_ref()?))));
        [("Materials", Bound::from(&self.records))].into_iter().chain(tables).chain(optional).collect()
    }
}

/// The shader's buffer of threads.
struct DeviceThreads {
    elements: Vec<[u32; 4]>,
    /// Level 0 of the blurred environment on the scale of kernels, if that is looked up.
    finest_level: Option<f32>,
}

impl DeviceThreads {
    /// Those of whole pixels, and of sub-pixels that do not share a sum.
    fn add(&mut self, threads: &Threads) -> [ThreadTableRecord; 2] {
        match threads {
            Threads::Fitted(table) | Threads::Gaussian(table) => {
                let of_pixels = self.add_kernels(table);
                let of_subpixels = table.of_subpixels.as_ref().map(|table| self.add_kernels(table));
                [of_pixels, of_subpixels.unwrap_or(of_pixels)]
            }
            Threads::Paper(table) => {
                let first = self.elements.len() as u32;
                self.elements.extend(table.device_elements());
                let (count, row_count) = (table.count as u32, table.rows as u32);
                [ThreadTableRecord { first, count, row_count, ..ThreadTableRecord::NONE }; 2]
            }
        }
    }

    fn add_kernels(&mut self, table: &FittedTable) -> ThreadTableRecord {
        let used = table.used();
        let first = self.elements.len() as u32;
        self.elements.extend(used.device_elements());
        ThreadTableRecord {
            first,
            count: used.count() as u32,
            row_count: table.rows as u32,
            sharp_count: self.finest_level.map_or(0, |level| used.sharp_count(level) as u32),
            set_count: table.sets as u32,
            azimuth_count: table.azimuths as u32,
        }
    }
}
