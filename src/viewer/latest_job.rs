//! Background work on a thread of its own: the newest request wins, what it replaces is told to stop and its results are dropped.
use std::collections::VecDeque;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crate::error::{Error, Result};
use crate::progress::Observer;

/// Progress wakes the event loop this often at most: a bar is no smoother for more.
const WAKE_INTERVAL: Duration = Duration::from_millis(40);
/// And not before the work has taken this long: a bar that flashes disturbs, and drawing it holds the work up.
const UNTOLD: Duration = Duration::from_millis(500);
/// Work that does not stop within this time of closing is left behind, as the window is to be gone within a second.
const CLOSING_TIME: Duration = Duration::from_millis(800);

/// How far a request is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Progress {
    /// What is being done, in a word or two.
    pub what: String,
    /// Parts that are done.
    pub done: usize,
    /// Parts that there are; 0 where that is not known.
    pub total: usize,
}

/// Work of one kind whose newest request is the only one that counts. Results are of type `T`.
///
/// Dropping it cancels the work and waits for it to end, until 800 ms after it was [closed](Self::close).
pub struct LatestJob<T> {
    shared: Arc<Shared<T>>,
    thread: Option<JoinHandle<()>>,
}

type Work<T> = Box<dyn FnOnce(&Task<T>) -> Result<T> + Send>;

struct Shared<T> {
    /// Number of the newest request: all others are cancelled.
    newest: AtomicU64,
    state: Mutex<State<T>>,
    /// There is a request, or the end.
    called: Condvar,
    wake: Box<dyn Fn() + Send + Sync>,
}

struct State<T> {
    /// Not begun yet.
    pending: Option<(u64, Work<T>)>,
    /// Number of the request that is worked on.
    running: Option<u64>,
    results: VecDeque<Result<T>>,
    progress: Option<Progress>,
    last_wake: Instant,
    /// When the work that is running was begun.
    begun: Instant,
    /// Since when no more requests are served.
    closing: Option<Instant>,
}

/// A request as the work sees it: tells whether it still counts, and hears of progress.
pub struct Task<T> {
    number: u64,
    shared: Arc<Shared<T>>,
}

impl<T: Send + 'static> LatestJob<T> {
    /// Starts a thread called `name`. `wake` is called from it when there is a result or progress: it should make the event loop look.
    ///
    /// # Panics
    /// If the system has no thread left.
    pub fn new(name: &str, wake: impl Fn() + Send + Sync + 'static) -> Self {
        let state = State {
            pending: None,
            running: None,
            results: VecDeque::new(),
            progress: None,
            last_wake: Instant::now(),
            begun: Instant::now(),
            closing: None,
        };
        let shared = Arc::new(Shared {
            newest: AtomicU64::new(0),
            state: Mutex::new(state),
            called: Condvar::new(),
            wake: Box::new(wake),
        });
        let of_thread = shared.clone();
        let thread = std::thread::Builder::new().name(name.to_owned()).spawn(move || serve(&of_thread));
        Self { shared, thread: Some(thread.expect("a thread")) }
    }

    /// Asks for `work`, in the place of whatever was asked for before and has not been [taken](Self::take).
    pub fn request(&self, work: impl FnOnce(&Task<T>) -> Result<T> + Send + 'static) {
        let mut state = self.shared.forget();
        state.pending = Some((self.shared.newest.load(Ordering::Relaxed), Box::new(work)));
        self.shared.called.notify_one();
    }

    /// Ends what was asked for, without a result.
    pub fn cancel(&self) {
        drop(self.shared.forget());
        self.shared.called.notify_one();
    }

    /// Cancels the work for good. Several that are closed before the first is dropped end within the time of one.
    pub fn close(&self) {
        self.closing_since();
    }

    /// The oldest result of the newest request that was not taken yet: what it [published](Task::publish), then what it returned.
    pub fn take(&self) -> Option<Result<T>> {
        self.shared.lock().results.pop_front()
    }

    /// How far the newest request is, while it is worked on.
    pub fn progress(&self) -> Option<Progress> {
        self.shared.lock().progress.clone()
    }

    /// Whether the newest request is still to end, or has results that were not taken.
    pub fn is_busy(&self) -> bool {
        let state = self.shared.lock();
        let newest = self.shared.newest.load(Ordering::Relaxed);
        state.pending.is_some() || state.running == Some(newest) || !state.results.is_empty()
    }
}

