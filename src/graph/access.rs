//! What a pass may do with a resource, and what Vulkan calls it: one table.
use ash::vk;

/// How a pass uses a resource. The table in [`Access::info`] is all that the graph knows about each.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Access {
    /// Colour attachment of a raster pass; `modify` keeps (loads) what was there, `write` does not.
    ColorAttachment,
    /// Depth attachment of a raster pass, tested and written.
    DepthAttachment,
    /// Uniform buffer in compute shaders.
    UniformCompute,
    /// Sampled image in compute shaders.
    SampledCompute,
    /// Storage buffer or image, read in compute shaders.
    StorageReadCompute,
    /// Storage buffer or image in compute shaders; `modify` where the shader also reads it (atomics too) or writes a part.
    StorageWriteCompute,
    /// Arguments of an indirect draw or dispatch.
    Indirect,
    /// Source of a copy or blit.
    TransferRead,
    /// Destination of a copy, blit, fill or clear; `modify` where it covers a part only.
    TransferWrite,
    /// Read by the CPU after the frame's fence. Only the owner of an imported buffer does this, never a pass.
    HostRead,
    /// Presented. Only the owner of an imported image does this, never a pass. Its stage is `ALL_COMMANDS`, so that
    /// barriers form a chain with the swapchain's semaphores, which must wait and signal at `ALL_COMMANDS` too.
    Present,
}

/// What an [`Access`] is to Vulkan.
#[derive(Clone, Copy, Debug)]
pub struct AccessInfo {
    /// Pipeline stages that touch the resource.
    pub stages: vk::PipelineStageFlags2,
    /// Memory accesses of a `read`; a `modify` makes these too.
    pub reads: vk::AccessFlags2,
    /// Memory accesses of a `write` or `modify`; empty for an access that only reads.
    pub writes: vk::AccessFlags2,
    /// Layout that an image must be in.
    pub layout: vk::ImageLayout,
    /// Usage that an image needs for it; `None`: not for images.
    pub image_usage: Option<vk::ImageUsageFlags>,
    /// Usage that a buffer needs for it; `None`: not for buffers.
    pub buffer_usage: Option<vk::BufferUsageFlags>,
}

impl Access {
    /// The table.
    #[rustfmt::skip]
    pub fn info(self) -> AccessInfo {
        use ash::vk::{AccessFlags2 as A, BufferUsageFlags as B, ImageLayout as L, ImageUsageFlags as I, PipelineStageFlags2 as S};
        let tests = S::EARLY_FRAGMENT_TESTS | S::LATE_FRAGMENT_TESTS;
        // The depth test reads what the clear wrote, so a depth write is never without reads.
        let (depth_read, depth_write) = (A::DEPTH_STENCIL_ATTACHMENT_READ, A::DEPTH_STENCIL_ATTACHMENT_READ | A::DEPTH_STENCIL_ATTACHMENT_WRITE);
        let (no, read_only) = (A::NONE, L::SHADER_READ_ONLY_OPTIMAL);
        let (stages, reads, writes, layout, image_usage, buffer_usage) = match self {
            Self::ColorAttachment     => (S::COLOR_ATTACHMENT_OUTPUT, A::COLOR_ATTACHMENT_READ, A::COLOR_ATTACHMENT_WRITE, L::COLOR_ATTACHMENT_OPTIMAL, Some(I::COLOR_ATTACHMENT), None),
            Self::DepthAttachment     => (tests, depth_read, depth_write, L::DEPTH_STENCIL_ATTACHMENT_OPTIMAL, Some(I::DEPTH_STENCIL_ATTACHMENT), None),
            Self::UniformCompute      => (S::COMPUTE_SHADER, A::UNIFORM_READ, no, L::UNDEFINED, None, Some(B::UNIFORM_BUFFER)),
            Self::SampledCompute      => (S::COMPUTE_SHADER, A::SHADER_SAMPLED_READ, no, read_only, Some(I::SAMPLED), None),
            Self::StorageReadCompute  => (S::COMPUTE_SHADER, A::SHADER_STORAGE_READ, no, L::GENERAL, Some(I::STORAGE), Some(B::STORAGE_BUFFER)),
            Self::StorageWriteCompute => (S::COMPUTE_SHADER, A::SHADER_STORAGE_READ, A::SHADER_STORAGE_WRITE, L::GENERAL, Some(I::STORAGE), Some(B::STORAGE_BUFFER)),
            Self::Indirect            => (S::DRAW_INDIRECT, A::INDIRECT_COMMAND_READ, no, L::UNDEFINED, None, Some(B::INDIRECT_BUFFER)),
            Self::TransferRead        => (S::ALL_TRANSFER, A::TRANSFER_READ, no, L::TRANSFER_SRC_OPTIMAL, Some(I::TRANSFER_SRC), Some(B::TRANSFER_SRC)),
            Self::TransferWrite       => (S::ALL_TRANSFER, no, A::TRANSFER_WRITE, L::TRANSFER_DST_OPTIMAL, Some(I::TRANSFER_DST), Some(B::TRANSFER_DST)),
            Self::HostRead            => (S::HOST, A::HOST_READ, no, L::UNDEFINED, None, Some(B::empty())),
            Self::Present             => (S::ALL_COMMANDS, no, no, L::PRESENT_SRC_KHR, Some(I::empty()), None),
        };
        AccessInfo { stages, reads, writes, layout, image_usage, buffer_usage }
    }

    /// Whether only the owner of an imported resource can make this access, before or after the frame.
    pub fn is_outside_frame(self) -> bool {
        matches!(self, Self::HostRead | Self::Present)
    }
}

/// What a pass needs of a resource's contents.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Looks at them.
    Read,
    /// Replaces all of them: what was there is lost (attachments are cleared or not loaded).
    Write,
    /// Changes some of them, or reads and writes: what was there is kept (attachments are loaded).
    Modify,
}

impl Mode {
    /// The memory accesses that `access` makes in this mode.
    pub(super) fn accesses(self, access: Access) -> vk::AccessFlags2 {
        let info = access.info();
        match self {
            Self::Read => info.reads,
            Self::Write => info.writes,
            Self::Modify => info.reads | info.writes,
        }
    }
}
