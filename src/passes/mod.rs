//! The passes of a frame and of what is made before it: a function each, handles in and handles out. The order of those of a frame is
//! in `pipeline::declare`.
//!
//! What a pass needs besides its handles (pipeline, meshes, tables) is made once, in a struct beside the function.

mod background;
mod bare_lookups;
mod brdf_atlas;
mod classify;
mod cube_borders;
mod device_check;
mod geometry_cache;
mod light;
mod materials;
mod picture_size;
#[cfg(feature = "viewer")]
mod present;
mod readback;
mod region;
mod shade;
mod tone_map;
#[cfg(feature = "viewer")]
mod ui;
mod view;
mod vmf_pyramid;

pub use background::{Background, BackgroundMap, background};
pub use bare_lookups::{BareLookup, BareLookups, bare_lookups};
pub use classify::{
    CLASSIFY_PASS, Classify, Counters, MAX_SHADERS, SMOOTH_DEG, ShaderOfMaterial, SmoothVariance, Tiles, classify,
    most_shaders, upload_shaders,
};
pub use cube_borders::WayAround;
pub use device_check::{Answers, Questions, Volume, ask};
pub use geometry_cache::{DeviceMesh, GeometryCache, PlacedMesh, PlacedTangent, geometry_cache, geometry_pipeline};
pub(crate) use geometry_cache::{GEOMETRY_STATE, geometry_shaders};
pub use light::{DeviceIrradiance, DeviceLight, check_aliases};
pub use materials::{DeviceMaterials, ShadedMaterial};
pub use picture_size::check_picture;
pub(crate) use picture_size::{check_cache_size, check_lists};
#[cfg(feature = "viewer")]
pub use present::{Area, present};
pub use readback::{Readbacks, texels};
pub use region::Region;
pub(crate) use shade::most_samples;
pub use shade::{SHADE_PASS, Shade, Shaded, shade, shade_shader};
pub use tone_map::{ToneMap, tone_map};
#[cfg(feature = "viewer")]
pub use ui::ui;
pub use view::{CameraRays, View};
pub use vmf_pyramid::vmf_pyramid;
