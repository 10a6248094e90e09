//! Draws what egui has laid out, by egui-ash-renderer.
use super::commands::Commands;
use super::device::Device;
use super::error::{During, Result, VulkanError};
use super::image::Image;
use ash::vk;
use egui::epaint::{ClippedPrimitive, ColorImage, ImageDelta, TextureId, textures::TexturesDelta};
use egui_ash_renderer::{DynamicRendering, Options, Renderer, RendererError};
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

/// A frame of egui, as triangles.
#[derive(Default)]
pub struct UiFrame {
    /// What to draw.
    pub primitives: Vec<ClippedPrimitive>,
    /// Pixels of an egui point.
    pub pixels_per_point: f32,
}

/// What the user interface is drawn by.
pub struct UiPainter {
    // It has pipeline, textures and vertices of its own; locked, as recording a frame changes the latter.
    renderer: Mutex<Option<Renderer>>,
    /// The textures as they are: see [`UiPainter::update`].
    textures: HashMap<TextureId, ColorImage>,
    /// Those that the frame after the last update is the last to draw.
    unused: Vec<TextureId>,
    command_pool: vk::CommandPool,
    format: vk::Format,
    device: Arc<Device>,
}

impl UiPainter {
    /// That of what it draws on.
    pub(crate) fn format(&self) -> vk::Format {
        self.format
    }

    /// Compiles its shaders for colour targets of `format` that hold display values, and so many frames in flight.
    ///
    /// # Errors
    /// No memory left.
    pub fn new(device: &Arc<Device>, format: vk::Format, frames: usize) -> Result<Self> {
        let attachments = DynamicRendering { color_attachment_format: format, depth_attachment_format: None };
        let options = Options { in_flight_frames: frames, srgb_framebuffer: false, ..Options::default() };
        let renderer = Renderer::with_default_allocator(
            &device.instance.raw,
            device.physical,
            device.raw.clone(),
            attachments,
            options,
        );
        let info = vk::CommandPoolCreateInfo::default()
            .flags(vk::CommandPoolCreateFlags::TRANSIENT)
            .queue_family_index(device.queue_family);
        let renderer = Mutex::new(Some(renderer.map_err(refused)?));
        // SAFETY: plain creation; destroyed when dropped.
        let command_pool =
            unsafe { device.raw.create_command_pool(&info, None) }.during("vkCreateCommandPool", "panel")?;
        device.set_name(command_pool, "panel");
        Ok(Self {
            renderer,
            textures: HashMap::new(),
            unused: Vec::new(),
            command_pool,
            format,
            device: device.clone(),
        })
    }

    /// Brings the textures (glyphs, above all) up to date, before the frame that needs them is recorded. That may draw those that are to be
    /// freed, which stay until the next update.
    ///
    /// # Errors
    /// No memory left.
    pub fn update(&mut self, changes: &TexturesDelta) -> Result<()> {
        let unused = std::mem::replace(&mut self.unused, changes.free.clone());
        if changes.set.is_empty() && unused.is_empty() {
            return Ok(());
        }
        unused.iter().for_each(|id| drop(self.textures.remove(id)));
        let mut whole = Vec::new();
        for (id, change) in &changes.set {
            // The renderer would drop the rest of a texture that changes in part (it takes it from an undefined layout), so
            // parts are put together here, and the whole is uploaded.
            let egui::ImageData::Color(part) = &change.image;
            let texture = match (change.pos, self.textures.get_mut(id)) {
                (Some([left, top]), Some(texture)) => {
                    for row in 0..part.height() {
                        let start = (top + row) * texture.width() + left;
                        let source = &part.pixels[row * part.width()..][..part.width()];
                        texture.pixels[start..start + part.width()].copy_from_slice(source);
                    }
                    texture.clone()
                }
                _ => {
                    self.textures.insert(*id, (**part).clone());
                    (**part).clone()
                }
            };
            whole.retain(|(other, _)| other != id);
            whole.push((*id, ImageDelta::full(texture, change.options)));
        }
        // Frames that are still drawn have the old ones.
        self.device.wait_idle()?;
        let (pool, renderer) = (self.command_pool, self.renderer.get_mut().unwrap_or_else(PoisonError::into_inner));
        let Some(renderer) = renderer else { return Ok(()) };
        renderer.free_textures(&unused).map_err(refused)?;
        self.device.with_queue(|queue| renderer.set_textures(queue, pool, &whole)).map_err(refused)
    }
}

