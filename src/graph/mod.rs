//! The frame graph: passes say what they read and write, and everything else follows from that.
//!
//! ```text
//! declare -> validate -> cull -> order -> lifetimes -> alias -> barriers -> plan -> execute
//! ```
//!
//! Results that outlive the frame (`keep`) let passes go that would only make the same again.
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
mod keep;
mod lifetimes;
mod order;
mod plan;
mod text;
mod validate;

pub use access::{Access, AccessInfo, Mode, is_depth};
pub use alias::{Block, MemoryRequirement, Placement};
pub use barriers::Barrier;
pub use declare::{Buffer, BufferDesc, Graph, Handle, Image, ImageDesc, PassBuilder, ResourceKind, Versioned};
pub use execute::{DeviceResource, Executable, Resources, Store, Work};
pub use keep::Kept;
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
        validate::validate(&self)?;
        let fingerprints = keep::fingerprints(&self);
        let mut still_good = keep::still_good(&self, kept, &fingerprints);
        let culled = cull::cull(&self, &mut still_good);
        let order = order::order(&self, &culled.live)?;
        let mut resources = lifetimes::lifetimes(&self, &order, kept);
        let blocks = alias::alias(&mut resources, memory);
        let (barriers, kept) = barriers::barriers(&self, &order, &resources, kept, &fingerprints);
        Ok(plan::plan(self, &order, resources, blocks, barriers, culled.reasons, kept))
    }
}
