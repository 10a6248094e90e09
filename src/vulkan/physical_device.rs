//! The devices that the loader offers, and what each lacks.
use super::error::{During, Result, VulkanError, call};
use super::instance::Instance;
use ash::{khr, vk};
use std::ffi::CStr;

/// Storage buffers of the shader that has most. Vulkan promises four, desktop GPUs have many more.
const STORAGE_BUFFERS: u32 = 7;

/// What a device is, in the order in which one is preferred when none is named.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum DeviceKind {
    /// A GPU with memory of its own.
    Discrete,
    /// A GPU that shares the CPU's memory.
    Integrated,
    /// A GPU handed through by a hypervisor.
    Virtual,
    /// A software implementation such as lavapipe.
    Cpu,
    /// Anything else.
    Other,
}

impl DeviceKind {
    fn of(kind: vk::PhysicalDeviceType) -> Self {
        match kind {
            vk::PhysicalDeviceType::DISCRETE_GPU => Self::Discrete,
            vk::PhysicalDeviceType::INTEGRATED_GPU => Self::Integrated,
            vk::PhysicalDeviceType::VIRTUAL_GPU => Self::Virtual,
            vk::PhysicalDeviceType::CPU => Self::Cpu,
            _ => Self::Other,
        }
    }
}

/// A physical device, as `threadlight devices` lists it.
#[derive(Clone, Debug)]
pub struct DeviceDescription {
    /// Position in the loader's list: what a number means where a device is named.
    pub index: usize,
    /// Name as the driver gives it.
    pub name: String,
    /// Driver name and version, e.g. `llvmpipe (Mesa 22.3.6)`.
    pub driver: String,
    /// What it is.
    pub kind: DeviceKind,
    /// Vulkan version, e.g. `1.3.230`.
    pub api_version: String,
    /// What it lacks for Threadlight; empty if it can be used.
    pub lacks: Vec<&'static str>,
}

impl DeviceDescription {
    /// Whether `asked` is part of its name or of its driver's, in any case. A number is only where it is a word of several digits, as in
    /// `NVIDIA GeForce RTX 4090`: some digit is in most names.
    fn is_called(&self, asked: &str) -> bool {
        let asked = asked.to_lowercase();
        let [name, driver] = [&self.name, &self.driver].map(|name| name.to_lowercase());
        if asked.parse::<i64>().is_ok() {
            return asked.len() > 1
                && [name, driver].iter().any(|name| name.split_whitespace().any(|word| word == asked));
        }
        name.contains(&asked)
            || driver.contains(&asked)
            // Mesa's software driver calls itself llvmpipe; everybody else calls it lavapipe.
            || (asked == "lavapipe" && driver.starts_with("llvmpipe"))
    }
}

/// Which of the devices is `asked` for: the one of that index, or else those of which it is part of the name, as `4090` may be.
pub(super) fn named<'a>(devices: impl Iterator<Item = &'a DeviceDescription> + Clone, asked: &str) -> Vec<usize> {
    let asked = asked.trim();
    let of_index = asked.parse().ok().filter(|&index: &usize| devices.clone().any(|device| device.index == index));
    match of_index {
        Some(index) => vec![index],
        // What is empty is a part of every name.
        None if asked.is_empty() => Vec::new(),
        None => devices.filter(|device| device.is_called(asked)).map(|device| device.index).collect(),
    }
}

/// What is lacking where not even shaders can be compiled, as [`DeviceDescription::lacks`] has it.
pub(super) const CUBE_ARRAYS: &str = "arrays of cube maps (imageCubeArray)";
pub(super) const DYNAMIC_RENDERING: &str = "VK_KHR_dynamic_rendering";

/// A physical device and what was found out about it.
pub(super) struct Candidate {
    pub description: DeviceDescription,
    pub physical: vk::PhysicalDevice,
    pub properties: vk::PhysicalDeviceProperties,
    pub queue_family: u32,
    pub timestamp_valid_bits: u32,
    /// Most bytes of a buffer; `u64::MAX` where the device does not say.
    pub most_buffer_bytes: u64,
    pub driver: vk::DriverId,
    pub extensions: Vec<&'static CStr>,
}

