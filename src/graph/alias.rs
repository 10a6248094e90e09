//! Alias: transient resources that are never alive together share memory.
use super::plan::{Block, MemoryRequirement, Placement, PlannedResource};
use super::resource::ResourceInfo;
use std::cmp::Reverse;

/// Places the largest resource first, each at the lowest offset that is free during its lifetime, in the block that
/// grows least by it; in a block of its own where that costs less. So the blocks are never larger than the resources
/// together.
pub(super) fn alias(
    resources: &mut [PlannedResource],
    memory: &mut dyn FnMut(&ResourceInfo) -> MemoryRequirement,
) -> Vec<Block> {
    let transient = resources.iter().enumerate().filter(|(_, resource)| !resource.imported && !resource.kept);
    let mut largest_first: Vec<_> = transient.map(|(index, resource)| (index, memory(&resource.info))).collect();
    largest_first.sort_by_key(|(_, requirement)| Reverse(requirement.size_bytes));

    let mut blocks: Vec<Block> = Vec::new();
    for (index, MemoryRequirement { size_bytes, alignment, memory_type_bits }) in largest_first {
        let new = &resources[index];
        let candidates = blocks.iter().enumerate().filter_map(|(block, found)| {
            let placed = || resources.iter().filter_map(|other| Some((other, other.placement?)));
            let in_block = || placed().filter(|(_, at)| at.block == block);
            let same_kind = in_block().all(|(other, _)| other.info.is_image() == new.info.is_image());
            let shares_type = found.memory_type_bits & memory_type_bits != 0;
            let alive = in_block().filter(|(other, _)| other.lifetime.overlaps(new.lifetime));
            let taken: Vec<Placement> = alive.map(|(_, at)| at).collect();
            let at = Placement { block, offset_bytes: lowest_free(&taken, size_bytes, alignment), size_bytes };
            let growth = at.end_bytes().saturating_sub(found.size_bytes);
            (same_kind && shares_type && growth <= size_bytes).then_some((growth, at))
        });
        let cheapest = candidates.min_by_key(|(growth, _)| *growth).map(|(_, at)| at);
        let at = cheapest.unwrap_or(Placement { block: blocks.len(), offset_bytes: 0, size_bytes });
        if at.block == blocks.len() {
            blocks.push(Block { size_bytes, alignment, memory_type_bits });
        }
        let block = &mut blocks[at.block];
        block.size_bytes = block.size_bytes.max(at.end_bytes());
        block.alignment = block.alignment.max(alignment);
        block.memory_type_bits &= memory_type_bits;
        resources[index].placement = Some(at);
    }
    blocks
}

/// The lowest multiple of `alignment` from which `size_bytes` bytes are not `taken`: 0 or just after something.
fn lowest_free(taken: &[Placement], size_bytes: u64, alignment: u64) -> u64 {
    let just_after = taken.iter().map(|other| other.end_bytes().next_multiple_of(alignment.max(1)));
    let mut starts: Vec<u64> = just_after.chain([0]).collect();
    starts.sort_unstable();
    let is_free =
        |start: u64| taken.iter().all(|other| start + size_bytes <= other.offset_bytes || other.end_bytes() <= start);
    // The highest start is behind everything, hence always free.
    starts.into_iter().find(|&start| is_free(start)).unwrap_or(0)
}
