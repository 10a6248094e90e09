//! What frames are made of.
use super::session::Edit;
use crate::error::{Error, Result};
use crate::memo::{Key, Round};
use crate::pipeline::DeviceScene;
use crate::prepare::{Prepared, view_of};
use crate::scene::{BoundingSphere, Scene};
use crate::vulkan::Device;
use std::path::PathBuf;
use std::sync::Arc;

/// What was asked for; else why it cannot be: at least one fault.
pub type Made = Result<Loaded, Vec<Fault>>;

/// Why something cannot be.
#[derive(Debug)]
pub struct Fault {
    /// What is wrong.
    pub error: Error,
    /// The edit, not shown yet, that cannot be loaded; none if all of them can.
    pub edit: Option<Edit>,
}

/// All that a scene needs, on the device.
#[derive(Clone)]
pub struct Loaded {
    /// In memory.
    pub prepared: Arc<Prepared>,
    /// A sphere around each of its objects, in world space.
    pub spheres: Arc<[BoundingSphere]>,
    /// The same around all of them.
    pub sphere: BoundingSphere,
    /// On the device.
    pub device_scene: Arc<DeviceScene>,
    /// What it was made of.
    pub key: Option<Key>,
    /// The change that it was asked for by: [`super::latency::Latency::asked`].
    pub change: u64,
    /// Its files, with the keys of the contents that were loaded.
    pub files: Vec<(PathBuf, Key)>,
}

impl Loaded {
    /// What `round` has `prepared`, and all else that frames of it need on `device`, with geometry caches whose sides are no longer than
    /// `longest_side`.
    ///
    /// # Errors
    /// Those of [`DeviceScene::new`].
    pub fn new(
        device: &Arc<Device>,
        mut prepared: Prepared,
        longest_side: u32,
        round: &Round,
        key: Option<Key>,
        change: u64,
    ) -> Result<Self> {
        prepared.view = prepared.view.fit(longest_side);
        let device_scene = Arc::new(DeviceScene::new(device, &prepared, round)?);
        let files = prepared.scene.files().into_iter();
        let files = files.filter_map(|path| round.memo().file_key(&path).ok().map(|key| (path, key))).collect();
        // Of every vertex, so not found anew for each frame.
        let spheres = prepared.spheres();
        let sphere = BoundingSphere::around(&spheres);
        Ok(Self { prepared: Arc::new(prepared), spheres: spheres.into(), sphere, device_scene, key, change, files })
    }

    /// Whether some of its threads only stand in for those that are being made.
    pub fn is_draft(&self) -> bool {
        self.prepared.is_draft
    }

    /// What was loaded, looked at as `scene` says, which names nothing else.
    ///
    /// # Errors
    /// Objects that no camera can frame.
    pub fn seen_as(&self, scene: Scene) -> Result<Prepared> {
        let view = view_of(&scene, self.sphere)?;
        Ok(Prepared { scene, view, ..(*self.prepared).clone() })
    }
}
