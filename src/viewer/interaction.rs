//! The viewer: what inputs do to the session. What follows is in `making.rs` and `drawing.rs`. Knows nothing of the window system.
use super::change::{Change, most_count};
use super::comparer::Comparer;
use super::comparison::Wipe;
use super::dynamic_resolution::DynamicResolution;
use super::history::History;
use super::input::{DragAction, Dropped, Input, change_of_dropped};
use super::keyboard;
use super::latency::{Latency, Record};
use super::loaded::Loaded;
use super::measured::Measured;
use super::motion::Motion;
use super::orbit::{Orbit, environment_turn_deg};
use super::plots::Plotter;
use super::requests::Requests;
use super::session::{Edit, Session};
use crate::files;
use crate::memo::{Key, Memo};
use crate::passes::Area;
use crate::prepare::{Prepared, view_of};
use crate::scene::{Background, Scene, within};
use crate::vulkan::Device;
use crate::{Error, Result};
use glam::DVec2;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// Something to tell the user.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Notice {
    /// In one sentence.
    pub text: String,
    /// Whether it is that something could not be done.
    pub is_error: bool,
    /// Number of the latest change when it was told.
    pub(super) change: u64,
}

/// A picture that is to be saved.
pub(super) struct UnsavedPicture {
    pub(super) path: PathBuf,
    /// What was wanted when that was asked for.
    pub(super) scene: Scene,
    /// What it is made of: [`Requests::wanted`].
    pub(super) key: Option<Key>,
}

/// The viewer.
pub struct Viewer {
    /// The scene that is asked for, and the one that is seen.
    pub session: Session,
    /// What of it can be undone.
    pub history: History,
    /// Where the picture is in the window.
    pub area: Area,
    /// What was last told.
    pub notice: Option<Notice>,
    /// What could not be done so far, in order.
    pub failures: Vec<String>,
    /// What frames have shown of themselves.
    pub measured: Measured,
    /// What moves the picture.
    pub motion: Motion,
    /// What the picture is compared with.
    pub comparer: Comparer,
    /// Plots of the material.
    pub plotter: Plotter,
    /// Where the cursor is in the window, in pixels; none while it is elsewhere.
    pub cursor: Option<[f64; 2]>,
    pub(super) loaded: Option<Loaded>,
    pub(super) requests: Requests,
    /// Pictures that are to be saved when their threads are finished.
    pub(super) to_save: Vec<UnsavedPicture>,
    /// How long inputs wait to be seen.
    pub latency: Latency,
    /// Number of the latest change.
    pub(super) changes: u64,
    pub(super) record: Record,
    /// The drafts that were shown, where they are to be measured: each with the number of the answer that it was.
    pub(super) drafts: Vec<(usize, Arc<Prepared>)>,
    pub(super) dynamic_resolution: DynamicResolution,
    /// Geometry caches have no longer sides, since the device has no such images or had no memory for one.
    pub(super) longest_side: u32,
    /// Whether a frame has run the shader that shades what is loaded.
    pub(super) is_compiled: bool,
    #[cfg(feature = "hot-reload")]
    pub(super) shaders: super::shader_watch::ShaderWatch,
    pub(super) device: Arc<Device>,
    pub(super) memo: Arc<Memo>,
}

impl Viewer {
    /// A viewer of `scene`, which begins to load. `wake` is called when there is something new to be drawn.
    pub fn new(scene: Scene, device: &Arc<Device>, memo: Memo, wake: impl Fn() + Send + Sync + 'static) -> Self {
        let wake = Arc::new(wake);
        let (wake_when_made, wake_for_plots) = (wake.clone(), wake.clone());
        #[cfg(feature = "hot-reload")]
        let wake_for_shaders = wake.clone();
        let area = Area { left: 0, top: 0, width: scene.image.width, height: scene.image.height };
        let mut viewer = Self {
            session: Session::new(scene),
            history: History::default(),
            area,
            notice: None,
            failures: Vec::new(),
            measured: Measured::default(),
            motion: Motion::default(),
            loaded: None,
            comparer: Comparer::new(move || wake()),
            plotter: Plotter::new(move || wake_for_plots()),
            cursor: None,
            requests: Requests::new(&wake_when_made),
            to_save: Vec::new(),
            latency: Latency::keeping(100),
            changes: 0,
            record: Record::default(),
            drafts: Vec::new(),
            dynamic_resolution: DynamicResolution::default(),
            longest_side: device.longest_target_side(),
            is_compiled: false,
            #[cfg(feature = "hot-reload")]
            shaders: super::shader_watch::ShaderWatch::new(move || wake_for_shaders()),
            device: device.clone(),
            memo: Arc::new(memo),
        };
        viewer.request();
        viewer
    }

    /// What is shown, if it has been loaded.
    pub fn loaded(&self) -> Option<&Loaded> {
        self.loaded.as_ref()
    }

    /// The device that draws.
    pub fn device(&self) -> &Device {
        &self.device
    }

