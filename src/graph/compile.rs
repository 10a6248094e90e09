//! Compile: one stage after another, from the declarations to the plan.
use super::alias::alias;
use super::barriers::barriers;
use super::cull::cull;
use super::declare::{Graph, Pass, Use};
use super::error::GraphError;
use super::keep::{fingerprints, still_good};
use super::kept::Kept;
use super::lifetimes::lifetimes;
use super::order::order;
use super::plan::{Barrier, Block, MemoryRequirement, Plan, PlannedPass, PlannedResource, PlannedUse};
use super::resource::{Handle, ResourceInfo};
use super::validate::validate;
use std::collections::HashSet;

impl<W> Graph<W> {
    /// Turns the declarations into a plan. `memory` says what a transient resource needs (Vulkan knows); it is called once
    /// for each that the plan uses, in order of declaration.
    ///
    /// # Errors
    /// The first thing that is wrong with the graph.
    pub fn compile(self, memory: &mut dyn FnMut(&ResourceInfo) -> MemoryRequirement) -> Result<Plan<W>, GraphError> {
        self.compile_with(None, memory)
    }

    /// The same for a frame after others, which left `kept`: passes whose results are still good do not run.
    /// [`Plan::kept`] is for the frame after this one, if this one runs.
    ///
    /// # Errors
    /// The first thing that is wrong with the graph.
    pub fn compile_keeping(
        self,
        kept: &Kept,
        memory: &mut dyn FnMut(&ResourceInfo) -> MemoryRequirement,
    ) -> Result<Plan<W>, GraphError> {
        self.compile_with(Some(kept), memory)
    }

    fn compile_with(
        self,
        kept: Option<&Kept>,
        memory: &mut dyn FnMut(&ResourceInfo) -> MemoryRequirement,
    ) -> Result<Plan<W>, GraphError> {
        validate(&self)?;
        let known = fingerprints(&self);
        let mut good = still_good(&self, kept, &known);
        let culled = cull(&self, &mut good);
        let order = order(&self, &culled.live)?;
        let mut resources = lifetimes(&self, &order, kept);
        let blocks = alias(&mut resources, memory);
        let (barriers, kept) = barriers(&self, &order, &resources, kept, &known);
        Ok(plan(self, &order, resources, blocks, barriers, culled.reasons, kept))
    }
}

/// Puts together what the stages before have found.
fn plan<W>(
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
        Some(PlannedUse { resource, access: use_.access, mode: use_.mode, kept, handle: use_.handle })
    };
    let mut declared: Vec<Option<Pass<W>>> = graph.passes.into_iter().map(Some).collect();
    let passes = order.iter().zip(barriers).filter_map(|(&pass, barriers)| {
        let Pass { name, portion_of, uses, work, .. } = declared[pass].take()?;
        let uses = uses.iter().filter_map(plan_use).collect();
        Some(PlannedPass { name, portion_of, barriers, uses, work: work? })
    });
    Plan { passes: passes.collect(), final_barriers, resources, blocks, culled, kept }
}
