//! Plan: the frame as data, everything that executing it needs; printed by [`std::fmt::Display`] in `text.rs`.
use super::access::{Access, Mode};
use super::alias::{Block, Placement};
use super::barriers::Barrier;
use super::declare::{Graph, Handle, Pass, ResourceKind, Use};
use super::keep::Kept;
use super::lifetimes::Lifetime;
use ash::vk;
use std::collections::HashSet;

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

/// Puts together what the stages before have found.
pub(super) fn plan<W>(
    graph: Graph<W>,
    order: &[usize],
    resources: Vec<PlannedResource>,
    blocks: Vec<Block>,
    (barriers, final_barriers): (Vec<Vec<Barrier>>, Vec<Barrier>),
    culled: Vec<(String, String)>,
    kept: Kept,
) -> Plan<W> {
    let needed: HashSet<Handle> =
        order.iter().flat_map(|&pass| &graph.passes[pass].uses).filter_map(|use_| use_.needs()).collect();
    let plan_use = |use_: &Use| {
        let resource = resources.iter().position(|resource| resource.declared == use_.handle.resource)?;
        let outlives = resources[resource].imported || resources[resource].kept;
        let kept = use_.makes().is_some_and(|made| outlives || needed.contains(&made));
        Some(PlannedUse { resource, access: use_.access, mode: use_.mode, kept })
    };
    let mut declared: Vec<Option<Pass<W>>> = graph.passes.into_iter().map(Some).collect();
    let passes = order.iter().zip(barriers).filter_map(|(&pass, barriers)| {
        let Pass { name, uses, work, .. } = declared[pass].take()?;
        Some(PlannedPass { name, barriers, uses: uses.iter().filter_map(plan_use).collect(), work: work? })
    });
    Plan { passes: passes.collect(), final_barriers, resources, blocks, culled, kept }
}
