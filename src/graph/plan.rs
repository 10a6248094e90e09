//! Plan: the frame as data, everything that executing it needs; printed by [`std::fmt::Display`] in `text.rs`.
use super::access::{Access, Mode};
use super::kept::Kept;
use super::resource::{Handle, ResourceInfo};
use ash::vk::{AccessFlags2, ImageLayout, PipelineStageFlags2};

/// What runs in a frame, in which order, with which barriers, in which memory.
///
/// Resources and passes are named by their index in [`Plan::resources`] and [`Plan::passes`].
#[derive(Debug)]
pub struct Plan<W> {
    /// The passes that run, in this order.
    pub passes: Vec<PlannedPass<W>>,
    /// Barriers after the last pass: they leave imported resources as their owners want them.
    pub final_barriers: Vec<Barrier>,
    /// The resources that these passes use, in order of declaration. Others are not needed and not made.
    pub resources: Vec<PlannedResource>,
    /// The memory of the transient resources.
    pub blocks: Vec<Block>,
    /// Names of the passes that do not run, and why.
    pub culled: Vec<(String, String)>,
    /// What kept resources hold after the frame.
    pub kept: Kept,
}

/// A pass that runs.
#[derive(Debug)]
pub struct PlannedPass<W> {
    /// Its name.
    pub name: String,
    /// The pass that it is a later portion of, if it is.
    pub portion_of: Option<String>,
    /// What must be recorded before it; the order among these does not matter.
    pub barriers: Vec<Barrier>,
    /// What it uses, in order of declaration: also the order of colour attachments.
    pub uses: Vec<PlannedUse>,
    /// What it records.
    pub work: W,
}

/// One use of a resource by a pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlannedUse {
    /// Index of the resource.
    pub resource: usize,
    /// How it is used.
    pub access: Access,
    /// Whether contents are kept or replaced (for an attachment: load, or clear or leave undefined).
    pub mode: Mode,
    /// Whether anything looks at what this pass leaves (for an attachment: store, or do not care). False for reads.
    pub kept: bool,
    /// The version that it finds.
    pub(super) handle: Handle,
}

/// A resource that a pass of the plan uses.
#[derive(Clone, Debug)]
pub struct PlannedResource {
    /// What it is. The owner of an imported resource must have made it with at least this usage.
    pub info: ResourceInfo,
    /// Whether someone else owns it.
    pub imported: bool,
    /// Whether it outlives the frame.
    pub kept: bool,
    /// The passes that use it.
    pub lifetime: Lifetime,
    /// Its memory; `None` for an imported or kept resource.
    pub placement: Option<Placement>,
    /// Its index among the declared resources.
    pub(super) declared: usize,
}

/// First and last position in the plan, both included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lifetime {
    /// Position of the first pass that uses the resource.
    pub first: usize,
    /// Position of the last pass that uses the resource.
    pub last: usize,
}

impl Lifetime {
    /// Whether some pass of the plan is in both.
    pub fn overlaps(self, other: Self) -> bool {
        self.first <= other.last && other.first <= self.last
    }
}

/// What Vulkan asks for a resource (`VkMemoryRequirements`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemoryRequirement {
    /// Bytes of memory.
    pub size_bytes: u64,
    /// Its offset in a block must be a multiple of this.
    pub alignment: u64,
    /// Memory types that will do, one bit each.
    pub memory_type_bits: u32,
}

/// One allocation of device memory, shared by resources of one kind: images and buffers are kept apart, so that
/// `bufferImageGranularity` never matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Block {
    /// Bytes of memory.
    pub size_bytes: u64,
    /// The strictest alignment of the resources in it.
    pub alignment: u64,
    /// Memory types that will do for all resources in it.
    pub memory_type_bits: u32,
}

/// Where a resource lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Placement {
    /// Index of the block.
    pub block: usize,
    /// First byte within the block.
    pub offset_bytes: u64,
    /// Bytes that the resource occupies.
    pub size_bytes: u64,
}

impl Placement {
    /// Whether some byte belongs to both.
    pub fn overlaps(self, other: Self) -> bool {
        self.block == other.block && self.offset_bytes < other.end_bytes() && other.offset_bytes < self.end_bytes()
    }

    /// First byte after it.
    pub(super) fn end_bytes(self) -> u64 {
        self.offset_bytes + self.size_bytes
    }
}

/// One dependency, in the terms of `VkMemoryBarrier2` and `VkImageMemoryBarrier2` over a whole resource.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Barrier {
    /// Index of the resource in the plan.
    pub resource: usize,
    /// Stages that must have finished.
    pub src_stage: PipelineStageFlags2,
    /// Writes of these stages that must be made available; empty where execution is all that is waited for.
    pub src_access: AccessFlags2,
    /// Stages that wait.
    pub dst_stage: PipelineStageFlags2,
    /// Accesses of these stages that memory is made visible to.
    pub dst_access: AccessFlags2,
    /// Layout before; `UNDEFINED` where the contents are not kept, and for buffers.
    pub old_layout: ImageLayout,
    /// Layout after; `UNDEFINED` for buffers. No transition if it is the old one.
    pub new_layout: ImageLayout,
    /// Empty but for the first use of transient memory, where these are the resources whose last accesses it waits for: all
    /// that share bytes with it, in order, itself included.
    pub takes_over: Vec<usize>,
}

impl Barrier {
    /// Whether the source is (also) accesses made through other resources in the same memory.
    ///
    /// An image or buffer barrier covers accesses through that image or buffer only, so this one must be recorded as a
    /// global memory barrier. An image then gets its layout by a barrier of its own in a later command, from `dst_stage`
    /// to `dst_stage`, which forms a chain with the first.
    pub fn is_aliasing(&self) -> bool {
        self.takes_over.iter().any(|&other| other != self.resource)
    }
}

impl<W> Plan<W> {
    /// Index in [`Plan::resources`] of the resource that `handle` is a version of; `None` if no pass that runs uses it.
    pub fn find(&self, handle: impl Into<Handle>) -> Option<usize> {
        let handle = handle.into();
        self.resources.iter().position(|resource| resource.declared == handle.resource)
    }

    /// Memory of the transient resources, in bytes.
    pub fn aliased_bytes(&self) -> u64 {
        self.blocks.iter().map(|block| block.size_bytes).sum()
    }

    /// What it would be if none were shared, in bytes.
    pub fn unaliased_bytes(&self) -> u64 {
        self.resources.iter().filter_map(|resource| resource.placement).map(|placement| placement.size_bytes).sum()
    }
}
