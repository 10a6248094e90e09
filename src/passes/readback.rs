//! Copies what the CPU wants to see into memory that it can read.
use super::FrameGraph;
use crate::graph::{Access, Buffer, Image};

/// Copies all texels of `image`, tightly packed, into the imported buffer `target`.
pub fn read_image(graph: &mut FrameGraph<'_>, name: &str, image: Image, target: Buffer) -> Buffer {
    let mut pass = graph.pass(name);
    pass.read(image, Access::TransferRead);
    let target = pass.write(target, Access::TransferWrite);
    pass.record(Box::new(move |commands, resources| {
        commands.copy_image_to_buffer(resources.image(image), resources.buffer(target));
        Ok(())
    }));
    target
}

/// Copies all of `buffer` into the imported buffer `target`.
pub fn read_buffer(graph: &mut FrameGraph<'_>, name: &str, buffer: Buffer, target: Buffer) -> Buffer {
    let mut pass = graph.pass(name);
    pass.read(buffer, Access::TransferRead);
    let target = pass.write(target, Access::TransferWrite);
    pass.record(Box::new(move |commands, resources| {
        commands.copy_buffer(resources.buffer(buffer), resources.buffer(target));
        Ok(())
    }));
    target
}
