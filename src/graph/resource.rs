//! Resources: what they are, and the handles that name their versions.
use super::access::Access;
use ash::vk;

/// An image of one layer, one mip level and one sample per pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ImageDesc {
    /// Texel format.
    pub format: vk::Format,
    /// Width in texels, at least 1.
    pub width: u32,
    /// Height in texels, at least 1.
    pub height: u32,
}

/// A buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct BufferDesc {
    /// Size in bytes, at least 1.
    pub size_bytes: u64,
}

/// What a resource is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ResourceKind {
    /// An image.
    Image(ImageDesc),
    /// A buffer.
    Buffer(BufferDesc),
}

/// One version of one resource of one graph: the contents between one write and the next.
///
/// Version 0 is what the resource holds when the frame begins: nothing for a transient one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Handle {
    pub(super) resource: usize,
    pub(super) version: u32,
}

impl Handle {
    /// The version that a write to this one makes.
    pub(super) fn next(self) -> Self {
        Self { version: self.version + 1, ..self }
    }
}

/// A version of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ImageHandle(Handle);

/// A version of a buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct BufferHandle(Handle);

/// [`ImageHandle`] or [`BufferHandle`]: writing one gives the next version of the same type.
pub trait Versioned: Copy + Into<Handle> + From<Handle> {}
impl Versioned for ImageHandle {}
impl Versioned for BufferHandle {}

impl From<ImageHandle> for Handle {
    fn from(image: ImageHandle) -> Self {
        image.0
    }
}

impl From<BufferHandle> for Handle {
    fn from(buffer: BufferHandle) -> Self {
        buffer.0
    }
}

impl From<Handle> for ImageHandle {
    fn from(handle: Handle) -> Self {
        Self(handle)
    }
}

impl From<Handle> for BufferHandle {
    fn from(handle: Handle) -> Self {
        Self(handle)
    }
}

/// What a resource must be when it is made.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ResourceInfo {
    /// Its name.
    pub name: String,
    /// Image or buffer, and its size.
    pub kind: ResourceKind,
    /// All uses of an image together; empty for a buffer.
    pub image_usage: vk::ImageUsageFlags,
    /// All uses of a buffer together; empty for an image.
    pub buffer_usage: vk::BufferUsageFlags,
}

impl ResourceInfo {
    /// A resource for these accesses.
    pub(super) fn used_as(name: &str, kind: ResourceKind, accesses: impl Iterator<Item = Access>) -> Self {
        let mut info = Self {
            name: name.to_owned(),
            kind,
            image_usage: vk::ImageUsageFlags::empty(),
            buffer_usage: vk::BufferUsageFlags::empty(),
        };
        for access in accesses.map(Access::info) {
            match kind {
                ResourceKind::Image(_) => info.image_usage |= access.image_usage.unwrap_or_default(),
                ResourceKind::Buffer(_) => info.buffer_usage |= access.buffer_usage.unwrap_or_default(),
            }
        }
        info
    }

    /// Whether it is an image rather than a buffer.
    pub fn is_image(&self) -> bool {
        matches!(self.kind, ResourceKind::Image(_))
    }
}
