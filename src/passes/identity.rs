//! Tells what passes are made of apart, so that a pass whose meshes, tables or maps were exchanged runs again.
use std::sync::atomic::{AtomicU64, Ordering};

/// Different from every other one that is [`Identity::new`]; copies are the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Identity(u64);

impl Identity {
    /// One that nothing has had before.
    #[allow(clippy::new_without_default)] // Defaults are all alike; these never are.
    pub fn new() -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        Self(NEXT.fetch_add(1, Ordering::Relaxed))
    }
}
