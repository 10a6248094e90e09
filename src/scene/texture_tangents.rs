//! Tangents along texture coordinates, as MikkTSpace has them, by the crate `bevy_mikktspace`.
//!
//! Mikkelsen, "Simulation of Wrinkled Surfaces Revisited" (2008): at each corner of a triangle the mean of the tangents of the triangles that
//! share its vertex and texture coordinates, weighted by their angles. So it is the tangent that programs bake normal maps by.
use std::collections::HashMap;

use bevy_mikktspace::{Geometry, TangentSpace, generate_tangents};
use glam::{Vec2, Vec3};

use super::obj_file::{TEXTURED_FORMAT, TexturedMesh};
use super::{Mesh, TangentRule, mesh};
use crate::files::FileKind;
use crate::tangent::tangent_along;

impl TexturedMesh {
    /// The formats of mesh files, with their texture coordinates.
    pub const FILES: FileKind<Self> =
        FileKind { what: "mesh", formats: &[TEXTURED_FORMAT], builtin_names: || mesh::builtin_names().to_vec() };

    /// The mesh with its tangents, or without if no triangle has texture coordinates with an area. Vertices are split where tangents differ.
    /// Where others have none, tangents go by [`TangentRule::DEFAULT`], and a warning says so of the mesh of this `name`.
    pub fn with_tangents(self, name: impl std::fmt::Display) -> Mesh {
        let Self { mesh, uvs } = self;
        let corners = Corners::of(&mesh, &uvs);
        let missing = corners.tangents.iter().filter(|tangent| tangent.is_none()).count();
        if missing == mesh.indices.len() {
            return mesh;
        }
        if missing > 0 {
            tracing::warn!(
                "{name}: {missing} of {} corners have no texture coordinates to go by: they are brushed around the y axis",
                mesh.indices.len()
            );
        }
        let mut split = Mesh { indices: Vec::with_capacity(mesh.indices.len()), ..Mesh::default() };
        let mut vertices = HashMap::new();
        for (&index, tangent) in mesh.indices.iter().zip(corners.tangents) {
            let (position, normal) = (mesh.positions[index as usize], mesh.normals[index as usize]);
            let along = tangent.unwrap_or_else(|| TangentRule::DEFAULT.at(position, Vec3::ZERO));
            let tangent = tangent_along(along, normal);
            let index = *vertices.entry((index, tangent.to_array().map(f32::to_bits))).or_insert_with(|| {
                split.positions.push(position);
                split.normals.push(normal);
                split.tangents.push(tangent);
                split.positions.len() as u32 - 1
            });
            split.indices.push(index);
        }
        split
    }
}

/// The triangles that have texture coordinates, and the tangent that each corner of the mesh got.
struct Corners<'a> {
    mesh: &'a Mesh,
    uvs: &'a [Vec2],
    /// Numbers of these triangles.
    triangles: Vec<usize>,
    tangents: Vec<Option<Vec3>>,
}

impl<'a> Corners<'a> {
    fn of(mesh: &'a Mesh, uvs: &'a [Vec2]) -> Self {
        let uv = |index: &u32| uvs.get(*index as usize).copied().filter(|uv| uv.is_finite());
        let has_area = |triangle: &[u32; 3]| {
            let [Some(a), Some(b), Some(c)] = triangle.each_ref().map(uv) else { return false };
            // Of none there is no direction in which the first coordinate grows.
            (b - a).as_dvec2().perp_dot((c - a).as_dvec2()) != 0.0
        };
        let triangles = mesh.indices.as_chunks::<3>().0.iter().enumerate();
        let triangles = triangles.filter(|(_, triangle)| has_area(triangle)).map(|(number, _)| number).collect();
        let mut corners = Self { mesh, uvs, triangles, tangents: vec![None; mesh.indices.len()] };
        if let Err(problem) = generate_tangents(&mut corners) {
            tracing::debug!("no tangents of texture coordinates: {problem:?}");
        }
        corners
    }

    /// Its place in the indices.
    fn corner(&self, face: usize, corner: usize) -> usize {
        3 * self.triangles[face] + corner
    }

    fn vertex(&self, face: usize, corner: usize) -> usize {
        self.mesh.indices[self.corner(face, corner)] as usize
    }
}

