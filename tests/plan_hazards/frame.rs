//! Random frames, valid by construction.
use ash::vk;
use threadlight::low_level::graph::*;
use threadlight::low_level::vulkan::is_depth;

/// A small linear congruential generator (Knuth's MMIX constants): the same frames on every machine.
pub struct Random(u64);

impl Random {
    pub fn below(&mut self, bound: usize) -> usize {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((self.0 >> 33) as usize) % bound
    }

    pub fn chance(&mut self, percent: usize) -> bool {
        self.below(100) < percent
    }

    pub fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[self.below(from.len())]
    }
}

/// A frame as the test knows it.
#[derive(Default)]
pub struct Frame {
    pub resources: Vec<Resource>,
    pub passes: Vec<(String, Vec<Use>)>,
    pub outputs: Vec<usize>,
}

pub struct Resource {
    pub name: String,
    pub kind: ResourceKind,
    pub import: Option<(Option<Access>, Option<Access>)>,
    pub versions: u32,
}

#[derive(Clone, Copy)]
pub struct Use {
    pub resource: usize,
    pub version: u32,
    pub mode: Mode,
    pub access: Access,
}

pub const COLOR_WRITES: [Access; 3] = [Access::ColorAttachment, Access::StorageWriteCompute, Access::TransferWrite];
pub const COLOR_READS: [Access; 3] = [Access::SampledCompute, Access::StorageReadCompute, Access::TransferRead];
pub const DEPTH_WRITES: [Access; 2] = [Access::DepthAttachment, Access::TransferWrite];
pub const DEPTH_READS: [Access; 2] = [Access::SampledCompute, Access::TransferRead];
pub const BUFFER_WRITES: [Access; 2] = [Access::StorageWriteCompute, Access::TransferWrite];
pub const BUFFER_READS: [Access; 4] =
    [Access::UniformCompute, Access::StorageReadCompute, Access::Indirect, Access::TransferRead];

pub fn writes_of(kind: &ResourceKind) -> &'static [Access] {
    match kind {
        ResourceKind::Buffer(_) => &BUFFER_WRITES,
        ResourceKind::Image(desc) if is_depth(desc.format) => &DEPTH_WRITES,
        ResourceKind::Image(_) => &COLOR_WRITES,
    }
}

pub fn reads_of(kind: &ResourceKind) -> &'static [Access] {
    match kind {
        ResourceKind::Buffer(_) => &BUFFER_READS,
        ResourceKind::Image(desc) if is_depth(desc.format) => &DEPTH_READS,
        ResourceKind::Image(_) => &COLOR_READS,
    }
}

impl Frame {
    pub fn random(seed: u64) -> Self {
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
                let outside = Some(if is_buffer { Access::HostRead } else { Access::Present });
                let [before, after] = [(); 2].map(|()| accesses(&mut random, outside));
                (before, if random.chance(40) { before } else { after })
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
    pub fn random_use(&self, random: &mut Random, resource: usize, uses: &mut Vec<Use>) {
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

    pub fn finish_pass(&mut self, name: String, mut uses: Vec<Use>, random: &mut Random) {
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

    pub fn graph(&self) -> Graph<usize> {
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
    pub fn needed(&self) -> Vec<bool> {
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
    pub fn precedes(&self, a: usize, b: usize) -> bool {
        let pairs = self.passes[a].1.iter().flat_map(|x| self.passes[b].1.iter().map(move |y| (x, y)));
        pairs.filter(|(x, y)| x.resource == y.resource).any(|(x, y)| match (x.mode, y.mode) {
            (Mode::Read, Mode::Read) => false,
            (Mode::Read, _) => x.version <= y.version,
            _ => x.version < y.version,
        })
    }

    pub fn has_cycle(&self) -> bool {
        let needed = self.needed();
        let mut left: Vec<usize> = (0..self.passes.len()).filter(|&pass| needed[pass]).collect();
        while let Some(free) = left.iter().position(|&pass| !left.iter().any(|&other| self.precedes(other, pass))) {
            left.remove(free);
        }
        !left.is_empty()
    }
}
