//! Sets a buffer to zero before others count in it.
use super::FrameGraph;
use crate::graph::{Access, BufferHandle};

/// Fills `buffer` with zeros.
pub fn clear(graph: &mut FrameGraph<'_>, name: &str, buffer: BufferHandle) -> BufferHandle {
    let mut pass = graph.pass(name);
    let cleared = pass.write(buffer, Access::TransferWrite);
    pass.depends_on(&());
    pass.record(Box::new(move |commands, resources| {
        commands.clear_buffer(resources.buffer(cleared));
        Ok(())
    }));
    cleared
}
