//! The frame graph: passes say what they read and write, and everything else follows from that.
//!
//! ```text
//! declare -> validate -> cull -> order -> lifetimes -> alias -> barriers -> plan -> execute
//! ```
//!
//! Results that outlive the frame (`keep`) let passes go that would only make the same again.
//!
//! Each stage is one file of that name and, up to the plan, a pure function of the graph: the same graph gives the same
//! plan, without a GPU. `compile` puts them in a row. They share `resource`, `kept` and `plan`, which are data only. A plan
//! prints itself ([`Plan`] is `Display`), which is also how it is tested.
//!
//! Passes on a device are declared by `compute`, `raster` and `copies`, so that what a shader says is not said again.
//!
//! A handle names one *version* of a resource. A pass that writes or modifies a version makes the next one, and only one
//! pass may, so the order of writes is explicit. Whoever holds an older handle reads the older contents: that pass
//! runs before the next write.
mod access;
mod alias;
mod barriers;
mod compile;
mod compute;
mod copies;
mod cull;
mod declare;
mod error;
mod execute;
mod keep;
mod kept;
mod lifetimes;
mod order;
mod plan;
mod raster;
mod resource;
mod store;
#[cfg(test)]
mod tests;
mod text;
mod validate;
mod work;

pub use access::{Access, AccessInfo, Mode};
pub use compute::ComputePass;
pub use declare::{Graph, PassBuilder};
pub use error::GraphError;
pub use kept::Kept;
pub use plan::{
    Barrier, Block, Lifetime, MemoryRequirement, Placement, Plan, PlannedPass, PlannedResource, PlannedUse,
};
pub use raster::RasterPass;
pub use resource::{BufferDesc, BufferHandle, Handle, ImageDesc, ImageHandle, ResourceInfo, ResourceKind, Versioned};
pub use work::{DeviceResource, FrameGraph, Resources, Work};

pub(crate) use execute::Executable;
#[cfg(feature = "viewer")]
pub(crate) use store::Store;
