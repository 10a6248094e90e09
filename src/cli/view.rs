//! `threadlight view`: a window to look at a scene and change it.
use super::scene_flags::{MachineFlags, SceneFlags, one_of, takes_methods};
use super::{cache_folder, json, none_of, signals};
use clap::builder::TypedValueParser;
use clap::value_parser;
use std::path::PathBuf;
use std::time::Duration;
use threadlight::Error;
use threadlight::low_level::files;
use threadlight::low_level::method::Method;
use threadlight::low_level::picture;
use threadlight::low_level::viewer::latency::Record;
use threadlight::low_level::viewer::{self, Ended, ViewerSettings, input};
use threadlight::low_level::vulkan::PresentMode;

const EXAMPLES: &str = "\
Examples:
  threadlight view                                      the built-in scene
  threadlight view --mesh dragon.obj --material alumina-oxide.binary --environment lebombo.hdr
  threadlight view scene.toml --present-mode mailbox
  threadlight view --frames 1 --screenshot window.png   for scripts: draw the scene, take a picture of the window, end

In the window:
  drag                 turn the camera              F, Home   frame the objects, reset the view
  right drag, Shift    move it                      T         turntable
  wheel                zoom                         + - 0     exposure
  Ctrl + drag          turn the environment         [ ]       half, twice the threads
  drop a file          material, environment,       B         background
  (not on Wayland)     mesh or scene                Escape    close the message
  Ctrl + Z             undo                         Ctrl + Y  redo (or Ctrl + Shift + Z)";

/// Opens a window to look at a scene, change it, and save picture and scene. Flags override the scene file.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES, allow_negative_numbers = true, mut_arg("method", takes_methods(Method::runs_on_gpu)))]
pub struct ViewArguments {
    #[command(flatten)]
    scene: SceneFlags,
    #[command(flatten)]
    machine: MachineFlags,
    /// When finished frames reach the screen: fifo and fifo-relaxed wait for the display, mailbox and immediate do not.
    #[arg(long, value_name = "MODE", default_value = "fifo", value_parser = present_modes())]
    present_mode: PresentMode,
    /// End after this many frames of the loaded scene (and after the replay).
    #[arg(long, value_name = "N", value_parser = value_parser!(u64).range(1..))]
    frames: Option<u64>,
    /// Write what the window shows in the last of these frames, as .png; an error if the window is closed before.
    #[arg(long, value_name = "FILE")]
    screenshot: Option<PathBuf>,
    /// Do what this file says as if the user did it: one event a line, in JSON.
    #[arg(long, value_name = "FILE")]
    replay: Option<PathBuf>,
    /// End with an error where one "wait" of the replay takes longer.
    #[arg(long, value_name = "SECONDS", default_value_t = 600, value_parser = value_parser!(u64).range(1..))]
    replay_limit: u64,
    /// Write how long inputs waited for the frame that shows them, as JSON.
    #[arg(long, value_name = "FILE")]
    stats: Option<PathBuf>,
    /// Render at the end how far the drafts that were shown are from what they stood for, for --stats.
    #[arg(long, requires = "stats")]
    stats_error: bool,
}

/// Size of the picture where neither scene nor flag names one: with the panel, 1280 x 720.
const SIZE: (u32, u32) = (980, 720);

impl ViewArguments {
    pub fn run(self) -> anyhow::Result<()> {
        self.screenshot.as_deref().map_or(Ok(()), picture::check_png)?;
        files::check_all_writable(self.screenshot.iter().chain(&self.stats))?;
        let mut scene = self.scene.scene()?;
        let read = self.scene.scene.iter().chain(&self.replay);
        files::check_not_read(self.screenshot.iter().chain(&self.stats), read.chain(&scene.files()))?;
        if self.scene.scene.is_none() && self.scene.size.is_none() {
            (scene.image.width, scene.image.height) = SIZE;
        }
        let replay = self.replay.as_deref().map(input::read_replay).transpose()?.unwrap_or_default();
        let record = match (&self.stats, self.stats_error) {
            (None, _) => Record::Latest,
            (Some(_), false) => Record::All,
            (Some(_), true) => Record::AllAndErrors,
        };
        let settings = ViewerSettings {
            scene,
            cache: cache_folder(self.machine.device.no_cache),
            device: self.machine.device.device,
            validate: self.machine.validate,
            present_mode: self.present_mode,
            frames: self.frames,
            screenshot: self.screenshot,
            replay,
            replay_limit: Duration::from_secs(self.replay_limit),
            record,
        };
        let Ended { messages, stats, failures, missing_screenshot } =
            viewer::run(settings, |cancel| signals::next_does(move || cancel.cancel()))?;
        if let Some((path, stats)) = self.stats.as_deref().zip(stats) {
            files::write_whole(path, json("--stats", &stats)?.as_bytes())?;
        }
        none_of(&messages)?;
        // Whoever sits before the window has been told.
        if let Some((replay, first)) = self.replay.as_deref().zip(failures.first()) {
            let problem = format!("{} of what it asks for could not be done, the first: {first}", failures.len());
            return Err(Error::in_file(replay, problem, "the log has all of them").into());
        }
        if let Some(path) = missing_screenshot {
            let problem = "the window was closed before this picture of it was taken";
            anyhow::bail!("{}: {problem}; leave \"quit\" out of the replay, or ask for fewer --frames", path.display());
        }
        Ok(())
    }
}

/// The name of a present mode.
fn present_modes() -> impl TypedValueParser<Value = PresentMode> {
    one_of(PresentMode::ALL.map(|mode| (mode.name(), mode)))
}
