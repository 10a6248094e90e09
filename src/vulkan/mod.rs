//! The Vulkan layer: everything that touches a raw handle, and the only place where `unsafe` is allowed.
//!
//! Nothing here knows of BRDFs, threads or environments. Lifetimes are handled once: every object holds its
//! [`Device`], and dropping one hands its handles to the device's deletion queue, which destroys them when
//! the GPU has finished the last submission made before the drop. So no caller ever has to wait before dropping.
//!
//! A file leans only on those above it, or to its left:
//!
//! ```text
//! error, instance, surface     what was refused; loader, validation messages; windows
//! physical_device, deletion    what there is to choose from; what waits for being destroyed
//! device, identity             the chosen one: its queue and its submissions; which object is which
//! memory, image                buffers; images and samplers
//! glslc, hot_reload            (feature hot-reload) the compiler of shaders; those that were edited
//! shader                       SPIR-V and what it declares (reflection)
//! pipeline_cache, pipeline     compiled ones on disk; layouts from reflection
//! shader_statistics            what compilers say of shaders, on devices that only compile
//! commands, copies, frames     one recorded pass after another; frames in flight, timestamps
//! upload, triangles, render    contents of buffers and images; meshes; drawing them
//! swapchain, ui                images of a window; what egui has laid out
//! test_device, faults          (tests) the device that tests run on; calls that fail on purpose
//! ```

mod commands;
mod copies;
mod deletion;
mod device;
mod error;
#[cfg(test)]
pub(crate) mod faults;
mod frames;
#[cfg(feature = "hot-reload")]
mod glslc;
#[cfg(feature = "hot-reload")]
pub mod hot_reload;
mod identity;
mod image;
mod instance;
mod memory;
mod physical_device;
mod pipeline;
mod pipeline_cache;
mod render;
mod shader;
mod shader_statistics;
#[cfg(feature = "viewer")]
mod surface;
#[cfg(feature = "viewer")]
mod swapchain;
#[cfg(test)]
pub(crate) mod test_device;
mod triangles;
#[cfg(feature = "viewer")]
mod ui;
mod upload;

pub use commands::{Bound, Commands};
pub use device::{Device, Semaphores};
pub use error::VulkanError;
pub use frames::{Frames, PassTime};
pub use image::{Image, ImageKind, ImageShape, Sampler, SamplerKind, is_depth};
pub use instance::{Instance, Messages};
pub use memory::{Buffer, BufferUse, Memory};
pub use physical_device::{DeviceDescription, DeviceKind, describe_devices};
pub use pipeline::{ComputePipeline, GraphicsPipeline};
pub use pipeline_cache::PipelineCache;
pub use shader::{Shader, ShaderStage, compiled};
pub use shader_statistics::{CompiledShader, CompilingDevice};
#[cfg(feature = "viewer")]
pub use surface::{Surface, Window};
#[cfg(feature = "viewer")]
pub use swapchain::{AcquiredImage, PresentMode, Presented, Swapchain};
pub use triangles::{Triangles, VertexAttribute};
#[cfg(feature = "viewer")]
pub use ui::{UiFrame, UiPainter};

pub(crate) use commands::Groups;
pub(crate) use pipeline::GraphicsState;
pub(crate) use render::{ColorTarget, DepthTarget};
pub(crate) use shader::{Binding, BindingAccess};
