//! Pass 2 of the paper (section 4.2): the radiance of every listed pixel, by its partition of the sample threads.
use super::brdf_atlas::BrdfAtlas;
use super::{CameraRays, Counters, DeviceIrradiance, DeviceLight, Tiles, View};
use crate::brdf::{Brdf, LobeShape, MADE_TABLE_SIZE, MaterialRecord, ThreadTableRecord, merl};
use crate::graph::{BufferDesc, BufferHandle, FrameGraph, ImageDesc, ImageHandle};
use crate::memo::Keyed;
use crate::method::{Method, Sampling};
use crate::threads::{FittedTable, SliceTable, SplitSum, Threads};
use crate::vulkan::{self, Bound, Buffer, ComputePipeline, Device, Sampler, SamplerKind, Shader, compiled};
use crate::{Error, Result};
use ash::vk;
use bytemuck::{Pod, Zeroable};
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

/// Bit i: a material has the BRDF of model i, and it is evaluated.
pub fn models_used<'a>(materials: impl Iterator<Item = (&'a Brdf, &'a LobeShape)>, evaluates_brdf: bool) -> u32 {
    let bits = materials.filter(|_| evaluates_brdf).map(|(brdf, lobe)| 1 << brdf.model_index(lobe));
    bits.fold(0, |all, bit| all | bit)
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
    fn bindings(&self) -> Vec<(&'static str, Bound<'_>)> {
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

/// The variant of shade.comp that runs `method`.
///
/// # Errors
/// The reference runs on the CPU.
///
/// # Panics
/// A method in the table has no file in `glsl/methods/`.
pub fn shade_shader(method: Method) -> Result<&'static Shader> {
    if method == Method::Reference {
        return Err(Error::input("method \"reference\"", "does not run on the GPU", "use another here"));
    }
    let variant = |shader: &&Shader| shader.name().strip_prefix("shade_") == Some(method.name());
    Ok(compiled::ALL.iter().find(variant).expect("a test looks for the shader of every method"))
}

/// What the pass is made of.
#[derive(Clone)]
pub struct Shade {
    /// The method's shader, for each class of pixels: [`Counters::arguments_of`].
    pub pipelines: Vec<Keyed<ComputePipeline>>,
    /// What objects are made of.
    pub materials: Keyed<DeviceMaterials>,
    /// What lights them.
    pub light: Keyed<DeviceLight>,
    /// What of the light the bases of fitted threads look up.
    pub irradiance: Option<Keyed<DeviceIrradiance>>,
    /// How many threads or samples, and which random numbers.
    pub sampling: Sampling,
    /// The method of the shader.
    pub method: Method,
}

/// Samples of `mis` in a submission: half a second for a GPU of 1 Tflop/s, by what an H200 of 60 takes. Systems end what runs for longer than
/// 2 s (Windows) or 10 s (Linux), and the device is lost with it.
const MOST_SAMPLES: u64 = 1 << 25;

/// Lamps by the BRDF are the work of so many samples in each of 2 x 2 sub-pixels: alumina-oxide takes 4 ms for them on that GPU, where 1.4 million
/// pixels see a dragon. A quarter of it counts, as of all that sub-pixels have of their own.
const SAMPLES_OF_SOURCES: u64 = 3;

