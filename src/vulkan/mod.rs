//! The Vulkan layer: everything that touches a raw handle, and the only place where `unsafe` is allowed.
//!
//! Nothing here knows of BRDFs, threads or environments. Lifetimes are handled once: every object holds its
//! [`Device`], and dropping one hands its handles to the device's deletion queue, which destroys them when
//! the GPU has finished the last submission made before the drop. So no caller ever has to wait before dropping.
//!
//! ```text
//! instance  loader, validation messages          shader    SPIR-V and what it declares (reflection)
//! device    choice, queue, submissions, deletion  pipeline  layouts from reflection, cache on disk
//! memory    buffers, images, samplers, upload     commands  one recorded pass after another
//! surface, swapchain  images that go to a window  frames    frames in flight, timestamps
//! ui        what egui has laid out
//! ```

mod commands;
mod device;
mod error;
mod frames;
#[cfg(feature = "hot-reload")]
mod glslc;
#[cfg(feature = "hot-reload")]
pub mod hot_reload;
mod instance;
mod memory;
mod pipeline;
mod shader;
#[cfg(feature = "viewer")]
mod surface;
#[cfg(feature = "viewer")]
mod swapchain;
#[cfg(feature = "viewer")]
mod ui;

pub use commands::{Bindings, ColorTarget, Commands, DepthTarget, Groups};
pub use device::{Device, DeviceDescription, DeviceKind, describe_devices};
pub use error::VulkanError;
pub use frames::{Frames, PassTime, Semaphores};
pub use instance::{Instance, Messages};
pub use memory::{Buffer, BufferUse, Image, ImageKind, ImageShape, Memory, Sampler, SamplerKind};
pub use pipeline::{ComputePipeline, GraphicsPipeline, GraphicsState, PipelineCache};
pub use shader::{Shader, ShaderStage, compiled};
#[cfg(feature = "viewer")]
pub use surface::{Surface, Window};
#[cfg(feature = "viewer")]
pub use swapchain::{AcquiredImage, PresentMode, Presented, Swapchain};
#[cfg(feature = "viewer")]
pub use ui::{UiFrame, UiPainter};

pub(crate) type Result<T> = std::result::Result<T, VulkanError>;
