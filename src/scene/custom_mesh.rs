//! Meshes that a program makes.
use std::sync::Arc;

use glam::Vec3;

use super::obj_file::{Obj, TexturedMesh};
use crate::error::{Error, Result};

/// A mesh of triangles that a program has made. Cheap to clone: clones share it.
///
/// ```
/// use threadlight::{CustomMesh, Renderer, Scene};
///
/// let corners = vec![[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]];
/// let square = CustomMesh::new("square", corners, vec![[0, 1, 2], [0, 2, 3]], None, None)?;
/// let scene = Scene::default().with_mesh(square).with_material("clay").with_environment("white").with_size(32, 24).with_threads(4);
/// let picture = Renderer::new()?.render(&scene)?;
/// // A white furnace: the square is darker than the light behind it.
/// let [middle, corner] = [12 * 32 + 16, 0].map(|pixel| picture.radiance()[pixel][0]);
/// assert!(middle < 0.9 && corner > 0.99, "{middle} {corner}");
/// # Ok::<(), threadlight::Error>(())
/// ```
#[derive(Clone)]
pub struct CustomMesh(Arc<Given>);

/// What was given.
struct Given {
    name: String,
    positions: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    normals: Option<Vec<[f32; 3]>>,
    uvs: Option<Vec<[f32; 2]>>,
    digest: blake3::Hash,
}

impl CustomMesh {
    /// A mesh of triangles, each of three numbers of positions, from 0 on; counter-clockwise ones face outwards. Positions are in the unit of the
    /// scene. There may be a normal, of any length, and texture coordinates for each position: these count for the tangents of anisotropic
    /// materials ([`TangentRule::Uv`](super::TangentRule::Uv)). It is known by its name and all of these.
    ///
    /// It is read as an OBJ file of the same numbers is. A normal that is 0 or not finite is missing, and where one is missing the mean normal
    /// of the triangles at its position takes its place. Texture coordinates that are not finite are missing too. Degenerate triangles are
    /// dropped, and reported as a warning. If none is left, rendering is an error; so it is of an object as it is placed that is smaller than
    /// 1e-9 or reaches farther than 1e9 from the origin.
    ///
    /// # Errors
    /// No triangles, or so many that their corners are above 2^32, a corner without a position, a position that is not finite, more or fewer
    /// normals or texture coordinates than positions.
    pub fn new(
        name: impl Into<String>,
        positions: Vec<[f32; 3]>,
        triangles: Vec<[u32; 3]>,
        normals: Option<Vec<[f32; 3]>>,
        uvs: Option<Vec<[f32; 2]>>,
    ) -> Result<Self> {
        let name = name.into();
        let count = positions.len();
        let refused = |problem: String, remedy| Err(Error::input(&name, problem, remedy));
        if triangles.is_empty() {
            return refused("has no triangles".into(), "give one at least");
        }
        if triangles.as_flattened().len() > u32::MAX as usize {
            return refused(format!("has {} triangles, more than can be numbered", triangles.len()), "give fewer");
        }
        let is_absent = |corner: &u32| *corner as usize >= count;
        if let Some((index, corners)) = triangles.iter().enumerate().find(|(_, corners)| corners.iter().any(is_absent))
        {
            let problem = format!("has {count} positions, and triangle {index} is of {corners:?}");
            return refused(problem, "use their numbers, from 0 on");
        }
        if let Some(index) = positions.iter().position(|&position| !Vec3::from(position).is_finite()) {
            let problem = format!("has position {index} that is not finite, {:?}", positions[index]);
            return refused(problem, "give finite numbers");
        }
        let counts = [("normals", normals.as_ref().map(Vec::len)), ("texture coordinates", uvs.as_ref().map(Vec::len))];
        if let Some((what, Some(other))) =
            counts.into_iter().find(|(_, other)| other.is_some_and(|other| other != count))
        {
            return refused(format!("has {count} positions and {other} {what}"), "give one for each position, or none");
        }
        let mut hasher = blake3::Hasher::new();
        let parts: [&[u8]; 4] = [
            bytemuck::cast_slice(&positions),
            bytemuck::cast_slice(&triangles),
            bytemuck::cast_slice(normals.as_deref().unwrap_or_default()),
            bytemuck::cast_slice(uvs.as_deref().unwrap_or_default()),
        ];
        for bytes in parts {
            hasher.update(&(bytes.len() as u64).to_le_bytes()).update(bytes);
        }
        let digest = hasher.finalize();
        Ok(Self(Arc::new(Given { name, positions, triangles, normals, uvs, digest })))
    }

