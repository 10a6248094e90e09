//! Random frames against an independent model of Vulkan's memory: no hazard over frames in a row, no barrier in vain.
//!
//! The model knows nothing of how plans are made. It replays a plan access by access and keeps, for every access ever made
//! to some bytes, which stages are ordered after it and who sees what it wrote, by the rules of synchronization2. It
//! is stricter than Vulkan in that a barrier helps only the memory of its own resource.
use ash::vk;
use std::collections::HashMap;
use threadlight::graph::*;

/// A small linear congruential generator (Knuth's MMIX constants): the same frames on every machine.
struct Random(u64);

impl Random {
    fn below(&mut self, bound: usize) -> usize {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((self.0 >> 33) as usize) % bound
    }

    fn chance(&mut self, percent: usize) -> bool {
        self.below(100) < percent
    }

    fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[self.below(from.len())]
    }
}

/// A frame as the test knows it.
#[derive(Default)]
struct Frame {
    resources: Vec<Resource>,
    passes: Vec<(String, Vec<Use>)>,
    outputs: Vec<usize>,
}

struct Resource {
    name: String,
    kind: ResourceKind,
    import: Option<(Option<Access>, Option<Access>)>,
    versions: u32,
}

#[derive(Clone, Copy)]
struct Use {
    resource: usize,
    version: u32,
    mode: Mode,
    access: Access,
}

const COLOR_WRITES: [Access; 3] = [Access::ColorAttachment, Access::StorageWriteCompute, Access::TransferWrite];
const COLOR_READS: [Access; 5] = [
    Access::SampledFragment,
    Access::SampledCompute,
    Access::StorageReadGraphics,
    Access::StorageReadCompute,
    Access::TransferRead,
];
const DEPTH_WRITES: [Access; 2] = [Access::DepthAttachment, Access::TransferWrite];
const DEPTH_READS: [Access; 3] = [Access::SampledFragment, Access::SampledCompute, Access::TransferRead];
const BUFFER_WRITES: [Access; 2] = [Access::StorageWriteCompute, Access::TransferWrite];
const BUFFER_READS: [Access; 7] = [
    Access::VertexInput,
    Access::UniformGraphics,
    Access::UniformCompute,
    Access::StorageReadGraphics,
    Access::StorageReadCompute,
    Access::Indirect,
    Access::TransferRead,
];

fn writes_of(kind: &ResourceKind) -> &'static [Access] {
    match kind {
        ResourceKind::Buffer(_) => &BUFFER_WRITES,
        ResourceKind::Image(desc) if is_depth(desc.format) => &DEPTH_WRITES,
        ResourceKind::Image(_) => &COLOR_WRITES,
    }
}

fn reads_of(kind: &ResourceKind) -> &'static [Access] {
    match kind {
        ResourceKind::Buffer(_) => &BUFFER_READS,
        ResourceKind::Image(desc) if is_depth(desc.format) => &DEPTH_READS,
        ResourceKind::Image(_) => &COLOR_READS,
    }
}

