//! Tells when a shader's source has changed (feature `hot-reload`).
use crate::vulkan::hot_reload;
use notify::{EventKind, RecommendedWatcher, RecursiveMode, Watcher};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Watches the folder of the shaders' sources.
pub struct ShaderWatch {
    changed: Arc<AtomicBool>,
    /// Watches until it is dropped.
    _watcher: Option<RecommendedWatcher>,
}

impl ShaderWatch {
    /// Begins to watch; `wake` is called when something changes. A system that cannot watch is reported, and otherwise no matter.
    pub fn new(wake: impl Fn() + Send + 'static) -> Self {
        let changed = Arc::new(AtomicBool::new(false));
        let flag = changed.clone();
        let on_event = move |event: notify::Result<notify::Event>| {
            let writes = |kind: &EventKind| kind.is_modify() || kind.is_create() || kind.is_remove();
            if event.is_ok_and(|event| writes(&event.kind)) {
                flag.store(true, Ordering::Relaxed);
                wake();
            }
        };
        let watcher = notify::recommended_watcher(on_event).and_then(|mut watcher| {
            watcher.watch(hot_reload::sources(), RecursiveMode::Recursive)?;
            Ok(watcher)
        });
        let watcher = watcher.inspect_err(|cause| tracing::warn!("{}: {cause}", hot_reload::sources().display()));
        Self { changed, _watcher: watcher.ok() }
    }

    /// Whether something has changed since this was asked last.
    pub fn take(&self) -> bool {
        self.changed.swap(false, Ordering::Relaxed)
    }
}
