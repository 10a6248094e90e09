//! How a method samples: with how many samples, by which random numbers, and where.
use serde::{Deserialize, Serialize};

/// How a method samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sampling {
    /// Threads of a pixel, or samples of methods that have none.
    pub count: u32,
    /// What the random numbers of those start from.
    pub seed: u64,
    /// Where samples are drawn, by methods that have the choice. The shader is specialised by it.
    pub pattern: Pattern,
}

/// Where `filtered` and `importance` draw the samples of a pixel; other methods have no choice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Pattern {
    /// At random numbers of its own: noise.
    #[default]
    PerPixel,
    /// At one low-discrepancy set for all pixels, Sobol's in Owen's scramble: no noise, but bias.
    Fixed,
}

impl Pattern {
    /// Both.
    pub const ALL: [Self; 2] = [Self::PerPixel, Self::Fixed];

    /// What the command line and scene files call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::PerPixel => "per-pixel",
            Self::Fixed => "fixed",
        }
    }
}