impl Frame {
    fn random(seed: u64) -> Self {
        let mut random = Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let mut frame = Self::default();
        for index in 0..3 + random.below(7) {
            let kind = match random.below(3) {
                0 => ResourceKind::Buffer(BufferDesc { size_bytes: 1 + random.below(5000) as u64 }),
                which => ResourceKind::Image(ImageDesc {
                    format: [vk::Format::R8G8B8A8_UNORM, vk::Format::D32_SFLOAT][which - 1],
                    width: 1 + random.below(90) as u32,
                    height: 1 + random.below(90) as u32,
                }),
            };
            let accesses = |random: &mut Random, outside: Option<Access>| {
                let all: Vec<_> = writes_of(&kind).iter().chain(reads_of(&kind)).copied().chain(outside).collect();
                random.chance(60).then(|| random.pick(&all))
            };
            let is_buffer = matches!(kind, ResourceKind::Buffer(_));
            let import = random.chance(30).then(|| {
                let before = accesses(&mut random, Some(if is_buffer { Access::HostWrite } else { Access::Present }));
                let after = accesses(&mut random, Some(if is_buffer { Access::HostRead } else { Access::Present }));
                (before, if random.chance(40) { before.filter(|a| *a != Access::HostWrite) } else { after })
            });
            frame.resources.push(Resource { name: format!("r{index}"), kind, import, versions: 0 });
        }
        let kind = ResourceKind::Buffer(BufferDesc { size_bytes: 64 });
        let import = Some((Some(Access::HostRead), Some(Access::HostRead)));
        frame.resources.push(Resource { name: "result".into(), kind, import, versions: 0 });

        for index in 0..2 + random.below(14) {
            let mut uses = Vec::new();
            for _ in 0..1 + random.below(4) {
                let resource = random.below(frame.resources.len() - 1);
                frame.random_use(&mut random, resource, &mut uses);
            }
            frame.finish_pass(format!("p{index}"), uses, &mut random);
        }
        let mut uses = Vec::new();
        for resource in 0..frame.resources.len() - 1 {
            let has_contents = frame.resources[resource].versions > 0;
            if has_contents && random.chance(30) {
                let access = random.pick(reads_of(&frame.resources[resource].kind));
                let version = frame.resources[resource].versions;
                uses.push(Use { resource, version, mode: Mode::Read, access });
            }
        }
        let result = frame.resources.len() - 1;
        uses.push(Use { resource: result, version: 0, mode: Mode::Write, access: Access::StorageWriteCompute });
        frame.finish_pass("last".into(), uses, &mut random);
        for (index, resource) in frame.resources.iter().enumerate() {
            if resource.import.is_some() && resource.versions > 0 && (index == result || random.chance(60)) {
                frame.outputs.push(index);
            }
        }
        frame
    }

    /// Adds a valid use of `resource`, unless the pass has one already.
    fn random_use(&self, random: &mut Random, resource: usize, uses: &mut Vec<Use>) {
        let Resource { kind, import, versions, .. } = &self.resources[resource];
        if uses.iter().any(|use_| use_.resource == resource) {
            return;
        }
        let oldest = if import.is_some_and(|(before, _)| before.is_some()) { 0 } else { 1 };
        if *versions < oldest || random.chance(40) {
            let mode = if *versions >= oldest && random.chance(60) { Mode::Modify } else { Mode::Write };
            uses.push(Use { resource, version: *versions, mode, access: random.pick(writes_of(kind)) });
            return;
        }
        // Mostly the newest version, sometimes the one before: that reader has to run before a pass declared earlier.
        let version = if *versions > oldest && random.chance(15) { versions - 1 } else { *versions };
        let access = random.pick(reads_of(kind));
        uses.push(Use { resource, version, mode: Mode::Read, access });
        let also = random.pick(reads_of(kind));
        let same_layout = matches!(kind, ResourceKind::Buffer(_)) || also.info().layout == access.info().layout;
        if same_layout && random.chance(30) {
            uses.push(Use { resource, version, mode: Mode::Read, access: also });
        }
    }

    fn finish_pass(&mut self, name: String, mut uses: Vec<Use>, random: &mut Random) {
        if uses.iter().all(|use_| use_.mode == Mode::Read) {
            let unused = (0..self.resources.len() - 1).find(|r| uses.iter().all(|use_| use_.resource != *r));
            let Some(resource) = unused else { return };
            let access = random.pick(writes_of(&self.resources[resource].kind));
            uses.push(Use { resource, version: self.resources[resource].versions, mode: Mode::Write, access });
        }
        for use_ in uses.iter().filter(|use_| use_.mode != Mode::Read) {
            self.resources[use_.resource].versions += 1;
        }
        self.passes.push((name, uses));
    }

    fn graph(&self) -> Graph<usize> {
        let mut graph = Graph::new();
        let mut handles: Vec<Vec<Handle>> = Vec::new();
        for Resource { name, kind, import, .. } in &self.resources {
            handles.push(vec![match (*kind, *import) {
                (ResourceKind::Image(desc), None) => graph.image(name, desc).into(),
                (ResourceKind::Buffer(desc), None) => graph.buffer(name, desc).into(),
                (ResourceKind::Image(desc), Some((before, after))) => {
                    graph.import_image(name, desc, before, after).into()
                }
                (ResourceKind::Buffer(desc), Some((before, after))) => {
                    graph.import_buffer(name, desc, before, after).into()
                }
            }]);
        }
        for (index, (name, uses)) in self.passes.iter().enumerate() {
            let mut pass = graph.pass(name);
            for Use { resource, version, mode, access } in uses {
                let handle = handles[*resource][*version as usize];
                let made: Handle = match mode {
                    Mode::Read => {
                        pass.read(handle, *access);
                        continue;
                    }
                    Mode::Write => pass.write(BufferHandle::from(handle), *access).into(),
                    Mode::Modify => pass.modify(BufferHandle::from(handle), *access).into(),
                };
                handles[*resource].push(made);
            }
            pass.record(index);
        }
        self.outputs.iter().for_each(|&resource| graph.output(*handles[resource].last().expect("version 0")));
        graph
    }

