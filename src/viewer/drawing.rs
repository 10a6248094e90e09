//! The frames of the session, and what is saved and told of them.
use super::change::Change;
use super::comparison::{Other, compare_with};
use super::input::Input;
use super::interaction::{UnsavedPicture, Viewer};
use super::latency::{Answer, Latency, Record, Stats};
use super::loaded::Loaded;
use super::presenter::{Drawn, Extras, Presenter, ShownPicture};
use crate::files;
use crate::passes::{Area, SHADE_PASS, View};
use crate::picture::Format;
use crate::pipeline::Wanted;
use crate::prepare::view_of;
use crate::scene::Scene;
use crate::vulkan::UiFrame;
use crate::{Error, Result};
use egui::TexturesDelta;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Where there is no memory for a geometry cache of this size, there is none for pictures.
const LEAST_SIDE: u32 = 64;

impl Viewer {
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

    /// From where and how what is shown is looked at, at full resolution; none while nothing is.
    pub fn shown_view(&self) -> Option<View> {
        let loaded = self.loaded.as_ref()?;
        view_of(self.session.shown(), loaded.sphere).ok()
    }

    /// Gives the picture this size, in pixels.
    pub fn resize(&mut self, area: Area) {
        if self.area == area {
            return;
        }
        self.area = area;
        self.handle(&Input::Set(Change::Size(area.width.max(1), area.height.max(1))));
    }

    /// Turns the turntable to where it is now.
    fn turn(&mut self) {
        let Some(seconds) = self.motion.turned_s() else { return };
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
        presenter: &mut Presenter,
        size: [u32; 2],
        panel: &UiFrame,
        textures: &TexturesDelta,
        is_held: bool,
        screenshot: bool,
    ) -> Result<Option<Drawn>> {
        let start = Instant::now();
        self.turn();
        let loaded = self.loaded.clone();
        let is_draft = loaded.as_ref().is_some_and(Loaded::is_draft);
        let is_moving = self.motion.is_moving(is_held) && !screenshot;
        let view = match &loaded {
            Some(loaded) => {
                // The window scales it.
                let mut view = self.view(loaded)?.fit(self.longest_side);
                while let Err(error) = loaded.device_scene.check_size(&view) {
                    self.shrink(&view, error)?;
                    view = view.fit(self.longest_side);
                }
                if is_moving {
                    [view.width, view.height] = self.dynamic_resolution.moving([view.width, view.height]);
                }
                Some(view)
            }
            None => None,
        };
        if let Some(loaded) = &loaded {
            self.comparer.update(self.session.shown(), loaded, &self.device, &self.memo, is_moving || is_draft)?;
        }
        let picture = loaded.as_ref().zip(view.as_ref()).map(|(loaded, view)| ShownPicture {
            device_scene: &loaded.device_scene,
            view,
            area: self.area,
            is_compiled: self.is_compiled,
        });
        let change = loaded.as_ref().map_or(0, |loaded| loaded.change);
        let is_awaited = loaded.is_some() && self.latency.is_awaited(change, is_draft);
        let extras = Extras { counts: !is_moving, screenshot, completion: is_awaited };
        let mut drawn = presenter.draw(size, picture, panel, textures, extras)?;
        self.frame_was_drawn();
        if let (Some(view), Some(error)) = (&view, drawn.as_mut().and_then(|drawn| drawn.lack.take())) {
            self.shrink(view, error)?;
            return Ok(None);
        }
        if drawn.is_some() && is_awaited {
            self.latency.shown(change, is_draft, Instant::now());
            if let Some(draft) = loaded.as_ref().filter(|_| is_draft && self.record == Record::AllAndErrors) {
                let seen = Arc::new(draft.seen_as(self.session.shown().clone())?);
                self.drafts.push((self.latency.answers().len() - 1, seen));
            }
        }
        if let (Some(drawn), Some(view)) = (&drawn, &view) {
            self.note(drawn, [view.width, view.height], start.elapsed());
        }
        Ok(drawn)
    }

