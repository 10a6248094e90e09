//! The window: what winit tells becomes inputs, and frames are drawn when there is something new.
use super::change::{Change, check_picture_size};
use super::input::{Input, Scroll};
use super::interaction::Viewer;
use super::keyboard::input_of;
use super::latency::Stats;
use super::panel::{self, Panel};
use super::pointer::{Pointer, button_of, scroll_of};
use super::presenter::Presenter;
use super::script::{self, Script, Turn};
use super::{ViewerSettings, failed};
use crate::memo::Memo;
use crate::passes::Area;
use crate::picture;
use crate::scene::{MAX_SIZE_PX, Scene};
use crate::vulkan::{Device, Instance, Messages, Surface, UiFrame};
use crate::{Error, Result};
use egui::{TexturesDelta, ViewportId};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};
use winit::application::ApplicationHandler;
use winit::dpi::{LogicalSize, PhysicalSize};
use winit::event::{ElementState, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoopProxy};
use winit::keyboard::ModifiersState;
use winit::window::{Window, WindowId};

/// What wakes the window from another thread.
#[derive(Debug)]
pub enum Wake {
    /// Something is new: a result of background work, or progress.
    New,
    /// It is to end.
    Cancel,
}

/// A window that cannot be drawn on is tried again after this time.
const RETRY: Duration = Duration::from_millis(100);
/// How often the progress of background work is drawn.
const PROGRESS_INTERVAL: Duration = Duration::from_millis(100);
/// What the picture has at least, so that the panel beside it can be used.
const LEAST_PICTURE: [u32; 2] = [160, 240];

/// The program as winit sees it.
pub struct App {
    settings: ViewerSettings,
    proxy: EventLoopProxy<Wake>,
    open: Option<Open>,
    /// What ended it.
    pub result: Result<()>,
    /// What the validation layer said, once there is an instance.
    pub messages: Option<Messages>,
    /// How long inputs waited, if that was to be recorded.
    pub stats: Option<Stats>,
    /// The scene as it was at the end, if it is another than at the beginning.
    pub edited: Option<Scene>,
    /// What could not be done that was asked for, in order.
    pub failures: Vec<String>,
    /// Where the picture of the window was to be written, if it ended before.
    pub missing_screenshot: Option<PathBuf>,
}

/// An open window.
struct Open {
    // In the order in which they are dropped: the window goes last.
    viewer: Viewer,
    presenter: Presenter,
    panel: Panel,
    egui: egui_winit::State,
    context: egui::Context,
    window: Arc<Window>,
    /// Changes of egui's textures that have not been drawn yet.
    textures: TexturesDelta,
    /// When a frame is due; none while nothing changes.
    due: Option<Instant>,
    last_drawn: Instant,
    is_minimised: bool,
    pointer: Pointer,
    modifiers: ModifiersState,
    script: Script,
}

impl App {
    /// An app that will open its window when winit says so.
    pub fn new(settings: ViewerSettings, proxy: EventLoopProxy<Wake>) -> Self {
        Self {
            settings,
            proxy,
            open: None,
            result: Ok(()),
            messages: None,
            stats: None,
            edited: None,
            failures: Vec::new(),
            missing_screenshot: None,
        }
    }

    fn open(&mut self, event_loop: &ActiveEventLoop) -> Result<Open> {
        let ViewerSettings { scene, device, validate, cache, present_mode, .. } = &self.settings;
        let image = &scene.image;
        let [least_width, least_height] = LEAST_PICTURE;
        if image.width < least_width || image.height < least_height {
            tracing::warn!(
                "a picture of {} x {} is smaller than the window can be, and has at least {least_width} x {least_height}",
                image.width,
                image.height
            );
        }
        let attributes = Window::default_attributes()
            .with_title("Threadlight")
            .with_min_inner_size(LogicalSize::new(panel::WIDTH + least_width as f32, least_height as f32))
            .with_inner_size(PhysicalSize::new(image.width + panel::WIDTH.ceil() as u32, image.height));
        let window = Arc::new(event_loop.create_window(attributes).map_err(failed)?);
        // The panel is as wide as the display's scale makes it, the picture as large as asked for.
        let scale = window.scale_factor();
        if scale != 1.0 {
            let _ = window.request_inner_size(window_size([image.width, image.height], scale));
        }
        let display = event_loop.owned_display_handle();
        let raw = winit::raw_window_handle::HasDisplayHandle::display_handle(&display).map_err(failed)?.as_raw();
        let instance = Instance::for_display(*validate, raw)?;
        self.messages = Some(instance.messages());
        let surface = Surface::new(&instance, window.clone())?;
        let device = Device::for_surface(&instance, device.as_deref(), &surface)?;
        let presenter = Presenter::new(&device, surface, *present_mode)?;
        let context = egui::Context::default();
        // The panel has one width, and + and - are the exposure's.
        context.options_mut(|options| options.zoom_with_keyboard = false);
        let egui = egui_winit::State::new(
            context.clone(),
            ViewportId::ROOT,
            &*window,
            Some(scale as f32),
            None,
            Some(device.limits().max_image_dimension2_d as usize),
        );
        let proxy = self.proxy.clone();
        let mut viewer = Viewer::new(scene.clone(), &device, Memo::new(cache.as_deref()), move || {
            // A loop that has ended needs no waking.
            let _ = proxy.send_event(Wake::New);
        });
        let &ViewerSettings { ref replay, replay_limit, frames, ref screenshot, record, .. } = &self.settings;
        viewer.record(record);
        let mut open = Open {
            viewer,
            presenter,
            panel: Panel::default(),
            egui,
            context,
            window,
            textures: TexturesDelta::default(),
            due: Some(Instant::now()),
            last_drawn: Instant::now(),
            is_minimised: false,
            pointer: Pointer::default(),
            modifiers: ModifiersState::empty(),
            script: Script::new(replay, replay_limit, frames, screenshot.clone()),
        };
        open.fit_picture();
        Ok(open)
    }