impl Commands {
    /// Draws `frame` over `target`, whose contents stay.
    ///
    /// # Errors
    /// No memory left for triangles.
    pub(crate) fn draw_ui(&mut self, painter: &UiPainter, frame: &UiFrame, target: &Image) -> Result<()> {
        target.check(&self.device, vk::ImageUsageFlags::COLOR_ATTACHMENT)?;
        self.device.check_same(&painter.device, "panel")?;
        let [width, height, _] = target.shape.extent;
        let extent = vk::Extent2D { width, height };
        let colors = [vk::RenderingAttachmentInfo::default()
            .image_view(target.view)
            .image_layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)
            .load_op(vk::AttachmentLoadOp::LOAD)
            .store_op(vk::AttachmentStoreOp::STORE)];
        let info = vk::RenderingInfo::default().render_area(extent.into()).layer_count(1).color_attachments(&colors);
        // SAFETY: the view is alive and in the layout named above, by the caller's barriers; ended below.
        unsafe { self.device.dynamic_rendering.cmd_begin_rendering(self.raw, &info) };
        let mut renderer = painter.renderer.lock().unwrap_or_else(PoisonError::into_inner);
        let drawn = renderer
            .as_mut()
            .map_or(Ok(()), |painter| painter.cmd_draw(self.raw, extent, frame.pixels_per_point, &frame.primitives));
        // SAFETY: begun above.
        unsafe { self.device.dynamic_rendering.cmd_end_rendering(self.raw) };
        drawn.map_err(refused)
    }
}

fn refused(error: RendererError) -> VulkanError {
    match error {
        RendererError::Vulkan(result) => VulkanError::Call { call: "egui", object: "panel".to_owned(), result },
        RendererError::Allocator(_) => VulkanError::Memory { object: "panel".to_owned(), cause: error.to_string() },
        _ => VulkanError::unfit("panel", error),
    }
}

impl Drop for UiPainter {
    fn drop(&mut self) {
        // The renderer destroys what it has at once, so no frame may still be drawing it.
        if let Err(error) = self.device.wait_idle() {
            tracing::error!("{error}");
        }
        drop(self.renderer.get_mut().unwrap_or_else(PoisonError::into_inner).take());
        // SAFETY: the queue is idle, so none of its commands are in use.
        unsafe { self.device.raw.destroy_command_pool(self.command_pool, None) };
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Frames, ImageShape, Memory, test_device};
    use super::*;
    use egui::epaint::{Mesh, Primitive};
    use egui::{Color32, Rect, TextureOptions, pos2};

    #[test]
    fn the_frame_of_an_update_may_draw_what_that_frees_and_later_ones_may_not() {
        let (device, messages) = test_device::open_validated();
        let format = vk::Format::B8G8R8A8_UNORM;
        let mut painter = UiPainter::new(&device, format, 1).expect("a painter");
        let mut frames = Frames::new(&device, "frames", 1).expect("frames");
        let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT;
        let mut target = Image::unbound(&device, "target", ImageShape::plane(format, 4, 4), usage).expect("an image");
        let memory = Memory::new(&device, "target", target.requirements(), false).expect("memory");
        target.bind(&memory, 0).expect("an image with memory");

        let id = TextureId::Managed(1);
        let square = Rect::from_min_max(pos2(0.0, 0.0), pos2(4.0, 4.0));
        let mut mesh = Mesh::with_texture(id);
        mesh.add_rect_with_uv(square, square, Color32::WHITE);
        let primitives = vec![ClippedPrimitive { clip_rect: square, primitive: Primitive::Mesh(mesh) }];
        let frame = UiFrame { primitives, pixels_per_point: 1.0 };
        let mut draw = |changes: TexturesDelta| -> Result<()> {
            painter.update(&changes)?;
            frames.record(|commands| {
                let to_target = Commands::image_barrier(&target)
                    .dst_stage_mask(vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT)
                    .dst_access_mask(vk::AccessFlags2::COLOR_ATTACHMENT_WRITE | vk::AccessFlags2::COLOR_ATTACHMENT_READ)
                    .new_layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL);
                commands.barriers(&[to_target], &[], &[]);
                commands.draw_ui(&painter, &frame, &target)
            })?;
            frames.wait()
        };
        let white = ImageDelta::full(ColorImage::filled([1, 1], Color32::WHITE), TextureOptions::default());
        draw(TexturesDelta { set: vec![(id, white)], free: vec![id] }).expect("a frame");
        assert!(draw(TexturesDelta::default()).is_err(), "it is there no more");
        drop((painter, frames, target, memory, device));
        assert_eq!(messages.all(), Vec::<String>::new());
    }
}
