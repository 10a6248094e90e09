//! Barriers: what must finish, and be visible to whom, before a pass touches a resource (synchronization2).
//!
//! The uses of a resource in plan order fall into *spans*: one write, or all reads in one layout until the next write. A
//! barrier stands before each span but says nothing within one, so it takes a single rule to derive them all: it waits
//! for the stages of the span before, makes visible what that span wrote, and changes the layout if the two differ.
//!
//! | span before, span after | what the barrier promises |
//! |---|---|
//! | write, reads | the writes are visible to every read of the span, also to those of later passes: these get no barrier |
//! | write, write | the first write is finished and does not land after the second |
//! | reads, write | all reads, in whatever stages, are finished: execution only, no memory access in the source |
//! | reads, reads in another layout | all reads are finished, then the layout changes; the contents stay |
//!
//! Why the span before is enough: its own barrier waited for the one before it, and so on; each barrier's source stages
//! are the destination stages of the one before, which is what Vulkan calls an execution dependency chain.
//!
//! Before the first span of a resource stands what happened to it earlier:
//! - *Imported with an access before*: that access. No barrier if it already covers all reads of the span.
//! - *Imported without*: unknown, hence everything earlier on the queue, and its memory writes.
//! - *Transient*: the last span of every resource that shares bytes with it, itself included. Those of the same frame ran
//!   before it, those later in the plan ran a frame ago: frames in flight share one set of transient memory, which is
//!   sound because a barrier also waits for earlier submissions to the same queue. The image's layout is then `UNDEFINED`: the
//!   contents are gone. Sparing a wait where the order implies it would save nothing: there is one barrier either way.
//! - *Kept*: the last span of the last frame that used it. What it holds may be still good, or be written anew.
//!
//! After the last span of an imported resource stands the access that its owner wants it left for, as one more span. Its
//! barrier is left out only if the stages are the very same: the owner waits for these later, and for no others.
//!
//! What the barriers do not promise: anything between queues, between two plans whose memory overlaps, or to the CPU
//! beyond making writes available to it (it still has to wait for the frame's fence).
use super::access::Access;
use super::declare::Graph;
use super::kept::{Held, Kept};
use super::plan::{Barrier, PlannedResource};
use super::resource::{Handle, ResourceKind};
use ash::vk::{AccessFlags2, ImageLayout, PipelineStageFlags2};
use std::collections::HashMap;

/// Everything that writes memory, in all of [`Access`]; `MEMORY_WRITE` stands for an unknown past.
const WRITES: AccessFlags2 = AccessFlags2::from_raw(
    AccessFlags2::MEMORY_WRITE.as_raw()
        | AccessFlags2::COLOR_ATTACHMENT_WRITE.as_raw()
        | AccessFlags2::DEPTH_STENCIL_ATTACHMENT_WRITE.as_raw()
        | AccessFlags2::SHADER_STORAGE_WRITE.as_raw()
        | AccessFlags2::TRANSFER_WRITE.as_raw(),
);

/// One write, or all reads in one layout until the next write or change of layout.
#[derive(Clone, Copy)]
struct Span {
    /// Position in the plan of the first pass; of no meaning for what an owner does.
    first: usize,
    stages: PipelineStageFlags2,
    accesses: AccessFlags2,
    layout: ImageLayout,
    discards: bool,
}

/// A past that nothing is known about.
const UNKNOWN: Span = Span {
    first: 0,
    stages: PipelineStageFlags2::ALL_COMMANDS,
    accesses: AccessFlags2::MEMORY_WRITE,
    layout: ImageLayout::UNDEFINED,
    discards: false,
};

impl Span {
    fn new(first: usize, access: Access, accesses: AccessFlags2, kind: &ResourceKind, discards: bool) -> Self {
        let info = access.info();
        let layout = if matches!(kind, ResourceKind::Image(_)) { info.layout } else { ImageLayout::UNDEFINED };
        Self { first, stages: info.stages, accesses, layout, discards }
    }

    /// What the owner does with an imported resource before or after the frame.
    fn by_owner(first: usize, access: Access, kind: &ResourceKind) -> Self {
        Self::new(first, access, access.info().reads | access.info().writes, kind, false)
    }

    fn only_reads(&self) -> bool {
        !self.accesses.intersects(WRITES)
    }

    /// Whether both are reads in the same layout.
    fn reads_with(&self, next: &Self) -> bool {
        self.only_reads() && next.only_reads() && self.layout == next.layout
    }

    /// Whether what these reads see, those of `next` see too.
    fn covers(&self, next: &Self) -> bool {
        self.reads_with(next) && self.stages.contains(next.stages) && self.accesses.contains(next.accesses)
    }
}