impl<T> LatestJob<T> {
    /// Closes it; gives when that was first done.
    fn closing_since(&self) -> Instant {
        let since = *self.shared.forget().closing.get_or_insert_with(Instant::now);
        self.shared.called.notify_one();
        since
    }
}

impl<T> Drop for LatestJob<T> {
    fn drop(&mut self) {
        let since = self.closing_since();
        let Some(thread) = self.thread.take() else { return };
        while !thread.is_finished() && since.elapsed() < CLOSING_TIME {
            std::thread::sleep(Duration::from_millis(1));
        }
        if thread.is_finished() {
            // It catches the panics of work.
            let _ = thread.join();
        } else {
            tracing::warn!("background work has not ended in {CLOSING_TIME:?} and is left behind");
        }
    }
}

impl<T> Shared<T> {
    /// Nobody holds the lock while calling what may panic.
    fn lock(&self) -> MutexGuard<'_, State<T>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Makes all requests so far old ones.
    fn forget(&self) -> MutexGuard<'_, State<T>> {
        let mut state = self.lock();
        self.newest.fetch_add(1, Ordering::Relaxed);
        state.pending = None;
        state.progress = None;
        state.results.clear();
        state
    }

    /// Keeps `result` if it is that of the newest request.
    fn keep(&self, number: u64, result: Result<T>) {
        let mut state = self.lock();
        if number == self.newest.load(Ordering::Relaxed) {
            state.results.push_back(result);
        }
    }
}

/// Works on requests, one after the other, until the end.
fn serve<T>(shared: &Arc<Shared<T>>) {
    loop {
        let mut state = shared.lock();
        let (number, work) = loop {
            if state.closing.is_some() {
                return;
            }
            match state.pending.take() {
                Some(request) => break request,
                None => state = shared.called.wait(state).unwrap_or_else(PoisonError::into_inner),
            }
        };
        (state.running, state.begun) = (Some(number), Instant::now());
        drop(state);
        let task = Task { number, shared: shared.clone() };
        // What the work leaves half done is dropped with it.
        let result = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| work(&task))).unwrap_or_else(|_| {
            Err(Error::input("background work", "ended in a fault of the program", "please report how it came about"))
        });
        shared.keep(number, result);
        let mut state = shared.lock();
        state.running = None;
        if number == shared.newest.load(Ordering::Relaxed) {
            state.progress = None;
        }
        drop(state);
        (shared.wake)();
    }
}

impl<T: Send> Task<T> {
    /// Hands in a result before the last one, such as a coarse one.
    pub fn publish(&self, result: T) {
        self.shared.keep(self.number, Ok(result));
        (self.shared.wake)();
    }

    /// Does nothing for so long: whoever asks again meanwhile does not have to wait for the rest.
    ///
    /// # Errors
    /// Cancelled.
    pub fn rest(&self, time: Duration) -> Result<()> {
        let state = self.shared.lock();
        let rested = self.shared.called.wait_timeout_while(state, time, |_| !self.cancelled());
        drop(rested.unwrap_or_else(PoisonError::into_inner));
        self.check()
    }

    fn report(&self, change: impl FnOnce(&mut Progress)) {
        let mut state = self.shared.lock();
        if self.cancelled() {
            return;
        }
        change(state.progress.get_or_insert(Progress { what: String::new(), done: 0, total: 0 }));
        let due = state.begun.elapsed() >= UNTOLD && state.last_wake.elapsed() >= WAKE_INTERVAL;
        if due {
            state.last_wake = Instant::now();
        }
        drop(state);
        if due {
            (self.shared.wake)();
        }
    }
}

impl<T: Send> Observer for Task<T> {
    fn begin(&self, what: &str) {
        self.report(|progress| *progress = Progress { what: what.to_owned(), done: 0, total: 0 });
    }

    fn progress(&self, done: usize, total: usize) {
        self.report(|progress| (progress.done, progress.total) = (done, total));
    }

