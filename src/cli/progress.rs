//! The progress bar of a long computation, which a signal cancels.
use super::{say, signals};
use indicatif::{HumanDuration, ProgressBar, ProgressState, ProgressStyle};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use threadlight::low_level::progress::Observer;

/// A bar on a terminal (nothing elsewhere); Ctrl-C and SIGTERM cancel what it shows.
pub struct TerminalProgress {
    bar: ProgressBar,
    /// How it looks where it is known how many parts there are, and until then.
    counted: ProgressStyle,
    uncounted: ProgressStyle,
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
        let counted =
            ProgressStyle::with_template(&format!("{{prefix}} {{wide_bar}} {{pos}}/{{len}} {units}{{left}}"))?;
        // The first parts are no measure of the others: caches are cold, and threads begin.
        let left = |state: &ProgressState, text: &mut dyn std::fmt::Write| {
            if state.elapsed() > Duration::from_secs(2) {
                let _ = write!(text, ", {} left", HumanDuration(state.eta()));
            }
        };
        let counted = counted.with_key("left", left);
        let uncounted = ProgressStyle::with_template("{prefix} {spinner}")?;
        let bar = ProgressBar::no_length().with_style(uncounted.clone()).with_prefix(name);
        Ok(Self { bar, counted, uncounted, cancelled })
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
        self.bar.set_style(self.uncounted.clone());
        self.bar.set_prefix(what.to_owned());
    }

    fn progress(&self, done: usize, total: usize) {
        if self.bar.length().is_none() {
            self.bar.set_style(self.counted.clone());
        }
        self.bar.set_length(total as u64);
        self.bar.set_position(done as u64);
    }

    fn cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }
}
