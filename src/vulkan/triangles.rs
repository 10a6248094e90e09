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
    /// One vertex after another. Two attributes of the same bytes in memory share one buffer.
    pub bytes: &'a [u8],
}

/// A mesh on the device: a buffer for each attribute, and the indices.
pub struct Triangles {
    buffers: Vec<Buffer>,
    /// The buffer of each attribute.
    attributes: Vec<usize>,
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
        let most = device.limits().max_draw_indexed_index_value;
        if vertex_count as u64 > u64::from(most) + 1 {
            let problem =
                format!("{vertex_count} vertices are more than this device draws, {most}; it takes smaller meshes");
            return Err(VulkanError::unfit(name, problem));
        }
        let (vertex, index) = (vk::BufferUsageFlags::VERTEX_BUFFER, vk::BufferUsageFlags::INDEX_BUFFER);
        let upload =
            |part: &str, usage, bytes: &[u8]| Buffer::with_contents(device, &format!("{name} {part}"), usage, bytes);
        let mut distinct: Vec<&VertexAttribute> = Vec::new();
        let mut buffer_of = Vec::new();
        for attribute in attributes {
            let known = distinct.iter().position(|known| std::ptr::eq(known.bytes, attribute.bytes));
            buffer_of.push(known.unwrap_or(distinct.len()));
            distinct.extend(known.is_none().then_some(attribute));
        }
        let uploaded = distinct.iter().map(|attribute| upload(attribute.name, vertex, attribute.bytes));
        Ok(Self {
            buffers: uploaded.collect::<Result<_>>()?,
            attributes: buffer_of,
            strides: attributes.iter().map(|attribute| attribute.stride).collect(),
            indices: upload("indices", index, bytemuck::cast_slice(indices))?,
            index_count: indices.len() as u32,
            identity: Identity::new(),
            device: device.clone(),
        })
    }

    /// The buffer of each attribute.
    pub(super) fn attributes(&self) -> impl Iterator<Item = &Buffer> {
        self.attributes.iter().map(|&buffer| &self.buffers[buffer])
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
