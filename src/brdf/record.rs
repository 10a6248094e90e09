//! A material as shaders have it. Twin of the layout: glsl/material.glsl.
use super::{BaseProfile, Brdf, LobeShape};

/// `ThreadTable` in glsl/material.glsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct ThreadTableRecord {
    /// Where its threads start in the buffer of threads, in elements of that.
    pub first: u32,
    /// Number of its threads.
    pub count: u32,
    /// Number of their view angles.
    pub row_count: u32,
    /// How many of its threads, up to the last one that is, are sharper than the environment's pyramid in some row.
    pub sharp_count: u32,
    /// Number of sets of its threads, each of which does alone: thread k is of set k % `set_count`.
    pub set_count: u32,
    /// Azimuths of the view for which there are rows or CDFs: 1 of an isotropic BRDF.
    pub azimuth_count: u32,
}

impl ThreadTableRecord {
    /// No threads, in one set, of one azimuth.
    pub const NONE: Self = Self { first: 0, count: 0, row_count: 0, sharp_count: 0, set_count: 1, azimuth_count: 1 };
}

/// `Material` in glsl/material.glsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct MaterialRecord {
    /// What the model's GLSL twin reads: [`super::Model::gpu_parameters`].
    pub parameters: [f32; 12],
    /// Position of the model in models/table.rs.
    pub model: u32,
    /// Where its CDFs or its split sum start in the buffer of these.
    pub first_slice: u32,
    /// [`LobeShape::width_rad`].
    pub lobe_width: f32,
    /// [`LobeShape::narrowness`].
    pub narrowness: f32,
    /// [`LobeShape::long_axis`].
    pub long_axis: [f32; 2],
    /// Its threads.
    pub threads: ThreadTableRecord,
    /// Those of a sub-pixel that does not share a sum with the others.
    pub subpixel_threads: ThreadTableRecord,
    /// Deviation of normals up to which sub-pixels share one sum, seen along them, in radians.
    pub shared_deviation: f32,
    /// [`LobeShape::flank_rad`].
    pub flank: f32,
    /// [`GivingWay::clear`](crate::threads::GivingWay::clear) of its threads.
    pub clear: [f32; 2],
    /// [`GivingWay::lobe_radius_rad`](crate::threads::GivingWay::lobe_radius_rad) of its threads.
    pub lobe_radius: f32,
    /// [`LobeShape::dark_from`].
    pub dark_from: f32,
    /// [`LobeShape::narrowing`].
    pub narrowing: [f32; 4],
    /// [`rim_power`](crate::threads::rim::rim_power) of its threads or its split sum.
    pub rim_power: f32,
    /// Which irradiance map is that of [`FittedTable::base`](crate::threads::FittedTable::base).
    pub base_map: u32,
    /// [`FittedTable::base`](crate::threads::FittedTable::base).
    pub base: BaseProfile,
}

impl MaterialRecord {
    /// Of `brdf`, whose lobe this is, without threads and CDFs.
    pub fn new(brdf: &Brdf, lobe: &LobeShape) -> Self {
        Self {
            parameters: bytemuck::cast(brdf.gpu_parameters().map(<[f32; 4]>::from)),
            model: brdf.model_index(lobe),
            first_slice: 0,
            lobe_width: lobe.width_rad as f32,
            narrowness: lobe.narrowness as f32,
            long_axis: lobe.long_axis.as_vec2().to_array(),
            threads: ThreadTableRecord::NONE,
            subpixel_threads: ThreadTableRecord::NONE,
            shared_deviation: 0.0,
            flank: lobe.flank_rad as f32,
            clear: [0.0; 2],
            lobe_radius: 0.0,
            dark_from: lobe.dark_from() as f32,
            narrowing: lobe.narrowing.map(|step| step as f32),
            rim_power: 1.0,
            base_map: 0,
            base: BaseProfile::EVEN,
        }
    }

    /// The same with `table`, which [`super::tabulate`] made, at this y and z in the atlas of its kind.
    ///
    /// # Panics
    /// It is none.
    pub fn with_table_at(mut self, table: &Brdf, place: [usize; 2]) -> Self {
        self.parameters = match table {
            Brdf::Tabulated(table) => table.parameters_at(place),
            Brdf::TabulatedAnisotropic(table) => table.parameters_at(place),
            Brdf::MerlTable(table) => table.parameters_at(place),
            _ => panic!("model `{}` is no table that was made", table.model()),
        };
        self
    }
}
