//! The device: which one, its queue, its submissions, and the deletion of what they no longer use.
use super::deletion::{Deletions, Garbage};
use super::error::{Result, VulkanError, call};
use super::instance::Instance;
use super::physical_device::{Candidate, DeviceDescription, candidates, named};
#[cfg(feature = "viewer")]
use super::surface::Surface;
use ash::{ext, khr, vk};
use gpu_allocator::vulkan::{Allocation, Allocator, AllocatorCreateDesc};
use std::ffi::CStr;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// What a submission waits for before it starts, and signals when it has finished, besides the device's timeline.
#[derive(Clone, Copy, Default)]
pub struct Semaphores {
    pub(super) wait: Option<vk::Semaphore>,
    pub(super) signal: Option<vk::Semaphore>,
}

impl Semaphores {
    /// The same for the first of several submissions that were to be one.
    pub fn first(self) -> Self {
        Self { signal: None, ..self }
    }

    /// The same for the last of several submissions that were to be one.
    pub fn last(self) -> Self {
        Self { wait: None, ..self }
    }
}

/// A logical device with one queue for everything.
pub struct Device {
    pub(super) raw: ash::Device,
    pub(super) synchronization2: khr::synchronization2::Device,
    pub(super) dynamic_rendering: khr::dynamic_rendering::Device,
    pub(super) debug: Option<ext::debug_utils::Device>,
    pub(super) physical: vk::PhysicalDevice,
    pub(super) queue_family: u32,
    pub(super) properties: vk::PhysicalDeviceProperties,
    pub(super) timestamp_valid_bits: u32,
    pub(super) most_buffer_bytes: u64,
    driver: vk::DriverId,
    description: DeviceDescription,
    #[cfg(feature = "viewer")]
    pub(super) swapchain: Option<khr::swapchain::Device>,
    queue: Mutex<vk::Queue>,
    // Counts submissions: the n-th signals the value n when it has finished.
    timeline: vk::Semaphore,
    submitted: AtomicU64,
    /// Bytes that may be handed out.
    memory_limit: u64,
    // `None` only while the device is being dropped: the allocator has to go first.
    allocator: Mutex<Option<Allocator>>,
    deletions: Deletions,
    pub(super) instance: Arc<Instance>,
}

/// The environment variable that says how much device memory may be taken.
const MEMORY_LIMIT: &str = "THREADLIGHT_DEVICE_MEMORY_MIB";

/// What that allows, in bytes: all if it is not set.
fn memory_limit() -> Result<u64> {
    let Some(text) = std::env::var_os(MEMORY_LIMIT).filter(|text| !text.is_empty()) else { return Ok(u64::MAX) };
    let mib: Option<u64> = text.to_str().and_then(|text| text.parse().ok());
    let bytes = mib.and_then(|mib| mib.checked_mul(1 << 20));
    bytes.ok_or_else(|| VulkanError::Variable {
        variable: MEMORY_LIMIT,
        problem: format!("{text:?} is no number of MiB"),
        remedy: "set it to a whole number, such as 1024, or unset it",
    })
}

/// The one that `asked` names, or the best one; it may lack what the renderer needs.
pub(super) fn choose(mut candidates: Vec<Candidate>, asked: Option<&str>) -> Result<Candidate> {
    if let Some(asked) = asked {
        let list = candidates.iter().map(|c| format!("{} \"{}\"", c.description.index, c.description.name));
        let available = list.collect::<Vec<_>>().join(", ");
        let meant = named(candidates.iter().map(|candidate| &candidate.description), asked);
        candidates.retain(|candidate| meant.contains(&candidate.description.index));
        if candidates.is_empty() {
            return Err(VulkanError::NoSuchDevice { asked: asked.to_owned(), available });
        }
    }
    // Stable sort: among equals the loader's order decides, which VK_LOADER_* and the user's settings shape.
    candidates.sort_by_key(|candidate| (!candidate.description.lacks.is_empty(), candidate.description.kind));
    candidates.into_iter().next().ok_or(VulkanError::NoDriver)
}

