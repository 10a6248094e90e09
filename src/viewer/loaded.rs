//! What frames are made of.
use crate::memo::Key;
use crate::pipeline::Renderer;
use crate::prepare::Prepared;
use std::sync::Arc;

/// All that a scene needs, on the device.
#[derive(Clone)]
pub struct Loaded {
    /// In memory.
    pub prepared: Arc<Prepared>,
    /// On the device.
    pub renderer: Arc<Renderer>,
    /// What it was made of.
    pub key: Option<Key>,
}
