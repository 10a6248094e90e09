//! Tells objects on a device apart, so that a pass that is given others than before runs again.
use std::sync::atomic::{AtomicU64, Ordering};

/// Different from every other one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Identity(u64);

impl Identity {
    /// One that nothing has had before.
    pub(super) fn new() -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        Self(NEXT.fetch_add(1, Ordering::Relaxed))
    }
}