/// Makes a device of `chosen` with one queue, these extensions, what pipelines of the renderer need, and the features that are chained to `info`.
pub(super) fn create_device(
    instance: &Instance,
    chosen: &Candidate,
    extensions: &[&CStr],
    info: vk::DeviceCreateInfo,
) -> Result<ash::Device> {
    let priorities = [1.0];
    let queues =
        [vk::DeviceQueueCreateInfo::default().queue_family_index(chosen.queue_family).queue_priorities(&priorities)];
    let extensions: Vec<_> = extensions.iter().map(|extension| extension.as_ptr()).collect();
    // Graphics pipelines have no render pass.
    let mut dynamic_rendering = vk::PhysicalDeviceDynamicRenderingFeatures::default().dynamic_rendering(true);
    // The irradiance maps of all bases are one array of cube maps.
    let features = vk::PhysicalDeviceFeatures::default().image_cube_array(true);
    let info = info
        .enabled_features(&features)
        .queue_create_infos(&queues)
        .enabled_extension_names(&extensions)
        .push_next(&mut dynamic_rendering);
    // SAFETY: the physical device is this instance's; `info` and all it points to outlive the call.
    call("vkCreateDevice", &chosen.description.name, || unsafe {
        instance.raw.create_device(chosen.physical, &info, None)
    })
}

/// What every device has of its own from the start.
fn allocator_and_timeline(
    instance: &Instance,
    chosen: &Candidate,
    raw: &ash::Device,
) -> Result<(Allocator, vk::Semaphore)> {
    let allocator = Allocator::new(&AllocatorCreateDesc {
        instance: instance.raw.clone(),
        device: raw.clone(),
        physical_device: chosen.physical,
        debug_settings: Default::default(),
        buffer_device_address: false,
        allocation_sizes: Default::default(),
    })
    .map_err(|cause| VulkanError::Memory { object: chosen.description.name.clone(), cause: cause.to_string() })?;
    let mut kind = vk::SemaphoreTypeCreateInfo::default().semaphore_type(vk::SemaphoreType::TIMELINE).initial_value(0);
    let info = vk::SemaphoreCreateInfo::default().push_next(&mut kind);
    // SAFETY: the timeline feature was enabled with the device.
    let timeline = call("vkCreateSemaphore", "timeline", || unsafe { raw.create_semaphore(&info, None) })?;
    Ok((allocator, timeline))
}

impl Device {
    /// Opens the device that `asked` names (index, or part of its name), or the best one: discrete, then integrated,
    /// then CPU.
    ///
    /// # Errors
    /// No driver, no device of that name, or one that lacks what the renderer needs.
    pub fn new(instance: &Arc<Instance>, asked: Option<&str>) -> Result<Arc<Self>> {
        Self::choose(instance, candidates(instance)?, asked)
    }

    /// The same among those that can present to `surface`.
    ///
    /// # Errors
    /// No driver, no device of that name, or one that lacks what the renderer needs or cannot present to that window.
    #[cfg(feature = "viewer")]
    pub fn for_surface(instance: &Arc<Instance>, asked: Option<&str>, surface: &Surface) -> Result<Arc<Self>> {
        surface.check_instance(instance)?;
        let mut candidates = candidates(instance)?;
        for candidate in &mut candidates {
            if !candidate.extensions.contains(&khr::swapchain::NAME) {
                candidate.description.lacks.push("VK_KHR_swapchain");
            } else if !surface.is_supported(candidate.physical, candidate.queue_family) {
                candidate.description.lacks.push("a queue that presents to this window");
            }
        }
        Self::choose(instance, candidates, asked)
    }

    fn choose(instance: &Arc<Instance>, candidates: Vec<Candidate>, asked: Option<&str>) -> Result<Arc<Self>> {
        let chosen = choose(candidates, asked)?;
        if !chosen.description.lacks.is_empty() {
            let feature = chosen.description.lacks.join(" and ");
            return Err(VulkanError::Unsuitable { device: chosen.description.name, feature });
        }
        Self::open(instance, chosen)
    }

