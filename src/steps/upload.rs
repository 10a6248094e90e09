//! Uploads to the device what passes read.
use super::compile::on;
use super::load::FindLobe;
use super::looked_up::LookedUp;
use crate::Result;
use crate::brdf::Brdf;
use crate::environment::Environment;
use crate::light::{BlurredLight, Light, bases};
use crate::memo::{Key, Keyed, Memo, Round, Step};
use crate::method::Method;
use crate::passes::{
    BackgroundMap, DeviceIrradiance, DeviceLight, DeviceMaterials, DeviceMesh, ShadedMaterial, ShaderOfMaterial,
    WayAround, upload_shaders,
};
use crate::scene::Mesh;
use crate::threads::{FittedTable, Threads};
use crate::vulkan::{Buffer, Device};
use std::sync::Arc;

/// Uploads the triangles of a mesh.
pub struct UploadMesh<'a> {
    /// To where.
    pub device: &'a Arc<Device>,
    /// Its name, for people who look at the device's objects.
    pub name: &'a str,
    /// What.
    pub mesh: &'a Keyed<Mesh>,
}

impl Step for UploadMesh<'_> {
    type Output = DeviceMesh;
    const NAME: &'static str = "upload of meshes";

    fn key(&self, _: &Memo) -> Result<Key> {
        Ok(on(self.device, "mesh").key(self.mesh.key).build())
    }

    fn make(&self, _: &Round) -> Result<DeviceMesh> {
        DeviceMesh::new(self.device, self.name, self.mesh)
    }
}

/// What a material is uploaded of, and by which the upload is known.
#[derive(Clone, Copy)]
pub struct KeyedMaterial<'a> {
    /// What it is.
    pub brdf: &'a Keyed<Brdf>,
    /// Its threads, for methods that have any.
    pub threads: Option<&'a Keyed<Threads>>,
}

/// Uploads what a method looks up of materials.
pub struct UploadMaterials<'a> {
    /// To where.
    pub device: &'a Arc<Device>,
    /// What for.
    pub method: Method,
    /// In the order of the indices that objects have.
    pub materials: &'a [KeyedMaterial<'a>],
    /// Whether BRDFs are evaluated.
    pub evaluates_brdf: bool,
    /// Level 0 of the blurred environment on the scale of kernels, if that is looked up.
    pub finest_level: Option<f32>,
}

impl Step for UploadMaterials<'_> {
    type Output = DeviceMaterials;
    const NAME: &'static str = "upload of materials";

    fn key(&self, _: &Memo) -> Result<Key> {
        let key = on(self.device, self.method.name()).number(u64::from(self.evaluates_brdf));
        let keys = self.materials.iter().flat_map(|KeyedMaterial { brdf, threads }| {
            std::iter::once(brdf.key).chain(threads.map(|threads| threads.key))
        });
        let key = key.keys(keys);
        // Of the light, only how many threads are sharper than it.
        let sharp = self.finest_level.map(|level| {
            let threads = self.materials.iter().filter_map(|material| material.threads);
            threads
                .filter_map(|threads| threads.fitted())
                .flat_map(FittedTable::tables)
                .map(|table| table.used().sharp_count(level) as u64)
                .collect::<Vec<_>>()
        });
        Ok(sharp.into_iter().flatten().fold(key, |key, count| key.number(count)).build())
    }

    fn make(&self, round: &Round) -> Result<DeviceMaterials> {
        let brdfs = || self.materials.iter().map(|material| material.brdf);
        let lobes = brdfs().map(|brdf| round.ask(&FindLobe(brdf))).collect::<Result<Vec<_>>>()?;
        let looked_up = brdfs().map(|brdf| LookedUp::ask(round, self.method, brdf, self.evaluates_brdf));
        let looked_up = looked_up.collect::<Result<Vec<_>>>()?;
        let (_, base_maps) = bases(self.materials.iter().map(|material| material.threads.map(|threads| &**threads)));
        let materials = self.materials.iter().enumerate().map(|(i, KeyedMaterial { brdf, threads })| ShadedMaterial {
            brdf,
            lobe: &lobes[i],
            threads: threads.map(|threads| &**threads),
            base_map: base_maps[i],
            table: looked_up[i].table.as_deref(),
            slices: looked_up[i].slices.as_deref(),
            split_sum: looked_up[i].split_sum.as_deref(),
        });
        DeviceMaterials::new(self.device, self.method, materials, self.evaluates_brdf, self.finest_level)
    }
}