    /// Ends the program, with `result` if it is the first.
    fn end(&mut self, event_loop: &ActiveEventLoop, result: Result<()>) {
        tracing::debug!("closing");
        if self.result.is_ok() {
            self.result = result;
        }
        event_loop.exit();
    }
}

/// Size of a window whose picture has this size.
fn window_size([width, height]: [u32; 2], scale: f64) -> PhysicalSize<u32> {
    PhysicalSize::new(width + (f64::from(panel::WIDTH) * scale).ceil() as u32, height)
}

impl Open {
    /// The picture takes what the panel leaves of the window.
    fn fit_picture(&mut self) {
        let PhysicalSize { width, height } = self.window.inner_size();
        let panel = (f64::from(panel::WIDTH) * self.window.scale_factor()).ceil() as u32;
        let longest = self.longest_side();
        if width.max(height) > longest {
            tracing::warn!(
                "a window of {width} x {height} is larger than {longest} x {longest}, which the device can draw"
            );
            let _ = self.window.request_inner_size(PhysicalSize::new(width.min(longest), height.min(longest)));
        }
        // A minimised window has no area; the picture keeps its.
        if width > panel && height > 0 {
            // What is past the largest picture stays empty.
            let [width, height] = [width - panel, height].map(|side| side.min(MAX_SIZE_PX));
            self.viewer.resize(Area { left: 0, top: 0, width, height });
        }
    }

    /// Columns or rows that a window can have: it is drawn as one image.
    fn longest_side(&self) -> u32 {
        self.viewer.device().longest_target_side()
    }

    /// Asks the window system for a window whose picture has this size.
    ///
    /// # Errors
    /// A size that no picture has, or that is too large beside the panel.
    fn request_size(&mut self, size: [u32; 2]) -> Result<()> {
        check_picture_size(size)?;
        let window = window_size(size, self.window.scale_factor());
        let longest = self.longest_side();
        if window.width.max(window.height) > longest {
            let problem = format!("with the panel, {} x {} is out of range", window.width, window.height);
            return Err(Error::input(
                "size",
                problem,
                format!("the device draws windows of up to {longest} x {longest}"),
            ));
        }
        if let Some(size) = self.window.request_inner_size(window) {
            tracing::debug!("the window is {} x {} at once", size.width, size.height);
            self.presenter.window_changed();
            self.fit_picture();
        }
        self.script.resizes(size, Instant::now());
        Ok(())
    }

    fn redraw(&mut self) {
        self.due = Some(Instant::now());
    }

