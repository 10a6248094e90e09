//! How wrong a picture is, against what, and at what cost.
//!
//! | question | module |
//! |---|---|
//! | what the truth is | [`reference`](mod@reference) |
//! | how much two pictures differ | [`metrics`], [`ssim`] |
//! | where they differ | [`difference`] |
//! | how much they will differ, and how many threads that takes | [`expected`] |
//! | what is measured: materials, environments, scenes, methods, counts | [`cases`] |
//! | error and time of all of these: tables 2 to 4, figures 10 to 12 | [`sweep`] |
//! | time of a frame beside its floor, and as things double: table 1 | [`speed`], [`bare_lookups`] |
//! | what many materials in one picture cost, beside each alone | [`together`] |
//! | what threads cost to make, beside what they are worth | [`fit`] |
//! | what a driver's compiler makes of the shaders | [`shaders`] |
//! | what drafts of threads are worth while a parameter is dragged | [`live`] |
//! | what each rounding of a device costs | [`rounding`] |
//! | whether hard cases are shaded as on the CPU | [`stress`] |
//! | what a measured material is in words of a model | [`material_fit`] |
//! | what a material is by itself: curves and image, and these drawn | [`material_curves`], [`material_plot`] |
//! | pictures side by side: figures 10, 11 and 13 | [`gallery`] |
//! | how it looks | [`tables`], [`plots`], [`sheet`] |
//! | all of it on one page | [`report`](mod@report) |

pub mod bare_lookups;
pub mod cases;
mod colours;
pub mod difference;
pub mod expected;
pub mod fit;
pub mod gallery;
pub mod live;
pub mod material_curves;
pub mod material_fit;
pub mod material_plot;
mod merge;
pub mod metrics;
pub mod plots;
pub mod reference;
pub mod report;
pub mod rounding;
pub mod shaders;
pub mod sheet;
pub mod speed;
pub mod ssim;
pub mod stress;
pub mod sweep;
pub mod tables;
pub mod together;

pub use cases::{Cases, Estimator, Place, Shard};
pub use difference::difference_picture;
pub use merge::merged;
pub use metrics::{Comparable, Display, Metrics, compare};
pub use sweep::{Row, Sweep};
