//! What tests of the whole have in common; each file of it has one job, and says which.
// Each test needs a part of it.
#![allow(dead_code, unused_imports)]
mod device;
mod files;
mod pictures;
mod program;
mod scenes;

pub use device::*;
pub use files::*;
pub use pictures::*;
pub use program::*;
pub use scenes::*;