impl Shade {
    /// In how many portions a picture is shaded, so that no submission takes too long. Threads are a sixteenth of the work of a sample or less,
    /// `ris` is four times that. At edges each sub-pixel has all samples and all lamps: where all pixels are edges, 2 x 2 of them take as long as may
    /// be, and more count as more.
    fn portion_count(&self, view: &View) -> u32 {
        let pixels = u64::from(view.width) * u64::from(view.height);
        let samples = u64::from(self.sampling.count);
        let times_edges = (u64::from(view.subpixels).pow(2) / 4).max(1);
        let of_sources = if self.light.has_sources() { SAMPLES_OF_SOURCES } else { 0 };
        let work = match self.method {
            Method::Ris => 4 * samples * times_edges * pixels,
            method if method.threads().is_some() => samples * pixels / 16 + of_sources * times_edges * pixels,
            _ => samples * times_edges * pixels,
        };
        work.div_ceil(MOST_SAMPLES).max(1) as u32
    }
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Push {
    camera: CameraRays,
    size_px: [u32; 2],
    portion: [u32; 2],
    pixel_class: u32,
    face_size: f32,
    rotation: [f32; 2],
    radiance_scale: f32,
    sample_count: u32,
    seed: [u32; 2],
    finest_level: f32,
    intensity: f32,
}

impl Push {
    fn new(view: &View, sampling: &Sampling, light: &DeviceLight, pixel_class: u32, portion: [u32; 2]) -> Self {
        Self {
            camera: view.camera_rays(),
            size_px: [view.width, view.height],
            portion,
            pixel_class,
            face_size: light.face_size(),
            rotation: view.rotation(),
            radiance_scale: light.radiance_scale(),
            sample_count: sampling.count,
            seed: [sampling.seed as u32, (sampling.seed >> 32) as u32],
            finest_level: light.finest_level,
            intensity: view.intensity as f32,
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

/// Shades the pixels that `tiles` lists, by the shader of each: interior ones with one sum shared by all sub-pixels, then those at edges. Others may
/// hold anything: see [`background`](super::background()).
pub fn shade<'a>(
    graph: &mut FrameGraph<'a>,
    shade: &'a Shade,
    geometry: ImageHandle,
    tiles: &Tiles,
    view: &View,
) -> Shaded {
    let Tiles { counters, parts, pixels, .. } = *tiles;
    let Shade { pipelines, materials, light, irradiance, sampling, .. } = shade;
    let format = vk::Format::R32G32B32A32_SFLOAT;
    let mut radiance = graph.kept_image("radiance", ImageDesc { format, width: view.width, height: view.height });
    let mut lookups = graph.buffer("lookups", BufferDesc { size_bytes: size_of::<u64>() as u64 });
    graph.clear_buffer("clear_lookups", &mut lookups);
    let portion_count = shade.portion_count(view);
    for portion in 0..portion_count {
        let dispatch = |pixel_class: usize| {
            let push = Push::new(view, sampling, light, pixel_class as u32, [portion, portion_count]);
            (&*pipelines[pixel_class], Counters::arguments_of(pixel_class), push)
        };
        let pass = match portion {
            0 => graph.compute("shade", &pipelines[0]),
            _ => graph.compute(&format!("shade, portion {}", portion + 1), &pipelines[0]).portion_of("shade"),
        };
        let pass = pass
            .read("geometry", geometry)
            .read("counters", counters)
            .read("part_list", parts)
            .read("pixel_list", pixels);
        let pass = match portion {
            0 => pass.write("radiance", &mut radiance),
            _ => pass.modify("radiance", &mut radiance),
        };
        pass.modify("all_lookups", &mut lookups)
            .bind_all(materials.bindings())
            .bind_all(light.bindings())
            .bind_all(irradiance.iter().map(|irradiance| irradiance.binding()))
            .indirect(counters, (0..pipelines.len()).map(dispatch));
    }
    Shaded { radiance, lookups }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::method::Lookups;

    #[test]
    fn every_method_has_a_shader_and_every_shader_a_method() {
        let variants = compiled::ALL.iter().filter_map(|shader| shader.name().strip_prefix("shade_"));
        for name in variants {
            assert!(Method::from_name(name).is_ok_and(|method| method.name() == name), "{name} is not in the table");
        }
        for &method in Method::ALL.iter().filter(|method| method.runs_on_gpu()) {
            assert_eq!(shade_shader(method).unwrap().name(), format!("shade_{}", method.name()));
        }
        assert!(shade_shader(Method::Reference).is_err());
    }

    #[test]
    fn methods_have_a_pattern_where_their_shaders_declare_one() {
        let declares = |shader: &Shader| shader.declares("FIXED_PATTERN").unwrap();
        for &method in Method::ALL {
            assert_eq!(shade_shader(method).is_ok_and(declares), method.has_pattern(), "{}", method.name());
        }
    }

    #[test]
    fn what_methods_look_up_is_what_their_shaders_declare() {
        for &method in Method::ALL.iter().filter(|method| method.runs_on_gpu()) {
            let declares = |name| shade_shader(method).unwrap().declares(name).unwrap();
            let split_sum = declares("SplitSums");
            let blurred = declares("irradiance_maps");
            let declared = Lookups {
                box_filtered: declares("environment_pyramid") && !blurred && !split_sum,
                blurred,
                map: declares("environment_map") && !blurred,
                aliases: declares("LightAliases"),
                slices: declares("Slices"),
                split_sum,
            };
            assert_eq!(method.lookups(), declared, "{}", method.name());
        }
    }
}
