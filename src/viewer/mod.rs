//! The interactive viewer (feature `viewer`).
//!
//! | what | module | |
//! |---|---|---|
//! | what the user does, as data | [`input`] | pure |
//! | the camera's orbit | [`orbit`] | pure |
//! | what can be changed of a scene | [`change`] | pure |
//! | the scene that is asked for, and the one that is seen | [`session`] | pure |
//! | undo and redo | [`history`] | pure |
//! | what moves the picture | [`motion`] | pure |
//! | how coarse a moving picture is | [`dynamic_resolution`] | pure |
//! | loading and making in the background | [`latest_job`] | threads |
//! | another picture of the same view, and the difference | [`comparison`] | |
//! | when that is made anew | [`comparer`] | |
//! | the threads of what is under the cursor | [`threads_seen`] | egui |
//! | plots of the material | [`plots`] | threads |
//! | what frames have shown of themselves | [`measured`] | pure |
//! | how long inputs wait to be seen | [`latency`] | pure |
//! | what was asked for and is being made | `requests` | threads |
//! | what inputs do | [`interaction`] | |
//! | what is made for them | `making` | |
//! | the frames that follow | `drawing` | |
//! | what is shown and set beside the picture | `panel` | egui |
//! | frames into the window | [`presenter`] | Vulkan, by the frame graph |
//! | where the pointer is, and what it drags | `pointer` | pure |
//! | what keys ask for | `keyboard` | pure |
//! | when inputs of a replay have their turn | `script` | pure |
//! | the window | `window` | winit |

pub mod change;
pub mod comparer;
pub mod comparison;
mod drawing;
pub mod dynamic_resolution;
pub mod history;
pub mod input;
pub mod interaction;
mod keyboard;
pub mod latency;
pub mod latest_job;
pub mod loaded;
mod making;
pub mod measured;
pub mod motion;
pub mod orbit;
mod panel;
pub mod plots;
mod pointer;
pub mod presenter;
mod requests;
mod script;
pub mod session;
#[cfg(feature = "hot-reload")]
mod shader_watch;
pub mod threads_seen;
mod window;
#[cfg(test)]
mod window_tests;

use crate::scene::Scene;
use crate::vulkan::PresentMode;
use crate::{Error, Result};
use input::Input;
use latency::{Record, Stats};
use std::path::{Path, PathBuf};
use std::time::Duration;
use winit::event_loop::{EventLoop, EventLoopProxy};

/// What the viewer is started with.
#[derive(Clone, Debug, Default)]
pub struct ViewerSettings {
    /// What is looked at first; its image is as large as the picture in the window.
    pub scene: Scene,
    /// Vulkan device: index or part of its name.
    pub device: Option<String>,
    /// Whether the validation layer is on; any message is an error at the end.
    pub validate: bool,
    /// Folder for what takes long to make.
    pub cache: Option<PathBuf>,
    /// How frames reach the screen.
    pub present_mode: PresentMode,
    /// Ends after so many frames of the loaded scene, and of the end of the replay.
    pub frames: Option<u64>,
    /// Writes what the window shows in the last of these (or the first, if none are asked for).
    pub screenshot: Option<PathBuf>,
    /// What is done as if the user did it.
    pub replay: Vec<Input>,
    /// The longest that a `"wait"` of it may take.
    pub replay_limit: Duration,
    /// What to record of how long inputs wait to be seen.
    pub record: Record,
}

/// What a session leaves.
pub struct Ended {
    /// The validation layer's messages.
    pub messages: Vec<String>,
    /// How long inputs waited, if all were to be recorded.
    pub stats: Option<Stats>,
    /// What was asked for and could not be done, as the user was told.
    pub failures: Vec<String>,
    /// Where the picture of the window was to be written, if the window was closed before it was taken.
    pub missing_screenshot: Option<PathBuf>,
}

/// Ends a viewer from another thread.
pub struct Cancel(EventLoopProxy<window::Wake>);

impl Cancel {
    /// Ends it, as [`Error::Cancelled`].
    pub fn cancel(&self) {
        // One that has ended needs no more.
        let _ = self.0.send_event(window::Wake::Cancel);
    }
}

/// Opens a window and runs until it is closed, or cancelled by what `take_cancel` is given.
///
/// # Errors
/// No window system, no device that presents to it, a scene that cannot be loaded; cancelled, or a device or a window system that fails, or a
/// screenshot that cannot be written. The scene is kept if it was edited, and the log says where.
pub fn run(settings: ViewerSettings, take_cancel: impl FnOnce(Cancel)) -> Result<Ended> {
    let folder = settings.cache.clone().unwrap_or_else(std::env::temp_dir);
    let mut event_loop = EventLoop::<window::Wake>::with_user_event();
    // Tests run on threads of their own.
    #[cfg(all(test, target_os = "linux"))]
    winit::platform::x11::EventLoopBuilderExtX11::with_any_thread(&mut event_loop, true);
    let event_loop = event_loop.build()?;
    take_cancel(Cancel(event_loop.create_proxy()));
    let mut app = window::App::new(settings, event_loop.create_proxy());
    let ended = event_loop.run_app(&mut app);
    let window::App { result, messages, stats, edited, failures, missing_screenshot, .. } = app;
    if let Some(scene) = edited.filter(|_| ended.is_err() || result.is_err()) {
        keep(&scene, &folder);
    }
    result?;
    ended?;
    let messages = messages.map(|messages| messages.all()).unwrap_or_default();
    Ok(Ended { messages, stats, failures, missing_screenshot })
}

/// Keeps a `scene` whose viewer fails or is cancelled, in a new file of `folder`.
fn keep(scene: &Scene, folder: &Path) {
    let keep = || -> Result<PathBuf> {
        let unwritable = |cause| Error::unwritable(folder, cause);
        // Early on nothing was kept yet, and there is no folder.
        std::fs::create_dir_all(folder).map_err(unwritable)?;
        // Another viewer may end, too, and in a folder that users share a name that can be told beforehand may be a link of somebody else's.
        let file =
            tempfile::Builder::new().prefix("edited-").suffix(".toml").tempfile_in(folder).map_err(unwritable)?;
        scene.save(file.path())?;
        let path = file.into_temp_path();
        path.keep().map_err(|cause| unwritable(cause.error))
    };
    match keep() {
        Ok(path) => tracing::warn!("the scene as it was edited is kept: threadlight view {}", path.display()),
        Err(error) => tracing::warn!("the scene as it was edited is lost: {error}"),
    }
}

/// What the window system refuses. Errors of winit begin with the place in its source.
fn failed(cause: impl std::fmt::Display) -> Error {
    let cause = cause.to_string();
    let reason = cause.strip_prefix("os error at ").and_then(|rest| rest.split_once(": ")).map(|(_, reason)| reason);
    Error::Window { cause: reason.unwrap_or(&cause).trim_end_matches('.').to_owned() }
}
