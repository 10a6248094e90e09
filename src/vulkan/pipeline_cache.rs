//! The driver's cache of compiled pipelines, on disk.
use super::device::Device;
use super::error::{During, Result};
use ash::vk;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The driver's cache of compiled pipelines, kept in a file.
///
/// A missing, foreign or damaged file is only a slower start: drivers check the header of what they are given.
pub struct PipelineCache {
    pub(super) raw: vk::PipelineCache,
    file: Option<PathBuf>,
    device: Arc<Device>,
}

impl PipelineCache {
    /// Opens the cache of this device in `folder`; without a folder it lives in memory only.
    ///
    /// # Errors
    /// The driver cannot make a cache.
    pub fn new(device: &Arc<Device>, folder: Option<&Path>) -> Result<Self> {
        let uuid: String = device.properties.pipeline_cache_uuid.iter().map(|byte| format!("{byte:02x}")).collect();
        let file = folder.map(|folder| folder.join(format!("pipelines-{uuid}.bin")));
        let contents = file.as_deref().and_then(|file| std::fs::read(file).ok()).unwrap_or_default();
        let info = vk::PipelineCacheCreateInfo::default().initial_data(&contents);
        // SAFETY: `contents` outlives the call; the driver validates it.
        let raw = unsafe { device.raw.create_pipeline_cache(&info, None) }
            .during("vkCreatePipelineCache", "pipeline cache")?;
        Ok(Self { raw, file, device: device.clone() })
    }

    /// Writes the file. A folder that cannot be written costs time at the next start, nothing else, so it only warns.
    fn save(&self) {
        let Some(file) = &self.file else { return };
        // SAFETY: plain query of a live cache.
        let contents = match unsafe { self.device.raw.get_pipeline_cache_data(self.raw) } {
            Ok(contents) => contents,
            Err(result) => return tracing::warn!("vkGetPipelineCacheData failed: {result}"),
        };
        if std::fs::read(file).is_ok_and(|old| old == contents) {
            return;
        }
        // If the folder cannot be made, neither can the file, and that is what to say.
        let _ = file.parent().map(std::fs::create_dir_all);
        if let Err(cause) = crate::output::write_whole(file, &contents) {
            tracing::warn!("the pipeline cache was not saved: {cause}");
        }
    }
}

impl Drop for PipelineCache {
    fn drop(&mut self) {
        self.save();
        // SAFETY: pipelines do not need their cache after creation, and this one is destroyed once.
        unsafe { self.device.raw.destroy_pipeline_cache(self.raw, None) };
    }
}
