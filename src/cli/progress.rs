//! The progress bar of a long computation, which a signal cancels.
use super::{say, signals};
use indicatif::{ProgressBar, ProgressStyle};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use threadlight::low_level::progress::Observer;

/// A bar on a terminal (nothing elsewhere); Ctrl-C and SIGTERM cancel what it shows.
pub struct TerminalProgress {
    bar: ProgressBar,
    cancelled: Arc<AtomicBool>,
}

impl TerminalProgress {
    /// A bar called `name` that counts parts, hidden until something happens.
    pub fn new(name: &'static str) -> anyhow::Result<Self> {
        Self::of(name, "parts")
    }

    /// A bar called `name` that counts `units`, hidden until something happens.
    pub fn of(name: &'static str, units: &str) -> anyhow::Result<Self> {
        let cancelled = Arc::new(AtomicBool::new(false));
        let flag = cancelled.clone();
        signals::next_does(move || {
            flag.store(true, Ordering::Relaxed);
            say(format_args!("stopping after what runs now; Ctrl-C again stops at once"));
        });
        let style =
            ProgressStyle::with_template(&format!("{{prefix}} {{wide_bar}} {{pos}}/{{len}} {units}, {{eta}} left"))?;
        let bar = ProgressBar::no_length().with_style(style).with_prefix(name);
        Ok(Self { bar, cancelled })
    }

    /// Takes the bar off the terminal.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

impl Observer for TerminalProgress {
    fn begin(&self, what: &str) {
        self.bar.reset();
        self.bar.unset_length();
        self.bar.set_prefix(what.to_owned());
    }

    fn progress(&self, done: usize, total: usize) {
        self.bar.set_length(total as u64);
        self.bar.set_position(done as u64);
    }

    fn cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }
}