    /// Notes what is known of a frame whose picture has this `size`, which took `time` in all.
    fn note(&mut self, drawn: &Drawn, size: [u32; 2], time: Duration) {
        self.is_compiled |= drawn.ran.iter().any(|pass| pass == SHADE_PASS);
        if let Some(cost) = drawn.cost {
            let full = &self.session.shown().image;
            self.dynamic_resolution.drawn(cost.size, [full.width, full.height], cost.time);
        }
        tracing::debug!("{} x {} in {:.1} ms", size[0], size[1], time.as_secs_f64() * 1e3);
        self.measured.frames += 1;
        (self.measured.frame, self.measured.size) = (time, size);
        self.measured.ran.clone_from(&drawn.ran);
        self.measured.time(&drawn.passes);
        self.measured.counted = drawn.counted.or(self.measured.counted);
    }

    /// A frame of `view` is too large for the device, or there is too little memory for it: later ones have a quarter of its pixels at most.
    fn shrink(&mut self, view: &View, error: Error) -> Result<()> {
        let [width, height] = view.cache_size();
        self.longest_side = width.max(height) / 2;
        if self.longest_side < LEAST_SIDE {
            return Err(error);
        }
        self.tell_error(&error);
        Ok(())
    }

    /// How the scene that is shown is looked at.
    pub(super) fn view(&self, loaded: &Loaded) -> Result<View> {
        let mut view = view_of(self.session.shown(), loaded.sphere)?;
        // Others have yet to be compiled.
        view.subpixels = loaded.device_scene.view.subpixels;
        Ok(view)
    }

    /// Saves the picture of what is wanted, as `threadlight render` would make it: now, or when its threads are finished.
    pub(super) fn save_picture(&mut self, path: &Path) -> Result<()> {
        Format::of(path)?;
        files::check_writable(path)?;
        files::check_not_read([path], &self.session.wanted().files())?;
        let (path, scene) = (path.to_owned(), self.session.wanted().clone());
        self.to_save.push(UnsavedPicture { path, scene, key: self.requests.wanted });
        self.save_finished(self.is_loading() || self.has_new_draft());
        if let Some(UnsavedPicture { path, .. }) = self.to_save.last() {
            self.tell(format!("{} is saved when its threads are finished", path.display()));
        }
        Ok(())
    }

    /// Saves the pictures that are finished. Those that never will be are told: only what is wanted, and only if that `is_coming`.
    pub(super) fn save_finished(&mut self, is_coming: bool) {
        let loaded = self.loaded.clone().filter(|loaded| !loaded.is_draft());
        for unsaved in std::mem::take(&mut self.to_save) {
            let UnsavedPicture { path, scene, key } = &unsaved;
            let result = match &loaded {
                Some(loaded) if key.is_some() && loaded.key == *key => self.save_as(path, scene, loaded),
                _ if is_coming && *key == self.requests.wanted => {
                    self.to_save.push(unsaved);
                    continue;
                }
                _ => {
                    let problem =
                        "is not saved: the scene was changed, or could not be made, before its threads were finished";
                    Err(Error::input(path.display(), problem, "save it again"))
                }
            };
            if let Err(error) = result {
                self.tell_error(&error);
            }
        }
    }

    /// Saves what was `loaded`, looked at as `scene` says.
    fn save_as(&mut self, path: &Path, scene: &Scene, loaded: &Loaded) -> Result<()> {
        let format = Format::of(path)?;
        let mut device_scene = (*loaded.device_scene).clone();
        device_scene.view = view_of(scene, loaded.sphere)?;
        let wanted = Wanted { radiance: format == Format::Exr, display: format == Format::Png, geometry: false };
        let rendering = device_scene.render(wanted, 1)?;
        let header = rendering.exr_header(&loaded.prepared, &self.device.description().name);
        rendering.write(path, &scene.image, &header)?;
        self.tell_saved(path);
        Ok(())
    }
}