    /// Draws a frame; gives whether the program is to end.
    fn draw(&mut self) -> Result<bool> {
        self.due = None;
        self.script.draws();
        self.last_drawn = Instant::now();
        let raw = self.egui.take_egui_input(&self.window);
        let mut inputs = Vec::new();
        let (panel, viewer) = (&mut self.panel, &mut self.viewer);
        let output = self.context.run(raw, |context| inputs.extend(panel.show(context, viewer)));
        self.egui.handle_platform_output(&self.window, output.platform_output);
        self.textures.append(output.textures_delta);
        inputs.iter().for_each(|input| self.viewer.handle(input));
        // What was dragged up to its release is handled by now.
        if !self.context.input(|input| input.pointer.any_down()) {
            self.viewer.history.hold(false);
        }
        let frame = UiFrame {
            primitives: self.context.tessellate(output.shapes, output.pixels_per_point),
            pixels_per_point: output.pixels_per_point,
        };
        let PhysicalSize { width, height } = self.window.inner_size();
        let size = if self.is_minimised { [0, 0] } else { [width, height] };
        let drags_slider = self.context.is_using_pointer() && inputs.iter().any(Input::changes_picture);
        let is_held = drags_slider || self.pointer.is_dragging();
        let counts = self.viewer.loaded().is_some() && !self.viewer.is_busy() && self.script.is_played();
        let last = counts && self.script.is_last();
        let screenshot = last && self.script.screenshot.is_some();
        let drawn = self.viewer.draw(&mut self.presenter, size, &frame, &self.textures, is_held, screenshot)?;
        self.textures.clear();
        // What changed in the panel shows in the next frame.
        if !inputs.is_empty() {
            self.redraw();
        }
        if let Some(output) = output.viewport_output.get(&ViewportId::ROOT)
            && output.repaint_delay < Duration::from_secs(3600)
        {
            self.due_at(Instant::now() + output.repaint_delay);
        }
        // A window without area is drawn when it has one.
        if !size.contains(&0) {
            match &drawn {
                Some(_) => self.viewer.motion.next_frame().into_iter().for_each(|next| self.due_at(next)),
                None => self.due_at(Instant::now() + RETRY),
            }
        }
        let Some(drawn) = drawn else { return Ok(false) };
        if let Some((rgba, [width, height])) = drawn.screenshot
            && let Some(path) = self.script.screenshot.take()
        {
            picture::write_png(&path, width, height, &rgba, false)?;
        }
        if counts && self.script.count() {
            self.redraw();
        }
        Ok(last)
    }

    fn due_at(&mut self, time: Instant) {
        self.due = Some(self.due.map_or(time, |due| due.min(time)));
    }

    /// Does what the script asks for now. Gives whether the program is to end.
    ///
    /// # Errors
    /// Those of [`Script::next`].
    fn play(&mut self) -> Result<bool> {
        let state = script::State {
            size: [self.viewer.area.width, self.viewer.area.height],
            is_frame_due: self.due.is_some(),
            has_new_draft: self.viewer.has_new_draft(),
            draft_awaited_until: self.viewer.draft_awaited_until(),
            is_loading: self.viewer.is_loading(),
            is_busy: self.viewer.is_busy(),
            turntable: self.viewer.motion.turntable,
        };
        let input = match self.script.next(state, Instant::now())? {
            Turn::Later => return Ok(false),
            Turn::At(time) => {
                self.due_at(time);
                return Ok(false);
            }
            Turn::Quit => return Ok(true),
            Turn::Now(input) => input,
        };
        match &input {
            Input::Resize(width, height) | Input::Set(Change::Size(width, height)) => {
                if let Err(error) = self.request_size([*width, *height]) {
                    self.viewer.tell_error(&error);
                }
            }
            Input::Minimise(minimise) => {
                self.window.set_minimized(*minimise);
                // Window systems need not do so, or tell; either way nothing is drawn meanwhile.
                self.is_minimised = *minimise;
            }
            Input::Move(at) => {
                self.pointer.at = *at;
                self.viewer.handle(&input);
            }
            input => self.viewer.handle(input),
        }
        self.redraw();
        Ok(false)
    }

    fn drag(&mut self, to: [f64; 2]) {
        self.viewer.cursor = Some(to);
        let control = self.modifiers.control_key() || self.modifiers.super_key();
        if let Some(drag) = self.pointer.move_to(to, self.modifiers.shift_key(), control) {
            self.viewer.handle(&Input::Drag(drag));
            self.redraw();
        }
    }

    /// Whether the cursor is over the picture.
    fn over_picture(&self) -> bool {
        let Area { left, top, width, height } = self.viewer.area;
        let within = |at: f64, low: u32, size: u32| at >= f64::from(low) && at < f64::from(low + size);
        within(self.pointer.at[0], left, width) && within(self.pointer.at[1], top, height)
    }