    /// Digest of all that was given but the name.
    pub(crate) fn digest(&self) -> blake3::Hash {
        self.0.digest
    }

    /// The mesh; with its texture coordinates if it has any and they are wanted.
    ///
    /// # Errors
    /// No triangle has an area.
    pub(crate) fn mesh(&self, is_textured: bool) -> Result<TexturedMesh> {
        let Given { name, positions, triangles, normals, uvs, .. } = &*self.0;
        let indices = triangles.as_flattened().to_vec();
        // A normal of length 0 is none.
        let (normals, normal_indices) = match normals {
            Some(normals) => (normals.as_flattened().to_vec(), indices.clone()),
            None => (vec![0.0; 3], vec![0; indices.len()]),
        };
        let uvs = uvs.as_ref().filter(|_| is_textured);
        let mesh = tobj::Mesh {
            positions: positions.as_flattened().to_vec(),
            texcoords: uvs.map(|uvs| uvs.as_flattened().to_vec()).unwrap_or_default(),
            texcoord_indices: uvs.map(|_| indices.clone()).unwrap_or_default(),
            normals,
            normal_indices,
            indices,
            ..Default::default()
        };
        Obj::of_triangles(mesh).cleaned(name, is_textured, &())
    }
}

/// By its name.
impl std::fmt::Display for CustomMesh {
    fn fmt(&self, formatter: &mut std::fmt::Formatter) -> std::fmt::Result {
        formatter.write_str(&self.0.name)
    }
}

impl std::fmt::Debug for CustomMesh {
    fn fmt(&self, formatter: &mut std::fmt::Formatter) -> std::fmt::Result {
        formatter.debug_tuple("CustomMesh").field(&self.0.name).finish()
    }
}

