//! Raster passes: triangles into one colour and one depth target, both cleared first.
use super::access::Access;
use super::declare::PassBuilder;
use super::error::GraphError;
use super::resource::ImageHandle;
use super::work::{FrameGraph, Work};
use crate::vulkan::{Bound, ColorTarget, DepthTarget, GraphicsPipeline, Image, Sampler, Triangles};
use bytemuck::Pod;

/// A raster pass that is being declared: [`RasterPass::draw`] ends it.
#[must_use = "a pass without a draw records nothing"]
pub struct RasterPass<'g, 'a> {
    pass: PassBuilder<'g, Work<'a>>,
    pipeline: &'a GraphicsPipeline,
    color: Option<(ImageHandle, [u32; 4])>,
    depth: Option<(ImageHandle, f32)>,
    /// Left, top, width and height; none for all of the targets.
    area: Option<[u32; 4]>,
    bindings: Vec<(&'a str, Bound<'a>)>,
}

impl<'a> FrameGraph<'a> {
    /// Adds a pass that draws with `pipeline`.
    pub fn raster(&mut self, name: &str, pipeline: &'a GraphicsPipeline) -> RasterPass<'_, 'a> {
        RasterPass { pass: self.pass(name), pipeline, color: None, depth: None, area: None, bindings: Vec::new() }
    }
}

impl<'a> RasterPass<'_, 'a> {
    /// The colour target, cleared to the bits `clear`. `target` becomes the new version.
    pub fn color(mut self, target: &mut ImageHandle, clear: [u32; 4]) -> Self {
        *target = self.pass.write(*target, Access::ColorAttachment);
        self.color = Some((*target, clear));
        self
    }

    /// The depth target, cleared to `clear`. `target` becomes the new version.
    pub fn depth(mut self, target: &mut ImageHandle, clear: f32) -> Self {
        *target = self.pass.write(*target, Access::DepthAttachment);
        self.depth = Some((*target, clear));
        self
    }

    /// Draws and clears only within this area of the targets: left, top, width and height. Elsewhere they may hold anything afterwards.
    pub fn within(mut self, area: [u32; 4]) -> Self {
        self.area = Some(area);
        self
    }

    /// The shaders look at what is no resource of the graph, an image with its sampler, as their binding `name`.
    pub fn sampled(mut self, name: &'a str, image: &'a Image, sampler: &'a Sampler) -> Self {
        let bound = Bound::Sampled(image, sampler);
        self.pass.depends_on(&bound.identity());
        self.bindings.push((name, bound));
        self
    }

    /// Draws each mesh with its push constants.
    pub fn draw<P: Pod>(mut self, meshes: impl IntoIterator<Item = (&'a Triangles, P)>) {
        let Self { color: Some(color), depth: Some(depth), .. } = self else {
            let pass = self.pass.name().to_owned();
            return self.pass.refuse(GraphError::NoTarget { pass });
        };
        let Self { mut pass, pipeline, area, bindings, .. } = self;
        let meshes: Vec<_> = meshes.into_iter().collect();
        pass.depends_on(&pipeline.identity()).depends_on(&color.1).depends_on(&depth.1.to_bits()).depends_on(&area);
        for (triangles, push) in &meshes {
            pass.depends_on(&triangles.identity()).depends_on(&bytemuck::bytes_of(push));
        }
        pass.record(Box::new(move |commands, resources| {
            let color = ColorTarget { image: resources.image(color.0)?, clear: color.1 };
            let depth = DepthTarget { image: resources.image(depth.0)?, clear: depth.1 };
            let draws = meshes.iter().map(|(triangles, push)| (*triangles, bytemuck::bytes_of(push)));
            Ok(commands.render(pipeline, &color, &depth, area, &bindings, draws)?)
        }));
    }
}
