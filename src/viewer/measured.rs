//! What frames have shown of themselves: times, counts.
use crate::passes::Counters;
use crate::vulkan::PassTime;
use std::time::Duration;

/// What the last frames have shown of themselves.
#[derive(Clone, Debug, Default)]
pub struct Measured {
    /// Time of each pass of the frame when it last ran.
    pub passes: Vec<PassTime>,
    /// Names of the passes that ran in the last frame.
    pub ran: Vec<String>,
    /// Pixels and lookups of the last frame that counted them.
    pub counted: Option<(Counters, u64)>,
    /// From the start of the last frame until it was handed to the window.
    pub frame: Duration,
    /// Frames so far.
    pub frames: u64,
    /// Columns and rows that the last frame shaded.
    pub size: [u32; 2],
}

impl Measured {
    /// Takes the times of the passes that ran; those of the others stay.
    pub(super) fn time(&mut self, passes: &[PassTime]) {
        for (index, pass) in passes.iter().enumerate() {
            match self.passes.iter_mut().find(|known| known.name == pass.name) {
                Some(known) => known.gpu_ms = pass.gpu_ms,
                // Where it belongs: after the one that it ran after.
                None => {
                    let before = index.checked_sub(1).map(|before| &passes[before].name);
                    let place = self.passes.iter().position(|known| Some(&known.name) == before);
                    self.passes.insert(place.map_or(0, |place| place + 1), pass.clone());
                }
            }
        }
    }
}
