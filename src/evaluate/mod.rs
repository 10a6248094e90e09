//! How wrong a picture is, and what the truth is.
pub mod reference;
