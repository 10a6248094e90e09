//! Puts the picture into the window.
use super::ui::UI_PASS;
use crate::graph::{FrameGraph, ImageHandle};
use crate::vulkan::PassTime;

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

const CLEAR_WINDOW_PASS: &str = "clear_window";
const PRESENT_PASS: &str = "present";

impl PassTime {
    /// Whether the pass is of the window, not of the picture in it.
    pub(crate) fn is_of_window(&self) -> bool {
        [CLEAR_WINDOW_PASS, PRESENT_PASS, UI_PASS].contains(&self.name.as_str())
    }
}

/// Scales `display` to its `area` of `window`, an image of the swapchain; all else is grey, as all is without a picture.
pub fn present(
    graph: &mut FrameGraph<'_>,
    display: Option<ImageHandle>,
    mut window: ImageHandle,
    area: Area,
) -> ImageHandle {
    graph.clear_image(CLEAR_WINDOW_PASS, &mut window, AROUND);
    if let Some(display) = display {
        let Area { left, top, width, height } = area;
        graph.blit(PRESENT_PASS, display, &mut window, [left, top, width, height]);
    }
    window
}
