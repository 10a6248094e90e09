//! The ways out: Ctrl-C, and SIGTERM, which schedulers and `timeout` send. They end the program with exit code 130, or do first what a
//! command asks for.
use std::io;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

type Act = Box<dyn FnOnce() + Send>;

/// Signals that follow each other so soon are one: `timeout` sends its own to the program, and again to its process group.
const AT_ONCE: Duration = Duration::from_millis(100);

/// What signals do.
struct Listener {
    /// What the next one does; it ends the program if there is nothing.
    act: Option<Act>,
    /// When the last one came.
    last: Option<Instant>,
}

static LISTENER: Mutex<Listener> = Mutex::new(Listener { act: None, last: None });

fn listener() -> MutexGuard<'static, Listener> {
    LISTENER.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Listens from now on.
#[cfg(unix)]
pub fn listen() -> io::Result<()> {
    use signal_hook::consts::{SIGINT, SIGTERM};
    let mut signals = signal_hook::iterator::Signals::new([SIGINT, SIGTERM])?;
    std::thread::Builder::new()
        .name("signals".to_owned())
        .spawn(move || signals.forever().for_each(|_| act()))
        .map(drop)
}

/// Listens from now on.
#[cfg(not(unix))]
pub fn listen() -> io::Result<()> {
    ctrlc::set_handler(act).map_err(io::Error::other)
}

/// Has the next signal do this. The one after that ends the program: for those who do not want to wait.
pub fn next_does(act: impl FnOnce() + Send + 'static) {
    listener().act = Some(Box::new(act));
}

fn act() {
    let answer = listener().answer(Instant::now(), Box::new(end));
    answer();
}

/// Ends the program, without what other threads still use being torn down first.
fn end() {
    #[cfg(unix)]
    signal_hook::low_level::exit(130);
    #[cfg(not(unix))]
    std::process::exit(130);
}

impl Listener {
    /// What a signal that comes `now` does: what was asked for, nothing if it only repeats the one before, or `end`.
    fn answer(&mut self, now: Instant, end: Act) -> Act {
        let repeats = self.last.replace(now).is_some_and(|last| now - last < AT_ONCE);
        match self.act.take() {
            Some(act) => act,
            None if repeats => Box::new(|| ()),
            None => end,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    #[test]
    fn the_second_signal_ends_the_program_if_it_is_no_echo_of_the_first() {
        let done = Arc::new(Mutex::new(Vec::new()));
        let does = |what: &'static str| -> Act {
            let done = done.clone();
            Box::new(move || done.lock().unwrap().push(what))
        };
        let mut listener = Listener { act: Some(does("cancel")), last: None };
        let start = Instant::now();
        for after_ms in [0, 1, 500, 501] {
            listener.answer(start + Duration::from_millis(after_ms), does("end"))();
        }
        assert_eq!(*done.lock().unwrap(), ["cancel", "end"]);
        // What is asked for later is not lost to an echo either.
        listener.act = Some(does("cancel"));
        listener.answer(start + Duration::from_millis(502), does("end"))();
        assert_eq!(*done.lock().unwrap(), ["cancel", "end", "cancel"]);
    }
}
