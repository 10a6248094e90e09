//! Checks a device at its first use.
use crate::Result;
use crate::device_check::{Verdict, check};
use crate::error::Error;
use crate::files;
use crate::files::write_whole;
use crate::memo::{Key, Memo, Round, Step, Stored};
use crate::steps::pipelines;
use crate::vulkan::{Device, compiled};
use std::path::Path;
use std::sync::Arc;

/// To be raised when the same answers of a device get another verdict, or it is asked otherwise.
const VERSION: u64 = 1;

/// Whether what a device computes is right. Kept on disk for this device and version of its driver.
pub struct CheckDevice<'a>(pub &'a Arc<Device>);

impl Step for CheckDevice<'_> {
    type Output = Verdict;
    const NAME: &'static str = "device check";

    fn key(&self, _: &Memo) -> Result<Key> {
        let key = Key::builder("device check").number(VERSION).bytes(&self.0.driver_id());
        Ok(key.bytes(bytemuck::cast_slice(&compiled::DEVICE_CHECK.words())).build())
    }

    fn make(&self, round: &Round) -> Result<Verdict> {
        check(self.0, &*pipelines(round, self.0)?)
    }

    fn stored(&self) -> Option<Stored<'_, Verdict>> {
        Some(Stored { extension: "device", read: Box::new(read), write: Box::new(write) })
    }
}

fn read(path: &Path) -> Result<Verdict> {
    Verdict::parse(path, &files::read(path)?)
}

fn write(path: &Path, verdict: &Verdict) -> Result<()> {
    let text = serde_json::to_vec(verdict).map_err(|cause| Error::unwritable(path, cause))?;
    write_whole(path, &text)
}
