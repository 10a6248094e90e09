//! What frames are made of.
use crate::Result;
use crate::memo::Key;
use crate::pipeline::DeviceScene;
use crate::prepare::{Prepared, view_of};
use crate::scene::Scene;
use std::sync::Arc;

/// All that a scene needs, on the device.
#[derive(Clone)]
pub struct Loaded {
    /// In memory.
    pub prepared: Arc<Prepared>,
    /// On the device.
    pub renderer: Arc<DeviceScene>,
    /// What it was made of.
    pub key: Option<Key>,
    /// The change that it was asked for by: [`super::latency::Latency::asked`].
    pub change: u64,
}

impl Loaded {
    /// Whether some of its threads only stand in for those that are being made.
    pub fn is_draft(&self) -> bool {
        self.prepared.is_draft
    }

    /// What was loaded, looked at as `scene` says, which names nothing else.
    ///
    /// # Errors
    /// Objects that no camera can frame.
    pub fn seen_as(&self, scene: Scene) -> Result<Prepared> {
        let view = view_of(&scene, self.prepared.bounding_sphere())?;
        Ok(Prepared { scene, view, ..(*self.prepared).clone() })
    }
}
