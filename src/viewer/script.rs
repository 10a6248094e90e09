//! What a script asks for: inputs, each when its turn comes, frames to count, a picture to take.
use super::input::Input;
use crate::{Error, Result};
use std::collections::VecDeque;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// A window system has this long to give the window the size that a replay asks for, and is asked so often.
const RESIZE_PATIENCE: Duration = Duration::from_secs(2);
const RESIZE_INTERVAL: Duration = Duration::from_millis(20);

/// A script, as far as it was played.
#[derive(Debug)]
pub struct Script {
    replay: VecDeque<Input>,
    /// The longest that a `"wait"` may take.
    limit: Duration,
    frames_left: Option<u64>,
    /// Where the picture goes, until it is taken.
    pub screenshot: Option<PathBuf>,
    /// Until when the picture may take to get this size.
    resizing: Option<([u32; 2], Instant)>,
    /// Whether the last input has not been drawn yet: each is before the next.
    is_undrawn: bool,
    /// Until when a `"wait"` may take.
    waiting: Option<Instant>,
}

/// What whether an input's turn has come depends on.
#[derive(Clone, Copy, Debug, Default)]
pub struct State {
    /// Columns and rows of the picture in the window.
    pub size: [u32; 2],
    /// Whether a frame is to be drawn, now or later.
    pub is_frame_due: bool,
    /// Whether there is a draft that no frame has shown yet.
    pub has_new_draft: bool,
    /// Until when frames wait for a draft.
    pub draft_awaited_until: Option<Instant>,
    /// Whether something is being loaded or made that frames wait for.
    pub is_loading: bool,
    /// Whether anything is made in the background.
    pub is_busy: bool,
    /// Whether the turntable turns: it always has a next frame.
    pub turntable: bool,
}

/// What is to be done now.
#[derive(Clone, Debug, PartialEq)]
pub enum Turn {
    /// Nothing until something happens.
    Later,
    /// Nothing until this time.
    At(Instant),
    /// This, and then a frame.
    Now(Input),
    /// The program ends.
    Quit,
}

impl Script {
    /// One that plays `replay`, whose waits take no longer than `limit`, counts so many `frames`, and takes a picture: in the last of the frames, or
    /// in the first if none are to be counted.
    pub fn new(replay: &[Input], limit: Duration, frames: Option<u64>, screenshot: Option<PathBuf>) -> Self {
        Self {
            replay: replay.to_vec().into(),
            limit,
            frames_left: frames.or(screenshot.is_some().then_some(1)),
            screenshot,
            resizing: None,
            is_undrawn: true,
            waiting: None,
        }
    }

    /// What is to be done: the next input, if its turn has come.
    ///
    /// # Errors
    /// A `"wait"` that takes too long.
    pub fn next(&mut self, state: State, now: Instant) -> Result<Turn> {
        if let Some((size, until)) = self.resizing {
            if state.size != size && now < until {
                return Ok(Turn::At(now + RESIZE_INTERVAL));
            }
            self.resizing = None;
        }
        // Nor does a user see where a slider is while frames wait for a draft.
        let is_draft_awaited = state.draft_awaited_until.is_some_and(|until| now < until);
        if self.is_undrawn && state.is_frame_due || state.has_new_draft || is_draft_awaited {
            return Ok(Turn::Later);
        }
        let waits = match self.replay.front() {
            None => return Ok(Turn::Later),
            Some(Input::Quit) => return Ok(Turn::Quit),
            Some(Input::Wait) => state.is_busy || (state.is_frame_due && !state.turntable),
            // What comes next is not to change it.
            Some(Input::SavePicture(_)) => state.is_loading,
            Some(_) => false,
        };
        if waits {
            if now < *self.waiting.get_or_insert(now + self.limit) {
                return Ok(Turn::Later);
            }
            let problem = format!("waits for more than {} s", self.limit.as_secs());
            return Err(Error::input("the replay", problem, "raise --replay-limit, or ask for less"));
        }
        (self.waiting, self.is_undrawn) = (None, true);
        Ok(self.replay.pop_front().map_or(Turn::Later, Turn::Now))
    }

    /// When it has to be asked again, if nothing happens until then.
    pub fn due(&self) -> Option<Instant> {
        self.waiting
    }

    /// The window was asked for a picture of this size: the next input waits for that.
    pub fn resizes(&mut self, size: [u32; 2], now: Instant) {
        self.resizing = Some((size, now + RESIZE_PATIENCE));
    }

    /// A frame is being drawn.
    pub fn draws(&mut self) {
        self.is_undrawn = false;
    }

    /// Whether it counts frames, which are to be drawn behind other windows, too.
    pub fn counts_frames(&self) -> bool {
        self.frames_left.is_some()
    }

    /// Whether frames are of the end of the replay.
    pub fn is_played(&self) -> bool {
        self.replay.is_empty()
    }

