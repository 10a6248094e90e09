//! Draws the panel over the picture.
use crate::graph::{Access, FrameGraph, ImageHandle};
use crate::vulkan::{UiFrame, UiPainter};

/// Name of the pass.
pub(super) const UI_PASS: &str = "ui";

/// Draws `frame` over `window`, an image of the swapchain.
pub fn ui<'a>(
    graph: &mut FrameGraph<'a>,
    painter: &'a UiPainter,
    frame: &'a UiFrame,
    window: ImageHandle,
) -> ImageHandle {
    let mut pass = graph.pass(UI_PASS);
    let window = pass.modify(window, Access::ColorAttachment);
    pass.record(Box::new(move |commands, resources| Ok(commands.draw_ui(painter, frame, resources.image(window)?)?)));
    window
}
