//! The interactive viewer (feature `viewer`).
//!
//! | what | module | |
//! |---|---|---|
//! | what the user does, as data | [`input`] | pure |
//! | the camera's orbit | [`orbit`] | pure |
//! | the scene being edited, and what a change asks for | [`session`] | pure |
//! | loading and making in the background | [`jobs`] | threads |
//! | another picture of the same view, and the difference | [`comparison`] | |
//! | that in the window | [`comparer`] | egui |
//! | the threads of what is under the cursor | [`threads_seen`] | egui |

pub mod comparer;
pub mod comparison;
pub mod input;
pub mod jobs;
pub mod orbit;
pub mod session;
pub mod threads_seen;
