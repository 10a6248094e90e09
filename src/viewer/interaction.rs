//! The viewer: what inputs do to the session, and the frames that follow from it. Knows nothing of the window system.
use super::change::Change;
use super::comparer::Comparer;
use super::comparison::{Other, Wipe, compare_with};
use super::dynamic_resolution::DynamicResolution;
use super::input::{DragAction, Dropped, Input, change_of_dropped};
use super::latency::{Answer, Latency, Record, Stats};
use super::latest_job::{LatestJob, Progress};
use super::loaded::Loaded;
use super::measured::Measured;
use super::orbit::{Bounds, Orbit, environment_turn_deg};
use super::presenter::{Drawn, Extras, Presenter, ShownPicture};
use super::session::Session;
use crate::memo::{Key, Memo, Round};
use crate::output::{self, Format};
use crate::passes::{Area, View};
use crate::pipeline::{DeviceScene, Wanted};
use crate::prepare::{Prepared, can_draft, key_of, prepare, prepare_draft, view_of};
#[cfg(feature = "hot-reload")]
use crate::progress::Observer;
use crate::scene::{Background, Scene};
use crate::vulkan::{Device, UiFrame};
use crate::{Error, Result};
use egui::TexturesDelta;
use glam::DVec2;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A picture is still moving for so long after the last motion: a scroll wheel has no release.
const SETTLING: Duration = Duration::from_millis(150);
/// Frames wait for a draft so long at most.
const DRAFT_PATIENCE: Duration = Duration::from_millis(100);
/// Threads are finished when nobody has asked for others for so long: what is dragged moves more often.
const BEFORE_FINISHING: Duration = Duration::from_millis(100);

/// Something to tell the user.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Notice {
    /// In one sentence.
    pub text: String,
    /// Whether it is that something could not be done.
    pub is_error: bool,
}

/// The viewer.
pub struct Viewer {
    /// The scene that is asked for, and the one that is seen.
    pub session: Session,
    /// Where the picture is in the window.
    pub area: Area,
    /// What was last told.
    pub notice: Option<Notice>,
    /// What frames have shown of themselves.
    pub measured: Measured,
    /// Whether the camera turns by itself.
    pub turntable: bool,
    /// What the picture is compared with.
    pub comparer: Comparer,
    /// Where the cursor is in the window, in pixels; none while it is elsewhere.
    pub cursor: Option<[f64; 2]>,
    loaded: Option<Loaded>,
    loading: LatestJob<Loaded>,
    /// What was asked for last.
    requested: Option<Key>,
    /// Since when a draft is being made of what was asked for last; none if it is there, or there is none.
    drafting_since: Option<Instant>,
    /// Whether more may be wanted than the draft that the next frame shows. It is asked for then: making it now would hold that frame up.
    request_after_frame: bool,
    /// How long inputs wait to be seen.
    pub latency: Latency,
    /// Number of the latest change.
    changes: u64,
    record: Record,
    /// The drafts that were shown, where they are to be measured: each with the number of the answer that it was.
    drafts: Vec<(usize, Arc<Prepared>)>,
    dynamic_resolution: DynamicResolution,
    /// Whether a frame has run the shader that shades what is loaded.
    is_compiled: bool,
    last_motion: Option<Instant>,
    last_turn: Option<Instant>,
    #[cfg(feature = "hot-reload")]
    shaders: super::shader_watch::ShaderWatch,
    device: Arc<Device>,
    memo: Arc<Memo>,
}

impl Viewer {
    /// A viewer of `scene`, which begins to load. `wake` is called when there is something new to be drawn.
    pub fn new(scene: Scene, device: &Arc<Device>, memo: Memo, wake: impl Fn() + Send + Sync + 'static) -> Self {
        let wake = Arc::new(wake);
        let wake_too = wake.clone();
        #[cfg(feature = "hot-reload")]
        let wake_for_shaders = wake.clone();
        let area = Area { left: 0, top: 0, width: scene.image.width, height: scene.image.height };
        let mut viewer = Self {
            session: Session::new(scene),
            area,
            notice: None,
            measured: Measured::default(),
            turntable: false,
            loaded: None,
            comparer: Comparer::new(move || wake_too()),
            cursor: None,
            loading: LatestJob::new("loading", move || wake()),
            requested: None,
            drafting_since: None,
            request_after_frame: false,
            latency: Latency::keeping(100),
            changes: 0,
            record: Record::default(),
            drafts: Vec::new(),
            dynamic_resolution: DynamicResolution::default(),
            is_compiled: false,
            last_motion: None,
            last_turn: None,
            #[cfg(feature = "hot-reload")]
            shaders: super::shader_watch::ShaderWatch::new(move || wake_for_shaders()),
            device: device.clone(),
            memo: Arc::new(memo),
        };
        viewer.request();
        viewer
    }