/// The devices that the loader offers, usable or not.
///
/// # Errors
/// No driver at all, or a failing query.
pub fn describe_devices(instance: &Instance) -> Result<Vec<DeviceDescription>> {
    Ok(candidates(instance)?.into_iter().map(|candidate| candidate.description).collect())
}

/// The devices that the loader offers, usable or not, each with what is needed to open it.
pub(super) fn candidates(instance: &Instance) -> Result<Vec<Candidate>> {
    // SAFETY: plain query of a live instance.
    let physical_devices = unsafe { instance.raw.enumerate_physical_devices() };
    let physical_devices = match physical_devices {
        Err(vk::Result::ERROR_INITIALIZATION_FAILED) => Vec::new(),
        other => other.during("vkEnumeratePhysicalDevices", "instance")?,
    };
    if physical_devices.is_empty() {
        return Err(VulkanError::NoDriver);
    }
    physical_devices.into_iter().enumerate().map(|(index, physical)| candidate(instance, index, physical)).collect()
}

/// Most bytes of a buffer, which devices say from Vulkan 1.3 on (`maxBufferSize`).
fn most_buffer_bytes(instance: &Instance, physical: vk::PhysicalDevice, api_version: u32) -> u64 {
    if api_version < vk::API_VERSION_1_3 {
        return u64::MAX;
    }
    let mut limits = vk::PhysicalDeviceMaintenance4Properties::default();
    let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut limits);
    // SAFETY: `physical` comes from this instance, and has these properties.
    unsafe { instance.raw.get_physical_device_properties2(physical, &mut properties) };
    limits.max_buffer_size
}

fn candidate(instance: &Instance, index: usize, physical: vk::PhysicalDevice) -> Result<Candidate> {
    let mut driver = vk::PhysicalDeviceDriverProperties::default();
    let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut driver);
    // SAFETY: `physical` comes from this instance.
    unsafe { instance.raw.get_physical_device_properties2(physical, &mut properties) };
    let properties = properties.properties;
    let name = text(properties.device_name_as_c_str());
    let mut lacks = Vec::new();
    if properties.api_version < vk::API_VERSION_1_2 {
        lacks.push("Vulkan 1.2");
    }
    if properties.limits.max_per_stage_descriptor_storage_buffers < STORAGE_BUFFERS {
        const { assert!(STORAGE_BUFFERS == 7) };
        lacks.push("seven storage buffers in a shader (maxPerStageDescriptorStorageBuffers)");
    }
    // SAFETY: `physical` comes from this instance.
    let features = unsafe { instance.raw.get_physical_device_features(physical) };
    if features.image_cube_array == vk::FALSE {
        lacks.push(CUBE_ARRAYS);
    }
    let extensions = extensions(instance, physical, &name, &mut lacks)?;
    let (queue_family, timestamp_valid_bits) = queue_family(instance, physical, &mut lacks);
    let description = DeviceDescription {
        index,
        name,
        driver: format!("{} ({})", text(driver.driver_name_as_c_str()), text(driver.driver_info_as_c_str())),
        kind: DeviceKind::of(properties.device_type),
        api_version: version_text(properties.api_version),
        lacks,
    };
    Ok(Candidate {
        description,
        physical,
        properties,
        queue_family,
        timestamp_valid_bits,
        most_buffer_bytes: most_buffer_bytes(instance, physical, properties.api_version),
        driver: driver.driver_id,
        extensions,
    })
}

/// The extensions to enable: of those that are wanted, the ones that there are. Needed ones that there are not go to `lacks`.
fn extensions(
    instance: &Instance,
    physical: vk::PhysicalDevice,
    name: &str,
    lacks: &mut Vec<&'static str>,
) -> Result<Vec<&'static CStr>> {
    let available = available_extensions(instance, physical, name)?;
    let has = |wanted: &CStr| contains(&available, wanted);
    // These are asked for even where Vulkan 1.3 has them in its core: their entry points are the same ones.
    let needed =
        [(khr::synchronization2::NAME, "VK_KHR_synchronization2"), (khr::dynamic_rendering::NAME, DYNAMIC_RENDERING)];
    lacks.extend(needed.iter().filter(|(extension, _)| !has(extension)).map(|(_, name)| *name));
    let mut wanted: Vec<&'static CStr> = needed.iter().map(|(extension, _)| *extension).collect();
    // A portability driver insists on this one being enabled.
    wanted.push(khr::portability_subset::NAME);
    #[cfg(feature = "viewer")]
    if instance.presents {
        wanted.push(khr::swapchain::NAME);
    }
    wanted.retain(|extension| has(extension));
    Ok(wanted)
}