/// Uploads what a method looks up of an environment.
pub struct UploadLight<'a> {
    /// To where.
    pub device: &'a Arc<Device>,
    /// What for.
    pub method: Method,
    /// Of what.
    pub environment: &'a Keyed<Environment>,
    /// Its filtered forms.
    pub light: &'a Light,
    /// How cube maps are uploaded. Part of no key: a device has one.
    pub way_around: Option<WayAround>,
}

impl Step for UploadLight<'_> {
    type Output = DeviceLight;
    const NAME: &'static str = "upload of the environment";

    fn key(&self, _: &Memo) -> Result<Key> {
        let lookups = self.method.lookups();
        let mut key = on(self.device, "light").key(self.environment.key);
        for part in [lookups.box_filtered, lookups.blurred, lookups.split_sum, lookups.map, lookups.aliases] {
            key = key.number(u64::from(part));
        }
        if let Some(blurred) = &self.light.blurred {
            key = key.number(u64::from(blurred.needs.map)).number(u64::from(blurred.needs.mirrored_sources));
        }
        Ok(key.build())
    }

    fn make(&self, _: &Round) -> Result<DeviceLight> {
        DeviceLight::new(self.device, self.method, self.environment, self.light, self.way_around)
    }
}

/// Uploads the irradiance by each base of the scene's materials.
pub struct UploadIrradiance<'a> {
    /// To where.
    pub device: &'a Arc<Device>,
    /// What it is part of.
    pub light: &'a BlurredLight,
    /// How cube maps are uploaded. Part of no key: a device has one.
    pub way_around: Option<WayAround>,
}

impl Step for UploadIrradiance<'_> {
    type Output = DeviceIrradiance;
    const NAME: &'static str = "upload of irradiance";

    fn key(&self, _: &Memo) -> Result<Key> {
        let scale = self.light.radiance_scale();
        let maps = self.light.irradiance.iter().map(|map| map.key);
        Ok(on(self.device, "irradiance").real(scale.into()).keys(maps).build())
    }

    fn make(&self, _: &Round) -> Result<DeviceIrradiance> {
        DeviceIrradiance::new(self.device, self.light, self.way_around)
    }
}

/// Uploads the environment as it is seen behind objects.
pub struct UploadBackground<'a> {
    /// To where.
    pub device: &'a Arc<Device>,
    /// What.
    pub environment: &'a Keyed<Environment>,
}

impl Step for UploadBackground<'_> {
    type Output = BackgroundMap;
    const NAME: &'static str = "upload of the background";

    fn key(&self, _: &Memo) -> Result<Key> {
        Ok(on(self.device, "background").key(self.environment.key).build())
    }

    fn make(&self, _: &Round) -> Result<BackgroundMap> {
        BackgroundMap::new(self.device, self.environment)
    }
}

/// Uploads which shader each material is shaded by.
pub struct UploadShaders<'a> {
    /// To where.
    pub device: &'a Arc<Device>,
    /// Which.
    pub of_materials: &'a [ShaderOfMaterial],
}

impl Step for UploadShaders<'_> {
    type Output = Buffer;
    const NAME: &'static str = "upload of the shaders of materials";

    fn key(&self, _: &Memo) -> Result<Key> {
        Ok(on(self.device, "shaders of materials").bytes(bytemuck::cast_slice(self.of_materials)).build())
    }

    fn make(&self, _: &Round) -> Result<Buffer> {
        upload_shaders(self.device, self.of_materials)
    }
}
