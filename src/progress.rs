//! Long work: how it says how far it is, and how it is told to stop.

use std::sync::{Mutex, PoisonError};

use crate::error::{Error, Result};

/// Watches long work. It may be called on any thread.
pub trait Observer: Sync {
    /// What is being made from now on, in a word or two; its parts are counted from 0.
    fn begin(&self, _what: &str) {}

    /// `done` of `total` parts are finished: after `begin` never fewer than before.
    fn progress(&self, done: usize, total: usize);

    /// Whether the work is to end with [`Error::Cancelled`].
    fn cancelled(&self) -> bool;

    /// An error if the work is to end.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    fn check(&self) -> Result<()> {
        if self.cancelled() { Err(Error::Cancelled) } else { Ok(()) }
    }
}

/// Neither watches nor cancels.
impl Observer for () {
    fn progress(&self, _done: usize, _total: usize) {}
    fn cancelled(&self) -> bool {
        false
    }
}

/// Counts the parts of long work for its observer; they may end on any thread.
pub(crate) struct Parts<'a> {
    observer: &'a dyn Observer,
    done: Mutex<usize>,
    total: usize,
}

impl<'a> Parts<'a> {
    /// Tells `observer` that none of `total` is done.
    pub fn new(total: usize, observer: &'a dyn Observer) -> Self {
        observer.progress(0, total);
        Self { observer, done: Mutex::new(0), total }
    }

    /// One more is done.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub fn advance(&self) -> Result<()> {
        {
            // Held while it is told: else of two that end at once the later one might be told first.
            let mut done = self.done.lock().unwrap_or_else(PoisonError::into_inner);
            *done += 1;
            self.observer.progress(*done, self.total);
        }
        self.observer.check()
    }
}

/// Passes on whether to stop, but no progress: that of a part is not that of the whole.
pub struct OnlyCancels<'a>(pub &'a dyn Observer);

impl Observer for OnlyCancels<'_> {
    fn progress(&self, _done: usize, _total: usize) {}
    fn cancelled(&self) -> bool {
        self.0.cancelled()
    }
}
