//! Work: what passes record, and the objects that they may record it with.
use super::access::Mode;
use super::declare::Graph;
use super::error::GraphError;
use super::plan::PlannedPass;
use super::resource::{BufferHandle, Handle, ImageHandle};
use crate::Result;
use crate::vulkan::{self, Commands};
use std::sync::Arc;

/// What a pass records when it runs.
pub type Work<'a> = Box<dyn Fn(&mut Commands, &Resources<'_>) -> Result<()> + 'a>;

/// A frame whose passes run on a device.
pub type FrameGraph<'a> = Graph<Work<'a>>;

/// The Vulkan object behind a resource of the plan.
#[derive(Clone)]
pub enum DeviceResource {
    /// Behind an image.
    Image(Arc<vulkan::Image>),
    /// Behind a buffer.
    Buffer(Arc<vulkan::Buffer>),
}

/// The objects behind the handles that one pass has declared.
pub struct Resources<'r> {
    pub(super) pass: &'r PlannedPass<Work<'r>>,
    /// By resource of the plan.
    pub(super) objects: &'r [DeviceResource],
    /// Names of all resources of the graph, planned or not.
    pub(super) names: &'r [String],
}

impl Resources<'_> {
    /// The image behind `handle`.
    ///
    /// # Errors
    /// The pass has not declared it.
    pub(crate) fn image(&self, handle: ImageHandle) -> Result<&vulkan::Image> {
        match self.object(handle.into())? {
            DeviceResource::Image(image) => Ok(image),
            DeviceResource::Buffer(_) => Err(self.undeclared(handle.into()).into()),
        }
    }

    /// The buffer behind `handle`.
    ///
    /// # Errors
    /// The pass has not declared it.
    pub(crate) fn buffer(&self, handle: BufferHandle) -> Result<&vulkan::Buffer> {
        match self.object(handle.into())? {
            DeviceResource::Buffer(buffer) => Ok(buffer),
            DeviceResource::Image(_) => Err(self.undeclared(handle.into()).into()),
        }
    }

    /// The object behind `handle`: the version that the pass finds, or the one that it leaves.
    pub(super) fn object(&self, handle: Handle) -> Result<&DeviceResource> {
        let is_declared = |found: Handle, makes: bool| found == handle || (makes && found.next() == handle);
        let mut uses = self.pass.uses.iter();
        let declared = uses.find(|use_| is_declared(use_.handle, use_.mode != Mode::Read));
        let object = declared.and_then(|use_| self.objects.get(use_.resource));
        Ok(object.ok_or_else(|| self.undeclared(handle))?)
    }

    fn undeclared(&self, handle: Handle) -> GraphError {
        let foreign = || "a resource of another graph".to_owned();
        let resource = self.names.get(handle.resource).cloned().unwrap_or_else(foreign);
        GraphError::Undeclared { pass: self.pass.name.clone(), resource }
    }
}
