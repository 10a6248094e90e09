//! Execute: the plan's resources as Vulkan objects, its passes and barriers as commands.
use super::error::GraphError;
use super::plan::{Barrier, Block, MemoryRequirement, Plan, PlannedPass};
use super::resource::{Handle, ResourceInfo, ResourceKind};
use super::store::{Made, Store, bind, make};
use super::work::{DeviceResource, FrameGraph, Resources, Work};
use crate::Result;
use crate::progress::Observer;
use crate::vulkan::{Commands, Device, Frames, Memory, PassTime, Semaphores};
use ash::vk;
use std::collections::HashMap;
use std::sync::Arc;
use std::time::Instant;

/// A compiled frame with its resources: executed as often as wanted.
pub struct Executable<'a> {
    /// What it does.
    pub plan: Plan<Work<'a>>,
    objects: Vec<DeviceResource>,
    /// Names of all resources of the graph.
    names: Vec<String>,
}

impl<'a> Executable<'a> {
    /// Compiles `graph` and makes its transient resources; `imports` are the objects behind its imported ones.
    ///
    /// # Errors
    /// A wrong graph, no device memory left.
    pub(crate) fn new(
        device: &Arc<Device>,
        graph: FrameGraph<'a>,
        imports: &[(Handle, DeviceResource)],
    ) -> Result<Self> {
        Self::compile(device, graph, imports, None)
    }

    /// The same for a frame that is executed once, after those whose results are in `store`.
    ///
    /// # Errors
    /// A wrong graph, no device memory left.
    #[cfg(feature = "viewer")]
    pub(crate) fn keeping(
        device: &Arc<Device>,
        graph: FrameGraph<'a>,
        imports: &[(Handle, DeviceResource)],
        store: &mut Store,
    ) -> Result<Self> {
        Self::compile(device, graph, imports, Some(store))
    }

    fn compile(
        device: &Arc<Device>,
        graph: FrameGraph<'a>,
        imports: &[(Handle, DeviceResource)],
        mut store: Option<&mut Store>,
    ) -> Result<Self> {
        let names = graph.resources.iter().map(|resource| resource.name.clone()).collect();
        let (plan, mut made) = plan(device, graph, store.as_deref())?;
        let memory = memory_of(device, &plan)?;
        let mut objects = Vec::new();
        for (index, resource) in plan.resources.iter().enumerate() {
            let object = match (made.remove(&resource.info.name), resource.placement, &mut store) {
                (Some(object), Some(at), _) => bind(object, &memory[at.block], at.offset_bytes)?,
                (_, _, Some(store)) if resource.kept => store.object(device, &resource.info)?,
                _ => {
                    let import = imports.iter().find(|(handle, _)| plan.find(*handle) == Some(index));
                    let missing = || GraphError::NotImported { resource: resource.info.name.clone() };
                    import.ok_or_else(missing)?.1.clone()
                }
            };
            objects.push(object);
        }
        if let Some(store) = store {
            store.kept = plan.kept.clone();
        }
        Ok(Self { plan, objects, names })
    }

    /// Records and submits one frame.
    ///
    /// # Errors
    /// Whatever Vulkan refuses.
    pub fn execute(&self, frames: &mut Frames) -> Result<()> {
        self.execute_between(frames, Semaphores::default())
    }

    /// The same between two semaphores.
    ///
    /// # Errors
    /// Whatever Vulkan refuses.
    pub fn execute_between(&self, frames: &mut Frames, semaphores: Semaphores) -> Result<()> {
        frames.record_between(semaphores, |commands| {
            for pass in &self.plan.passes {
                self.record_pass(commands, pass)?;
            }
            self.record_barriers(commands, &self.plan.final_barriers);
            Ok(())
        })
    }

    /// Whether a pass is in portions, which are not to be submitted together.
    pub fn is_in_portions(&self) -> bool {
        self.plan.passes.iter().any(|pass| pass.portion_of.is_some())
    }

    /// Runs one frame until the GPU is done with it; gives the time of each pass, by timestamps where those of `device` tell
    /// passes apart. One in portions can be stopped between them by `observer`.
    ///
    /// # Errors
    /// Whatever Vulkan refuses; cancelled.
    pub fn execute_timed(
        &self,
        device: &Device,
        frames: &mut Frames,
        observer: &dyn Observer,
    ) -> Result<Vec<PassTime>> {
        if device.times_passes() && !self.is_in_portions() {
            self.execute(frames)?;
            Ok(frames.pass_times()?)
        } else {
            self.execute_pass_by_pass(device, frames, Semaphores::default(), observer)
        }
    }