    /// Does what the user asks for. Whatever goes wrong is told by a notice, and changes nothing.
    pub fn handle(&mut self, input: &Input) {
        let (start, changes) = (Instant::now(), self.changes);
        if let Err(error) = self.try_handle(input) {
            self.tell_error(&error);
        } else if self.changes > changes {
            let is_loaded = self.is_wanted(self.loaded.as_ref());
            self.latency.asked(input, start, (!is_loaded).then_some(self.changes));
        }
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
                        self.motion.moved();
                        let turned = self.session.wanted().environment.rotation_deg + environment_turn_deg(by.x, rows);
                        self.change(&Change::Rotation(turned.rem_euclid(360.0)))
                    }
                }
            }
            Input::Scroll(scroll) => self.move_camera(|orbit| orbit.zoom(*scroll)),
            Input::Key(key) => self.press(key),
            Input::Drop(path) => match change_of_dropped(path)? {
                Dropped::Change(change) => self.change(&change),
                Dropped::Scene(path) => {
                    let mut scene = Scene::load(&path)?;
                    // The window stays as large as it is.
                    (scene.image.width, scene.image.height) = (self.area.width, self.area.height);
                    scene.files().iter().for_each(|path| self.memo.look_again(path));
                    let edit = Edit::Scene(Box::new(scene.clone()));
                    self.history.record(self.session.wanted(), edit, self.changes + 1, Instant::now());
                    self.replace(scene);
                    Ok(())
                }
            },
            Input::Set(change) => self.change(change),
            Input::SavePicture(path) => self.save_picture(path),
            Input::SaveScene(path) => {
                Scene::FILES.format_of(path)?;
                files::check_not_read([path], &self.session.wanted().files())?;
                self.session.wanted().save(path)?;
                self.tell_saved(path);
                Ok(())
            }
            Input::Move(at) => {
                self.cursor = Some(*at);
                Ok(())
            }
            Input::Compare(other) => {
                other.iter().try_for_each(|other| other.check(self.session.wanted()))?;
                self.comparer.other.clone_from(other);
                Ok(())
            }
            Input::Wipe(part) => {
                self.comparer.wipe = Wipe::at(within("wipe", *part, &(0.0..=1.0))?);
                Ok(())
            }
            Input::HeatMap(shows) => {
                self.comparer.shows_heat_map = *shows;
                Ok(())
            }
            Input::Undo | Input::Redo => {
                let step = if *input == Input::Undo { History::undo } else { History::redo };
                if let Some(scene) = step(&mut self.history, self.session.wanted()) {
                    self.replace(scene);
                }
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
                self.motion.toggle_turntable();
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
                let method = shading.method;
                let count = shading.count();
                let count = if key == "[" { count / 2 } else { count.saturating_mul(2) };
                let count = count.clamp(1, most_count(method, self.session.wanted()));
                self.change(&Change::Threads(Some(count)))
            }
            "escape" => {
                self.notice = None;
                Ok(())
            }
            // Others do nothing.
            _ if keyboard::is_key(key) => Ok(()),
            _ => {
                let remedy =
                    "use a letter in lower case, a digit or another character, \"space\", \"home\" or \"escape\"";
                Err(Error::input(format!("key \"{key}\""), "is not known", remedy))
            }
        }
    }

    /// Makes a change; what it needs is loaded in the background.
    pub(super) fn change(&mut self, change: &Change) -> Result<()> {
        let files = change.files();
        files.iter().for_each(|path| self.memo.look_again(path));
        if !files.is_empty() {
            self.forget_errors(self.changes + 1);
        }
        let before = self.session.wanted().clone();
        self.session.change(change, self.changes + 1)?;
        self.changes += 1;
        self.history.record(&before, Edit::Change(change.clone()), self.changes, Instant::now());
        self.request();
        Ok(())
    }

    /// Asks for another scene.
    fn replace(&mut self, scene: Scene) {
        self.changes += 1;
        self.forget_errors(self.changes);
        self.session.replace(scene, self.changes);
        self.request();
    }

    pub(super) fn move_camera(&mut self, act: impl FnOnce(&mut Orbit)) -> Result<()> {
        // What is still being loaded is to be seen by its own camera, or framed.
        let Some(loaded) = self.loaded.as_ref().filter(|_| self.session.shares_a_camera()) else { return Ok(()) };
        let view = view_of(self.session.shown(), loaded.sphere)?;
        let mut orbit = Orbit::new(&view.camera, loaded.sphere);
        act(&mut orbit);
        self.motion.moved();
        self.change(&Change::Camera(Some(orbit.camera())))
    }

    /// Says where a file is now: in which folder the program runs, a window does not show.
    pub(super) fn tell_saved(&mut self, path: &Path) {
        let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        self.tell(format!("saved {}", path.display()));
    }

    pub(super) fn tell(&mut self, text: String) {
        tracing::info!("{text}");
        self.notice = Some(Notice { text, is_error: false, change: self.changes });
    }

    /// What could not be done before the change of this number is told no more: another file was opened, or what is shown would contradict it.
    pub(super) fn forget_errors(&mut self, change: u64) {
        self.notice.take_if(|notice| notice.is_error && notice.change < change);
    }

    pub(super) fn tell_error(&mut self, error: &Error) {
        self.tell_errors(std::slice::from_ref(error));
    }

    /// What went wrong at once is one notice.
    pub(super) fn tell_errors(&mut self, errors: &[Error]) {
        let texts: Vec<_> = errors.iter().map(Error::to_string).collect();
        texts.iter().for_each(|text| tracing::warn!("{text}"));
        self.notice = Some(Notice { text: texts.join("\n"), is_error: true, change: self.changes });
        self.failures.extend(texts);
    }
}
