//! The driver's cache of compiled pipelines, on disk.
use super::device::Device;
use super::error::{Result, call};
use crate::output::{keep_file, write_whole};
use ash::vk;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The driver's cache of compiled pipelines, kept in a file.
///
/// A missing, foreign or damaged file is only a slower start. Drivers check the header of what they are given and trust the
/// rest, so the file begins with a hash of it.
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
        let contents =
            file.as_deref().and_then(|file| unwrapped(crate::file_format::read(file).ok()?)).unwrap_or_default();
        let info = vk::PipelineCacheCreateInfo::default().initial_data(&contents);
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
        let contents = [&blake3::hash(&contents).as_bytes()[..], &contents].concat();
        if crate::file_format::read(file).is_ok_and(|old| old == contents) {
            return;
        }
        keep_file(file, || write_whole(file, &contents));
    }
}

impl Drop for PipelineCache {
    fn drop(&mut self) {
        self.save();
        // SAFETY: pipelines do not need their cache after creation, and this one is destroyed once.
        unsafe { self.device.raw.destroy_pipeline_cache(self.raw, None) };
    }
}

/// What was written, without its hash; none if it was not written whole.
fn unwrapped(file: Vec<u8>) -> Option<Vec<u8>> {
    let (hash, contents) = file.split_at_checked(blake3::OUT_LEN)?;
    (blake3::hash(contents).as_bytes()[..] == *hash).then(|| contents.to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_damaged_file_is_as_good_as_none() {
        let contents = b"compiled".to_vec();
        let file = [&blake3::hash(&contents).as_bytes()[..], &contents].concat();
        assert_eq!(unwrapped(file.clone()), Some(contents));
        for at in 0..file.len() {
            let mut damaged = file.clone();
            damaged[at] ^= 1;
            assert_eq!(unwrapped(damaged), None);
            assert_eq!(unwrapped(file[..at].to_vec()), None);
        }
    }
}
