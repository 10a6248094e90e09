//! Triangle meshes: read from files, built in, or made by a program.
use std::collections::HashMap;
use std::path::Path;

use glam::{DVec3, Vec3};

use super::{BoundingSphere, FORMATS};
use crate::error::{Error, Result};
use crate::files::FileKind;

/// Cells along the edge of a face of the built-in sphere, 49152 triangles: chords err by 1.5e-4, half of it each side.
const SPHERE_CELLS: usize = 64;

/// An indexed triangle mesh with unit normals; counter-clockwise triangles face outwards, as far as the file is right.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Finite.
    pub positions: Vec<Vec3>,
    /// Unit, one a position.
    pub normals: Vec<Vec3>,
    /// Those of the texture coordinates, unit, one a position; empty where they were not asked for, or there are none.
    pub tangents: Vec<Vec3>,
    /// Three a triangle, each below the number of positions; no triangle is degenerate.
    pub indices: Vec<u32>,
}

/// Where a ray meets a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// How many of the ray's directions away.
    pub distance: f64,
    /// The interpolated normal, of any length.
    pub normal: DVec3,
    /// The interpolated tangent, of any length: 0 of a mesh without.
    pub tangent: DVec3,
}

/// The names that [`Mesh::builtin`] takes.
pub fn builtin_names() -> &'static [&'static str] {
    &["sphere"]
}

impl Mesh {
    /// A built-in mesh: `sphere` has radius 1 and its centre at the origin, and is within 1e-4 of the true sphere everywhere.
    pub fn builtin(name: &str) -> Result<Self> {
        match name {
            "sphere" => Ok(cube_sphere(SPHERE_CELLS)),
            _ => Err(Error::input(format!("mesh `{name}`"), "is not built in", Self::FILES.remedy_for(name))),
        }
    }

    /// The formats of mesh files.
    pub const FILES: FileKind<Self> =
        FileKind { what: "mesh", formats: FORMATS, builtin_names: || builtin_names().to_vec() };

    /// Reads a mesh file: see [`Self::FILES`].
    ///
    /// # Errors
    /// What cannot be read or is no mesh with an area.
    pub fn load(path: &Path) -> Result<Self> {
        Self::FILES.load(path)
    }

    /// The same surface with each triangle split into four at the middles of its edges; normals and tangents are interpolated.
    pub fn subdivided(&self) -> Self {
        let mut mesh = Self { indices: Vec::with_capacity(4 * self.indices.len()), ..self.clone() };
        let mut middles = HashMap::new();
        for &[a, b, c] in self.indices.as_chunks::<3>().0 {
            let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[from, to]| {
                // Both triangles at an edge get the same vertex.
                *middles.entry([from.min(to), from.max(to)]).or_insert_with(|| {
                    let [from, to] = [from as usize, to as usize];
                    let normal = self.normals[from] + self.normals[to];
                    mesh.positions.push(self.positions[from].midpoint(self.positions[to]));
                    // Opposite normals have no middle.
                    mesh.normals.push(normal.try_normalize().unwrap_or(self.normals[from]));
                    if let [a, b] = [from, to].map(|end| self.tangents.get(end))
                        && let (Some(a), Some(b)) = (a, b)
                    {
                        mesh.tangents.push((a + b).try_normalize().unwrap_or(*a));
                    }
                    mesh.positions.len() as u32 - 1
                })
            });
            mesh.indices.extend([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca]);
        }
        mesh
    }

    /// Where the ray from `origin` along `direction` (any length) first meets the surface, from either side: how many directions away.
    /// Tries every triangle: a millisecond for 100,000.
    pub fn hit(&self, origin: DVec3, direction: DVec3) -> Option<Hit> {
        let mut first: Option<Hit> = None;
        for triangle in self.indices.as_chunks::<3>().0 {
            let [a, b, c] = triangle.map(|index| self.positions[index as usize].as_dvec3());
            // Moeller and Trumbore 1997.
            let (ab, ac) = (b - a, c - a);
            let across = direction.cross(ac);
            let inverse = across.dot(ab).recip();
            let from_a = origin - a;
            let u = across.dot(from_a) * inverse;
            let along = from_a.cross(ab);
            let v = along.dot(direction) * inverse;
            let distance = along.dot(ac) * inverse;
            // A ray along the triangle's plane gives infinities or NaN, which are in no range.
            let is_inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 0.0;
            if is_inside && first.is_none_or(|nearest| distance < nearest.distance) {
                let interpolated = |of: &[Vec3]| {
                    let [a, b, c] =
                        triangle.map(|index| of.get(index as usize).copied().unwrap_or_default().as_dvec3());
                    (1.0 - u - v) * a + u * b + v * c
                };
                let (normal, tangent) = (interpolated(&self.normals), interpolated(&self.tangents));
                first = Some(Hit { distance, normal, tangent });
            }
        }
        first
    }

    /// The smallest and largest coordinates.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        self.positions.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), &position| {
            (low.min(position), high.max(position))
        })
    }

    /// A sphere that holds the mesh: around the middle of its bounds, so not always the smallest.
    pub fn bounding_sphere(&self) -> BoundingSphere {
        let (low, high) = self.bounds();
        let centre = low.as_dvec3().midpoint(high.as_dvec3());
        let distances = self.positions.iter().map(|position| position.as_dvec3().distance(centre));
        BoundingSphere { centre, radius: distances.fold(0.0, f64::max) }
    }
}

