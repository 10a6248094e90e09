//! The objects behind resources: made for a frame, or kept between frames.
use super::kept::Kept;
use super::plan::MemoryRequirement;
use super::resource::{ResourceInfo, ResourceKind};
use super::work::DeviceResource;
use crate::Result;
use crate::vulkan::{self, Device, ImageShape, Memory};
use ash::vk;
use std::collections::HashMap;
use std::sync::Arc;

/// The objects that outlive frames, and what they hold.
#[derive(Default)]
pub struct Store {
    pub(super) kept: Kept,
    objects: HashMap<String, (ResourceInfo, DeviceResource)>,
}

impl Store {
    /// What the frames so far have left.
    #[cfg(feature = "viewer")]
    pub fn kept(&self) -> &Kept {
        &self.kept
    }

    /// The object that is kept as `info`, made if there is none.
    pub(super) fn object(&mut self, device: &Arc<Device>, info: &ResourceInfo) -> Result<DeviceResource> {
        if let Some((_, object)) = self.objects.get(&info.name).filter(|(known, _)| known == info) {
            return Ok(object.clone());
        }
        let (object, needs) = make(device, info)?;
        let memory = Memory::new(device, &info.name, needs.into(), !info.is_image())?;
        let object = bind(object, &memory, 0)?;
        self.objects.insert(info.name.clone(), (info.clone(), object.clone()));
        Ok(object)
    }
}

/// An object that has no memory yet.
pub(super) enum Made {
    Image(vulkan::Image),
    Buffer(vulkan::Buffer),
}

/// Gives `made` its memory.
pub(super) fn bind(made: Made, memory: &Arc<Memory>, offset: u64) -> Result<DeviceResource> {
    Ok(match made {
        Made::Image(mut image) => {
            image.bind(memory, offset)?;
            DeviceResource::Image(Arc::new(image))
        }
        Made::Buffer(mut buffer) => {
            buffer.bind(memory, offset)?;
            DeviceResource::Buffer(Arc::new(buffer))
        }
    })
}

/// A resource without memory, and what memory it needs.
pub(super) fn make(device: &Arc<Device>, info: &ResourceInfo) -> Result<(Made, MemoryRequirement)> {
    let (object, needs) = match info.kind {
        ResourceKind::Image(desc) => {
            let shape = ImageShape::plane(desc.format, desc.width, desc.height);
            let image = vulkan::Image::unbound(device, &info.name, shape, info.image_usage)?;
            let needs = image.requirements();
            (Made::Image(image), needs)
        }
        ResourceKind::Buffer(desc) => {
            let buffer = vulkan::Buffer::unbound(device, &info.name, desc.size_bytes, info.buffer_usage)?;
            let needs = buffer.requirements();
            (Made::Buffer(buffer), needs)
        }
    };
    let vk::MemoryRequirements { size: size_bytes, alignment, memory_type_bits } = needs;
    Ok((object, MemoryRequirement { size_bytes, alignment, memory_type_bits }))
}

impl From<MemoryRequirement> for vk::MemoryRequirements {
    fn from(MemoryRequirement { size_bytes, alignment, memory_type_bits }: MemoryRequirement) -> Self {
        Self { size: size_bytes, alignment, memory_type_bits }
    }
}