    fn open(instance: &Arc<Instance>, chosen: Candidate) -> Result<Arc<Self>> {
        let memory_limit = memory_limit()?;
        let name = &chosen.description.name;
        let mut timeline_semaphore = vk::PhysicalDeviceTimelineSemaphoreFeatures::default().timeline_semaphore(true);
        let mut synchronization2 = vk::PhysicalDeviceSynchronization2Features::default().synchronization2(true);
        let info = vk::DeviceCreateInfo::default().push_next(&mut timeline_semaphore).push_next(&mut synchronization2);
        let raw = create_device(instance, &chosen, &chosen.extensions, info)?;
        let (allocator, timeline) = match allocator_and_timeline(instance, &chosen, &raw) {
            Ok(made) => made,
            Err(error) => {
                // SAFETY: nothing of the device is left, and nobody else has it yet.
                unsafe { raw.destroy_device(None) };
                return Err(error);
            }
        };
        // SAFETY: one queue of this family was asked for above.
        let queue = unsafe { raw.get_device_queue(chosen.queue_family, 0) };
        tracing::info!("device {}: {name}, {}", chosen.description.index, chosen.description.driver);
        Ok(Arc::new(Self {
            synchronization2: khr::synchronization2::Device::new(&instance.raw, &raw),
            dynamic_rendering: khr::dynamic_rendering::Device::new(&instance.raw, &raw),
            debug: instance.debug_names.then(|| ext::debug_utils::Device::new(&instance.raw, &raw)),
            physical: chosen.physical,
            queue_family: chosen.queue_family,
            properties: chosen.properties,
            timestamp_valid_bits: chosen.timestamp_valid_bits,
            most_buffer_bytes: chosen.most_buffer_bytes,
            driver: chosen.driver,
            description: chosen.description,
            #[cfg(feature = "viewer")]
            swapchain: chosen
                .extensions
                .contains(&khr::swapchain::NAME)
                .then(|| khr::swapchain::Device::new(&instance.raw, &raw)),
            queue: Mutex::new(queue),
            timeline,
            submitted: AtomicU64::new(0),
            memory_limit,
            allocator: Mutex::new(Some(allocator)),
            deletions: Deletions::default(),
            instance: instance.clone(),
            raw,
        }))
    }

    /// Name, driver and kind.
    pub fn description(&self) -> &DeviceDescription {
        &self.description
    }

    /// Whether timestamps between the passes of one submission tell how long each took.
    ///
    /// Lavapipe (Mesa 22.3) writes them with the next batch of rasterisation, not between the dispatches that they
    /// stand between: a full-screen dispatch of 20 ms was seen to take 0.02 ms by them.
    pub fn times_passes(&self) -> bool {
        self.timestamp_valid_bits > 0 && self.driver != vk::DriverId::MESA_LLVMPIPE
    }

    /// Whether clearing a part of a target is faster than all of it. So it was seen to be with NVIDIA's driver. Mesa's for AMD and Intel have fast
    /// clears of whole targets only, and lavapipe clears parts by one thread, whole targets tile by tile as it draws into them.
    pub(super) fn clears_parts(&self) -> bool {
        self.driver == vk::DriverId::NVIDIA_PROPRIETARY
    }

    /// An error for the object `name` of `other`, if that is another device than this.
    pub(super) fn check_same(&self, other: &Self, name: &str) -> Result<()> {
        if std::ptr::eq(self, other) { Ok(()) } else { Err(VulkanError::unfit(name, "it is of another device")) }
    }

    /// Tells devices and versions of their drivers apart, as far as drivers do.
    pub fn driver_id(&self) -> Vec<u8> {
        let &vk::PhysicalDeviceProperties { vendor_id, device_id, driver_version, api_version, .. } = &self.properties;
        let numbers = [vendor_id, device_id, driver_version, api_version].map(u32::to_le_bytes);
        let DeviceDescription { name, driver, .. } = &self.description;
        [name.as_bytes(), b"\0", driver.as_bytes(), b"\0", numbers.as_flattened(), &self.properties.pipeline_cache_uuid]
            .concat()
    }