/// The barriers before each pass of the plan, and those after the last one; each list in the order of the resources. And what
/// kept resources hold then.
pub(super) fn barriers<W>(
    graph: &Graph<W>,
    order: &[usize],
    resources: &[PlannedResource],
    kept: Option<&Kept>,
    fingerprints: &HashMap<Handle, Option<u64>>,
) -> ((Vec<Vec<Barrier>>, Vec<Barrier>), Kept) {
    let spans: Vec<Vec<Span>> = resources.iter().map(|resource| spans(graph, order, resource.declared)).collect();
    let mut barriers: Vec<Vec<Barrier>> = vec![Vec::new(); order.len()];
    let mut final_barriers = Vec::new();
    let mut kept = kept.cloned().unwrap_or_default();
    for (resource, own) in spans.iter().enumerate() {
        let declared = &graph.resources[resources[resource].declared];
        let (mut past, mut takes_over) = match &declared.import {
            Some(import) => (past_of_import(import.before, &declared.kind), Vec::new()),
            None if resources[resource].kept => (past_of_kept(&resources[resource], &kept), Vec::new()),
            None => past_of_memory(resource, resources, &spans),
        };
        for span in own {
            // A covered span is one with the past: whoever waits for the past waits for both.
            if !past.covers(span) {
                barriers[span.first].push(barrier(resource, &past, span, std::mem::take(&mut takes_over)));
                past = *span;
            }
        }
        let after = declared.import.as_ref().and_then(|import| import.after);
        if let Some(after) = after.map(|access| Span::by_owner(order.len(), access, &declared.kind)) {
            // The owner will wait for the stages of `after` only, so these must stand for all stages before.
            if !(past.covers(&after) && after.stages.contains(past.stages)) {
                final_barriers.push(barrier(resource, &past, &after, Vec::new()));
            }
        }
        if resources[resource].kept {
            kept.hold(&resources[resource], &past, newest(graph, order, resources[resource].declared), fingerprints);
        }
    }
    ((barriers, final_barriers), kept)
}

/// The newest version of a resource that the plan makes; none if it only reads.
fn newest<W>(graph: &Graph<W>, order: &[usize], resource: usize) -> Option<Handle> {
    let uses = order.iter().flat_map(|&pass| &graph.passes[pass].uses);
    uses.filter_map(|use_| use_.makes()).filter(|made| made.resource == resource).max()
}

impl Kept {
    /// Notes that the plan leaves `resource` as it was used last, with the contents of version `made`, or as they were.
    fn hold(
        &mut self,
        resource: &PlannedResource,
        last: &Span,
        made: Option<Handle>,
        fingerprints: &HashMap<Handle, Option<u64>>,
    ) {
        let name = &resource.info.name;
        let fingerprint = match made {
            Some(made) => fingerprints.get(&made).copied().flatten(),
            None => self.0.get(name).and_then(|held| held.fingerprint),
        };
        let Span { stages, accesses, layout, .. } = *last;
        self.0.insert(name.clone(), Held { info: resource.info.clone(), fingerprint, stages, accesses, layout });
    }
}

fn spans<W>(graph: &Graph<W>, order: &[usize], resource: usize) -> Vec<Span> {
    let declared = &graph.resources[resource];
    let mut spans: Vec<Span> = Vec::new();
    let mut append = |span: Span| match spans.last_mut().filter(|last| last.reads_with(&span)) {
        Some(last) => (last.stages, last.accesses) = (last.stages | span.stages, last.accesses | span.accesses),
        None => spans.push(span),
    };
    for (position, &pass) in order.iter().enumerate() {
        for use_ in graph.passes[pass].uses.iter().filter(|use_| use_.handle.resource == resource) {
            let discards = use_.needs().is_none();
            append(Span::new(position, use_.access, use_.mode.accesses(use_.access), &declared.kind, discards));
        }
    }
    spans
}

fn past_of_import(before: Option<Access>, kind: &ResourceKind) -> Span {
    before.map_or(UNKNOWN, |access| Span::by_owner(0, access, kind))
}

/// The last use in an earlier frame of what is still the same object.
fn past_of_kept(resource: &PlannedResource, kept: &Kept) -> Span {
    let held = kept.0.get(&resource.info.name).filter(|held| held.info == resource.info);
    held.map_or(UNKNOWN, |held| {
        let Held { stages, accesses, layout, .. } = *held;
        Span { first: 0, stages, accesses, layout, discards: false }
    })
}

/// The last spans, as one, of all resources that share bytes with a transient one; and which these are.
fn past_of_memory(resource: usize, resources: &[PlannedResource], spans: &[Vec<Span>]) -> (Span, Vec<usize>) {
    let shares = |other: &usize| match (resources[resource].placement, resources[*other].placement) {
        (Some(own), Some(others)) => own.overlaps(others),
        _ => false,
    };
    let sharing: Vec<usize> = (0..resources.len()).filter(shares).collect();
    let mut past = Span { stages: PipelineStageFlags2::NONE, accesses: AccessFlags2::NONE, ..UNKNOWN };
    for last in sharing.iter().filter_map(|&other| spans[other].last()) {
        past.stages |= last.stages;
        past.accesses |= last.accesses;
    }
    (past, sharing)
}

fn barrier(resource: usize, past: &Span, next: &Span, takes_over: Vec<usize>) -> Barrier {
    let is_transition = past.layout != next.layout;
    Barrier {
        resource,
        src_stage: past.stages,
        src_access: past.accesses & WRITES,
        dst_stage: next.stages,
        dst_access: next.accesses,
        old_layout: if next.discards && is_transition { ImageLayout::UNDEFINED } else { past.layout },
        new_layout: next.layout,
        takes_over,
    }
}
