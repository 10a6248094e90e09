//! The order of triangles in which a device shades most vertices once, by the crate `meshopt`.
use glam::Vec3;

use super::Mesh;

impl Mesh {
    /// The same surface: triangles that share vertices stand near each other, so that a device finds vertices in its cache, and vertices
    /// stand in the order of their first use. Unused ones are left out. Where an index is of no vertex, or corners of a triangle are
    /// missing, the mesh stays as it is: upload refuses it.
    pub fn in_drawing_order(&self) -> Self {
        let count = self.positions.len();
        let is_complete = self.indices.len().is_multiple_of(3) && self.normals.len() == count;
        if !is_complete || self.indices.iter().any(|index| *index as usize >= count) {
            return self.clone();
        }
        let indices = meshopt::optimize_vertex_cache(&self.indices, count);
        let places = meshopt::optimize_vertex_fetch_remap(&indices, count);
        // Unused vertices have the place u32::MAX.
        let used = places.iter().filter(|place| (**place as usize) < count).count();
        let moved = |of: &[Vec3]| meshopt::remap_vertex_buffer(of, used, &places);
        Self {
            positions: moved(&self.positions),
            normals: moved(&self.normals),
            tangents: if self.tangents.len() == count { moved(&self.tangents) } else { Vec::new() },
            indices: meshopt::remap_index_buffer(Some(&indices), indices.len(), &places),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Vertices that are shaded for each triangle where the last 16 are at hand.
    fn shaded_a_triangle(mesh: &Mesh) -> f32 {
        meshopt::analyze_vertex_cache(&mesh.indices, mesh.positions.len(), 16, 0, 0).acmr
    }

    /// Corners with all they have, each triangle from its least corner on, in order.
    fn triangles(mesh: &Mesh) -> Vec<[[u32; 9]; 3]> {
        let corner = |index: u32| {
            let of = |vectors: &[Vec3]| vectors.get(index as usize).map_or([0; 3], |v| v.to_array().map(f32::to_bits));
            let parts = [of(&mesh.positions), of(&mesh.normals), of(&mesh.tangents)];
            std::array::from_fn(|i| parts[i / 3][i % 3])
        };
        let turned = |triangle: &[u32; 3]| {
            let mut corners = triangle.map(corner);
            let least = (0..3).min_by_key(|i| corners[*i]).unwrap_or_default();
            corners.rotate_left(least);
            corners
        };
        let mut all: Vec<_> = mesh.indices.as_chunks::<3>().0.iter().map(turned).collect();
        all.sort_unstable();
        all
    }

    /// The sphere with its triangles in an order without rule, tangents, and a vertex that no triangle has.
    fn shuffled_sphere() -> Mesh {
        let sphere = Mesh::builtin("sphere").unwrap();
        let triangles = sphere.indices.as_chunks::<3>().0;
        // A step that shares no factor with their number reaches all.
        let indices = (0..triangles.len()).flat_map(|i| triangles[i * 30011 % triangles.len()]).collect();
        let tangents = sphere.normals.iter().map(|normal| normal.any_orthonormal_vector()).collect();
        let mut mesh = Mesh { indices, tangents, ..sphere };
        for of in [&mut mesh.positions, &mut mesh.normals, &mut mesh.tangents] {
            of.push(Vec3::X);
        }
        mesh
    }

    #[test]
    fn most_vertices_are_shaded_once_and_triangles_are_the_same() {
        let shuffled = shuffled_sphere();
        let ordered = shuffled.in_drawing_order();
        assert!(triangles(&ordered) == triangles(&shuffled));
        assert_eq!(ordered.positions.len(), shuffled.positions.len() - 1);
        let (before, after) = (shaded_a_triangle(&shuffled), shaded_a_triangle(&ordered));
        // Half a vertex a triangle is the least; three are the most.
        assert!(before > 2.5 && after < 0.75, "{before} {after}");
        let mut next = 0;
        for &index in &ordered.indices {
            assert!(index <= next, "vertices are not in the order of their first use");
            next = next.max(index + 1);
        }
    }

    #[test]
    fn what_is_no_sound_mesh_stays_as_it_is() {
        let sound = Mesh { positions: vec![Vec3::ZERO; 3], normals: vec![Vec3::Y; 3], ..Mesh::default() };
        for indices in [vec![0, 1, 3], vec![0, 1], vec![0, 1, 2, u32::MAX, 0, 1]] {
            let mesh = Mesh { indices, ..sound.clone() };
            assert_eq!(mesh.in_drawing_order(), mesh);
        }
        assert_eq!(sound.in_drawing_order(), Mesh::default());
    }
}