    /// Limits, as the driver states them.
    pub fn limits(&self) -> &vk::PhysicalDeviceLimits {
        &self.properties.limits
    }

    /// Most columns and rows of an image that is drawn into.
    pub fn longest_target_side(&self) -> u32 {
        let limits = self.limits();
        let [viewport_width, viewport_height] = limits.max_viewport_dimensions;
        let framebuffer = limits.max_framebuffer_width.min(limits.max_framebuffer_height);
        limits.max_image_dimension2_d.min(framebuffer).min(viewport_width).min(viewport_height)
    }

    /// Whether images of `format` can be sampled with linear filtering.
    pub fn filters_linearly(&self, format: vk::Format) -> bool {
        // SAFETY: plain query about this instance's physical device.
        let properties = unsafe { self.instance.raw.get_physical_device_format_properties(self.physical, format) };
        properties.optimal_tiling_features.contains(vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_LINEAR)
    }

    /// Bytes of device memory handed out to buffers and images at this moment.
    pub fn allocated_bytes(&self) -> u64 {
        lock(&self.allocator).as_ref().map_or(0, |allocator| allocator.generate_report().total_allocated_bytes)
    }

    /// Why `bytes` more may not be handed out, if they may not.
    pub(super) fn check_memory_limit(&self, bytes: u64) -> std::result::Result<(), String> {
        if self.memory_limit == u64::MAX || self.allocated_bytes().saturating_add(bytes) <= self.memory_limit {
            return Ok(());
        }
        let mib = self.memory_limit >> 20;
        Err(format!("it would take {bytes} bytes, and {MEMORY_LIMIT} allows {mib} MiB in all"))
    }

    /// Hands `commands` to the queue; the returned value is reached when they have finished.
    pub(super) fn submit(&self, commands: vk::CommandBuffer, name: &str, semaphores: Semaphores) -> Result<u64> {
        let queue = lock(&self.queue);
        let value = self.submitted.load(Ordering::Acquire) + 1;
        let buffers = [vk::CommandBufferSubmitInfo::default().command_buffer(commands)];
        let at_all_commands = |semaphore| {
            let info = vk::SemaphoreSubmitInfo::default().semaphore(semaphore);
            info.stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
        };
        let waits: Vec<_> = semaphores.wait.map(at_all_commands).into_iter().collect();
        let signals: Vec<_> = [at_all_commands(self.timeline).value(value)]
            .into_iter()
            .chain(semaphores.signal.map(at_all_commands))
            .collect();
        let info = vk::SubmitInfo2::default()
            .wait_semaphore_infos(&waits)
            .command_buffer_infos(&buffers)
            .signal_semaphore_infos(&signals);
        // SAFETY: the queue is held exclusively; the command buffer is complete and kept until `value` is reached.
        call("vkQueueSubmit2", name, || unsafe {
            self.synchronization2.queue_submit2(*queue, &[info], vk::Fence::null())
        })?;
        self.submitted.store(value, Ordering::Release);
        Ok(value)
    }

    /// Blocks until submission number `value` has finished, then destroys what was waiting for it.
    pub(super) fn wait_for(&self, value: u64) -> Result<()> {
        let (semaphores, values) = ([self.timeline], [value]);
        let info = vk::SemaphoreWaitInfo::default().semaphores(&semaphores).values(&values);
        // SAFETY: the timeline lives as long as the device; `value` has been submitted or is 0.
        call("vkWaitSemaphores", "timeline", || unsafe { self.raw.wait_semaphores(&info, u64::MAX) })?;
        self.collect_garbage(value);
        Ok(())
    }