    fn cancelled(&self) -> bool {
        self.number != self.shared.newest.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::AtomicUsize;
    use std::sync::mpsc;

    /// The next result; fails the test if it takes more than ten seconds.
    fn wait<T: Send + 'static>(jobs: &LatestJob<T>) -> Result<T> {
        let start = Instant::now();
        loop {
            if let Some(result) = jobs.take() {
                return result;
            }
            assert!(start.elapsed() < Duration::from_secs(10), "no result");
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    /// Works until cancelled.
    fn endless<T: Send>(task: &Task<T>) -> Result<T> {
        while !task.cancelled() {
            std::thread::sleep(Duration::from_millis(1));
        }
        Err(Error::Cancelled)
    }

    #[test]
    fn a_request_gives_its_results_in_order_and_wakes_the_loop() {
        let wakes = Arc::new(AtomicUsize::new(0));
        let count = wakes.clone();
        let jobs = LatestJob::new("test", move || {
            count.fetch_add(1, Ordering::Relaxed);
        });
        assert!(!jobs.is_busy() && jobs.take().is_none());
        jobs.request(|task| {
            task.publish(1);
            task.publish(2);
            Ok(3)
        });
        assert!(jobs.is_busy());
        for expected in 1..=3 {
            assert_eq!(wait(&jobs).unwrap(), expected);
        }
        while jobs.is_busy() {}
        assert!(jobs.take().is_none() && jobs.progress().is_none());
        assert!(wakes.load(Ordering::Relaxed) >= 3);
    }

    #[test]
    fn the_newest_request_wins_and_the_others_leave_nothing() {
        let jobs = LatestJob::new("test", || ());
        let (began, begins) = mpsc::channel();
        jobs.request(move |task| {
            task.publish(0);
            began.send(()).unwrap();
            endless(task)
        });
        begins.recv().unwrap();
        for number in 1..100 {
            jobs.request(move |_| Ok(number));
        }
        assert_eq!(wait(&jobs).unwrap(), 99);
        while jobs.is_busy() {}
        assert!(jobs.take().is_none());
    }

    #[test]
    fn what_is_cancelled_leaves_nothing_and_the_next_request_is_served() {
        let jobs = LatestJob::new("test", || ());
        jobs.request(endless);
        std::thread::sleep(Duration::from_millis(20));
        jobs.cancel();
        assert!(!jobs.is_busy());
        jobs.request(|_| Ok(5));
        assert_eq!(wait(&jobs).unwrap(), 5);
    }

    #[test]
    fn a_rest_ends_when_something_else_is_asked_for() {
        let jobs = LatestJob::new("test", || ());
        let (began, begins) = mpsc::channel();
        jobs.request(move |task| {
            began.send(()).unwrap();
            task.rest(Duration::from_secs(100))?;
            Ok(1)
        });
        begins.recv().unwrap();
        jobs.request(|task| {
            task.rest(Duration::from_millis(5))?;
            Ok(2)
        });
        assert_eq!(wait(&jobs).unwrap(), 2);
    }

    #[test]
    fn progress_is_told_while_it_lasts() {
        let jobs = LatestJob::new("test", || ());
        let (began, begins) = mpsc::channel();
        jobs.request(move |task: &Task<()>| {
            task.begin("threads");
            task.progress(3, 90);
            began.send(()).unwrap();
            endless(task)
        });
        begins.recv().unwrap();
        assert_eq!(jobs.progress(), Some(Progress { what: "threads".into(), done: 3, total: 90 }));
        jobs.cancel();
        assert_eq!(jobs.progress(), None);
    }

    #[test]
    fn errors_are_results_and_a_panic_is_an_error() {
        let jobs = LatestJob::<()>::new("test", || ());
        jobs.request(|_| Err(Error::input("x.obj", "is broken", "repair it")));
        assert_eq!(wait(&jobs).unwrap_err().to_string(), "x.obj: is broken; repair it");
        jobs.request(|_| panic!("on purpose"));
        assert!(wait(&jobs).unwrap_err().to_string().contains("fault"));
        jobs.request(|_| Ok(()));
        wait(&jobs).unwrap();
    }

    #[test]
    fn closing_ends_the_work_and_does_not_wait_for_what_will_not_end() {
        let jobs = LatestJob::<()>::new("test", || ());
        jobs.request(endless);
        std::thread::sleep(Duration::from_millis(20));
        let start = Instant::now();
        drop(jobs);
        assert!(start.elapsed() < Duration::from_millis(200));

        // Nor several of them, one after the other.
        let (ends, stuck): (Vec<_>, Vec<_>) = (0..4)
            .map(|_| {
                let (end, ends) = mpsc::channel::<()>();
                let jobs = LatestJob::<()>::new("test", || ());
                jobs.request(move |_| {
                    let _ = ends.recv();
                    Ok(())
                });
                (end, jobs)
            })
            .unzip();
        std::thread::sleep(Duration::from_millis(20));
        let start = Instant::now();
        stuck.iter().for_each(LatestJob::close);
        drop(stuck);
        assert!(start.elapsed() < Duration::from_secs(1));
        drop(ends);
    }
}
