//! Passes that only move or clear contents. Each turns the handle of what it writes into the new version.
use super::access::Access;
use super::resource::{BufferHandle, ImageHandle};
use super::work::FrameGraph;

impl FrameGraph<'_> {
    /// Sets all of `buffer` to zero.
    pub fn clear_buffer(&mut self, name: &str, buffer: &mut BufferHandle) {
        let mut pass = self.pass(name);
        let cleared = pass.write(*buffer, Access::TransferWrite);
        pass.depends_on(&());
        pass.record(Box::new(move |commands, resources| Ok(commands.clear_buffer(resources.buffer(cleared)?)?)));
        *buffer = cleared;
    }

    /// Fills all of `image` with a colour.
    pub fn clear_image(&mut self, name: &str, image: &mut ImageHandle, color: [f32; 4]) {
        let mut pass = self.pass(name);
        let cleared = pass.write(*image, Access::TransferWrite);
        pass.depends_on(&color.map(f32::to_bits));
        pass.record(Box::new(move |commands, resources| Ok(commands.clear_image(resources.image(cleared)?, color)?)));
        *image = cleared;
    }

    /// Copies `source` into `target`: its start, if that is shorter.
    pub fn copy_buffer(&mut self, name: &str, source: BufferHandle, target: &mut BufferHandle) {
        let mut pass = self.pass(name);
        let written = pass.read(source, Access::TransferRead).write(*target, Access::TransferWrite);
        pass.record(Box::new(move |commands, resources| {
            Ok(commands.copy_buffer(resources.buffer(source)?, resources.buffer(written)?)?)
        }));
        *target = written;
    }

    /// Copies all texels of `source`, tightly packed, into `target`.
    pub fn copy_image(&mut self, name: &str, source: ImageHandle, target: &mut BufferHandle) {
        let mut pass = self.pass(name);
        let written = pass.read(source, Access::TransferRead).write(*target, Access::TransferWrite);
        pass.record(Box::new(move |commands, resources| {
            Ok(commands.copy_image_to_buffer(resources.image(source)?, resources.buffer(written)?)?)
        }));
        *target = written;
    }

    /// Scales `source` to `area` (left, top, width, height) of `target`, whose other texels stay.
    pub fn blit(&mut self, name: &str, source: ImageHandle, target: &mut ImageHandle, area: [u32; 4]) {
        let mut pass = self.pass(name);
        let written = pass.read(source, Access::TransferRead).modify(*target, Access::TransferWrite);
        pass.record(Box::new(move |commands, resources| {
            Ok(commands.blit(resources.image(source)?, resources.image(written)?, area)?)
        }));
        *target = written;
    }
}
