//! What outlives a frame, as data.
use super::resource::ResourceInfo;
use ash::vk::{AccessFlags2, ImageLayout, PipelineStageFlags2};
use std::collections::BTreeMap;

/// What kept resources hold between two frames, by name: the plan of each frame says it for the next.
#[derive(Clone, Debug, Default)]
pub struct Kept(pub(super) BTreeMap<String, Held>);

/// What a kept resource holds, and how it was last used.
#[derive(Clone, Debug)]
pub(super) struct Held {
    /// What it was made as.
    pub info: ResourceInfo,
    /// Of the version that it holds; none if it depends on something unknown.
    pub fingerprint: Option<u64>,
    /// Stages of the last use.
    pub stages: PipelineStageFlags2,
    /// Memory accesses of the last use.
    pub accesses: AccessFlags2,
    /// Layout that the last use left it in.
    pub layout: ImageLayout,
}
