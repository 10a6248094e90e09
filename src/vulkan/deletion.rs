//! Deletion: what has been dropped while the GPU may still use it.
use ash::vk;
use gpu_allocator::vulkan::Allocation;
use std::sync::{Mutex, PoisonError};

/// A handle whose last use may still be in flight.
pub(super) enum Garbage {
    Buffer(vk::Buffer),
    Image(vk::Image),
    ImageView(vk::ImageView),
    Sampler(vk::Sampler),
    Pipeline(vk::Pipeline),
    PipelineLayout(vk::PipelineLayout),
    DescriptorSetLayout(vk::DescriptorSetLayout),
    DescriptorPool(vk::DescriptorPool),
    CommandPool(vk::CommandPool),
    QueryPool(vk::QueryPool),
    Memory(Allocation),
}

/// What waits for being destroyed, each with the number of the last submission that may use it.
#[derive(Default)]
pub(super) struct Deletions(Mutex<Vec<(u64, Garbage)>>);

impl Deletions {
    /// Adds what no submission after number `last_use` uses.
    pub fn add(&self, last_use: u64, garbage: Garbage) {
        // A panic elsewhere leaves this plain list intact, so a poisoned lock is no reason to stop.
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push((last_use, garbage));
    }

    /// Takes out what submissions up to number `finished` were the last to use.
    pub fn take(&self, finished: u64) -> Vec<Garbage> {
        let mut waiting = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let (ready, rest): (Vec<_>, Vec<_>) = waiting.drain(..).partition(|(last_use, _)| *last_use <= finished);
        *waiting = rest;
        ready.into_iter().map(|(_, garbage)| garbage).collect()
    }
}
