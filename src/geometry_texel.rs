//! A texel of the geometry cache: what shading needs of a sub-pixel, in 8 bytes. Twin of glsl/geometry_texel.glsl.
use std::f32::consts::TAU;

use glam::{UVec2, Vec2, Vec3};

use crate::packing::{octahedral_decode, octahedral_encode, pack_snorm_2x16, unpack_snorm_2x16};
use crate::shader_constants::geometry_texel::{MATERIAL_BITS, TANGENT_STEPS};
use crate::tangent::any_tangent;

/// Most materials of a picture: their indices plus one have 16 bits.
pub const MAX_MATERIALS: usize = MATERIAL_BITS as usize;

/// What a sub-pixel sees of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GeometryTexel {
    /// Unit, in world axes.
    pub normal: Vec3,
    /// Unit, orthogonal to the normal; none where the material is isotropic.
    pub tangent: Option<Vec3>,
    /// Index of the material, below [`MAX_MATERIALS`].
    pub material: usize,
}

impl GeometryTexel {
    /// The texel as it is stored: the normal, octahedral in 2 x 16 bits; the material plus one in 16 bits; in 16 more the angle of the
    /// tangent around the normal. Twin of `pack_geometry` and `with_tangent`.
    pub fn pack(self) -> UVec2 {
        let normal = pack_snorm_2x16(octahedral_encode(self.normal));
        let n = octahedral_decode(unpack_snorm_2x16(normal));
        let steps = self.tangent.map_or(0, |tangent| {
            let x = any_tangent(n);
            let angle = tangent.dot(n.cross(x)).atan2(tangent.dot(x));
            ((angle / TAU + 0.5) * TANGENT_STEPS).round() as u32 + 1
        });
        UVec2::new(normal, (self.material as u32 + 1) | steps << 16)
    }

    /// The texel that is stored so; `None` for the background. Twin of `is_covered`, `geometry_normal`, `geometry_tangent` and
    /// `geometry_material`.
    pub fn unpack(stored: UVec2) -> Option<Self> {
        let normal = octahedral_decode(unpack_snorm_2x16(stored.x));
        let tangent = (stored.y >> 16).checked_sub(1).map(|steps| {
            let x = any_tangent(normal);
            let at = Vec2::from_angle((steps as f32 / TANGENT_STEPS - 0.5) * TAU);
            at.x * x + at.y * normal.cross(x)
        });
        let material = (stored.y & MATERIAL_BITS).checked_sub(1)? as usize;
        Some(Self { normal, tangent, material })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tangent::tangent_along;
    use crate::threads::slice::fibonacci_lattice;

    #[test]
    fn a_texel_holds_the_material_the_normal_to_7e_5_rad_and_the_tangent_to_1e_4() {
        for (i, uv) in fibonacci_lattice(1000).enumerate() {
            let (z, phi) = (2.0 * uv.x - 1.0, std::f64::consts::TAU * uv.y);
            let normal = (1.0 - z * z).sqrt() * glam::DVec2::from_angle(phi);
            let normal = normal.extend(z).as_vec3();
            let along = Vec3::new((i % 7) as f32 - 3.0, (i % 5) as f32 - 2.0, 0.3);
            for tangent in [None, Some(tangent_along(along, normal))] {
                let texel = GeometryTexel::unpack(GeometryTexel { normal, tangent, material: i }.pack()).unwrap();
                assert_eq!((texel.material, texel.tangent.is_some()), (i, tangent.is_some()));
                assert!(texel.normal.distance(normal) < 7e-5, "{normal} became {}", texel.normal);
                let is_near =
                    texel.tangent.zip(tangent).is_none_or(|(stored, tangent)| stored.distance(tangent) < 1e-4);
                assert!(is_near, "{tangent:?} became {:?}", texel.tangent);
            }
        }
        let last = GeometryTexel { normal: Vec3::Z, tangent: Some(-Vec3::X), material: MAX_MATERIALS - 1 };
        assert_eq!(GeometryTexel::unpack(last.pack()).unwrap().material, MAX_MATERIALS - 1);
        assert_eq!(GeometryTexel::unpack(UVec2::new(0x1234_5678, 0)), None);
        assert_eq!(GeometryTexel::unpack(UVec2::new(0x1234_5678, 0x1234_0000)), None);
    }
}