/// The sphere as a cube of `cells` x `cells` quads a face, with equal angles between the grid lines.
fn cube_sphere(cells: usize) -> Mesh {
    let mut mesh = Mesh::default();
    // Chords lie inside the sphere, by at most half the square of the angle from the middle of a cell to its corner. The
    // cells at the middle of a face are the largest. Vertices lie half of that outside, so the error has both signs.
    let angle = 0.5 * std::f64::consts::FRAC_PI_2 / cells as f64;
    let radius = 1.0 + 0.5 * angle * angle;
    let tangent = |index: usize| ((2 * index) as f64 * angle - std::f64::consts::FRAC_PI_4).tan();
    // Normal, and the two directions along each face, right-handed.
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    for face in 0..6 {
        let (i, sign) = (face / 2, if face % 2 == 0 { 1.0 } else { -1.0 });
        let (normal, right, up) = (sign * axes[i], sign * axes[(i + 1) % 3], axes[(i + 2) % 3]);
        let first = mesh.positions.len() as u32;
        for row in 0..=cells {
            for column in 0..=cells {
                let direction = (normal + tangent(column) * right + tangent(row) * up).normalize();
                mesh.positions.push((radius * direction).as_vec3());
                mesh.normals.push(direction.as_vec3());
            }
        }
        let stride = cells as u32 + 1;
        for (row, column) in (0..cells as u32).flat_map(|row| (0..cells as u32).map(move |column| (row, column))) {
            let corner = first + row * stride + column;
            let [a, b, c, d] = [corner, corner + 1, corner + stride + 1, corner + stride];
            let length = |from: u32, to: u32| mesh.positions[from as usize].distance(mesh.positions[to as usize]);
            // Near the corners of the cube cells are rhombs: along the shorter diagonal the chords stay short.
            let split = if length(a, c) <= length(b, d) { [a, b, c, a, c, d] } else { [a, b, d, b, c, d] };
            mesh.indices.extend(split);
        }
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Loads a mesh from the text of an OBJ file named `test.obj`.
    fn load(text: impl AsRef<[u8]>) -> Result<Mesh> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("test.obj");
        std::fs::write(&path, text).unwrap();
        Mesh::load(&path)
    }

    const CUBE: &str = "
        v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1
        f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

    #[test]
    fn the_sphere_is_within_1e_4_of_the_true_one() {
        let mesh = Mesh::builtin("sphere").unwrap();
        let triangles = mesh.indices.len() / 3;
        assert!(triangles < 60_000, "{triangles}");
        let (mut low, mut high, mut crooked) = (f32::MAX, 0f32, 0f32);
        for triangle in mesh.indices.chunks_exact(3) {
            let [a, b, c] = [0, 1, 2].map(|corner| triangle[corner] as usize);
            for (u, v) in [(0.0, 0.0), (0.5, 0.0), (0.5, 0.5), (0.0, 0.5), (1.0 / 3.0, 1.0 / 3.0), (0.1, 0.3)] {
                let blend = |of: &[Vec3]| of[a] * (1.0 - u - v) + of[b] * u + of[c] * v;
                let (position, normal) = (blend(&mesh.positions), blend(&mesh.normals).normalize());
                low = low.min(position.length());
                high = high.max(position.length());
                crooked = crooked.max(normal.distance(position.normalize()));
            }
            let outwards = (mesh.positions[b] - mesh.positions[a]).cross(mesh.positions[c] - mesh.positions[a]);
            assert!(outwards.dot(mesh.positions[a]) > 0.0, "a triangle faces inwards");
        }
        assert!(1.0 - low < 1e-4 && high - 1.0 < 1e-4 && crooked < 1e-4, "{low} {high} {crooked}");
    }

    #[test]
    fn quads_and_polygons_become_triangles_of_the_same_area() {
        let area = |mesh: &Mesh| -> f32 {
            let corner = |index: u32| mesh.positions[index as usize];
            let triangles = mesh.indices.chunks_exact(3);
            triangles.map(|t| (corner(t[1]) - corner(t[0])).cross(corner(t[2]) - corner(t[0])).length() / 2.0).sum()
        };
        let cube = load(CUBE).unwrap();
        assert_eq!((cube.indices.len(), cube.positions.len()), (36, 8));
        assert!((area(&cube) - 24.0).abs() < 1e-5);
        assert_eq!(cube.bounds(), (Vec3::NEG_ONE, Vec3::ONE));
        assert_eq!(cube.bounding_sphere(), BoundingSphere { centre: DVec3::ZERO, radius: 3f64.sqrt() });
        let octagon: String = (0..8)
            .map(|i| (f32::from(i as u8) * std::f32::consts::FRAC_PI_4).sin_cos())
            .map(|(y, x)| format!("v {x} {y} 0\n"))
            .collect();
        let octagon = load(octagon + "f 1 2 3 4 5 6 7 8").unwrap();
        assert_eq!(octagon.indices.len(), 18);
        assert!((area(&octagon) - 8f32.sqrt()).abs() < 1e-5);
        assert!(octagon.normals.iter().all(|normal| normal.distance(Vec3::Z) < 1e-6));
    }

    #[test]
    fn subdividing_leaves_the_surface_as_it_is_and_shares_vertices() {
        let cube = load(CUBE).unwrap();
        let fine = cube.subdivided();
        assert_eq!(fine.indices.len(), 4 * cube.indices.len());
        // A closed surface of genus 0 has 3 E = 2 F edges each with one new vertex: V + 18.
        assert_eq!(fine.positions.len(), cube.positions.len() + 18);
        assert_eq!(fine.bounds(), cube.bounds());
        let area_vector = |mesh: &Mesh, t: &[u32]| {
            let [a, b, c] = [t[0], t[1], t[2]].map(|corner| mesh.positions[corner as usize]);
            (b - a).cross(c - a)
        };
        for (coarse, quarters) in cube.indices.chunks_exact(3).zip(fine.indices.chunks_exact(12)) {
            for quarter in quarters.chunks_exact(3) {
                assert!(area_vector(&fine, quarter).distance(area_vector(&cube, coarse) / 4.0) < 1e-6);
            }
        }
        assert!(fine.normals.iter().all(|normal| normal.is_normalized()));
    }

    #[test]
    fn missing_normals_are_weighted_by_angle() {
        // The corners of a cube, each face split along some diagonal: only weights by angle give the true diagonals.
        for (position, normal) in load(CUBE).map(|cube| cube.positions.into_iter().zip(cube.normals)).unwrap() {
            assert!(normal.distance(position.normalize()) < 1e-6, "{position} {normal}");
        }
    }

    #[test]
    fn single_missing_and_bad_normals_are_replaced_and_the_others_kept() {
        let mesh =
            load("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nvn 0 3 4\nvn 0 0 0\nvn nan 0 1\nf 1//1 2//2 3//3\nf 2 4 3//1")
                .unwrap();
        let tilted = Vec3::new(0.0, 0.6, 0.8);
        assert_eq!(mesh.normals, [tilted, Vec3::Z, Vec3::Z, Vec3::Z, tilted]);
        assert_eq!(mesh.indices, [0, 1, 2, 1, 3, 4]);
    }

    #[test]
    fn degenerate_triangles_are_dropped() {
        let mesh = load("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 2 0 0\nv 1 0 0\nf 1 2 3\nf 1 1 3\nf 1 2 4\nf 2 5 3\nf 1 2\nf 3")
            .unwrap();
        assert_eq!((mesh.indices.len(), mesh.positions.len()), (3, 3));
        let huge = load("v 1e38 1e38 0\nv -1e38 0 3e38\nv 0 1e38 1e38\nf 1 2 3").unwrap();
        assert!(huge.normals.iter().all(|normal| normal.is_normalized()));
    }

    #[test]
    fn what_is_not_geometry_is_ignored_and_indices_may_be_relative() {
        let mesh = load(b"# caf\xe9\nmtllib none.mtl\no a\nusemtl b\ns 1\nv 0 0 0 1 0 0\nv 1 0 0\r\nvt 0 0\nv 0 1 0\ng c\nl 1 2\nl 3 2 1\np 1\nf -3/1 -2/1 -1/9\n").unwrap();
        assert_eq!(mesh.indices, [0, 1, 2]);
        assert_eq!(mesh.normals, [Vec3::Z; 3]);
    }

    #[test]
    fn a_byte_order_mark_is_no_part_of_the_first_word() {
        let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        assert_eq!(load(format!("\u{feff}{triangle}")).unwrap(), load(triangle).unwrap());
    }

    #[test]
    fn groups_and_materials_do_not_cut_the_mesh() {
        let grouped = CUBE.replace("\nf 3", "\no lid\nusemtl red\nf 3");
        assert_eq!(load(grouped).unwrap(), load(CUBE).unwrap());
    }

    #[test]
    fn hostile_files_are_errors_that_name_the_file() {
        let triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\n";
        for (text, what) in [
            (format!("{triangle}f 1 2 4"), "line 5: there is no vertex 4"),
            (format!("{triangle}f 1 2 0"), "line 5: there is no vertex 0"),
            (format!("{triangle}f 1 2 -4"), "line 5: there is no vertex -4"),
            (format!("{triangle}f 1 2 -9223372036854775808"), "line 5: there is no vertex -9223372036854775808"),
            (format!("{triangle}f 1 2 9223372036854775807"), "line 5: there is no vertex 9223372036854775807"),
            (format!("{triangle}f 1 2 4294967299"), "line 5: there is no vertex 4294967299"),
            (format!("{triangle}f 1 2 //1"), "line 5: there is no vertex in //1"),
            (format!("{triangle}f 9"), "line 5: there is no vertex 9"),
            (format!("{triangle}f 1 9"), "line 5: there is no vertex 9"),
            (format!("{triangle}f 1 2 99999999999999999999"), "no vertex 99999999999999999999"),
            (format!("{triangle}f 1 2 x"), "no vertex x"),
            (format!("{triangle}f 1//1 2//2 3"), "line 5: there is no normal 2"),
            (format!("{triangle}f 1//0 2 3"), "line 5: there is no normal 0"),
            (format!("{triangle}f 1//-2 2 3\nvn 0 0 1"), "line 5: there is no normal -2"),
            (format!("{triangle}f 1//-9223372036854775808 2 3"), "no normal -9223372036854775808"),
            (format!("{triangle}f 1//99999999999999999999 2 3"), "no normal 99999999999999999999"),
            (format!("{triangle}f 1/1/x 2 3"), "no normal x"),
            (format!("{triangle}f"), "line 5: a face without corners"),
            (format!("{triangle}v 1 2"), "line 5: `v` is not followed by three numbers"),
            (format!("{triangle}v 1 2 x"), "line 5: `v` is not followed by three numbers"),
            (format!("{triangle}vn 1 2"), "line 5: `vn` is not followed by three numbers"),
            (format!("{triangle}v 1 2 nan\nf 1 2 4"), "line 5: a vertex that is not finite"),
            (format!("{triangle}v 1 2 1e99\nf 1 2 4"), "line 5: a vertex that is not finite"),
            (format!("{triangle}f 1 1 1"), "no triangle"),
            (format!("{triangle}f 1 2"), "no triangle"),
            (format!("{triangle}l 1 2 3"), "no triangle"),
            (triangle.into(), "no triangle"),
            (String::new(), "no triangle"),
        ] {
            let error = load(&text).unwrap_err().to_string();
            assert!(error.contains("test.obj") && error.contains(what) && !error.contains('\n'), "{text}: {error}");
        }
        assert!(Mesh::load(Path::new("missing.obj")).unwrap_err().to_string().contains("missing.obj"));
        assert!(Mesh::load(Path::new("mesh.ply")).unwrap_err().to_string().contains(".obj"));
        assert!(Mesh::builtin("cube").unwrap_err().to_string().contains("sphere"));
    }

    #[test]
    fn a_ray_meets_the_sphere_where_it_is_with_its_normal() {
        let sphere = Mesh::builtin("sphere").unwrap();
        for target in [DVec3::ZERO, DVec3::new(0.3, -0.2, 0.5), DVec3::new(-0.6, 0.6, 0.1)] {
            let origin = DVec3::new(1.5, 1.0, 3.5);
            let direction = 2.0 * (target - origin);
            let Hit { distance, normal, .. } = sphere.hit(origin, direction).unwrap();
            let point = origin + distance * direction;
            assert!((point.length() - 1.0).abs() < 2e-4 && normal.normalize().distance(point) < 1e-3, "{point}");
            // From within it is seen too; away from it, it is not.
            assert!(sphere.hit(DVec3::ZERO, direction).is_some() && sphere.hit(origin, -direction).is_none());
        }
        assert!(sphere.hit(DVec3::new(0.0, 0.0, 3.0), DVec3::new(0.5, 0.0, -1.0)).is_none());
        assert!(sphere.hit(DVec3::ZERO, DVec3::ZERO).is_none());
    }

    #[test]
    fn the_dragon_loads() {
        let Some(path) = crate::files::measured("mesh/dragon_100k.obj") else { return };
        let start = std::time::Instant::now();
        let mesh = Mesh::load(&path).unwrap();
        println!("{} triangles in {:?}", mesh.indices.len() / 3, start.elapsed());
        assert!(mesh.indices.len() / 3 > 99_900);
        assert!(mesh.normals.iter().all(|normal| normal.is_normalized()));
    }
}
