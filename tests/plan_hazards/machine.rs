//! An independent model of Vulkan's memory, by the rules of synchronization2.
use super::frame::Frame;
use ash::vk;
use std::collections::HashMap;
use threadlight::low_level::graph::*;

/// Something that touched memory: an access in one stage, or a change of layout (no stage).
pub struct Event {
    pub resource: usize,
    pub what: String,
    pub stage: u64,
    /// Write accesses; 0 for a read.
    pub writes: u64,
    pub available: bool,
    /// Stages of later commands that come after it.
    pub ordered: u64,
    /// Pairs of stages and accesses that see what it wrote.
    pub visible: Vec<(u64, u64)>,
}

/// The memory of a plan while frames run over it.
pub struct Machine<'a> {
    pub frame: &'a Frame,
    pub plan: &'a Plan<usize>,
    /// By resource of the plan: its index in `frame`.
    pub declared: Vec<usize>,
    pub events: Vec<Event>,
    pub layouts: Vec<vk::ImageLayout>,
    pub contents: Vec<Option<u32>>,
}

pub const TRANSITION: u64 = 1 << 63;

pub const WRITES: vk::AccessFlags2 = vk::AccessFlags2::from_raw(
    vk::AccessFlags2::COLOR_ATTACHMENT_WRITE.as_raw()
        | vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_WRITE.as_raw()
        | vk::AccessFlags2::SHADER_STORAGE_WRITE.as_raw()
        | vk::AccessFlags2::TRANSFER_WRITE.as_raw(),
);

/// The accesses that write: the table counts the depth test among them, which reads.
pub fn writes(access: Access) -> u64 {
    (access.info().writes & WRITES).as_raw()
}

/// `ALL_COMMANDS` stands for every stage, `MEMORY_WRITE` for every write.
pub fn all_if(mask: u64, all: u64) -> u64 {
    if mask & all != 0 { u64::MAX } else { mask }
}

pub fn bits(mask: u64) -> impl Iterator<Item = u64> {
    (0..64).map(|bit| 1 << bit).filter(move |bit| mask & bit != 0)
}

impl<'a> Machine<'a> {
    /// Runs the plan for `frames` frames; the first hazard, in words.
    pub fn run(frame: &'a Frame, plan: &'a Plan<usize>, frames: usize) -> Result<(), String> {
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

    pub fn import(&self, resource: usize) -> Option<(Option<Access>, Option<Access>)> {
        self.frame.resources[self.declared[resource]].import
    }

    /// The owners bring imported resources into the state they promise, unless the frame before left them so.
    pub fn begin(&mut self, number: usize) {
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

    pub fn push(
        &mut self,
        resource: usize,
        what: &str,
        stage: u64,
        writes: u64,
        ordered: u64,
        visible: Vec<(u64, u64)>,
    ) {
        let (what, available) = (what.to_owned(), writes == TRANSITION);
        self.events.push(Event { resource, what, stage, writes, available, ordered, visible });
    }

    pub fn shares(&self, a: usize, b: usize) -> bool {
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

    pub fn lose_contents(&mut self, resource: usize) {
        for other in 0..self.contents.len() {
            if self.shares(resource, other) {
                self.contents[other] = None;
            }
        }
    }

    pub fn barrier(&mut self, barrier: &Barrier) -> Result<(), String> {
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

    pub fn access(
        &mut self,
        resource: usize,
        access: Access,
        mode: Mode,
        what: &str,
        since: usize,
    ) -> Result<(), String> {
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

    pub fn pass(&mut self, pass: &PlannedPass<usize>) -> Result<(), String> {
        let since = self.events.len();
        let declared = &self.frame.passes[pass.work].1;
        assert_eq!(declared.len(), pass.uses.len(), "uses of {}", pass.name);
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
    pub fn end(&mut self) -> Result<(), String> {
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
