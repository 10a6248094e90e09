//! Random frames against an independent model of Vulkan's memory: no hazard over frames in a row, no barrier in vain.
//!
//! The model knows nothing of how plans are made. It replays a plan access by access and keeps, for every access ever made
//! to some bytes, which stages are ordered after it and who sees what it wrote, by the rules of synchronization2. It
//! is stricter than Vulkan in that a barrier helps only the memory of its own resource.
mod frame;
mod machine;

use ash::vk;
use frame::Frame;
use machine::{Machine, WRITES, bits};
use threadlight::low_level::graph::*;
use threadlight::low_level::vulkan::is_depth;

fn memory(info: &ResourceInfo) -> MemoryRequirement {
    let (size_bytes, alignment) = match info.kind {
        // As on devices where what is larger need not be aligned to more.
        ResourceKind::Buffer(desc) => (desc.size_bytes, 64 << (desc.size_bytes % 3)),
        ResourceKind::Image(desc) => (u64::from(desc.width * desc.height * 4), 1024 << (desc.width % 3)),
    };
    // Depth images live in other memory than colour images, as on some devices.
    let is_depth = matches!(info.kind, ResourceKind::Image(desc) if is_depth(desc.format));
    MemoryRequirement { size_bytes, alignment, memory_type_bits: if is_depth { 0b110 } else { 0b011 } }
}

/// Valid plans of random frames, with the frame each is for.
fn plans(seeds: std::ops::Range<u64>) -> Vec<(Frame, Plan<usize>)> {
    let frames = seeds.map(Frame::random);
    let planned = frames.filter_map(|frame| match frame.graph().compile(&mut memory) {
        Ok(plan) => {
            assert!(!frame.has_cycle());
            Some((frame, plan))
        }
        Err(GraphError::Cycle { .. }) if frame.has_cycle() => None,
        Err(error) => panic!("{error}"),
    });
    planned.collect()
}

#[test]
fn the_passes_that_run_are_those_that_outputs_need() {
    for (frame, plan) in plans(0..400) {
        let mut runs: Vec<usize> = plan.passes.iter().map(|pass| pass.work).collect();
        runs.sort_unstable();
        let needed = frame.needed();
        assert_eq!(runs, (0..needed.len()).filter(|&pass| needed[pass]).collect::<Vec<_>>());
        assert_eq!(plan.culled.len() + plan.passes.len(), frame.passes.len());
    }
}

#[test]
fn every_pass_runs_after_what_it_depends_on_and_ties_keep_the_declared_order() {
    for (frame, plan) in plans(0..400) {
        let order: Vec<usize> = plan.passes.iter().map(|pass| pass.work).collect();
        for (position, &later) in order.iter().enumerate() {
            assert!(order[..position].iter().all(|&earlier| !frame.precedes(later, earlier)), "{plan}");
            let still_free = order[position..]
                .iter()
                .filter(|&&pass| order[position..].iter().all(|&other| !frame.precedes(other, pass)));
            assert_eq!(still_free.min(), Some(&later), "{plan}");
        }
    }
}

#[test]
fn resources_alive_together_never_share_bytes() {
    let mut shared = 0;
    for (_, plan) in plans(0..600) {
        for (index, a) in plan.resources.iter().enumerate() {
            let Some(at) = a.placement else { continue };
            let (needs, block) = (memory(&a.info), plan.blocks[at.block]);
            assert!(at.offset_bytes % needs.alignment == 0 && block.alignment % needs.alignment == 0);
            assert!(at.offset_bytes + needs.size_bytes <= block.size_bytes);
            assert!(block.memory_type_bits != 0 && block.memory_type_bits & !needs.memory_type_bits == 0);
            for b in &plan.resources[index + 1..] {
                let Some(other) = b.placement.filter(|other| other.block == at.block) else { continue };
                assert_eq!(a.info.is_image(), b.info.is_image());
                let apart = at.offset_bytes + at.size_bytes <= other.offset_bytes
                    || other.offset_bytes + other.size_bytes <= at.offset_bytes;
                let alternate = a.lifetime.last < b.lifetime.first || b.lifetime.last < a.lifetime.first;
                assert!(apart || alternate, "{plan}");
                shared += usize::from(!apart);
            }
        }
        assert!(plan.aliased_bytes() <= plan.unaliased_bytes());
    }
    assert!(shared > 100, "the frames must be such that memory is shared, was {shared} times");
}