impl PartialEq for CustomMesh {
    fn eq(&self, other: &Self) -> bool {
        (&self.0.name, self.0.digest) == (&other.0.name, other.0.digest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Mesh;
    use std::path::Path;

    const CORNERS: [[f32; 3]; 5] =
        [[0.0, 0.0, 0.1], [1.0, 0.0, 0.0], [1.0, 1.0, 0.3], [0.0, 1.0, 0.0], [2.0, 0.5, 1.0]];
    const TRIANGLES: [[u32; 3]; 4] = [[0, 1, 2], [0, 2, 3], [1, 1, 2], [1, 4, 2]];
    const NORMALS: [[f32; 3]; 5] = [[0.0, 0.0, 1.0], [0.1, 0.0, 2.0], [0.0; 3], [f32::NAN, 0.0, 1.0], [0.0, 0.1, 0.9]];
    const UVS: [[f32; 2]; 5] = [[0.0, 0.0], [1.0, 0.1], [1.0, 1.0], [f32::NAN, 1.0], [2.0, 0.3]];

    /// The same as the text of an OBJ file.
    fn obj(has_normals: bool, has_uvs: bool) -> String {
        let lines = |keyword: &str, numbers: &[f32]| {
            numbers.iter().fold(keyword.to_owned(), |line, number| format!("{line} {number}")) + "\n"
        };
        let mut text: String = CORNERS.iter().map(|corner| lines("v", corner)).collect();
        text.extend(NORMALS.iter().filter(|_| has_normals).map(|normal| lines("vn", normal)));
        text.extend(UVS.iter().filter(|_| has_uvs).map(|uv| lines("vt", uv)));
        for triangle in TRIANGLES {
            let corner = |number: u32| match (has_normals, has_uvs) {
                (false, false) => format!(" {number}"),
                (false, true) => format!(" {number}/{number}"),
                (true, false) => format!(" {number}//{number}"),
                (true, true) => format!(" {number}/{number}/{number}"),
            };
            text += &format!("f{}\n", triangle.map(|number| corner(number + 1)).concat());
        }
        text
    }

    #[test]
    fn a_mesh_that_a_program_gives_is_that_of_an_obj_of_the_same_numbers() {
        for (has_normals, has_uvs) in [(false, false), (false, true), (true, false), (true, true)] {
            let (normals, uvs) = (has_normals.then(|| NORMALS.to_vec()), has_uvs.then(|| UVS.to_vec()));
            let custom = CustomMesh::new("test", CORNERS.to_vec(), TRIANGLES.to_vec(), normals, uvs).unwrap();
            let (path, text) = (Path::new("test.obj"), obj(has_normals, has_uvs));
            assert_eq!(custom.mesh(false).unwrap().mesh, Mesh::FILES.parse(path, text.as_bytes()).unwrap());
            let brushed = custom.mesh(true).unwrap().with_tangents("custom");
            assert_eq!(brushed, TexturedMesh::FILES.parse(path, text.as_bytes()).unwrap().with_tangents("test.obj"));
            assert_eq!((brushed.indices.len(), brushed.tangents.is_empty()), (9, !has_uvs));
        }
    }

    #[test]
    fn what_is_no_mesh_is_an_error_that_names_it() {
        let square = || (CORNERS.to_vec(), TRIANGLES.to_vec());
        let nan = |mut corners: Vec<[f32; 3]>| {
            corners[4][1] = f32::NAN;
            corners
        };
        let new = |(corners, triangles), normals, uvs| CustomMesh::new("square", corners, triangles, normals, uvs);
        for (refused, what) in [
            (new((vec![], vec![]), None, None), "has no triangles"),
            (new((CORNERS.to_vec(), vec![]), None, None), "has no triangles"),
            (new((vec![], TRIANGLES.to_vec()), None, None), "has 0 positions, and triangle 0 is of [0, 1, 2]"),
            (new((CORNERS[..4].to_vec(), TRIANGLES.to_vec()), None, None), "and triangle 3 is of [1, 4, 2]"),
            (
                new((nan(CORNERS.to_vec()), TRIANGLES.to_vec()), None, None),
                "position 4 that is not finite, [2.0, NaN, 1.0]",
            ),
            (new(square(), Some(vec![]), None), "has 5 positions and 0 normals"),
            (new(square(), None, Some(vec![[0.0; 2]; 6])), "has 5 positions and 6 texture coordinates"),
            (new((CORNERS.to_vec(), vec![[1, 1, 2]]), None, None), "has no triangle with an area"),
        ] {
            let error = refused.and_then(|mesh| mesh.mesh(false)).unwrap_err().to_string();
            assert!(error.starts_with("square: ") && error.contains(what), "{error}");
        }
    }

    #[test]
    fn equal_meshes_have_equal_names_and_numbers() {
        let of = |name: &str, triangles: &[[u32; 3]], normals, uvs| {
            CustomMesh::new(name, CORNERS.to_vec(), triangles.to_vec(), normals, uvs).unwrap()
        };
        let mesh = || of("a", &TRIANGLES, None, None);
        assert_eq!(mesh(), mesh());
        for other in [
            of("b", &TRIANGLES, None, None),
            of("a", &TRIANGLES[1..], None, None),
            of("a", &TRIANGLES, Some(NORMALS.to_vec()), None),
            of("a", &TRIANGLES, None, Some(UVS.to_vec())),
        ] {
            assert_ne!(mesh(), other);
        }
    }
}