    /// Records more, from now on, of how long inputs wait.
    pub fn record(&mut self, record: Record) {
        if record != Record::Latest {
            self.latency = Latency::keeping(usize::MAX);
        }
        self.record = record;
    }

    /// How long inputs waited; none unless all were to be recorded.
    ///
    /// # Errors
    /// Whatever goes wrong where drafts are measured.
    pub fn stats(&self) -> Result<Option<Stats>> {
        if self.record == Record::Latest {
            return Ok(None);
        }
        let mut events: Vec<Answer> = self.latency.answers().iter().cloned().collect();
        for (index, draft) in &self.drafts {
            let finished = Other::Shading(draft.scene.shading.clone());
            let rms = &mut events[*index].rms_to_finished;
            compare_with(draft, &finished, &self.device, &self.memo, &(), &mut |compared| {
                *rms = compared.metrics.map(|metrics| metrics.rms);
            })?;
        }
        Ok(Some(Stats {
            device: self.device.description().name.clone(),
            size: [self.area.width, self.area.height],
            median_shown_ms: self.latency.shown_ms(0.5),
            p95_shown_ms: self.latency.shown_ms(0.95),
            events,
        }))
    }

    /// What is shown, if it has been loaded.
    pub fn loaded(&self) -> Option<&Loaded> {
        self.loaded.as_ref()
    }

    /// The device that draws.
    pub fn device(&self) -> &Device {
        &self.device
    }

    /// How far the loading of what is wanted is.
    pub fn progress(&self) -> Option<Progress> {
        self.loading.progress()
    }

    /// Whether something is being loaded or made that frames wait for.
    pub fn is_loading(&self) -> bool {
        self.loading.is_busy()
    }

    /// Until when frames wait for the draft that is being made, if one is: where a slider is and what it asks for are shown together.
    pub fn draft_awaited_until(&self) -> Option<Instant> {
        self.drafting_since.map(|since| since + DRAFT_PATIENCE)
    }

    /// A frame was drawn of what was loaded: what was wanted meanwhile is asked for.
    pub fn frame_was_drawn(&mut self) {
        if std::mem::take(&mut self.request_after_frame) {
            self.request();
        }
    }

    /// Whether the next frame shows a draft that no frame has shown yet.
    pub fn has_new_draft(&self) -> bool {
        self.request_after_frame
    }

    /// Whether anything is made in the background.
    pub fn is_busy(&self) -> bool {
        self.is_loading() || self.comparer.is_busy()
    }

    /// From where and how what is shown is looked at, at full resolution; none while nothing is.
    pub fn shown_view(&self) -> Option<View> {
        let loaded = self.loaded.as_ref()?;
        view_of(self.session.shown(), loaded.prepared.bounding_sphere()).ok()
    }

    /// Does what the user asks for. Whatever goes wrong is told by a notice, and changes nothing.
    pub fn handle(&mut self, input: &Input) {
        let (start, changes) = (Instant::now(), self.changes);
        if let Err(error) = self.try_handle(input) {
            self.tell_error(&error);
        } else if self.changes > changes {
            let is_loaded = self.loaded.as_ref().is_some_and(|loaded| loaded.key.is_some() && loaded.key == self.key());
            self.latency.asked(input, start, (!is_loaded).then_some(self.changes));
        }
    }

    /// What is wanted is made of this; none where a file cannot be read.
    fn key(&self) -> Option<Key> {
        key_of(self.session.wanted(), &self.memo).ok()
    }