    /// The passes that outputs need, found from the outputs backwards.
    fn needed(&self) -> Vec<bool> {
        let mut needed = vec![false; self.passes.len()];
        let mut wanted: Vec<(usize, u32)> = self.outputs.iter().map(|&r| (r, self.resources[r].versions)).collect();
        while let Some((resource, version)) = wanted.pop() {
            let makes = |u: &Use| u.resource == resource && u.mode != Mode::Read && u.version + 1 == version;
            let Some(pass) = self.passes.iter().position(|(_, uses)| uses.iter().any(makes)) else { continue };
            if !std::mem::replace(&mut needed[pass], true) {
                let uses = self.passes[pass].1.iter().filter(|use_| use_.mode != Mode::Write);
                wanted.extend(uses.map(|use_| (use_.resource, use_.version)));
            }
        }
        needed
    }

    /// Whether pass `a` must run before pass `b`: one of them writes what the other uses, and finds the older version.
    fn precedes(&self, a: usize, b: usize) -> bool {
        let pairs = self.passes[a].1.iter().flat_map(|x| self.passes[b].1.iter().map(move |y| (x, y)));
        pairs.filter(|(x, y)| x.resource == y.resource).any(|(x, y)| match (x.mode, y.mode) {
            (Mode::Read, Mode::Read) => false,
            (Mode::Read, _) => x.version <= y.version,
            _ => x.version < y.version,
        })
    }

    fn has_cycle(&self) -> bool {
        let needed = self.needed();
        let mut left: Vec<usize> = (0..self.passes.len()).filter(|&pass| needed[pass]).collect();
        while let Some(free) = left.iter().position(|&pass| !left.iter().any(|&other| self.precedes(other, pass))) {
            left.remove(free);
        }
        !left.is_empty()
    }
}

fn memory(info: &ResourceInfo) -> MemoryRequirement {
    let (size_bytes, alignment) = match info.kind {
        ResourceKind::Buffer(desc) => (desc.size_bytes, 64),
        ResourceKind::Image(desc) => (u64::from(desc.width * desc.height * 4), 1024),
    };
    // Depth images live in other memory than colour images, as on some devices.
    let is_depth = matches!(info.kind, ResourceKind::Image(desc) if is_depth(desc.format));
    MemoryRequirement { size_bytes, alignment, memory_type_bits: if is_depth { 0b110 } else { 0b011 } }
}

/// Something that touched memory: an access in one stage, or a change of layout (no stage).
struct Event {
    resource: usize,
    what: String,
    stage: u64,
    /// Write accesses; 0 for a read.
    writes: u64,
    available: bool,
    /// Stages of later commands that come after it.
    ordered: u64,
    /// Pairs of stages and accesses that see what it wrote.
    visible: Vec<(u64, u64)>,
}

/// The memory of a plan while frames run over it.
struct Machine<'a> {
    frame: &'a Frame,
    plan: &'a Plan<usize>,
    /// By resource of the plan: its index in `frame`.
    declared: Vec<usize>,
    events: Vec<Event>,
    layouts: Vec<vk::ImageLayout>,
    contents: Vec<Option<u32>>,
}

const TRANSITION: u64 = 1 << 63;

const WRITES: vk::AccessFlags2 = vk::AccessFlags2::from_raw(
    vk::AccessFlags2::COLOR_ATTACHMENT_WRITE.as_raw()
        | vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_WRITE.as_raw()
        | vk::AccessFlags2::SHADER_STORAGE_WRITE.as_raw()
        | vk::AccessFlags2::TRANSFER_WRITE.as_raw()
        | vk::AccessFlags2::HOST_WRITE.as_raw(),
);

/// The accesses that write: the table counts the depth test among them, which reads.
fn writes(access: Access) -> u64 {
    (access.info().writes & WRITES).as_raw()
}

