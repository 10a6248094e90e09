//! What moves the picture: the user, drafts that follow each other, the turntable. While it moves it may be coarse.
use std::time::{Duration, Instant};

/// A picture is still moving for so long after the last motion: a scroll wheel has no release.
const SETTLING: Duration = Duration::from_millis(150);

/// What moves the picture.
#[derive(Clone, Copy, Debug, Default)]
pub struct Motion {
    /// Whether the camera turns by itself.
    pub turntable: bool,
    last_turn: Option<Instant>,
    /// The user's last motion; none once the picture has settled.
    by_user: Option<Instant>,
    /// When the draft that is shown came; none once that stands still.
    by_draft: Option<Instant>,
}

impl Motion {
    /// The user moves the camera or the light.
    pub fn moved(&mut self) {
        self.by_user = Some(Instant::now());
    }

    /// The picture is of other threads from now on.
    pub fn loaded(&mut self, is_draft: bool) {
        self.by_draft = is_draft.then(Instant::now);
    }

    /// Starts or stops the turntable.
    pub fn toggle_turntable(&mut self) {
        self.turntable = !self.turntable;
        self.last_turn = None;
    }

    /// For how many seconds the turntable has turned since it was last asked; none if it does not turn.
    pub fn turned_s(&mut self) -> Option<f64> {
        let now = Instant::now();
        self.turntable.then(|| self.last_turn.replace(now).map_or(0.0, |last| (now - last).as_secs_f64()))
    }

    /// When a frame is due though nothing happens: none if nothing is.
    pub fn next_frame(&self) -> Option<Instant> {
        if self.turntable {
            return Some(Instant::now());
        }
        self.by_user.max(self.by_draft).map(|last| last + SETTLING)
    }

    /// Whether the picture moves. What `is_held` is being dragged.
    pub fn is_moving(&mut self, is_held: bool) -> bool {
        for last in [&mut self.by_user, &mut self.by_draft] {
            last.take_if(|last| last.elapsed() >= SETTLING);
        }
        is_held || self.by_user.is_some() || self.by_draft.is_some() || self.turntable
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_settles_after_the_last_motion_and_then_no_frame_is_due() {
        let mut motion = Motion::default();
        assert!(!motion.is_moving(false) && motion.next_frame().is_none() && motion.is_moving(true));
        for move_it in [Motion::moved, |motion: &mut Motion| motion.loaded(true)] {
            move_it(&mut motion);
            assert!(motion.is_moving(false) && motion.next_frame().is_some());
            std::thread::sleep(SETTLING);
            assert!(!motion.is_moving(false) && motion.next_frame().is_none());
        }
        // Threads that are finished move nothing.
        motion.loaded(true);
        motion.loaded(false);
        assert!(!motion.is_moving(false));
    }

    #[test]
    fn the_turntable_turns_by_the_time_since_it_was_asked_and_not_while_it_stood() {
        let mut motion = Motion::default();
        assert_eq!(motion.turned_s(), None);
        for _ in 0..2 {
            motion.toggle_turntable();
            assert_eq!(motion.turned_s(), Some(0.0));
            std::thread::sleep(Duration::from_millis(10));
            assert!(motion.is_moving(false) && motion.turned_s().is_some_and(|seconds| seconds >= 0.01));
            motion.toggle_turntable();
            assert!(!motion.is_moving(false) && motion.turned_s().is_none());
        }
    }
}
