//! By what rule the tangents of an object go: which way anisotropic materials are brushed on it.
use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::three_numbers;

/// Which way tangents go on an object, in its own space before it is scaled and turned.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", try_from = "RawRule")]
pub enum TangentRule {
    /// In circles around an axis through the object's origin, as a lathe leaves them: along axis x position.
    Around(Vec3),
    /// Along an axis: what of it is in the tangent plane.
    Along(Vec3),
    /// Along the first of the mesh's texture coordinates, towards where it grows.
    Uv,
}

impl TangentRule {
    /// Of an object without one: around the vertical.
    pub const DEFAULT: Self = Self::Around(Vec3::Y);

    /// The tangent at `position`, where the mesh's own is `of_mesh`: of any length, not yet put into the tangent plane. `world_tangent` in
    /// glsl/geometry_cache.vert.
    pub fn at(self, position: Vec3, of_mesh: Vec3) -> Vec3 {
        match self {
            Self::Around(axis) => axis.cross(position),
            Self::Along(axis) => axis,
            Self::Uv => of_mesh,
        }
    }
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum RawRule {
    Around(#[serde(deserialize_with = "three_numbers")] [f32; 3]),
    Along(#[serde(deserialize_with = "three_numbers")] [f32; 3]),
    Uv,
}

impl TryFrom<RawRule> for TangentRule {
    type Error = String;

    fn try_from(raw: RawRule) -> Result<Self, String> {
        let (RawRule::Around(axis) | RawRule::Along(axis)) = raw else { return Ok(Self::Uv) };
        // Its square must not leave the range of floats.
        let axis = Vec3::from(axis).as_dvec3().try_normalize();
        let axis = axis.ok_or("the axis of `tangent` must be three finite numbers, not all 0")?.as_vec3();
        Ok(match raw {
            RawRule::Around(_) => Self::Around(axis),
            RawRule::Along(_) | RawRule::Uv => Self::Along(axis),
        })
    }
}
