//! Unit vectors in 32 bits. Twin of glsl/packing.glsl.
use glam::{Vec2, Vec3};

use crate::shader_constants;

/// Octahedral map of a unit vector to [-1, 1]^2. Twin of `octahedral_encode`.
pub fn octahedral_encode(n: Vec3) -> Vec2 {
    let n = n / (n.x.abs() + n.y.abs() + n.z.abs());
    let sign = |x: f32| if x >= 0.0 { 1.0 } else { -1.0 };
    if n.z >= 0.0 {
        Vec2::new(n.x, n.y)
    } else {
        Vec2::new((1.0 - n.y.abs()) * sign(n.x), (1.0 - n.x.abs()) * sign(n.y))
    }
}

/// The unit vector back. Twin of `octahedral_decode`.
pub fn octahedral_decode(e: Vec2) -> Vec3 {
    let z = 1.0 - e.x.abs() - e.y.abs();
    let fold = (-z).max(0.0);
    let unfold = |x: f32| if x >= 0.0 { x - fold } else { x + fold };
    Vec3::new(unfold(e.x), unfold(e.y), z).normalize()
}

/// How far from the middle a stereographic map goes: 13 degrees beyond the horizon.
pub const STEREOGRAPHIC_EXTENT: f32 = shader_constants::packing::STEREOGRAPHIC_EXTENT;

/// Stereographic map of a unit vector to the plane, from -z: the upper hemisphere is the unit disc. What is outside of the map is moved to
/// its border.
pub fn stereographic_encode(d: Vec3) -> Vec2 {
    // -z itself has no place outside, rather than all of them: it counts as z.
    let place = d.truncate() / (1.0 + d.z).max(f32::MIN_POSITIVE);
    place.clamp(Vec2::splat(-STEREOGRAPHIC_EXTENT), Vec2::splat(STEREOGRAPHIC_EXTENT))
}

/// The direction back, not of unit length. Twin of `stereographic_decode`.
pub fn stereographic_decode(place: Vec2) -> Vec3 {
    (2.0 * place).extend(1.0 - place.length_squared())
}

/// Two numbers from -1 to 1 in 16 bits each. Twin of `packSnorm2x16`.
pub fn pack_snorm_2x16(value: Vec2) -> u32 {
    let [x, y] = value.to_array().map(|x| u32::from((x.clamp(-1.0, 1.0) * 32767.0).round() as i16 as u16));
    x | y << 16
}

/// The two numbers back. Twin of `unpackSnorm2x16`.
pub fn unpack_snorm_2x16(bits: u32) -> Vec2 {
    let unpack = |bits: u32| (f32::from(bits as u16 as i16) / 32767.0).clamp(-1.0, 1.0);
    Vec2::new(unpack(bits), unpack(bits >> 16))
}