    fn try_handle(&mut self, input: &Input) -> Result<()> {
        match input {
            Input::Drag(drag) => {
                let by = DVec2::from(drag.by);
                let rows = f64::from(self.area.height);
                match drag.action() {
                    DragAction::Orbit => self.move_camera(|orbit| orbit.turn(by, rows)),
                    DragAction::Pan => self.move_camera(|orbit| orbit.pan(by, rows)),
                    DragAction::TurnEnvironment => {
                        self.last_motion = Some(Instant::now());
                        let turned = self.session.wanted().environment.rotation_deg + environment_turn_deg(by.x, rows);
                        self.change(&Change::Rotation(turned.rem_euclid(360.0)))
                    }
                }
            }
            Input::Scroll(scroll) => self.move_camera(|orbit| orbit.zoom((*scroll).into())),
            Input::Key(key) => self.press(key),
            Input::Drop(path) => match change_of_dropped(path)? {
                Dropped::Change(change) => self.change(&change),
                Dropped::Scene(path) => {
                    let mut scene = Scene::load(&path)?;
                    // The window stays as large as it is.
                    (scene.image.width, scene.image.height) = (self.area.width, self.area.height);
                    scene.files().for_each(|path| self.memo.look_again(path));
                    self.session.replace(scene);
                    self.changes += 1;
                    self.request();
                    Ok(())
                }
            },
            Input::Set(change) => self.change(change),
            Input::SavePicture(path) => self.save_picture(path),
            Input::SaveScene(path) => {
                self.session.wanted().save(path)?;
                self.tell(format!("saved {}", path.display()));
                Ok(())
            }
            Input::Move(at) => {
                self.cursor = Some(*at);
                Ok(())
            }
            Input::Compare(other) => {
                self.comparer.other.clone_from(other);
                Ok(())
            }
            Input::Wipe(part) => {
                self.comparer.wipe = Wipe::at(*part);
                Ok(())
            }
            Input::HeatMap(shows) => {
                self.comparer.shows_heat_map = *shows;
                Ok(())
            }
            // What the window itself does.
            Input::Resize(..) | Input::Minimise(_) | Input::Wait | Input::Quit => Ok(()),
        }
    }

