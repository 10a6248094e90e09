//! The presenter draws frames into the window.
use crate::graph::{Access, DeviceResource, Executable, FrameGraph, ImageDesc, ImageHandle, Store};
use crate::passes::{Area, Counters, Readbacks, SHADE_PASS, View, present, texels, ui};
use crate::pipeline::{DeviceScene, Frame, declare};
use crate::vulkan::{
    Buffer, Device, Frames, Image, PassTime, PresentMode, Presented, Surface, Swapchain, UiFrame, UiPainter,
    VulkanError,
};
use crate::{Error, Result};
use egui::TexturesDelta;
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

/// Frames in flight.
const FRAMES: usize = 2;

const NO_SIZES: [Option<[u32; 2]>; FRAMES] = [None; FRAMES];

/// What a frame shows.
#[derive(Clone, Copy)]
pub struct ShownPicture<'a> {
    /// Of what.
    pub device_scene: &'a DeviceScene,
    /// From where, and in which resolution: scaled to `area` where that is not its size.
    pub view: &'a View,
    /// Where it is in the window.
    pub area: Area,
    /// Whether its shaders have run before: drivers may compile one where it first runs, so the time of such a frame tells nothing.
    pub is_compiled: bool,
}

/// What became of a frame.
pub struct Drawn {
    /// Time of each pass: of an earlier frame, where frames are in flight. Where the device cannot tell, from submission until it is done.
    pub passes: Vec<PassTime>,
    /// Names of the passes that ran, in their order.
    pub ran: Vec<String>,
    /// What was counted, if it was shaded and that was asked for: pixels, and lookups in the environment.
    pub counted: Option<(Counters, u64)>,
    /// What the window shows, if that was asked for: RGBA, 8 bits each, and its size.
    pub screenshot: Option<(Vec<u8>, [u32; 2])>,
    /// What a picture took, without what a window of that size always takes: of an earlier frame, as `passes`. None if that shaded none.
    pub cost: Option<PictureCost>,
    /// What there was too little memory for, if the picture is missing: it is to be drawn with fewer pixels.
    pub lack: Option<Error>,
}

/// What a picture took that was shaded.
#[derive(Clone, Copy, Debug)]
pub struct PictureCost {
    /// Columns and rows.
    pub size: [u32; 2],
    /// In which all of it was made.
    pub time: Duration,
}

impl PictureCost {
    /// That of a picture of this size in a frame of these passes; none where the device cannot tell.
    fn of(size: [u32; 2], passes: &[PassTime]) -> Option<Self> {
        let of_picture = passes.iter().filter(|pass| !pass.is_of_window() && !pass.is_readback());
        let ms: f64 = of_picture.map(|pass| pass.gpu_ms).sum();
        let shades = passes.iter().any(|pass| pass.name == SHADE_PASS);
        shades.then(|| Self { size, time: Duration::from_secs_f64(ms * 1e-3) })
    }
}

/// What a frame is to leave besides the picture in the window. All wait for the GPU.
#[derive(Clone, Copy, Default)]
pub struct Extras {
    /// What was counted.
    pub counts: bool,
    /// What the window shows.
    pub screenshot: bool,
    /// That it has been drawn when [`Presenter::draw`] returns.
    pub completion: bool,
}

/// A frame in the window.
struct WindowFrame {
    /// The window's image as it is imported.
    window: ImageHandle,
    /// The same, drawn.
    shown: ImageHandle,
    /// Of the picture, if there is one.
    frame: Option<Frame>,
}

/// Declares `picture` and `panel` over it, in a window of `size`.
fn declare_window<'a>(
    graph: &mut FrameGraph<'a>,
    picture: Option<&ShownPicture<'a>>,
    painter: &'a UiPainter,
    panel: &'a UiFrame,
    [width, height]: [u32; 2],
) -> WindowFrame {
    let desc = ImageDesc { format: painter.format(), width, height };
    let window = graph.import_image("window", desc, None, Some(Access::Present));
    let nowhere = Area { left: 0, top: 0, width, height };
    let frame = picture
        .map(|ShownPicture { device_scene, view, .. }| declare(graph, device_scene, device_scene.region(view), view));
    let area = picture.map_or(nowhere, |picture| picture.area);
    let shown = present(graph, frame.as_ref().map(|frame| frame.display), window, area);
    let shown = ui(graph, painter, panel, shown);
    graph.output(shown);
    WindowFrame { window, shown, frame }
}

/// A frame with all that it needs.
struct ReadyFrame<'a> {
    executable: Executable<'a>,
    /// Where counters and lookups are read back, if it counts.
    counts: Option<[Arc<Buffer>; 2]>,
    /// Where the window is read back, if that was asked for.
    screenshot: Option<Arc<Buffer>>,
}

/// Makes what a frame of `picture` and `panel` in the image `target` of the window needs, besides what is in `store`.
fn make_ready<'a>(
    device: &Arc<Device>,
    store: &mut Store,
    painter: &'a UiPainter,
    picture: Option<ShownPicture<'a>>,
    panel: &'a UiFrame,
    target: &Arc<Image>,
    extras: Extras,
) -> Result<ReadyFrame<'a>> {
    let [width, height, _] = target.shape.extent;
    let mut graph = FrameGraph::new();
    let WindowFrame { window, shown, frame } =
        declare_window(&mut graph, picture.as_ref(), painter, panel, [width, height]);
    let mut readbacks = Readbacks::new(device, graph);
    // Only frames that shade count: reading what was counted must not be what makes them do so.
    let counting = frame.filter(|frame| extras.counts && !readbacks.graph.is_still_good(frame.radiance, store.kept()));
    let counts = match &counting {
        Some(frame) => Some([
            readbacks.buffer("counters", frame.counters, size_of::<Counters>() as u64)?,
            readbacks.buffer("lookups", frame.lookups, size_of::<u64>() as u64)?,
        ]),
        None => None,
    };
    let screenshot = readbacks.image("window", shown, extras.screenshot)?;
    let Readbacks { graph, mut imports, .. } = readbacks;
    imports.push((window.into(), DeviceResource::Image(target.clone())));
    let executable = Executable::keeping(device, graph, &imports, store)?;
    Ok(ReadyFrame { executable, counts, screenshot })
}