/// `ALL_COMMANDS` stands for every stage, `MEMORY_WRITE` for every write.
fn all_if(mask: u64, all: u64) -> u64 {
    if mask & all != 0 { u64::MAX } else { mask }
}

fn bits(mask: u64) -> impl Iterator<Item = u64> {
    (0..64).map(|bit| 1 << bit).filter(move |bit| mask & bit != 0)
}

impl<'a> Machine<'a> {
    /// Runs the plan for `frames` frames; the first hazard, in words.
    fn run(frame: &'a Frame, plan: &'a Plan<usize>, frames: usize) -> Result<(), String> {
        let names: HashMap<&str, usize> =
            frame.resources.iter().enumerate().map(|(index, resource)| (resource.name.as_str(), index)).collect();
        let declared: Vec<usize> = plan.resources.iter().map(|resource| names[resource.info.name.as_str()]).collect();
        let (layouts, contents) = (vec![vk::ImageLayout::UNDEFINED; declared.len()], vec![None; declared.len()]);
        let mut machine = Self { frame, plan, declared, events: Vec::new(), layouts, contents };
        for number in 0..frames {
            machine.begin(number);
            for pass in &plan.passes {
                pass.barriers.iter().try_for_each(|barrier| machine.barrier(barrier))?;
                machine.pass(pass)?;
            }
            plan.final_barriers.iter().try_for_each(|barrier| machine.barrier(barrier))?;
            machine.end()?;
        }
        Ok(())
    }

    fn import(&self, resource: usize) -> Option<(Option<Access>, Option<Access>)> {
        self.frame.resources[self.declared[resource]].import
    }

    /// The owners bring imported resources into the state they promise, unless the frame before left them so.
    fn begin(&mut self, number: usize) {
        for resource in 0..self.declared.len() {
            let Some((before, after)) = self.import(resource) else { continue };
            self.contents[resource] = before.map(|_| 0);
            let Some(before) = before.filter(|_| number == 0 || before != after) else { continue };
            let info = before.info();
            self.events.retain(|event| event.resource != resource);
            self.layouts[resource] = info.layout;
            let (stages, accesses) = (info.stages.as_raw(), (info.reads | info.writes).as_raw());
            self.push(resource, "owner's contents", 0, TRANSITION, stages, vec![(stages, accesses)]);
            for stage in bits(stages) {
                self.push(resource, "owner before", stage, writes(before), 0, Vec::new());
            }
        }
    }

    fn push(&mut self, resource: usize, what: &str, stage: u64, writes: u64, ordered: u64, visible: Vec<(u64, u64)>) {
        let (what, available) = (what.to_owned(), writes == TRANSITION);
        self.events.push(Event { resource, what, stage, writes, available, ordered, visible });
    }

    fn shares(&self, a: usize, b: usize) -> bool {
        let range = |resource: usize| self.plan.resources[resource].placement;
        match (range(a), range(b)) {
            _ if a == b => true,
            (Some(a), Some(b)) => {
                let apart =
                    a.offset_bytes + a.size_bytes <= b.offset_bytes || b.offset_bytes + b.size_bytes <= a.offset_bytes;
                a.block == b.block && !apart
            }
            _ => false,
        }
    }

    fn lose_contents(&mut self, resource: usize) {
        for other in 0..self.contents.len() {
            if self.shares(resource, other) {
                self.contents[other] = None;
            }
        }
    }

    fn barrier(&mut self, barrier: &Barrier) -> Result<(), String> {
        let src = all_if(barrier.src_stage.as_raw(), vk::PipelineStageFlags2::ALL_COMMANDS.as_raw());
        let dst = all_if(barrier.dst_stage.as_raw(), vk::PipelineStageFlags2::ALL_COMMANDS.as_raw());
        let flushed = all_if(barrier.src_access.as_raw(), vk::AccessFlags2::MEMORY_WRITE.as_raw());
        let is_transition = barrier.old_layout != barrier.new_layout;
        for index in 0..self.events.len() {
            if !self.shares(self.events[index].resource, barrier.resource) {
                continue;
            }
            let event = &mut self.events[index];
            let is_waited_for = src & (event.stage | event.ordered) != 0;
            let in_scope = event.resource == barrier.resource || barrier.takes_over.contains(&event.resource);
            if is_waited_for {
                event.ordered |= dst;
                event.available |= in_scope && src & event.stage != 0 && flushed & event.writes == event.writes;
                if event.available {
                    event.visible.push((dst, barrier.dst_access.as_raw()));
                }
            }
            if is_transition && (!is_waited_for || (event.writes != 0 && !event.available)) {
                return Err(format!("{barrier:?} changes the layout under {}", event.what));
            }
        }
        if is_transition {
            if barrier.old_layout == vk::ImageLayout::UNDEFINED {
                self.lose_contents(barrier.resource);
            } else if barrier.old_layout != self.layouts[barrier.resource] {
                return Err(format!("{barrier:?} finds another layout"));
            }
            self.layouts[barrier.resource] = barrier.new_layout;
            let visible = vec![(dst, barrier.dst_access.as_raw())];
            self.push(barrier.resource, "layout change", 0, TRANSITION, dst, visible);
        }
        Ok(())
    }

