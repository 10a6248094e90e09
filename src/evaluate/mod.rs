//! How wrong a picture is, against what, and at what cost.
//!
//! | question | module |
//! |---|---|
//! | what the truth is | [`reference`](mod@reference) |
//! | how much two pictures differ | [`metrics`], [`ssim`] |
//! | where they differ | [`difference`] |
//! | error and time of every method, count, material and environment | [`sweep`] |
//! | the paper's tables 2 to 4 | [`tables`] |
//! | the paper's figure 12, and error over time | [`plots`] |

pub mod difference;
pub mod metrics;
pub mod plots;
pub mod reference;
mod reference_picture;
pub mod ssim;
pub mod sweep;
pub mod tables;

pub use difference::difference_picture;
pub use metrics::{Comparable, Display, Metrics, compare};
pub use reference_picture::{ReferencePicture, reference_picture};
pub use sweep::{Row, Sweep};