/// Whether there was too little memory for it.
fn lacks_memory(ready: &Result<ReadyFrame>) -> bool {
    let Err(Error::Vulkan(cause)) = ready else { return false };
    cause.downcast_ref().is_some_and(VulkanError::is_lack_of_memory)
}

/// The window, as frames see it.
pub struct Presenter {
    // In the order in which they are dropped: whoever uses a thing goes before it.
    store: Store,
    painter: UiPainter,
    frames: Frames,
    /// Of each frame in flight, the oldest first, the size of its picture if what that takes tells of others.
    sizes: VecDeque<Option<[u32; 2]>>,
    swapchain: Swapchain,
    device: Arc<Device>,
}

impl Presenter {
    /// That of the window of `surface`.
    ///
    /// # Errors
    /// No memory left, or a window that cannot be presented to.
    pub fn new(device: &Arc<Device>, surface: Surface, mode: PresentMode) -> Result<Self> {
        let swapchain = Swapchain::new(device, surface, mode, FRAMES)?;
        Ok(Self {
            store: Store::default(),
            painter: UiPainter::new(device, swapchain.format(), FRAMES)?,
            frames: Frames::new(device, "window", FRAMES)?,
            sizes: NO_SIZES.into(),
            swapchain,
            device: device.clone(),
        })
    }

    /// Says that the window has another size.
    pub fn window_changed(&mut self) {
        self.swapchain.window_changed();
    }

    /// Draws one frame into a window of `size` pixels: what of `picture` is not still good, and `panel` over it. None if there is
    /// nothing to draw on now, or the window changed meanwhile; then it is to be drawn again later.
    ///
    /// # Errors
    /// Whatever Vulkan refuses.
    pub fn draw(
        &mut self,
        size: [u32; 2],
        picture: Option<ShownPicture>,
        panel: &UiFrame,
        textures: &TexturesDelta,
        extras: Extras,
    ) -> Result<Option<Drawn>> {
        // Also where nothing is drawn: egui tells of each change once.
        self.painter.update(textures)?;
        let Some(turn) = self.swapchain.turn(&self.frames, size)? else { return Ok(None) };
        let extent = turn.image.shape.extent;
        let make_ready = |store: &mut Store, picture| {
            make_ready(&self.device, store, &self.painter, picture, panel, &turn.image, extras)
        };
        let mut ready = make_ready(&mut self.store, picture);
        let mut lack = None;
        // Once more with the room that was taken by what was kept, then without the picture: an image that was acquired has to be presented.
        for picture in [picture, None] {
            if !lacks_memory(&ready) {
                break;
            }
            self.store = Store::default();
            self.device.wait_idle()?;
            lack = ready.err().filter(|_| picture.is_none());
            ready = make_ready(&mut self.store, picture);
        }
        let ReadyFrame { executable, counts, screenshot } = ready?;
        let ran: Vec<_> = executable.plan.passes.iter().map(|pass| pass.name.clone()).collect();
        let shades = ran.iter().any(|pass| pass == SHADE_PASS);
        let told = picture.filter(|picture| shades && picture.is_compiled);
        let size = told.map(|picture| [picture.view.width, picture.view.height]);
        let (passes, size) = match self.device.times_passes() && !executable.is_in_portions() {
            true => {
                let passes = self.frames.oldest_pass_times()?;
                executable.execute_between(&mut self.frames, turn.semaphores)?;
                self.sizes.push_back(size);
                (passes, self.sizes.pop_front().flatten())
            }
            false => {
                // What the frames in flight then have are single passes of this one.
                self.sizes = NO_SIZES.into();
                (executable.execute_pass_by_pass(&self.device, &mut self.frames, turn.semaphores, &())?, size)
            }
        };
        let cost = size.and_then(|size| PictureCost::of(size, &passes));
        if counts.is_some() || screenshot.is_some() || extras.completion {
            self.frames.wait()?;
        }
        tracing::debug!("frame: {}", ran.join(" "));
        drop(executable);
        if self.swapchain.present(turn)? == Presented::Again && screenshot.is_none() {
            return Ok(None);
        }
        let counted = counts.map(|[counters, lookups]| {
            let counters: Vec<Counters> = texels(Some(&counters));
            let lookups: Vec<u64> = texels(Some(&lookups));
            (counters.first().copied().unwrap_or_default(), lookups.first().copied().unwrap_or_default())
        });
        let [width, height, _] = extent;
        let screenshot = screenshot.map(|image| {
            let opaque = |texel| {
                let [r, g, b] = self.swapchain.rgb8(texel);
                [r, g, b, 255]
            };
            (texels(Some(&image)).into_iter().flat_map(opaque).collect(), [width, height])
        });
        Ok(Some(Drawn { passes, ran, counted, screenshot, cost, lack }))
    }
}

#[cfg(test)]
#[path = "presenter_tests.rs"]
mod tests;