fn available_extensions(
    instance: &Instance,
    physical: vk::PhysicalDevice,
    name: &str,
) -> Result<Vec<vk::ExtensionProperties>> {
    // SAFETY: `physical` comes from this instance.
    call("vkEnumerateDeviceExtensionProperties", name, || unsafe {
        instance.raw.enumerate_device_extension_properties(physical)
    })
}

fn contains(available: &[vk::ExtensionProperties], wanted: &CStr) -> bool {
    available.iter().any(|extension| extension.extension_name_as_c_str() == Ok(wanted))
}

/// Whether the device of this `name` has the extension that is `wanted`.
pub(super) fn has_extension(
    instance: &Instance,
    physical: vk::PhysicalDevice,
    name: &str,
    wanted: &CStr,
) -> Result<bool> {
    Ok(contains(&available_extensions(instance, physical, name)?, wanted))
}

/// The family of the queue for everything, and how many bits of its timestamps count.
fn queue_family(instance: &Instance, physical: vk::PhysicalDevice, lacks: &mut Vec<&'static str>) -> (u32, u32) {
    // SAFETY: `physical` comes from this instance.
    let families = unsafe { instance.raw.get_physical_device_queue_family_properties(physical) };
    let wanted = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
    let family = families.iter().position(|family| family.queue_flags.contains(wanted));
    if family.is_none() {
        lacks.push("a queue for both graphics and compute");
    }
    let family = family.unwrap_or(0);
    (family as u32, families.get(family).map_or(0, |family| family.timestamp_valid_bits))
}

fn version_text(version: u32) -> String {
    let (major, minor) = (vk::api_version_major(version), vk::api_version_minor(version));
    format!("{major}.{minor}.{}", vk::api_version_patch(version))
}

/// A name in a fixed-size array of the driver's; empty if it is not terminated.
fn text<E>(name: std::result::Result<&CStr, E>) -> String {
    name.map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vulkan::compiled;

    #[test]
    fn devices_are_asked_for_as_many_storage_buffers_as_a_shader_has() {
        let count = |shader: &&crate::vulkan::Shader| {
            let kinds = shader.reflect().unwrap().bindings.into_values().map(|binding| binding.kind);
            kinds.filter(|kind| *kind == vk::DescriptorType::STORAGE_BUFFER).count()
        };
        assert_eq!(compiled::ALL.iter().map(|shader| count(&shader)).max(), Some(STORAGE_BUFFERS as usize));
    }

    #[test]
    fn numbers_are_indices_where_there_is_one_and_else_whole_words_of_names() {
        let device = |index, name: &str, driver: &str| DeviceDescription {
            index,
            name: name.into(),
            driver: driver.into(),
            kind: DeviceKind::of(vk::PhysicalDeviceType::OTHER),
            api_version: "1.3.0".into(),
            lacks: Vec::new(),
        };
        let devices = [
            device(0, "NVIDIA GeForce RTX 4090", "NVIDIA (580.1)"),
            device(1, "llvmpipe (LLVM 15.0.6, 256 bits)", "llvmpipe (Mesa 22.3.6)"),
        ];
        for (asked, meant) in [
            ("0", &[0][..]),
            ("1", &[1]),
            ("4090", &[0]),
            ("rtx", &[0]),
            ("15.0", &[1]),
            ("lavapipe", &[1]),
            (" 1 ", &[1]),
            ("409", &[]),
            ("580", &[]),
            ("580.1", &[0]),
            ("7", &[]),
            ("2", &[]),
            ("-1", &[]),
            ("", &[]),
            (" ", &[]),
            ("\t", &[]),
        ] {
            assert_eq!(named(devices.iter(), asked), meant, "{asked:?}");
        }
    }
}