    /// Lets `act` use the queue, alone.
    #[cfg(feature = "viewer")]
    pub(super) fn with_queue<T>(&self, act: impl FnOnce(vk::Queue) -> T) -> T {
        act(*lock(&self.queue))
    }

    /// Blocks until the queue has nothing left to do, also for presentation, then destroys what was waiting for it.
    #[cfg(feature = "viewer")]
    pub(crate) fn wait_idle(&self) -> Result<()> {
        let finished = self.with_queue(|queue| {
            // SAFETY: the queue is held exclusively.
            call("vkQueueWaitIdle", &self.description.name, || unsafe { self.raw.queue_wait_idle(queue) })?;
            Ok(self.submitted.load(Ordering::Acquire))
        })?;
        self.collect_garbage(finished);
        Ok(())
    }

    /// Destroys `garbage` when everything submitted so far has finished.
    pub(super) fn delete_later(&self, garbage: Garbage) {
        let last_use = self.submitted.load(Ordering::Acquire);
        self.deletions.add(last_use, garbage);
    }

    fn collect_garbage(&self, finished: u64) {
        for garbage in self.deletions.take(finished) {
            // SAFETY: each handle was made by this device, is owned by the queue alone since its owner was dropped,
            // and the last submission that could use it has finished.
            unsafe {
                match garbage {
                    Garbage::Buffer(handle) => self.raw.destroy_buffer(handle, None),
                    Garbage::Image(handle) => self.raw.destroy_image(handle, None),
                    Garbage::ImageView(handle) => self.raw.destroy_image_view(handle, None),
                    Garbage::Sampler(handle) => self.raw.destroy_sampler(handle, None),
                    Garbage::Pipeline(handle) => self.raw.destroy_pipeline(handle, None),
                    Garbage::PipelineLayout(handle) => self.raw.destroy_pipeline_layout(handle, None),
                    Garbage::DescriptorSetLayout(handle) => self.raw.destroy_descriptor_set_layout(handle, None),
                    Garbage::DescriptorPool(handle) => self.raw.destroy_descriptor_pool(handle, None),
                    Garbage::CommandPool(handle) => self.raw.destroy_command_pool(handle, None),
                    Garbage::QueryPool(handle) => self.raw.destroy_query_pool(handle, None),
                    Garbage::Memory(allocation) => self.free(allocation),
                }
            }
        }
    }

    pub(super) fn with_allocator<T>(&self, act: impl FnOnce(&mut Allocator) -> T) -> Option<T> {
        lock(&self.allocator).as_mut().map(act)
    }

    fn free(&self, allocation: Allocation) {
        if let Some(Err(cause)) = self.with_allocator(|allocator| allocator.free(allocation)) {
            tracing::error!("device memory could not be freed: {cause}");
        }
    }

    /// Gives `handle` the name that validation messages and frame debuggers show.
    pub(super) fn set_name<T: vk::Handle>(&self, handle: T, name: &str) {
        let (Some(debug), Ok(name)) = (&self.debug, std::ffi::CString::new(name)) else { return };
        let info = vk::DebugUtilsObjectNameInfoEXT::default().object_handle(handle).object_name(&name);
        // SAFETY: the handle is alive and made by this device.
        if let Err(result) = unsafe { debug.set_debug_utils_object_name(&info) } {
            tracing::debug!("vkSetDebugUtilsObjectNameEXT failed for {name:?}: {result}");
        }
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: the last owner of the device is here, so no other thread uses its queue.
        if let Err(result) = unsafe { self.raw.device_wait_idle() } {
            tracing::error!("vkDeviceWaitIdle failed for {}: {result}", self.description.name);
        }
        self.collect_garbage(u64::MAX);
        drop(lock(&self.allocator).take());
        // SAFETY: the device is idle and everything made by it is gone: all owners held an `Arc` of it.
        unsafe {
            self.raw.destroy_semaphore(self.timeline, None);
            self.raw.destroy_device(None);
        }
    }
}

/// A panic elsewhere leaves these plain values intact, so a poisoned lock is no reason to stop.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