    /// Submits one frame pass by pass between two semaphores, waiting for each; portions of one are timed together, from outside where timestamps
    /// do not tell.
    ///
    /// # Errors
    /// Whatever Vulkan refuses; cancelled.
    pub fn execute_pass_by_pass(
        &self,
        device: &Device,
        frames: &mut Frames,
        semaphores: Semaphores,
        observer: &dyn Observer,
    ) -> Result<Vec<PassTime>> {
        let mut times: Vec<PassTime> = Vec::new();
        for (index, pass) in self.plan.passes.iter().enumerate() {
            observer.check()?;
            let start = Instant::now();
            let semaphores = if index == 0 { semaphores.first() } else { Semaphores::default() };
            frames.record_between(semaphores, |commands| self.record_pass(commands, pass))?;
            frames.wait()?;
            let gpu_ms = match device.times_passes() {
                true => frames.pass_times()?.iter().map(|time| time.gpu_ms).sum(),
                false => start.elapsed().as_secs_f64() * 1e3,
            };
            match times.iter_mut().find(|time| Some(&time.name) == pass.portion_of.as_ref()) {
                Some(whole) => whole.gpu_ms += gpu_ms,
                None => times.push(PassTime { name: pass.name.clone(), gpu_ms }),
            }
        }
        frames.record_between(semaphores.last(), |commands| -> Result<()> {
            self.record_barriers(commands, &self.plan.final_barriers);
            Ok(())
        })?;
        frames.wait()?;
        Ok(times)
    }

    fn record_pass(&self, commands: &mut Commands, pass: &PlannedPass<Work<'a>>) -> Result<()> {
        self.record_barriers(commands, &pass.barriers);
        let resources = Resources { pass, objects: &self.objects, names: &self.names };
        commands.timed_pass(&pass.name, |commands| (pass.work)(commands, &resources))
    }

    fn record_barriers(&self, commands: &mut Commands, barriers: &[Barrier]) {
        // Where memory changes hands, what was written through its last owner lies outside of the scope of a barrier on
        // its next one, so a global barrier comes first, and the next owner's own barrier waits for that.
        let takeovers: Vec<_> = barriers.iter().filter(|barrier| barrier.is_aliasing()).map(memory_barrier).collect();
        commands.barriers(&[], &[], &takeovers);
        let mut images = Vec::new();
        let mut buffers = Vec::new();
        for barrier in barriers {
            let (src_stage, src_access) = match barrier.is_aliasing() {
                true => (barrier.dst_stage, vk::AccessFlags2::NONE),
                false => (barrier.src_stage, barrier.src_access),
            };
            match &self.objects[barrier.resource] {
                DeviceResource::Image(image) => images.push(
                    Commands::image_barrier(image)
                        .src_stage_mask(src_stage)
                        .src_access_mask(src_access)
                        .dst_stage_mask(barrier.dst_stage)
                        .dst_access_mask(barrier.dst_access)
                        .old_layout(barrier.old_layout)
                        .new_layout(barrier.new_layout),
                ),
                // A buffer has no layout: the global barrier was all it needed.
                DeviceResource::Buffer(_) if barrier.is_aliasing() => {}
                DeviceResource::Buffer(buffer) => buffers.push(
                    Commands::buffer_barrier(buffer)
                        .src_stage_mask(src_stage)
                        .src_access_mask(src_access)
                        .dst_stage_mask(barrier.dst_stage)
                        .dst_access_mask(barrier.dst_access),
                ),
            }
        }
        commands.barriers(&images, &buffers, &[]);
    }
}

fn memory_barrier(barrier: &Barrier) -> vk::MemoryBarrier2<'static> {
    vk::MemoryBarrier2::default()
        .src_stage_mask(barrier.src_stage)
        .src_access_mask(barrier.src_access)
        .dst_stage_mask(barrier.dst_stage)
        .dst_access_mask(barrier.dst_access)
}

/// The plan of `graph`, and its transient resources, without memory, by name.
fn plan<'a>(
    device: &Arc<Device>,
    graph: FrameGraph<'a>,
    store: Option<&Store>,
) -> Result<(Plan<Work<'a>>, HashMap<String, Made>)> {
    // Vulkan tells what memory an object needs only once the object exists.
    let mut made = HashMap::new();
    let mut failure = None;
    let mut memory = |info: &ResourceInfo| match make(device, info) {
        Ok((object, requirement)) => {
            made.insert(info.name.clone(), object);
            requirement
        }
        Err(error) => {
            failure.get_or_insert(error);
            MemoryRequirement { size_bytes: 1, alignment: 1, memory_type_bits: !0 }
        }
    };
    let plan = match store {
        Some(store) => graph.compile_keeping(&store.kept, &mut memory)?,
        None => graph.compile(&mut memory)?,
    };
    failure.map_or(Ok((plan, made)), Err)
}

/// The memory of each block of the plan.
fn memory_of(device: &Arc<Device>, plan: &Plan<Work<'_>>) -> Result<Vec<Arc<Memory>>> {
    let memory = plan.blocks.iter().enumerate().map(|(index, block)| {
        let for_buffers = plan.resources.iter().any(|resource| {
            resource.placement.is_some_and(|at| at.block == index)
                && matches!(resource.info.kind, ResourceKind::Buffer(_))
        });
        let &Block { size_bytes, alignment, memory_type_bits } = block;
        let needs = MemoryRequirement { size_bytes, alignment, memory_type_bits };
        Ok(Memory::new(device, &format!("transient memory {index}"), needs.into(), for_buffers)?)
    });
    memory.collect()
}