    fn press(&mut self, key: &str) -> Result<()> {
        let (image, shading) = (&self.session.wanted().image, &self.session.wanted().shading);
        match key {
            "f" => {
                let aspect = image.aspect();
                self.move_camera(|orbit| orbit.frame(aspect))
            }
            "home" => self.change(&Change::Camera(None)),
            "t" => {
                self.turntable = !self.turntable;
                self.last_turn = None;
                Ok(())
            }
            "b" => {
                let none = image.background == Background::Environment;
                self.change(&Change::Background(if none { Background::None } else { Background::Environment }))
            }
            // Thirds of a stop.
            "+" | "=" => self.change(&Change::Exposure(image.exposure * 2f64.powf(1.0 / 3.0))),
            "-" => self.change(&Change::Exposure(image.exposure * 0.5f64.powf(1.0 / 3.0))),
            "0" => self.change(&Change::Exposure(1.0)),
            "[" | "]" => {
                let method = crate::method::Method::from_name(&shading.method)?;
                let count = shading.threads.unwrap_or(method.default_count());
                let count = if key == "[" { (count / 2).max(1) } else { count.saturating_mul(2) };
                self.change(&Change::Threads(Some(count)))
            }
            "escape" => {
                self.notice = None;
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// Makes a change; what it needs is loaded in the background.
    fn change(&mut self, change: &Change) -> Result<()> {
        if let Some(path) = change.file() {
            self.memo.look_again(path);
        }
        self.session.change(change)?;
        self.changes += 1;
        self.request();
        Ok(())
    }

    fn move_camera(&mut self, act: impl FnOnce(&mut Orbit)) -> Result<()> {
        let Some(loaded) = &self.loaded else { return Ok(()) };
        let (centre, radius) = loaded.prepared.bounding_sphere();
        let view = view_of(self.session.shown(), (centre, radius))?;
        let mut orbit = Orbit::new(&view.camera, Bounds { centre, radius });
        act(&mut orbit);
        self.last_motion = Some(Instant::now());
        self.change(&Change::Camera(Some(orbit.camera())))
    }

    /// Asks for what is wanted, if that is another than what was asked for last: for a draft of it first, where that can be.
    fn request(&mut self) {
        let scene = self.session.wanted().clone();
        // Where a file cannot be read there is no key, and asking for it tells why.
        let key = self.key();
        if key.is_some() && self.requested == key {
            return;
        }
        let before = self.loaded.as_ref().map(|loaded| loaded.prepared.clone());
        let before = before.filter(|before| can_draft(&scene, before));
        if before.is_some() && (self.drafting_since.is_some() || self.request_after_frame) {
            // The draft that is being made is shown first: else one that moves would never be seen.
            return;
        }
        (self.requested, self.drafting_since) = (key, before.is_some().then(Instant::now));
        let (device, memo, change) = (self.device.clone(), self.memo.clone(), self.changes);
        self.loading.request(move |task| {
            let loaded = |prepared: Prepared, round: &Round, is_draft: bool| -> Result<Loaded> {
                let renderer = Arc::new(DeviceScene::new(&device, &prepared, round)?);
                Ok(Loaded { prepared: Arc::new(prepared), renderer, key, is_draft, change })
            };
            if let Some(before) = before {
                let round = memo.round(task);
                if let Some(draft) = prepare_draft(&scene, &before, &round)? {
                    task.publish(loaded(draft, &round, true)?);
                    task.rest(BEFORE_FINISHING)?;
                }
            }
            let round = memo.round(task);
            loaded(prepare(&scene, &round)?, &round, false)
        });
    }

    /// Compiles the shaders anew, and everything that is made of them; if that fails, what is shown stays.
    #[cfg(feature = "hot-reload")]
    fn reload_shaders(&mut self) {
        let scene = self.session.wanted().clone();
        let (key, change) = (self.key(), self.changes);
        (self.requested, self.drafting_since) = (key, None);
        let (device, memo) = (self.device.clone(), self.memo.clone());
        self.loading.request(move |task| {
            Observer::begin(task, "shaders");
            let round = memo.round(task);
            let prepared = prepare(&scene, &round)?;
            let renderer = crate::vulkan::hot_reload::reload(|| DeviceScene::new(&device, &prepared, &round))?;
            let (prepared, renderer) = (Arc::new(prepared), Arc::new(renderer));
            Ok(Loaded { prepared, renderer, key, is_draft: false, change })
        });
    }

    /// Shows what has been loaded meanwhile; gives whether there is anything new.
    ///
    /// # Errors
    /// The scene that the viewer was started with cannot be loaded.
    pub fn take_loaded(&mut self) -> Result<bool> {
        #[cfg(feature = "hot-reload")]
        if self.shaders.take() {
            self.reload_shaders();
        }
        let mut is_new = self.comparer.take().unwrap_or_else(|error| {
            self.tell_error(&error);
            true
        });
        while let Some(result) = self.loading.take() {
            is_new = true;
            let was_drafting = self.drafting_since.take().is_some();
            match result {
                Ok(loaded) => {
                    self.session.loaded(loaded.prepared.scene.clone());
                    let before = self.loaded.replace(loaded.clone());
                    self.is_compiled &= before.is_some_and(|before| before.renderer.shades_as(&loaded.renderer));
                    self.request_after_frame = was_drafting;
                }
                Err(Error::Cancelled) => {}
                Err(error) if self.loaded.is_none() => return Err(error),
                Err(error) => {
                    self.session.failed();
                    self.latency.failed();
                    self.requested = self.loaded.as_ref().and_then(|loaded| loaded.key);
                    self.tell_error(&error);
                }
            }
        }
        Ok(is_new)
    }

    fn tell(&mut self, text: String) {
        tracing::info!("{text}");
        self.notice = Some(Notice { text, is_error: false });
    }

    fn tell_error(&mut self, error: &Error) {
        tracing::warn!("{error}");
        self.notice = Some(Notice { text: error.to_string(), is_error: true });
    }

    /// Gives the picture this size, in pixels.
    pub fn resize(&mut self, area: Area) {
        if self.area == area {
            return;
        }
        self.area = area;
        self.handle(&Input::Set(Change::Size(area.width.max(1), area.height.max(1))));
    }

    /// When a frame is due though nothing happens: none if nothing is.
    pub fn next_frame(&self) -> Option<Instant> {
        if self.turntable {
            return Some(Instant::now());
        }
        self.last_motion.map(|last| last + SETTLING)
    }

    /// Whether the picture moves, and may be coarse. What `is_held` is being dragged.
    fn is_moving(&mut self, is_held: bool) -> bool {
        let settled = self.last_motion.is_none_or(|last| last.elapsed() >= SETTLING) && !is_held;
        if settled {
            self.last_motion = None;
        }
        !settled || self.turntable
    }

    /// Turns the turntable to where it is now.
    fn turn(&mut self) {
        if !self.turntable {
            return;
        }
        let now = Instant::now();
        let seconds = self.last_turn.replace(now).map_or(0.0, |last| (now - last).as_secs_f64());
        if let Err(error) = self.move_camera(|orbit| orbit.turntable(seconds)) {
            self.tell_error(&error);
        }
    }

    /// Draws a frame. `is_held`: the user holds something that moves the picture.
    ///
    /// # Errors
    /// Whatever Vulkan refuses.
    pub fn draw(
        &mut self,
        stage: &mut Presenter,
        size: [u32; 2],
        panel: &UiFrame,
        textures: &TexturesDelta,
        is_held: bool,
        screenshot: bool,
    ) -> Result<Option<Drawn>> {
        let start = Instant::now();
        self.turn();
        let loaded = self.loaded.clone();
        let is_draft = loaded.as_ref().is_some_and(|loaded| loaded.is_draft);
        let is_moving = (self.is_moving(is_held) || is_draft) && !screenshot;
        let view = match &loaded {
            Some(loaded) => {
                let mut view = self.view(loaded)?;
                if is_moving {
                    [view.width, view.height] = self.dynamic_resolution.moving([view.width, view.height]);
                }
                Some(view)
            }
            None => None,
        };
        if let Some(loaded) = &loaded {
            self.comparer.update(self.session.shown(), loaded, &self.device, &self.memo, is_moving)?;
        }
        let picture = loaded.as_ref().zip(view.as_ref()).map(|(loaded, view)| ShownPicture {
            renderer: &loaded.renderer,
            view,
            area: self.area,
        });
        let change = loaded.as_ref().map_or(0, |loaded| loaded.change);
        let is_awaited = loaded.is_some() && self.latency.is_awaited(change, is_draft);
        let extras = Extras { counts: !is_moving, screenshot, completion: is_awaited };
        let drawn = stage.draw(size, picture, panel, textures, extras)?;
        self.frame_was_drawn();
        if drawn.is_some() && is_awaited {
            self.latency.shown(change, is_draft, Instant::now());
            if let Some(draft) = loaded.as_ref().filter(|_| is_draft && self.record == Record::AllAndErrors) {
                self.drafts.push((self.latency.answers().len() - 1, self.seen(draft)?));
            }
        }
        if let (Some(drawn), Some(view)) = (&drawn, &view) {
            let frame = start.elapsed();
            let size = [view.width, view.height];
            if drawn.ran.iter().any(|pass| pass == "shade") {
                let full = &self.session.shown().image;
                // Drivers may compile a shader where it first runs.
                if std::mem::replace(&mut self.is_compiled, true) {
                    let time = drawn.picture_time().unwrap_or(frame);
                    self.dynamic_resolution.drawn(size, [full.width, full.height], time);
                }
            }
            tracing::debug!("{} x {} in {:.1} ms", size[0], size[1], frame.as_secs_f64() * 1e3);
            self.measured.frames += 1;
            (self.measured.frame, self.measured.size) = (frame, size);
            self.measured.ran.clone_from(&drawn.ran);
            self.measured.time(&drawn.passes);
            self.measured.counted = drawn.counted.or(self.measured.counted);
        }
        Ok(drawn)
    }

    /// What was loaded, as it is looked at now.
    fn seen(&self, loaded: &Loaded) -> Result<Arc<Prepared>> {
        let view = self.view(loaded)?;
        Ok(Arc::new(Prepared { scene: self.session.shown().clone(), view, ..(*loaded.prepared).clone() }))
    }

    /// How the scene that is shown is looked at.
    fn view(&self, loaded: &Loaded) -> Result<View> {
        let mut view = view_of(self.session.shown(), loaded.prepared.bounding_sphere())?;
        // Others have yet to be compiled.
        view.subpixels = loaded.renderer.view.subpixels;
        Ok(view)
    }

    /// What is shown as a `draft`, with finished threads, which are waited for.
    fn finished(&self, draft: &Loaded) -> Result<Loaded> {
        let round = self.memo.round(&());
        let prepared = prepare(&draft.prepared.scene, &round)?;
        let renderer = Arc::new(DeviceScene::new(&self.device, &prepared, &round)?);
        Ok(Loaded { prepared: Arc::new(prepared), renderer, is_draft: false, ..draft.clone() })
    }

    /// Saves what is shown, as `threadlight render` would make it.
    fn save_picture(&mut self, path: &Path) -> Result<()> {
        let format = Format::of(path)?;
        output::check_writable(path)?;
        let Some(loaded) = self.loaded.clone() else {
            return Err(Error::input("the picture", "has not been loaded yet", "wait until it is shown"));
        };
        let loaded = if loaded.is_draft { self.finished(&loaded)? } else { loaded };
        let mut renderer = (*loaded.renderer).clone();
        renderer.view = self.view(&loaded)?;
        let wanted = Wanted { radiance: format == Format::Exr, display: format == Format::Png, geometry: false };
        let rendering = renderer.render(wanted, 1)?;
        let (width, height) = (renderer.view.width, renderer.view.height);
        let alpha = self.session.shown().image.background == Background::None;
        match format {
            Format::Png => output::write_png(path, width, height, &rendering.display, alpha)?,
            Format::Exr => {
                let header = rendering.exr_header(&loaded.prepared, &self.device.description().name);
                output::write_exr(path, width, height, &rendering.radiance, alpha, &header)?;
            }
        }
        self.tell(format!("saved {}", path.display()));
        Ok(())
    }
}