    /// Whether a frame that counts is the last one.
    pub fn is_last(&self) -> bool {
        self.frames_left.is_some_and(|left| left <= 1)
    }

    /// A frame was drawn that counts. Gives whether frames are counted, so that others are to follow.
    pub fn count(&mut self) -> bool {
        self.frames_left.as_mut().map(|left| *left = left.saturating_sub(1)).is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::viewer::change::Change;

    const LIMIT: Duration = Duration::from_secs(9);

    fn script(replay: &[Input]) -> Script {
        let mut script = Script::new(replay, LIMIT, None, None);
        script.draws();
        script
    }

    fn exposure() -> Input {
        Input::Set(Change::Exposure(2.0))
    }

    #[test]
    fn each_input_is_drawn_before_the_next() {
        let (mut script, now) = (script(&[exposure(), Input::Undo, Input::Quit]), Instant::now());
        let due = State { is_frame_due: true, ..State::default() };
        assert_eq!(script.next(due, now).unwrap(), Turn::Now(exposure()));
        assert_eq!(script.next(due, now).unwrap(), Turn::Later);
        script.draws();
        // Another frame may be due by now.
        assert_eq!(script.next(due, now).unwrap(), Turn::Now(Input::Undo));
        assert!(!script.is_played() && script.next(due, now).unwrap() == Turn::Later);
        script.draws();
        assert_eq!(script.next(due, now).unwrap(), Turn::Quit);
        assert_eq!(Script::new(&[], LIMIT, None, None).next(State::default(), now).unwrap(), Turn::Later);
    }

    #[test]
    fn an_input_waits_for_the_draft_of_the_one_before() {
        let (mut script, now) = (script(&[exposure()]), Instant::now());
        let awaited = State { draft_awaited_until: Some(now + Duration::from_secs(1)), ..State::default() };
        assert_eq!(script.next(awaited, now).unwrap(), Turn::Later);
        assert_eq!(script.next(State { has_new_draft: true, ..State::default() }, now).unwrap(), Turn::Later);
        assert_eq!(script.next(awaited, now + Duration::from_secs(1)).unwrap(), Turn::Now(exposure()));
    }

    #[test]
    fn a_wait_ends_when_nothing_is_made_or_drawn_and_not_later_than_its_limit() {
        let now = Instant::now();
        let busy = State { is_busy: true, ..State::default() };
        let mut waits = script(&[Input::Wait]);
        assert!(waits.next(busy, now).unwrap() == Turn::Later && waits.due() == Some(now + LIMIT));
        assert_eq!(waits.next(State { is_frame_due: true, ..State::default() }, now).unwrap(), Turn::Later);
        let turns = State { is_frame_due: true, turntable: true, ..State::default() };
        assert!(waits.next(turns, now).unwrap() == Turn::Now(Input::Wait) && waits.due().is_none());
        let mut waits = script(&[Input::Wait]);
        assert_eq!(waits.next(busy, now).unwrap(), Turn::Later);
        let error = waits.next(busy, now + LIMIT).unwrap_err().to_string();
        assert!(error.contains("9 s") && error.contains("--replay-limit"), "{error}");
        // Pictures are of what is wanted, and what comes after them is not to change it.
        let save = Input::SavePicture("a.png".into());
        let mut saves = script(std::slice::from_ref(&save));
        assert_eq!(saves.next(State { is_loading: true, ..busy }, now).unwrap(), Turn::Later);
        assert_eq!(saves.next(busy, now).unwrap(), Turn::Now(save));
    }

    #[test]
    fn a_window_that_is_resized_has_its_size_before_the_next_input_or_never_gets_it() {
        let (mut script, now) = (script(&[exposure(), exposure()]), Instant::now());
        script.resizes([30, 20], now);
        assert_eq!(script.next(State::default(), now).unwrap(), Turn::At(now + RESIZE_INTERVAL));
        assert_eq!(script.next(State { size: [30, 20], ..State::default() }, now).unwrap(), Turn::Now(exposure()));
        script.resizes([60, 40], now);
        assert_eq!(script.next(State::default(), now + RESIZE_PATIENCE).unwrap(), Turn::Now(exposure()));
    }

    #[test]
    fn a_picture_is_taken_in_the_last_frame_that_is_asked_for_or_in_the_first() {
        for (frames, expected) in [(None, 1), (Some(1), 1), (Some(3), 3), (Some(0), 1)] {
            let mut script = Script::new(&[], LIMIT, frames, Some("a.png".into()));
            let last = (1..).find(|_| script.is_last() || !script.count()).unwrap();
            assert!(last == expected && script.counts_frames(), "{frames:?}: {last}");
        }
        assert!(!script(&[]).is_last() && !script(&[]).counts_frames());
    }
}
