//! The ways out: Ctrl-C, and SIGTERM, which schedulers and `timeout` send. They end the program with exit code 130, or do first what a
//! command asks for.
use std::io;
use std::sync::{Mutex, PoisonError};

type Act = Box<dyn FnOnce() + Send>;

/// What the next signal does; it ends the program if there is nothing.
static ACT: Mutex<Option<Act>> = Mutex::new(None);

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
    *ACT.lock().unwrap_or_else(PoisonError::into_inner) = Some(Box::new(act));
}

fn act() {
    match ACT.lock().unwrap_or_else(PoisonError::into_inner).take() {
        Some(act) => act(),
        // Without what other threads still use being torn down first.
        #[cfg(unix)]
        None => signal_hook::low_level::exit(130),
        #[cfg(not(unix))]
        None => std::process::exit(130),
    }
}