    /// Takes an event of the window. Gives whether the program is to end.
    fn on_event(&mut self, event: &WindowEvent) -> bool {
        let response = self.egui.on_window_event(&self.window, event);
        if response.repaint {
            self.redraw();
        }
        if matches!(event, WindowEvent::MouseInput { state: ElementState::Pressed, .. }) {
            self.viewer.history.hold(true);
        }
        match event {
            WindowEvent::CloseRequested => return true,
            WindowEvent::Resized(_) | WindowEvent::ScaleFactorChanged { .. } => {
                self.presenter.window_changed();
                self.fit_picture();
                self.redraw();
            }
            WindowEvent::Occluded(hidden) => {
                // A script's frames are drawn behind other windows, too.
                self.is_minimised = *hidden && !self.script.counts_frames();
                self.redraw();
            }
            WindowEvent::ModifiersChanged(modifiers) => self.modifiers = modifiers.state(),
            WindowEvent::CursorLeft { .. } => self.viewer.cursor = None,
            WindowEvent::CursorMoved { position, .. } => self.drag([position.x, position.y]),
            WindowEvent::Focused(false) if self.pointer.let_go() => self.redraw(),
            WindowEvent::MouseInput { state: ElementState::Released, button, .. }
                if button_of(*button).is_some_and(|button| self.pointer.release(button)) =>
            {
                // Sharp again.
                self.redraw();
            }
            WindowEvent::MouseInput { state: ElementState::Pressed, button, .. }
                if !response.consumed && self.over_picture() =>
            {
                button_of(*button).into_iter().for_each(|button| self.pointer.press(button));
            }
            WindowEvent::MouseWheel { delta, .. } if !response.consumed && self.over_picture() => {
                self.viewer.handle(&Input::Scroll(scroll_of(*delta, self.window.scale_factor())));
                self.redraw();
            }
            WindowEvent::PinchGesture { delta, .. } if !response.consumed && self.over_picture() => {
                // A pinch to twice the size is as far as seven lines of the wheel.
                self.viewer.handle(&Input::Scroll(Scroll::Lines(7.0 * delta)));
                self.redraw();
            }
            WindowEvent::KeyboardInput { event, .. }
                if event.state == ElementState::Pressed && !self.context.wants_keyboard_input() =>
            {
                if let Some(input) = input_of(&event.logical_key, event.physical_key, event.repeat, self.modifiers) {
                    self.viewer.handle(&input);
                    self.redraw();
                }
            }
            WindowEvent::DroppedFile(path) => {
                self.viewer.handle(&Input::Drop(path.clone()));
                self.redraw();
            }
            _ => {}
        }
        false
    }
}

impl ApplicationHandler<Wake> for App {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.open.is_some() {
            return;
        }
        match self.open(event_loop) {
            Ok(open) => self.open = Some(open),
            Err(error) => self.end(event_loop, Err(error)),
        }
    }

    fn user_event(&mut self, event_loop: &ActiveEventLoop, wake: Wake) {
        if matches!(wake, Wake::Cancel) {
            return self.end(event_loop, Err(Error::Cancelled));
        }
        let Some(open) = &mut self.open else { return };
        match open.viewer.take_loaded() {
            Ok(true) => open.redraw(),
            // A bar that moves ten times a second is smooth enough, and leaves the processor to what it tells of.
            Ok(false) => open.due_at(open.last_drawn + PROGRESS_INTERVAL),
            Err(error) => self.end(event_loop, Err(error)),
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let Some(open) = &mut self.open else { return };
        if matches!(event, WindowEvent::RedrawRequested) {
            match open.draw() {
                Ok(false) => {}
                Ok(true) => self.end(event_loop, Ok(())),
                Err(error) => self.end(event_loop, Err(error)),
            }
        } else if open.on_event(&event) {
            self.end(event_loop, Ok(()));
        }
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        let Some(open) = &mut self.open else { return };
        match open.play() {
            Ok(false) => {}
            Ok(true) => return self.end(event_loop, Ok(())),
            Err(error) => return self.end(event_loop, Err(error)),
        }
        if let Some(until) = open.viewer.draft_awaited_until() {
            open.due = open.due.map(|due| due.max(until));
        }
        let flow = match open.due.into_iter().chain(open.script.due()).min() {
            None => ControlFlow::Wait,
            Some(until) if until <= Instant::now() => {
                open.window.request_redraw();
                ControlFlow::Wait
            }
            Some(until) => ControlFlow::WaitUntil(until),
        };
        event_loop.set_control_flow(flow);
    }

    fn exiting(&mut self, _: &ActiveEventLoop) {
        // All that Vulkan made goes while the window is still there.
        let Some(mut open) = self.open.take() else { return };
        open.viewer.save_finished(false);
        self.failures = std::mem::take(&mut open.viewer.failures);
        self.missing_screenshot = open.script.screenshot.take();
        let wanted = open.viewer.session.wanted();
        let mut opened = self.settings.scene.clone();
        // The window has its size of the window system.
        (opened.image.width, opened.image.height) = (wanted.image.width, wanted.image.height);
        self.edited = (*wanted != opened).then(|| wanted.clone());
        if self.result.is_ok() {
            match open.viewer.stats() {
                Ok(stats) => self.stats = stats,
                Err(error) => self.result = Err(error),
            }
        }
    }
}

impl From<winit::error::EventLoopError> for Error {
    fn from(error: winit::error::EventLoopError) -> Self {
        failed(error)
    }
}
