//! Frames in flight: each has its command pool, descriptors and timestamps, and is reused when the GPU is done with it.
use super::commands::{Commands, MAX_TIMED_PASSES};
use super::deletion::Garbage;
use super::device::{Device, Semaphores};
use super::error::{Result, VulkanError, call};
use ash::vk;
use std::sync::Arc;

/// Descriptor sets that a frame may bind, one for each draw and dispatch: two for each shader of materials, and far more than there are passes
/// besides. Running out is an error that says so.
const MAX_SETS: u32 = 64;

/// Most descriptors of a kind that a shader declares.
const MOST_OF_A_KIND: u32 = 8;

const DESCRIPTOR_KINDS: [vk::DescriptorType; 5] = [
    vk::DescriptorType::STORAGE_BUFFER,
    vk::DescriptorType::UNIFORM_BUFFER,
    vk::DescriptorType::COMBINED_IMAGE_SAMPLER,
    vk::DescriptorType::SAMPLED_IMAGE,
    vk::DescriptorType::STORAGE_IMAGE,
];

/// How long one pass took on the GPU.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct PassTime {
    /// Name of the pass.
    pub name: String,
    /// Milliseconds between the timestamps before and after it; where the device has none, from submission until it is done.
    pub gpu_ms: f64,
}

impl PassTime {
    /// Time of the pass of that name among `passes`, in milliseconds on the GPU; 0 if there is none.
    pub fn ms_of(passes: &[Self], name: &str) -> f64 {
        passes.iter().filter(|pass| pass.name == name).map(|pass| pass.gpu_ms).sum()
    }
}

/// What one frame in flight owns.
struct Slot {
    command_pool: vk::CommandPool,
    commands: vk::CommandBuffer,
    descriptor_pool: vk::DescriptorPool,
    queries: Option<vk::QueryPool>,
    /// Names of the timed passes of the frame that was recorded last.
    timed: Vec<String>,
    /// Value of the device's timeline at which that frame has finished; 0: never submitted.
    finished_at: u64,
    device: Arc<Device>,
}

/// A ring of frames: while the GPU works on one, the next is recorded.
pub struct Frames {
    slots: Vec<Slot>,
    next: usize,
    name: String,
    device: Arc<Device>,
}

impl Frames {
    /// A ring of `count` frames in flight.
    ///
    /// # Errors
    /// No memory left for pools.
    pub fn new(device: &Arc<Device>, name: &str, count: usize) -> Result<Self> {
        let slots = (0..count.max(1)).map(|_| Slot::new(device, name)).collect::<Result<_>>()?;
        Ok(Self { slots, next: 0, name: name.to_owned(), device: device.clone() })
    }

    /// Waits until the oldest frame has left the GPU, records the next one in its place, and submits it.
    ///
    /// # Errors
    /// What `record` returns, or a failing submission.
    pub(crate) fn record<T>(&mut self, record: impl FnOnce(&mut Commands) -> Result<T>) -> Result<T> {
        self.record_between(Semaphores::default(), record)
    }

    /// The same between two semaphores.
    ///
    /// # Errors
    /// What `record` returns, or a failing submission.
    pub(crate) fn record_between<T, E: From<VulkanError>>(
        &mut self,
        semaphores: Semaphores,
        record: impl FnOnce(&mut Commands) -> std::result::Result<T, E>,
    ) -> std::result::Result<T, E> {
        let slot = &mut self.slots[self.next];
        self.device.wait_for(slot.finished_at)?;
        slot.begin(&self.device, &self.name)?;
        let mut commands = Commands::new(&self.device, slot.commands, slot.descriptor_pool, slot.queries);
        let result = record(&mut commands)?;
        let timed = commands.into_timed_passes();
        // SAFETY: the command buffer is in the recording state.
        call("vkEndCommandBuffer", &self.name, || unsafe { self.device.raw.end_command_buffer(slot.commands) })?;
        slot.finished_at = self.device.submit(slot.commands, &self.name, semaphores)?;
        slot.timed = timed;
        self.next = (self.next + 1) % self.slots.len();
        Ok(result)
    }

    /// Blocks until the oldest frame has left the GPU, so that recording the next will not wait.
    ///
    /// # Errors
    /// A lost device.
    pub fn wait_for_place(&self) -> Result<()> {
        self.device.wait_for(self.slots[self.next].finished_at)
    }

    /// Blocks until every frame has left the GPU.
    ///
    /// # Errors
    /// A lost device.
    pub fn wait(&self) -> Result<()> {
        let last = self.slots.iter().map(|slot| slot.finished_at).max().unwrap_or(0);
        self.device.wait_for(last)
    }

    /// GPU time of each pass of the oldest frame, which must have left the GPU ([`Frames::wait_for_place`]); empty where there is none.
    ///
    /// # Errors
    /// A lost device.
    pub fn oldest_pass_times(&self) -> Result<Vec<PassTime>> {
        self.times_of(&self.slots[self.next])
    }

    /// GPU time of each pass of the frame recorded last, which is waited for. Empty where the device has no timestamps.
    ///
    /// # Errors
    /// A lost device.
    pub fn pass_times(&self) -> Result<Vec<PassTime>> {
        let slot = &self.slots[(self.next + self.slots.len() - 1) % self.slots.len()];
        self.device.wait_for(slot.finished_at)?;
        self.times_of(slot)
    }

