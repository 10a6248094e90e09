//! When the other picture of a comparison is made: begins anew when the view changes, waits while it moves.
use std::sync::Arc;

use super::comparison::{Compared, Other, Wipe, compare_with};
use super::latest_job::{LatestJob, Progress};
use super::loaded::Loaded;
use crate::memo::{Key, Memo};
use crate::progress::Observer;
use crate::scene::Scene;
use crate::vulkan::Device;
use crate::{Error, Result};

/// What is compared, and what has come of it so far.
pub struct Comparer {
    /// With what the picture is compared; none for nothing.
    pub other: Option<Other>,
    /// Where the line is.
    pub wipe: Wipe,
    /// Whether the heat map is right of it, in the place of the other picture.
    pub shows_heat_map: bool,
    jobs: LatestJob<Compared>,
    /// What was compared last, or is.
    begun: Option<(Option<Key>, Scene, Other)>,
    compared: Option<Arc<Compared>>,
}

impl Comparer {
    /// Nothing is compared yet. `wake` is called when there is something new to be drawn.
    pub fn new(wake: impl Fn() + Send + Sync + 'static) -> Self {
        Self {
            other: None,
            wipe: Wipe::default(),
            shows_heat_map: false,
            jobs: LatestJob::new("comparison", wake),
            begun: None,
            compared: None,
        }
    }

    /// The latest result for what is shown.
    pub fn compared(&self) -> Option<&Arc<Compared>> {
        self.compared.as_ref()
    }

    /// Whether more is to come.
    pub fn is_busy(&self) -> bool {
        self.jobs.is_busy()
    }

    /// How far the stage that is made is.
    pub fn progress(&self) -> Option<Progress> {
        self.jobs.progress()
    }

    /// Makes nothing any more: [`LatestJob::close`].
    pub fn close(&self) {
        self.jobs.close();
    }

    /// Takes what has been made meanwhile; gives whether there is anything new.
    ///
    /// # Errors
    /// It could not be made; nothing is compared then.
    pub fn take(&mut self) -> Result<bool> {
        let mut is_new = false;
        while let Some(result) = self.jobs.take() {
            is_new = true;
            match result {
                Ok(compared) => self.compared = Some(Arc::new(compared)),
                Err(Error::Cancelled) => {}
                Err(error) => {
                    self.other = None;
                    return Err(error);
                }
            }
        }
        Ok(is_new)
    }

    /// Begins anew if what is `shown` (all of which has been `loaded`) is not what was compared, but not while it `is_moving`.
    ///
    /// # Errors
    /// Objects that no camera can frame.
    pub fn update(
        &mut self,
        shown: &Scene,
        loaded: &Loaded,
        device: &Arc<Device>,
        memo: &Arc<Memo>,
        is_moving: bool,
    ) -> Result<()> {
        let wanted = self.other.clone().map(|other| (loaded.key, shown.clone(), other));
        if self.begun.is_some() && self.begun != wanted {
            self.jobs.cancel();
            (self.begun, self.compared) = (None, None);
        }
        let Some((_, scene, other)) = wanted.clone().filter(|_| self.begun.is_none() && !is_moving) else {
            return Ok(());
        };
        let prepared = loaded.seen_as(scene)?;
        let (device, memo) = (device.clone(), memo.clone());
        self.begun = wanted;
        self.jobs.request(move |task| {
            task.begin("comparison");
            let mut last = None;
            compare_with(&prepared, &other, &device, &memo, task, &mut |compared| {
                // The last one is what the work returns.
                if let Some(before) = last.replace(compared) {
                    task.publish(before);
                }
            })?;
            last.ok_or(Error::Cancelled)
        });
        Ok(())
    }
}
