//! The way around drivers that know what is beyond the edges of a cube map's faces only after a draw.
use super::Readbacks;
use crate::Result;
use crate::graph::{FrameGraph, ImageDesc};
use crate::vulkan::{
    self, Device, GraphicsPipeline, GraphicsState, ImageKind, PipelineCache, Sampler, Triangles, VertexAttribute,
    compiled,
};
use ash::vk;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

const COLOR_FORMAT: vk::Format = vk::Format::R16G16B16A16_SFLOAT;
const DEPTH_FORMAT: vk::Format = vk::Format::D32_SFLOAT;

/// How a fault of a driver is got around.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum WayAround {
    /// Each cube map is bound for a draw once before shaders look it up.
    ///
    /// SwiftShader keeps faces with a border of one texel, which it copies from their neighbours. It does so before draws, for what is
    /// bound then, but not before dispatches: compute shaders see what was in memory before.
    DrawWithCubeMaps,
}

impl WayAround {
    /// What people are told.
    pub fn name(self) -> &'static str {
        match self {
            Self::DrawWithCubeMaps => "a draw with each cube map before it is looked up",
        }
    }
}

/// Draws a triangle of which nothing is seen, with `cube`, a cube map or an array of them, bound.
///
/// # Errors
/// Whatever Vulkan refuses.
pub(super) fn draw_with_cube_map(device: &Arc<Device>, cube: &vulkan::Image, sampler: &Sampler) -> Result<()> {
    let positions = [[0.0_f32; 3]; 3];
    let stride = size_of_val(&positions[0]) as u32;
    let attribute = VertexAttribute { name: "positions", stride, bytes: bytemuck::cast_slice(&positions) };
    let triangle = Triangles::new(device, "triangle without area", &[attribute], &[0, 1, 2])?;
    let state = GraphicsState {
        attributes: &[(vk::Format::R32G32B32_SFLOAT, stride)],
        colors: &[COLOR_FORMAT],
        depth: DEPTH_FORMAT,
    };
    let vertex = &compiled::CUBE_BORDERS_VERT;
    let fragment = match cube.shape.kind {
        ImageKind::Cubes(_) => &compiled::CUBE_ARRAY_BORDERS_FRAG,
        _ => &compiled::CUBE_BORDERS_FRAG,
    };
    let cache = PipelineCache::new(device, None)?;
    let pipeline = GraphicsPipeline::new(device, &cache, vertex, fragment, &state)?;
    let mut graph = FrameGraph::new();
    let mut color = graph.image("color", ImageDesc { format: COLOR_FORMAT, width: 1, height: 1 });
    let mut depth = graph.image("depth", ImageDesc { format: DEPTH_FORMAT, width: 1, height: 1 });
    let pass = graph.raster("cube_borders", &pipeline).sampled("cube", cube, sampler);
    pass.color(&mut color, [0; 4]).depth(&mut depth, 0.0).draw([(&triangle, [0_u8; 0])]);
    // What nobody reads is not drawn.
    let mut readbacks = Readbacks::new(device, graph);
    readbacks.image("color", color, true)?;
    readbacks.run("cube borders")
}