impl Geometry for Corners<'_> {
    fn num_faces(&self) -> usize {
        self.triangles.len()
    }

    fn num_vertices_of_face(&self, _: usize) -> usize {
        3
    }

    fn position(&self, face: usize, corner: usize) -> [f32; 3] {
        self.mesh.positions[self.vertex(face, corner)].to_array()
    }

    fn normal(&self, face: usize, corner: usize) -> [f32; 3] {
        self.mesh.normals[self.vertex(face, corner)].to_array()
    }

    fn tex_coord(&self, face: usize, corner: usize) -> [f32; 2] {
        self.uvs[self.vertex(face, corner)].to_array()
    }

    fn set_tangent(&mut self, space: Option<TangentSpace>, face: usize, corner: usize) {
        let corner = self.corner(face, corner);
        // A tangent along the normal, or none, is none.
        let tangent = space.map(|space| Vec3::from(space.tangent()));
        self.tangents[corner] = tangent.filter(|tangent| tangent.is_finite() && tangent.length_squared() > 0.5);
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn brushed(obj: &str) -> Mesh {
        TexturedMesh::FILES.parse(Path::new("test.obj"), obj.as_bytes()).unwrap().with_tangents("test.obj")
    }

    /// Two squares side by side that face +z, whose texture is the second's mirror image in the first.
    const MIRRORED: &str = "v -1 0 0\nv 0 0 0\nv 1 0 0\nv -1 1 0\nv 0 1 0\nv 1 1 0\nvt 1 0\nvt 0 0\nvt 1 1\nvt 0 1\n\
                            f 1/1 2/2 5/4 4/3\nf 2/2 3/1 6/3 5/4\n";

    #[test]
    fn tangents_point_to_where_the_first_coordinate_grows_on_both_sides_of_a_mirror() {
        let mesh = brushed(MIRRORED);
        // The two vertices of the common edge have two tangents each.
        assert_eq!((mesh.indices.len(), mesh.positions.len(), mesh.tangents.len()), (12, 8, 8));
        for triangle in mesh.indices.as_chunks::<3>().0 {
            let corners = triangle.map(|index| (mesh.positions[index as usize], mesh.tangents[index as usize]));
            let is_left = corners.iter().any(|(position, _)| position.x < 0.0);
            let expected = if is_left { Vec3::NEG_X } else { Vec3::X };
            assert!(corners.iter().all(|(_, tangent)| tangent.distance(expected) < 1e-6), "{corners:?}");
        }
    }

    #[test]
    fn a_turned_texture_turns_tangents_and_a_sheared_one_leaves_them_in_the_surface() {
        // u = (x + y) / 2: its gradient is diagonal.
        let mesh =
            brushed("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 0.5 -0.5\nvt 1 0\nvt 0.5 0.5\nf 1/1 2/2 3/3 4/4\n");
        let diagonal = Vec3::new(1.0, 1.0, 0.0).normalize();
        assert_eq!(mesh.positions.len(), 4);
        assert!(mesh.tangents.iter().all(|tangent| tangent.distance(diagonal) < 1e-6), "{:?}", mesh.tangents);
        // Smooth normals that lean: tangents stay orthogonal to them.
        let bent = brushed("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0.6 0 0.8\nvt 0 0\nvt 1 0\nvt 0.3 1\nf 1/1/1 2/2/1 3/3/1\n");
        assert!(bent.tangents.iter().all(|tangent| tangent.distance(Vec3::new(0.8, 0.0, -0.6)) < 1e-6));
    }

    #[test]
    fn corners_without_texture_coordinates_have_the_default_tangent_and_a_mesh_without_has_none() {
        let plain = MIRRORED.replace("/1", "").replace("/2", "").replace("/3", "").replace("/4", "");
        assert!(brushed(&plain).tangents.is_empty());
        // All of them at one point of the texture: none has an area there.
        let squeezed = MIRRORED.replace("/2", "/1").replace("/3", "/1").replace("/4", "/1");
        assert!(brushed(&squeezed).tangents.is_empty());
        let half = brushed(&MIRRORED.replace("f 1/1 2/2 5/4 4/3", "f 1 2 5 4"));
        assert_eq!(half.tangents.len(), half.positions.len());
        for triangle in half.indices.as_chunks::<3>().0 {
            let corners = triangle.map(|index| (half.positions[index as usize], half.tangents[index as usize]));
            let is_left = corners.iter().any(|(position, _)| position.x < 0.0);
            for (position, tangent) in corners {
                // Around y in the plane of the squares is nowhere: any direction in it will do.
                let is_default = tangent == tangent_along(TangentRule::DEFAULT.at(position, Vec3::ZERO), Vec3::Z);
                assert!(if is_left { is_default } else { tangent.distance(Vec3::X) < 1e-6 }, "{position}: {tangent}");
            }
        }
    }

    #[test]
    fn wrong_indices_of_texture_coordinates_are_errors_where_these_are_wanted_only() {
        let wrong = MIRRORED.replace("1/1 2/2", "1/9 2/2");
        let path = Path::new("test.obj");
        assert!(Mesh::FILES.parse(path, wrong.as_bytes()).is_ok());
        let error = TexturedMesh::FILES.parse(path, wrong.as_bytes()).unwrap_err().to_string();
        assert!(error.contains("test.obj") && error.contains("line 11: there is no texture coordinate 9"), "{error}");
    }
}
