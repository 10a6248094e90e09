//! A texel of the geometry cache: what shading needs of a sub-pixel, in 8 bytes. Twin of glsl/geometry_texel.glsl.
use glam::{UVec2, Vec3};

use crate::packing::{octahedral_decode, octahedral_encode, pack_snorm_2x16, unpack_snorm_2x16};

/// What a sub-pixel sees of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GeometryTexel {
    /// Unit, in world axes.
    pub normal: Vec3,
    /// Index of the material.
    pub material: usize,
}

impl GeometryTexel {
    /// The texel as it is stored: the normal, octahedral in 2 x 16 bits, and the material plus one. Twin of `pack_geometry`.
    pub fn pack(self) -> UVec2 {
        UVec2::new(pack_snorm_2x16(octahedral_encode(self.normal)), self.material as u32 + 1)
    }

    /// The texel that is stored so; `None` for the background. Twin of `is_covered`, `geometry_normal` and `geometry_material`.
    pub fn unpack(stored: UVec2) -> Option<Self> {
        let normal = octahedral_decode(unpack_snorm_2x16(stored.x));
        stored.y.checked_sub(1).map(|material| Self { normal, material: material as usize })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::threads::slice::fibonacci_lattice;

    #[test]
    fn a_texel_holds_the_material_and_the_normal_to_7e_5_rad() {
        for (i, uv) in fibonacci_lattice(1000).enumerate() {
            let (z, phi) = (2.0 * uv.x - 1.0, std::f64::consts::TAU * uv.y);
            let normal = (1.0 - z * z).sqrt() * glam::DVec2::from_angle(phi);
            let normal = normal.extend(z).as_vec3();
            let texel = GeometryTexel::unpack(GeometryTexel { normal, material: i }.pack()).unwrap();
            assert_eq!(texel.material, i);
            assert!(texel.normal.distance(normal) < 7e-5, "{normal} became {}", texel.normal);
        }
        assert_eq!(GeometryTexel::unpack(UVec2::new(0x1234_5678, 0)), None);
    }
}