#[test]
fn frames_in_a_row_have_no_hazard() {
    let plans = plans(0..600);
    assert!(plans.len() > 400, "only {} frames without a cycle", plans.len());
    for (frame, plan) in &plans {
        Machine::run(frame, plan, 3).unwrap_or_else(|hazard| panic!("{hazard}\n{plan}"));
    }
}

#[test]
fn no_barrier_can_be_left_out_or_weakened() {
    let mut tried = 0;
    for (frame, mut plan) in plans(1000..1300) {
        for list in 0..=plan.passes.len() {
            let count = barriers(&mut plan, list).len();
            for index in 0..count {
                let whole = barriers(&mut plan, list).remove(index);
                let describe = format!("{whole:?}");
                let mut needed = |plan: &Plan<usize>, what: &str| {
                    tried += 1;
                    assert!(Machine::run(&frame, plan, 3).is_err(), "{what} of {describe} is in vain\n{plan}");
                };
                needed(&plan, "all");
                for weaker in weakened(&whole) {
                    barriers(&mut plan, list).insert(index, weaker);
                    needed(&plan, "a part");
                    barriers(&mut plan, list).remove(index);
                }
                barriers(&mut plan, list).insert(index, whole);
            }
        }
    }
    assert!(tried > 1000, "only {tried}");
}

fn barriers(plan: &mut Plan<usize>, list: usize) -> &mut Vec<Barrier> {
    if list < plan.passes.len() { &mut plan.passes[list].barriers } else { &mut plan.final_barriers }
}

/// The barrier without one of its stages or accesses, as far as each of them counts.
fn weakened(barrier: &Barrier) -> Vec<Barrier> {
    let without = |mask: vk::PipelineStageFlags2, bit: u64| vk::PipelineStageFlags2::from_raw(mask.as_raw() & !bit);
    let is_memory = !barrier.src_access.is_empty() || barrier.old_layout != barrier.new_layout;
    let is_execution = !is_memory && barrier.dst_access.intersects(WRITES);
    if !is_memory && !is_execution {
        return Vec::new(); // More stages read what some could read already: these alone may be left out.
    }
    let mut weaker = Vec::new();
    // All that shares memory is waited for, and all there is where the past is unknown, even where less would do.
    if barrier.takes_over.is_empty() && barrier.src_access != vk::AccessFlags2::MEMORY_WRITE {
        let stages = bits(barrier.src_stage.as_raw());
        weaker.extend(stages.map(|bit| Barrier { src_stage: without(barrier.src_stage, bit), ..barrier.clone() }));
        let flushes = !barrier.src_access.is_empty();
        weaker.extend(flushes.then(|| Barrier { src_access: vk::AccessFlags2::NONE, ..barrier.clone() }));
    }
    let stages = bits(barrier.dst_stage.as_raw());
    weaker.extend(stages.map(|bit| Barrier { dst_stage: without(barrier.dst_stage, bit), ..barrier.clone() }));
    // Before a write that follows reads, the read part of a modify may have been visible already.
    let accesses = bits(barrier.dst_access.as_raw()).filter(|_| is_memory);
    let without = |bit: u64| vk::AccessFlags2::from_raw(barrier.dst_access.as_raw() & !bit);
    weaker.extend(accesses.map(|bit| Barrier { dst_access: without(bit), ..barrier.clone() }));
    weaker
}
