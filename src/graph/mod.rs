//! The frame graph: passes say what they read and write, and everything else follows from that.
//!
//! ```text
//! declare -> validate -> cull -> order -> lifetimes -> alias -> barriers -> plan -> execute
//! ```
//!
//! Each stage is one file of that name and, up to the plan, a pure function of the graph: the same graph gives the same
//! plan, without a GPU. A plan prints itself ([`Plan`] is `Display`), which is also how it is tested.
//!
//! A handle names one *version* of a resource. A pass that writes or modifies a version makes the next one, and only one
//! pass may, so the order of writes is explicit. Whoever holds an older handle reads the older contents: that pass
//! runs before the next write.
mod access;
mod alias;
mod barriers;
mod cull;
mod declare;
mod execute;
mod lifetimes;
mod order;
mod plan;
mod text;
mod validate;

pub use access::{Access, AccessInfo, Mode, is_depth};
pub use alias::{Block, MemoryRequirement, Placement};
pub use barriers::Barrier;
pub use declare::{Buffer, BufferDesc, Graph, Handle, Image, ImageDesc, Kind, PassBuilder, Versioned};
pub use execute::{Executable, Resources, Work};
pub use lifetimes::Lifetime;
pub use plan::{Plan, PlannedPass, PlannedResource, PlannedUse, ResourceInfo};
pub use validate::GraphError;

impl<W> Graph<W> {
    /// Turns the declarations into a plan. `memory` says what a transient resource needs (Vulkan knows); it is called once
    /// for each that the plan uses, in order of declaration.
    ///
    /// # Errors
    /// The first thing that is wrong with the graph.
    pub fn compile(self, memory: &mut dyn FnMut(&ResourceInfo) -> MemoryRequirement) -> Result<Plan<W>, GraphError> {
        validate::validate(&self)?;
        let culled = cull::cull(&self);
        let order = order::order(&self, &culled.live)?;
        let mut resources = lifetimes::lifetimes(&self, &order);
        let blocks = alias::alias(&mut resources, memory);
        let barriers = barriers::barriers(&self, &order, &resources);
        Ok(plan::plan(self, &order, resources, blocks, barriers, culled.reasons))
    }
}
