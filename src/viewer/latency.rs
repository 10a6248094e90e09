//! How long the user waits: from an input to the frame that shows what it asks for.
use std::collections::VecDeque;
use std::time::Instant;

use super::input::Input;

/// What a session records of how long inputs wait to be seen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Record {
    /// The latest, for the panel.
    #[default]
    Latest,
    /// All of them.
    All,
    /// All of them, and how far the drafts were from what they stood for; that is rendered at the end.
    AllAndErrors,
}

/// An input that changed something, and how long it took to be seen.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Answer {
    /// What the user did.
    pub input: Input,
    /// From there to the first frame that shows it, or a later input of the same kind.
    pub shown_ms: f64,
    /// To the first frame whose threads are no draft; none if something else was asked for before.
    pub finished_ms: Option<f64>,
    /// RMS of display values between that first frame and the finished one, where that was a draft and is to be measured.
    pub rms_to_finished: Option<f64>,
}

/// How long the inputs of a session waited.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Stats {
    /// Name of the device.
    pub device: String,
    /// Columns and rows of the picture.
    pub size: [u32; 2],
    /// Median of `shown_ms`.
    pub median_shown_ms: Option<f64>,
    /// What 95 % of them are at most.
    pub p95_shown_ms: Option<f64>,
    /// Each input that changed something, in order.
    pub events: Vec<Answer>,
}

/// An input that no frame shows yet.
struct Waiting {
    input: Input,
    since: Instant,
    /// Number of the change; none for what every frame shows as it is wanted, such as the camera.
    loads: Option<u64>,
}

/// The inputs that wait for a frame, and those that had theirs.
pub struct Latency {
    waiting: Vec<Waiting>,
    answers: VecDeque<Answer>,
    /// Most answers that are kept: the newest.
    kept: usize,
    /// The latest answer if that was by a draft: number of the change, and since when it waits.
    drafted: Option<(u64, Instant)>,
}

impl Latency {
    /// Keeps so many answers.
    pub fn keeping(kept: usize) -> Self {
        Self { waiting: Vec::new(), answers: VecDeque::new(), kept, drafted: None }
    }

    /// The latest answers, the oldest first.
    pub fn answers(&self) -> &VecDeque<Answer> {
        &self.answers
    }

    /// `input` changes something, which is to be `loads`ed as change of this number, if at all.
    pub fn asked(&mut self, input: &Input, since: Instant, loads: Option<u64>) {
        self.waiting.push(Waiting { input: input.clone(), since, loads });
    }

    /// What was asked for cannot be loaded: nobody waits for it any more.
    pub fn failed(&mut self) {
        self.waiting.retain(|waiting| waiting.loads.is_none());
        self.drafted = None;
    }

    /// Whether someone waits for a frame of what was loaded for this change.
    pub fn is_awaited(&self, change: u64, is_draft: bool) -> bool {
        self.waiting.iter().any(|waiting| waiting.loads.is_none_or(|number| number <= change))
            || self.drafted.is_some_and(|(number, _)| number <= change && !is_draft)
    }

    /// Such a frame was presented at this time.
    pub fn shown(&mut self, change: u64, is_draft: bool, at: Instant) {
        let ms = |since: Instant| (at - since).as_secs_f64() * 1e3;
        if let Some((_, since)) = self.drafted.take_if(|(number, _)| *number <= change && !is_draft)
            && let Some(latest) = self.answers.back_mut()
        {
            latest.finished_ms = Some(ms(since));
        }
        let is_shown = |waiting: &mut Waiting| waiting.loads.is_none_or(|number| number <= change);
        for Waiting { input, since, loads } in self.waiting.extract_if(.., is_shown) {
            let is_finished = loads.is_none() || !is_draft;
            self.drafted = loads.filter(|_| is_draft).map(|number| (number, since));
            if self.answers.len() == self.kept {
                self.answers.pop_front();
            }
            self.answers.push_back(Answer {
                input,
                shown_ms: ms(since),
                finished_ms: is_finished.then_some(ms(since)),
                rms_to_finished: None,
            });
        }
    }

    /// The part `quantile` of the answers' times to the first frame is at most this, in milliseconds; none without answers.
    pub fn shown_ms(&self, quantile: f64) -> Option<f64> {
        let mut times: Vec<_> = self.answers.iter().map(|answer| answer.shown_ms).collect();
        times.sort_by(f64::total_cmp);
        let last = times.len().checked_sub(1)?;
        times.get((quantile * last as f64).ceil() as usize).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::viewer::change::Change;
    use std::time::Duration;

    fn input(exposure: f64) -> Input {
        Input::Set(Change::Exposure(exposure))
    }

    #[test]
    fn an_input_waits_for_a_frame_that_shows_it() {
        let start = Instant::now();
        let after = |ms: u64| start + Duration::from_millis(ms);
        let mut latency = Latency::keeping(3);
        latency.asked(&input(1.0), start, Some(1));
        latency.asked(&input(2.0), after(10), Some(2));
        latency.asked(&input(3.0), after(20), None);
        assert!(latency.is_awaited(0, false));
        // A frame of what was there before shows what needs no loading.
        latency.shown(0, false, after(30));
        assert!(!latency.is_awaited(0, false) && latency.is_awaited(1, true));
        latency.shown(2, true, after(50));
        // The finished threads of the newer one are there; the older one never had any of its own.
        assert!(!latency.is_awaited(2, true) && latency.is_awaited(2, false));
        latency.shown(2, false, after(500));
        let answers: Vec<_> = latency.answers().iter().cloned().collect();
        let answer = |exposure, shown_ms, finished_ms| Answer {
            input: input(exposure),
            shown_ms,
            finished_ms,
            rms_to_finished: None,
        };
        assert_eq!(answers, [answer(3.0, 10.0, Some(10.0)), answer(1.0, 50.0, None), answer(2.0, 40.0, Some(490.0))]);
        let shown = [0.0, 0.4, 0.5, 0.95].map(|quantile| latency.shown_ms(quantile));
        assert_eq!(shown, [10.0, 40.0, 40.0, 50.0].map(Some));
        // The oldest goes.
        latency.asked(&input(4.0), after(600), Some(3));
        latency.shown(3, false, after(601));
        assert_eq!(latency.answers().front(), Some(&answers[1]));
    }

    #[test]
    fn nobody_waits_for_what_cannot_be_loaded() {
        let start = Instant::now();
        let mut latency = Latency::keeping(10);
        latency.asked(&input(1.0), start, Some(1));
        latency.failed();
        assert!(!latency.is_awaited(9, false));
        latency.shown(9, false, start);
        assert!(latency.answers().is_empty() && latency.shown_ms(0.5).is_none());
        // Nor for the end of a draft of it.
        latency.asked(&input(2.0), start, Some(10));
        latency.shown(10, true, start);
        assert!(latency.is_awaited(10, false));
        latency.failed();
        assert!(!latency.is_awaited(10, false));
    }
}
