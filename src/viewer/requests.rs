//! What was asked for, and what is being made of it in the background.
use super::latest_job::LatestJob;
use super::loaded::Made;
use crate::memo::Key;
use crate::pipeline::DeviceScene;
use std::sync::Arc;
use std::time::Instant;

/// What was asked for, and what is being made of it.
pub(super) struct Requests {
    /// Loads what is wanted, by drafts first where there can be any.
    pub(super) loading: LatestJob<Made>,
    /// Makes what drafts need before there is one.
    pub(super) getting_ready: LatestJob<DeviceScene>,
    /// Keeps that for them.
    pub(super) ready: Option<DeviceScene>,
    /// What is wanted is made of this; none where a file cannot be read.
    pub(super) wanted: Option<Key>,
    /// What was asked for last.
    pub(super) requested: Option<Key>,
    /// Since when a draft is being made of what was asked for last; none if it is there, or there is none.
    pub(super) drafting_since: Option<Instant>,
    /// Whether more may be wanted than the draft that the next frame shows. It is asked for then: making it now would hold that frame up.
    pub(super) request_after_frame: bool,
}

impl Requests {
    /// Nothing is being made yet. `wake` is called when there is something new to be drawn.
    pub(super) fn new(wake: &Arc<impl Fn() + Send + Sync + 'static>) -> Self {
        let [wake_when_loaded, wake_when_ready] = [wake.clone(), wake.clone()];
        Self {
            loading: LatestJob::new("loading", move || wake_when_loaded()),
            getting_ready: LatestJob::new("getting ready", move || wake_when_ready()),
            ready: None,
            wanted: None,
            requested: None,
            drafting_since: None,
            request_after_frame: false,
        }
    }

    /// Makes nothing any more: [`LatestJob::close`].
    pub(super) fn close(&self) {
        self.loading.close();
        self.getting_ready.close();
    }
}
