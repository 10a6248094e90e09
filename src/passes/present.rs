//! Puts the picture into the window.
use super::FrameGraph;
use crate::graph::{Access, ImageHandle};

/// Where the picture is in the window, in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Area {
    /// Of its left edge.
    pub left: u32,
    /// Of its upper edge.
    pub top: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

/// Behind and beside the picture: a dark grey, which no tone mapping makes of black.
const AROUND: [f32; 4] = [0.08, 0.08, 0.08, 1.0];

/// Scales `display` to its `area` of `window`, an image of the swapchain; all else is grey, as all is without a picture.
pub fn present(
    graph: &mut FrameGraph<'_>,
    display: Option<ImageHandle>,
    window: ImageHandle,
    area: Area,
) -> ImageHandle {
    let mut pass = graph.pass("clear_window");
    let window = pass.write(window, Access::TransferWrite);
    pass.record(Box::new(move |commands, resources| {
        commands.clear_image(resources.image(window), AROUND);
        Ok(())
    }));
    let Some(display) = display else { return window };
    let mut pass = graph.pass("present");
    pass.read(display, Access::TransferRead);
    let window = pass.modify(window, Access::TransferWrite);
    pass.record(Box::new(move |commands, resources| {
        let Area { left, top, width, height } = area;
        commands.blit(resources.image(display), resources.image(window), [left, top, width, height]);
        Ok(())
    }));
    window
}