    /// Times of a frame that has left the GPU.
    fn times_of(&self, slot: &Slot) -> Result<Vec<PassTime>> {
        let Some(queries) = slot.queries.filter(|_| !slot.timed.is_empty()) else { return Ok(Vec::new()) };
        let mut ticks = vec![0_u64; 2 * slot.timed.len()];
        let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT;
        // SAFETY: the frame that was submitted last writes both timestamps of every timed pass; this waits for them.
        call("vkGetQueryPoolResults", &self.name, || unsafe {
            self.device.raw.get_query_pool_results(queries, 0, &mut ticks, flags)
        })?;
        // Timestamps count modulo the valid bits of the queue.
        let mask = u64::MAX >> (64 - self.device.timestamp_valid_bits.clamp(1, 64));
        let ms_per_tick = f64::from(self.device.limits().timestamp_period) * 1e-6;
        let times = slot.timed.iter().zip(ticks.chunks_exact(2)).map(|(name, ticks)| PassTime {
            name: name.clone(),
            gpu_ms: (ticks[1].wrapping_sub(ticks[0]) & mask) as f64 * ms_per_tick,
        });
        Ok(times.collect())
    }
}

impl Slot {
    fn new(device: &Arc<Device>, name: &str) -> Result<Self> {
        let info = vk::CommandPoolCreateInfo::default()
            .flags(vk::CommandPoolCreateFlags::TRANSIENT)
            .queue_family_index(device.queue_family);
        // SAFETY: plain creation; destroyed through the deletion queue, as all below.
        let command_pool =
            call("vkCreateCommandPool", name, || unsafe { device.raw.create_command_pool(&info, None) })?;
        // Destroyed with this from here on, whatever fails.
        let mut slot = Self {
            command_pool,
            commands: vk::CommandBuffer::null(),
            descriptor_pool: vk::DescriptorPool::null(),
            queries: None,
            timed: Vec::new(),
            finished_at: 0,
            device: device.clone(),
        };
        let info = vk::CommandBufferAllocateInfo::default().command_pool(command_pool).command_buffer_count(1);
        // SAFETY: the pool is alive; the buffer goes with it.
        slot.commands =
            call("vkAllocateCommandBuffers", name, || unsafe { device.raw.allocate_command_buffers(&info) })?[0];
        device.set_name(slot.commands, name);

        let sizes = DESCRIPTOR_KINDS
            .map(|kind| vk::DescriptorPoolSize::default().ty(kind).descriptor_count(MAX_SETS * MOST_OF_A_KIND));
        let info = vk::DescriptorPoolCreateInfo::default().max_sets(MAX_SETS).pool_sizes(&sizes);
        // SAFETY: plain creation.
        slot.descriptor_pool =
            call("vkCreateDescriptorPool", name, || unsafe { device.raw.create_descriptor_pool(&info, None) })?;

        if device.timestamp_valid_bits > 0 {
            let info = vk::QueryPoolCreateInfo::default()
                .query_type(vk::QueryType::TIMESTAMP)
                .query_count(2 * MAX_TIMED_PASSES);
            // SAFETY: plain creation.
            let queries = call("vkCreateQueryPool", name, || unsafe { device.raw.create_query_pool(&info, None) })?;
            slot.queries = Some(queries);
        }
        Ok(slot)
    }

    /// Empties the pools, whose earlier contents the GPU has finished with, and starts recording.
    fn begin(&mut self, device: &Device, name: &str) -> Result<()> {
        self.timed.clear();
        // SAFETY: the caller waited for `finished_at`: nothing of this pool is in use.
        call("vkResetCommandPool", name, || unsafe {
            device.raw.reset_command_pool(self.command_pool, vk::CommandPoolResetFlags::empty())
        })?;
        // SAFETY: nor of this one.
        call("vkResetDescriptorPool", name, || unsafe {
            device.raw.reset_descriptor_pool(self.descriptor_pool, vk::DescriptorPoolResetFlags::empty())
        })?;
        let info = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the command buffer was just reset.
        call("vkBeginCommandBuffer", name, || unsafe { device.raw.begin_command_buffer(self.commands, &info) })?;
        if let Some(queries) = self.queries {
            // SAFETY: recorded outside of rendering, before any timestamp.
            unsafe { device.raw.cmd_reset_query_pool(self.commands, queries, 0, 2 * MAX_TIMED_PASSES) };
        }
        Ok(())
    }
}

impl Drop for Slot {
    fn drop(&mut self) {
        // Handles that were never made are null, of which nothing is destroyed.
        self.device.delete_later(Garbage::CommandPool(self.command_pool));
        self.device.delete_later(Garbage::DescriptorPool(self.descriptor_pool));
        if let Some(queries) = self.queries {
            self.device.delete_later(Garbage::QueryPool(queries));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vulkan::compiled;

    #[test]
    fn a_frame_has_descriptors_for_every_shader() {
        for shader in compiled::ALL {
            let interface = shader.reflect().unwrap();
            for binding in interface.bindings.values() {
                assert!(DESCRIPTOR_KINDS.contains(&binding.kind), "{}: {:?}", shader.name(), binding.kind);
                let alike = interface.bindings.values().filter(|other| other.kind == binding.kind).count();
                assert!(alike <= MOST_OF_A_KIND as usize, "{}: {alike} {:?}", shader.name(), binding.kind);
            }
        }
    }
}
