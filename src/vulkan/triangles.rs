//! Indexed triangles whose indices are known to be those of vertices.
use super::device::Device;
use super::error::{Result, VulkanError};
use super::identity::Identity;
use super::memory::Buffer;
use ash::vk;
use std::sync::Arc;

/// One attribute of all vertices.
pub struct VertexAttribute<'a> {
    /// What it is, for the debug name.
    pub name: &'a str,
    /// Bytes of one vertex.
    pub stride: u32,
    /// One vertex after another.
    pub bytes: &'a [u8],
}

/// A mesh on the device: one buffer for each attribute, and the indices.
pub struct Triangles {
    pub(super) attributes: Vec<Buffer>,
    /// Bytes of one vertex in each.
    pub(super) strides: Vec<u32>,
    pub(super) indices: Buffer,
    pub(super) index_count: u32,
    identity: Identity,
    device: Arc<Device>,
}

impl Triangles {
    /// Uploads them.
    ///
    /// # Errors
    /// No device memory left, attributes of different numbers of vertices, an index that is of no vertex.
    pub fn new(device: &Arc<Device>, name: &str, attributes: &[VertexAttribute], indices: &[u32]) -> Result<Self> {
        let counts = attributes.iter().map(|attribute| attribute.bytes.len() / attribute.stride.max(1) as usize);
        let vertex_count = counts.min().unwrap_or(0);
        if let Some(stray) = indices.iter().find(|index| **index as usize >= vertex_count) {
            return Err(VulkanError::unfit(name, format!("index {stray} is of none of its {vertex_count} vertices")));
        }
        let (vertex, index) = (vk::BufferUsageFlags::VERTEX_BUFFER, vk::BufferUsageFlags::INDEX_BUFFER);
        let upload =
            |part: &str, usage, bytes: &[u8]| Buffer::with_contents(device, &format!("{name} {part}"), usage, bytes);
        let uploaded = attributes.iter().map(|attribute| upload(attribute.name, vertex, attribute.bytes));
        Ok(Self {
            attributes: uploaded.collect::<Result<_>>()?,
            strides: attributes.iter().map(|attribute| attribute.stride).collect(),
            indices: upload("indices", index, bytemuck::cast_slice(indices))?,
            index_count: indices.len() as u32,
            identity: Identity::new(),
            device: device.clone(),
        })
    }

    /// The device that they are on.
    pub(super) fn device(&self) -> &Device {
        &self.device
    }

    /// Which triangles these are.
    pub(crate) fn identity(&self) -> Identity {
        self.identity
    }
}
