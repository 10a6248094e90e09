//! The guide: how to use Threadlight, how it works, what it was measured to do, and where it ends.
//!
//! | chapter | what it tells |
//! |---|---|
//! | [`usage`] | commands, scene files, materials, methods, measurements |
//! | [`viewer`] | the window: mouse and keys, panel, comparison, replay |
//! | [`method`] | every equation, symbol by symbol, with the file and function that holds it |
//! | [`architecture`] | the way of a scene to pixels, the memo, the frame graph, how to add each kind of thing |
//! | [`results`] | all measurements, with the commands that made them |
//! | [`tried`] | what was measured on the way: what each choice is worth, and what was left out |
//! | [`limits`] | what it does not do, and where it is weak |
//!
//! A file is named by its path, `src/threads/cones.rs`; a function, type or constant in it by path and name,
//! `src/threads/cones.rs::sigma`. A test looks each of them up.

#[doc = include_str!("usage.md")]
pub mod usage {}

#[doc = include_str!("viewer.md")]
pub mod viewer {}

#[doc = include_str!("method.md")]
pub mod method {}

#[doc = include_str!("architecture.md")]
pub mod architecture {}

#[doc = include_str!("results.md")]
#[doc = include_str!("../../assets/error_over_time.svg")]
pub mod results {}

#[doc = include_str!("tried.md")]
pub mod tried {}

#[doc = include_str!("limits.md")]
pub mod limits {}
