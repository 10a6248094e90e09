//! Compiles pipelines, by the driver's cache of them.
use crate::Result;
use crate::memo::{Key, KeyBuilder, Keyed, Memo, Round, Step};
use crate::passes::{geometry_pipeline, geometry_shaders};
use crate::vulkan::{ComputePipeline, Device, GraphicsPipeline, PipelineCache, Shader};
use std::sync::Arc;

/// Begins the key of what is on `device`. Whatever is there keeps it alive, so no other can have its address.
pub(super) fn on(device: &Arc<Device>, what: &str) -> KeyBuilder {
    Key::builder(what).number(Arc::as_ptr(device).addr() as u64)
}

/// The driver's cache of compiled pipelines, which keeps itself in the memo's folder.
///
/// # Errors
/// The driver cannot make a cache.
pub fn pipelines(round: &Round, device: &Arc<Device>) -> Result<Keyed<PipelineCache>> {
    round.ask(&OpenPipelines(device))
}

struct OpenPipelines<'a>(&'a Arc<Device>);

impl Step for OpenPipelines<'_> {
    type Output = PipelineCache;
    const NAME: &'static str = "pipelines";

    fn key(&self, _: &Memo) -> Result<Key> {
        Ok(on(self.0, "pipelines").build())
    }

    fn make(&self, round: &Round) -> Result<PipelineCache> {
        Ok(PipelineCache::new(self.0, round.memo().folder())?)
    }
}

/// Compiles a compute shader.
pub struct CompileCompute<'a> {
    /// For what.
    pub device: &'a Arc<Device>,
    /// What.
    pub shader: &'static Shader,
    /// Specialisation constants by name.
    pub constants: &'a [(&'static str, u32)],
}

impl Step for CompileCompute<'_> {
    type Output = ComputePipeline;
    const NAME: &'static str = "shaders";

    fn key(&self, _: &Memo) -> Result<Key> {
        let key = on(self.device, self.shader.name()).bytes(bytemuck::cast_slice(&self.shader.words()));
        Ok(self.constants.iter().fold(key, |key, (name, value)| key.text(name).number(*value)).build())
    }

    fn make(&self, round: &Round) -> Result<ComputePipeline> {
        Ok(ComputePipeline::new(self.device, &*pipelines(round, self.device)?, self.shader, self.constants)?)
    }
}

/// Compiles the shaders of the geometry cache.
pub struct CompileGeometryCache<'a> {
    /// For what.
    pub device: &'a Arc<Device>,
    /// Whether objects have tangents.
    pub has_tangents: bool,
}

impl Step for CompileGeometryCache<'_> {
    type Output = GraphicsPipeline;
    const NAME: &'static str = "shaders";

    fn key(&self, _: &Memo) -> Result<Key> {
        let key = on(self.device, "geometry cache");
        let shaders = geometry_shaders(self.has_tangents);
        Ok(shaders.iter().fold(key, |key, shader| key.bytes(bytemuck::cast_slice(&shader.words()))).build())
    }

    fn make(&self, round: &Round) -> Result<GraphicsPipeline> {
        geometry_pipeline(self.device, &*pipelines(round, self.device)?, self.has_tangents)
    }
}
