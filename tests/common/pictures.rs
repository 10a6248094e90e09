//! What is asked of a rendering, and how its pixels are looked at.
use glam::{UVec2, Vec4};
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

/// How far `found` is from `expected`, in the channel that is farthest. Fails where that is no number: maxima of vectors pass over those.
pub fn difference(found: impl Into<Vec4>, expected: Vec4) -> f32 {
    let found = found.into();
    let difference = (found - expected).abs();
    assert!(difference.is_finite(), "{found}, not {expected}");
    difference.max_element()
}

/// All pixels, row by row.
pub fn pixels(prepared: &Prepared) -> impl Iterator<Item = UVec2> + use<> {
    let (width, height) = (prepared.view.width, prepared.view.height);
    (0..height).flat_map(move |y| (0..width).map(move |x| UVec2::new(x, y)))
}