    fn access(&mut self, resource: usize, access: Access, mode: Mode, what: &str, since: usize) -> Result<(), String> {
        let info = access.info();
        let name = &self.plan.resources[resource].info.name;
        if self.plan.resources[resource].info.is_image() && self.layouts[resource] != info.layout {
            return Err(format!("{what}: {name} is in layout {:?}", self.layouts[resource]));
        }
        let written = if mode == Mode::Read { 0 } else { writes(access) };
        let accesses = match mode {
            Mode::Read => info.reads,
            Mode::Write => info.writes,
            Mode::Modify => info.reads | info.writes,
        };
        for stage in bits(info.stages.as_raw()) {
            for event in self.events[..since].iter().filter(|event| self.shares(event.resource, resource)) {
                let (earlier, is_ordered) = (&event.what, event.ordered & stage != 0);
                if (written != 0 || event.writes != 0) && !is_ordered {
                    return Err(format!("{what} does not wait for {earlier} ({name}, stage {stage:#x})"));
                }
                if event.writes != 0 && !event.available {
                    return Err(format!("{what}: writes of {earlier} are not available ({name})"));
                }
                let sees =
                    |bit| event.visible.iter().any(|(stages, accesses)| stages & stage != 0 && accesses & bit != 0);
                if event.writes != 0 && !bits(accesses.as_raw()).all(sees) {
                    return Err(format!("{what} does not see {earlier} ({name})"));
                }
            }
            self.push(resource, what, stage, written, 0, Vec::new());
        }
        Ok(())
    }

    fn pass(&mut self, pass: &PlannedPass<usize>) -> Result<(), String> {
        let since = self.events.len();
        let declared = &self.frame.passes[pass.work].1;
        for (use_, planned) in declared.iter().zip(&pass.uses) {
            let resource = planned.resource;
            assert_eq!(self.declared[resource], use_.resource);
            self.access(resource, use_.access, use_.mode, &pass.name, since)?;
            if use_.mode != Mode::Write && self.contents[resource] != Some(use_.version) {
                return Err(format!("{} finds version {:?} of {}", pass.name, self.contents[resource], use_.resource));
            }
        }
        for (use_, planned) in declared.iter().zip(&pass.uses).filter(|(use_, _)| use_.mode != Mode::Read) {
            self.lose_contents(planned.resource);
            self.contents[planned.resource] = planned.kept.then_some(use_.version + 1);
        }
        Ok(())
    }

    /// The owners find imported resources as they asked for, and the outputs in them.
    fn end(&mut self) -> Result<(), String> {
        let since = self.events.len();
        for resource in 0..self.declared.len() {
            let Some((_, after)) = self.import(resource) else { continue };
            if let Some(after) = after {
                self.access(resource, after, Mode::Modify, "owner after", since)?;
                // All that the owner will ever wait for is its own stages.
                let stages = after.info().stages.as_raw();
                let own = self.events[..since].iter().filter(|event| event.resource == resource);
                if let Some(event) = own.into_iter().find(|event| stages & (event.stage | event.ordered) == 0) {
                    return Err(format!("the owner does not wait for {}", event.what));
                }
            }
            let output = self.frame.outputs.iter().find(|output| **output == self.declared[resource]);
            if output.is_some_and(|output| self.contents[resource] != Some(self.frame.resources[*output].versions)) {
                return Err(format!("output {} is lost", self.plan.resources[resource].info.name));
            }
        }
        Ok(())
    }
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
    for (_, plan) in plans(0..400) {
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
