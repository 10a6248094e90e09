//! What is asked of a rendering, and how its pixels are looked at.
use glam::{DVec3, UVec2, Vec3, Vec4};
use threadlight::low_level::pipeline::Wanted;
use threadlight::low_level::prepare::Prepared;
use threadlight::low_level::rendering::Rendering;
use threadlight::low_level::shading::texels_of_pixel;

/// Radiance and geometry.
pub const EVERYTHING: Wanted = Wanted { radiance: true, display: false, geometry: true };

/// The texels of the geometry cache that a pixel sees.
pub fn texels_of(prepared: &Prepared, rendering: &Rendering, pixel: UVec2) -> Vec<UVec2> {
    texels_of_pixel(&prepared.view, &rendering.geometry, pixel)
}

#[path = "../../src/farthest.rs"]
mod farthest;
pub use farthest::Farthest;

/// How far `found` is from `expected`, in the channel that is farthest. Fails where that is no number.
pub fn difference(found: impl Into<Vec4>, expected: Vec4) -> f32 {
    (found.into() - expected).farthest()
}

/// All pixels, row by row.
pub fn pixels(prepared: &Prepared) -> impl Iterator<Item = UVec2> + use<> {
    let (width, height) = (prepared.view.width, prepared.view.height);
    (0..height).flat_map(move |y| (0..width).map(move |x| UVec2::new(x, y)))
}
