//! The driver's cache of compiled pipelines, on disk.
use super::device::Device;
use super::error::{Result, call};
use crate::files::{keep_file, sealed, unsealed, write_whole};
use ash::vk;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The driver's cache of compiled pipelines, kept in a file.
///
/// A missing, foreign or damaged file is only a slower start. Drivers check the header of what they are given and trust the
/// rest, so the file is sealed.
pub struct PipelineCache {
    pub(super) raw: vk::PipelineCache,
    file: Option<PathBuf>,
    pub(super) device: Arc<Device>,
}

impl PipelineCache {
    /// Opens the cache of this device in `folder`; without a folder it lives in memory only.
    ///
    /// # Errors
    /// The driver cannot make a cache.
    pub fn new(device: &Arc<Device>, folder: Option<&Path>) -> Result<Self> {
        let uuid: String = device.properties.pipeline_cache_uuid.iter().map(|byte| format!("{byte:02x}")).collect();
        let file = folder.map(|folder| folder.join(format!("pipelines-{uuid}.bin")));
        let kept = file.as_deref().and_then(|file| crate::files::read(file).ok()).unwrap_or_default();
        let contents = unsealed(&kept).unwrap_or_default();
        let info = vk::PipelineCacheCreateInfo::default().initial_data(contents);
        // SAFETY: `contents` outlives the call; it is what a driver has made, whose header tells this one whether it is its own.
        let raw = call("vkCreatePipelineCache", "pipeline cache", || unsafe {
            device.raw.create_pipeline_cache(&info, None)
        })?;
        Ok(Self { raw, file, device: device.clone() })
    }

    /// Writes the file, if that can be.
    fn save(&self) {
        let Some(file) = &self.file else { return };
        // SAFETY: plain query of a live cache.
        let contents = match unsafe { self.device.raw.get_pipeline_cache_data(self.raw) } {
            Ok(contents) => contents,
            Err(result) => return tracing::warn!("vkGetPipelineCacheData failed: {result}"),
        };
        let kept = sealed(contents);
        if crate::files::read(file).is_ok_and(|old| old == kept) {
            return;
        }
        keep_file(file, || write_whole(file, &kept));
    }
}

impl Drop for PipelineCache {
    fn drop(&mut self) {
        self.save();
        // SAFETY: pipelines do not need their cache after creation, and this one is destroyed once.
        unsafe { self.device.raw.destroy_pipeline_cache(self.raw, None) };
    }
}
