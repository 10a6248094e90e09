//! Reads meshes from Wavefront OBJ files, and cleans them so that nothing degenerate reaches the rasteriser.
use std::borrow::Cow;
use std::collections::HashMap;
use std::fmt::Write;
use std::io::{BufReader, Read};
use std::path::Path;

use glam::{DVec3, Vec2, Vec3};

use super::Mesh;
use super::polygon::triangles_of;
use super::winding::against_neighbours;
use crate::error::{Error, Result};
use crate::files::FileFormat;
use crate::progress::Observer;

/// A mesh and where its vertices are on a texture.
#[derive(Clone, Debug, Default)]
pub struct TexturedMesh {
    /// Without tangents. Vertices are split where their texture coordinates differ.
    pub mesh: Mesh,
    /// One a position, not finite where there is none; or empty.
    pub uvs: Vec<Vec2>,
}

/// So many lines or triangles are read from one look at whether to go on to the next.
const BETWEEN_CHECKS: usize = 4096;

/// Why reading ends early.
const CANCELLED: &str = "is not read to its end";

/// What lines of the mesh begin with.
const MESH_KEYWORDS: [&str; 5] = ["v", "vn", "vt", "f", "s"];

pub(super) const FORMAT: FileFormat<Mesh> =
    FileFormat { extension: "obj", name: "a Wavefront .obj", is_of_format: |_| true, parse };

/// The same with its texture coordinates.
pub(super) const TEXTURED_FORMAT: FileFormat<TexturedMesh> =
    FileFormat { extension: "obj", name: "a Wavefront .obj", is_of_format: |_| true, parse: parse_textured };

fn parse(path: &Path, bytes: &[u8], observer: &dyn Observer) -> Result<Mesh> {
    parse_parts(path, bytes, false, observer).map(|TexturedMesh { mesh, .. }| mesh)
}

fn parse_textured(path: &Path, bytes: &[u8], observer: &dyn Observer) -> Result<TexturedMesh> {
    parse_parts(path, bytes, true, observer)
}

/// Reads all triangles and polygons as one mesh; objects, groups, materials and lines are ignored, and so are texture coordinates if they are
/// not wanted. Polygons become triangles. Where a normal is missing, zero or not finite, the mean normal of the faces that share position and
/// smoothing group takes its place, weighted by their angles there; of a sheet that has every face twice, once
/// reversed, those of one side. Faces that are wound against their neighbours count as turned. Degenerate triangles are dropped.
fn parse_parts(path: &Path, bytes: &[u8], is_textured: bool, observer: &dyn Observer) -> Result<TexturedMesh> {
    if [[0xff, 0xfe], [0xfe, 0xff]].iter().any(|mark| bytes.starts_with(mark)) {
        return Err(Error::in_file(path, "is text in UTF-16", "save it as UTF-8"));
    }
    // Names in old files are in any encoding; the numbers are ASCII in all of the others.
    let text = String::from_utf8_lossy(bytes);
    // Some editors put a byte order mark first, which would be part of the first word.
    let obj = read_obj(&whole_lines(text.trim_start_matches('\u{feff}')), is_textured, observer);
    // What is not read to its end is said to be wrong, too.
    observer.check()?;
    let obj = obj.map_err(|problem| Error::in_file(path, problem, "repair or export it again"))?;
    obj.cleaned(path.display(), is_textured, observer)
}

/// `text` without comments, its lines ended by LF, and each line of the mesh that a backslash continues as one. Lines after it keep their
/// numbers. Comments and names, such as that of a folder, may end in a backslash and go no further.
fn whole_lines(text: &str) -> Cow<'_, str> {
    if !text.contains(['#', '\\', '\r']) {
        return text.into();
    }
    let (mut joined, mut continued) = (String::with_capacity(text.len()), 0);
    // What is left of CR are ends of lines of old Macs.
    for line in text.lines().flat_map(|line| line.split('\r')) {
        let line = line.split('#').next().unwrap_or_default();
        let is_of_mesh =
            continued > 0 || MESH_KEYWORDS.contains(&line.split_ascii_whitespace().next().unwrap_or_default());
        match line.trim_end().strip_suffix('\\').filter(|_| is_of_mesh) {
            Some(begun) => {
                joined.extend([begun, " "]);
                continued += 1;
            }
            None => {
                joined.push_str(line);
                joined.extend(std::iter::repeat_n('\n', 1 + std::mem::take(&mut continued)));
            }
        }
    }
    joined.into()
}

/// Which faces a normal that is missing is the mean of.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum SmoothingGroup {
    /// Those before which nothing is said of it.
    Unsaid,
    /// Those of this number.
    Numbered(u32),
    /// The one of this index.
    Flat(u32),
}

/// What an OBJ says of faces.
pub(super) struct Obj {
    mesh: tobj::Mesh,
    /// That of each face.
    smoothing_groups: Vec<SmoothingGroup>,
}

impl Obj {
    /// An OBJ of triangles without smoothing groups.
    pub(super) fn of_triangles(mesh: tobj::Mesh) -> Self {
        let smoothing_groups = vec![SmoothingGroup::Unsaid; mesh.indices.len() / 3];
        Self { mesh, smoothing_groups }
    }

    /// The mesh of this name without its degenerate triangles.
    pub(super) fn cleaned(
        &self,
        name: impl std::fmt::Display,
        is_textured: bool,
        observer: &dyn Observer,
    ) -> Result<TexturedMesh> {
        let Cleaned { textured, dropped, turned } = clean(self, observer)?;
        let mesh = &textured.mesh;
        if mesh.indices.is_empty() {
            return Err(Error::input(name, "has no triangle with an area", "give a mesh with faces"));
        }
        // What is read for its tangents was read without them before.
        if dropped > 0 && !is_textured {
            tracing::warn!("{name}: dropped {dropped} degenerate triangles");
        }
        if turned > 0 && !is_textured {
            tracing::warn!("{name}: {turned} triangles are wound against their neighbours; their normals are turned");
        }
        tracing::debug!("{name}: {} triangles, {} vertices", mesh.indices.len() / 3, mesh.positions.len());
        Ok(textured)
    }
}

/// The faces in the text of an OBJ, each corner with an index into the positions and one into the normals; a corner
/// without a normal has one of length 0. If `is_textured` each has an index into the texture coordinates too, which are NaN where it has
/// none. The error is what is wrong.
fn read_obj(text: &str, is_textured: bool, observer: &dyn Observer) -> Result<Obj, String> {
    let (lines, smoothing_groups) = geometry_lines(text, is_textured, observer)?;
    let options = tobj::LoadOptions::default();
    let no_materials = |_: &Path| Ok(Default::default());
    let mut lines = BufReader::new(Watched { bytes: lines.as_bytes(), observer });
    let found = tobj::load_obj_buf(&mut lines, &options, no_materials);
    // Without o, g and usemtl there is one model.
    let mesh = found.map(|(models, _)| models.into_iter().next().map(|model| model.mesh).unwrap_or_default());
    let is_sound = |mesh: &tobj::Mesh| {
        !mesh.face_arities.contains(&0) && mesh.positions.iter().all(|coordinate| coordinate.is_finite())
    };
    match mesh {
        Ok(mesh) if is_sound(&mesh) => Ok(Obj { mesh, smoothing_groups }),
        // What tobj says of it names no line.
        unsound => {
            let fault = |(index, line)| Some(format!("line {}: {}", index + 1, fault(line, is_textured)?));
            let cause = unsound.err().map_or_else(String::new, |cause| format!(": {cause}"));
            Err(text.lines().enumerate().find_map(fault).unwrap_or(format!("is not a sound OBJ{cause}")))
        }
    }
}

/// Bytes that can be read until somebody cancels.
struct Watched<'a> {
    bytes: &'a [u8],
    observer: &'a dyn Observer,
}

impl Read for Watched<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        if self.observer.cancelled() { Err(std::io::Error::other(CANCELLED)) } else { self.bytes.read(buffer) }
    }
}

/// What is wrong with a line by itself, if anything is.
fn fault(line: &str, is_textured: bool) -> Option<String> {
    let mut words = line.split_ascii_whitespace();
    let keyword = words.next()?;
    let numbers = |most: usize| -> Vec<f32> { words.clone().take(most).map_while(|word| word.parse().ok()).collect() };
    match keyword {
        "v" | "vn" if numbers(3).len() < 3 => Some(format!("`{keyword}` is not followed by three numbers")),
        "v" if !numbers(3).iter().all(|number| number.is_finite()) => Some("a vertex that is not finite".to_owned()),
        "vt" if is_textured && numbers(2).len() < words.clone().count().clamp(1, 2) => {
            Some("`vt` is not followed by one or two numbers".to_owned())
        }
        "f" if words.next().is_none() => Some("a face without corners".to_owned()),
        _ => None,
    }
}

/// The lines of an OBJ that are the mesh, such that tobj reads them right: of `v` the coordinates, `vn`, and `f` with its
/// corners as `position//normal`; if `is_textured` also `vt` with two coordinates, and corners as `position/vt/normal`.
/// What `s` says comes beside them, for each face.
///
/// The rest goes since tobj takes polylines (`l`) for faces, wants colours for all vertices or none, and begins a new mesh at
/// every group and material, whose vertices then are no longer shared. Corners without a normal get one of length 0,
/// the last in the file, as from tobj they would get that of the corner before; those without texture coordinates get NaN in the same way.
/// Indices are checked here: errors then name the line, and of normals and texture coordinates tobj takes 0 for none, and multiplies absurd
/// ones until they overflow.
fn geometry_lines(
    text: &str,
    is_textured: bool,
    observer: &dyn Observer,
) -> Result<(String, Vec<SmoothingGroup>), String> {
    let count_of = |keyword: &str| {
        let is_one = |line: &&str| line.split_ascii_whitespace().next() == Some(keyword);
        text.lines().filter(is_one).count() as i64
    };
    let [positions, normals, uvs] = ["v", "vn", "vt"].map(count_of);
    // Adds the corner `word`, with so many positions, normals and texture coordinates before it, to `lines`; the error is what there is not.
    let corner = |lines: &mut String, word: &str, before: [i64; 3]| -> Result<(), String> {
        let [positions_before, normals_before, uvs_before] = before;
        let mut numbers = word.split('/');
        let [position, uv, normal] = [(); 3].map(|()| numbers.next().unwrap_or_default());
        if position.is_empty() {
            return Err(format!("vertex in {word}"));
        }
        let position =
            index_among(position, positions, positions_before).map_err(|number| format!("vertex {number}"))?;
        let normal = index_among(normal, normals, normals_before).map_err(|number| format!("normal {number}"))?;
        // Writing to a string cannot fail.
        let _ = if is_textured {
            let uv = index_among(uv, uvs, uvs_before).map_err(|number| format!("texture coordinate {number}"))?;
            write!(lines, " {position}/{uv}/{normal}")
        } else {
            write!(lines, " {position}//{normal}")
        };
        Ok(())
    };
    let (mut lines, mut before) = (String::with_capacity(text.len()), [0; 3]);
    let (mut groups, mut group) = (Vec::new(), SmoothingGroup::Unsaid);
    for (index, line) in text.lines().enumerate() {
        if index.is_multiple_of(BETWEEN_CHECKS) && observer.cancelled() {
            return Err(CANCELLED.into());
        }
        let mut words = line.split_ascii_whitespace();
        let Some(keyword) = words.next().filter(|word| MESH_KEYWORDS.contains(word)) else { continue };
        if keyword == "vt" && !is_textured {
            continue;
        }
        if keyword == "s" {
            // Some programs write `on`.
            let number = |word: &str| if word == "off" { 0 } else { word.parse().unwrap_or(1) };
            group = SmoothingGroup::Numbered(words.next().map_or(1, number));
            continue;
        }
        lines += keyword;
        for (count, counted) in before.iter_mut().zip(["v", "vn", "vt"]) {
            *count += i64::from(keyword == counted);
        }
        if keyword == "f" {
            let is_flat = group == SmoothingGroup::Numbered(0);
            groups.push(if is_flat { SmoothingGroup::Flat(groups.len() as u32) } else { group });
            for word in words {
                corner(&mut lines, word, before).map_err(|what| format!("line {}: there is no {what}", index + 1))?;
            }
        } else if keyword == "vt" {
            // The second one may be left out, a third has no meaning here.
            words.chain(["0"]).take(2).for_each(|word| lines.extend([" ", word]));
        } else {
            words.take(3).for_each(|word| lines.extend([" ", word]));
        }
        lines.push('\n');
    }
    Ok((lines + if is_textured { "vn 0 0 0\nvt nan nan\n" } else { "vn 0 0 0\n" }, groups))
}

/// What `number`, the word of an index, stands for among `count` things of which so many are `before` it: the one after all if it is empty.
fn index_among(number: &str, count: i64, before: i64) -> Result<i64, &str> {
    if number.is_empty() {
        return Ok(count + 1);
    }
    let index = number.parse().ok();
    index.filter(|index| (1..=count).contains(index) || (-before..0).contains(index)).ok_or(number)
}

/// The sum of normals of faces, weighted.
#[derive(Default)]
struct MeanNormal {
    sum: DVec3,
    /// The same with each normal turned to the side of those before.
    front: DVec3,
    weight: f64,
    /// Whether one was on the other side.
    has_both_sides: bool,
}

impl MeanNormal {
    /// Where the faces of two sides cancel, less than this part of their weight is left, and is rounding.
    const CANCELLED: f64 = 1e-3;

    fn add(&mut self, weight: f64, normal: DVec3) {
        let normal = weight * normal;
        self.sum += normal;
        let is_behind = normal.dot(self.front) < 0.0;
        self.has_both_sides |= is_behind;
        self.front += if is_behind { -normal } else { normal };
        self.weight += weight;
    }

    /// What a face of this normal has there, and whether that is the normal of the sheet's back.
    fn of_face(&self, normal: DVec3) -> (DVec3, bool) {
        if self.sum.length() > Self::CANCELLED * self.weight {
            return (self.sum.normalize(), false);
        }
        let (front, is_back) = (self.front.normalize(), normal.dot(self.front) < 0.0);
        (if is_back { -front } else { front }, is_back)
    }
}

/// What is left of an OBJ.
struct Cleaned {
    textured: TexturedMesh,
    /// How many triangles were degenerate.
    dropped: usize,
    /// How many were wound against their neighbours, where that matters.
    turned: usize,
}

/// A triangle of an OBJ.
struct Triangle {
    /// The places of its corners in the indices of the OBJ.
    corners: [usize; 3],
    positions: [u32; 3],
    /// Unit.
    normal: DVec3,
    area: f64,
    group: SmoothingGroup,
}

/// The mean normals of `triangles` at each position, group by group.
fn mean_normals(triangles: &[Triangle], positions: &[Vec3]) -> HashMap<(u32, SmoothingGroup), MeanNormal> {
    let mut mean_normals = HashMap::<_, MeanNormal>::new();
    for triangle in triangles {
        let [a, b, c] = triangle.positions.map(|position| positions[position as usize].as_dvec3());
        for (position, [at, next, before]) in triangle.positions.into_iter().zip([[a, b, c], [b, c, a], [c, a, b]]) {
            let angle = (next - at).angle_between(before - at);
            mean_normals.entry((position, triangle.group)).or_default().add(angle, triangle.normal);
        }
    }
    mean_normals
}

/// Turns the normals of `triangles` that are wound against their neighbours; gives their number.
fn turn_alike(triangles: &mut [Triangle]) -> usize {
    let corners: Vec<_> = triangles.iter().map(|triangle| triangle.positions).collect();
    let areas: Vec<_> = triangles.iter().map(|triangle| triangle.area).collect();
    let against = against_neighbours(&corners, &areas);
    let against = triangles.iter_mut().zip(against).filter(|(_, is_against)| *is_against);
    against.map(|(triangle, _)| triangle.normal = -triangle.normal).count()
}

/// Joins corners with the same position, normal and texture coordinates into vertices.
fn clean(Obj { mesh: obj, smoothing_groups }: &Obj, observer: &dyn Observer) -> Result<Cleaned> {
    let (positions, normals) = (vectors(&obj.positions), vectors(&obj.normals));
    // Normals that are none count as missing.
    let normal_at = |index: u32| {
        let normal = normals[index as usize].as_dvec3();
        (normal.is_finite() && normal.length_squared() > 0.0).then(|| normal.normalize())
    };
    let (mut kept, mut dropped) = (Vec::new(), 0);
    for (index, (face, corners)) in triangles(obj, &positions).into_iter().enumerate() {
        if index.is_multiple_of(BETWEEN_CHECKS) {
            observer.check()?;
        }
        let at = corners.map(|corner| obj.indices[corner]);
        let [a, b, c] = at.map(|position| positions[position as usize].as_dvec3());
        let area = (b - a).cross(c - a);
        let longest = (b - a).length_squared().max((c - a).length_squared()).max((c - b).length_squared());
        // A height of a millionth of the length is rounding of single precision, and the normal is noise.
        if area.length() <= 1e-6 * longest {
            dropped += 1;
            continue;
        }
        let group = smoothing_groups[face];
        kept.push(Triangle { corners, positions: at, normal: area.normalize(), area: area.length(), group });
    }
    let lacks_normals = obj.normal_indices.iter().any(|&index| normal_at(index).is_none());
    let mut means = if lacks_normals { mean_normals(&kept, &positions) } else { HashMap::new() };
    // Where all faces of a position are on one side, none is wound against another.
    let mut turned = 0;
    if means.values().any(|mean| mean.has_both_sides) {
        turned = turn_alike(&mut kept);
        if turned > 0 {
            means = mean_normals(&kept, &positions);
        }
    }
    let mut vertices = HashMap::new();
    let (mut mesh, mut uvs) = (Mesh::default(), Vec::new());
    for (index, Triangle { corners, positions: at, normal: face_normal, group, .. }) in kept.into_iter().enumerate() {
        if index.is_multiple_of(BETWEEN_CHECKS) {
            observer.check()?;
        }
        for (corner, position) in corners.into_iter().zip(at) {
            let index = obj.normal_indices[corner];
            let (normal, direction) = match normal_at(index) {
                Some(direction) => (Ok(index), direction),
                None => {
                    let (direction, is_back) = means[&(position, group)].of_face(face_normal);
                    (Err((group, is_back)), direction)
                }
            };
            let uv = obj.texcoord_indices.get(corner).copied();
            let index = *vertices.entry((position, normal, uv)).or_insert_with(|| {
                uvs.extend(uv.map(|uv| Vec2::from_slice(&obj.texcoords[2 * uv as usize..])));
                mesh.positions.push(positions[position as usize]);
                mesh.normals.push(direction.as_vec3());
                mesh.positions.len() as u32 - 1
            });
            mesh.indices.push(index);
        }
    }
    Ok(Cleaned { textured: TexturedMesh { mesh, uvs }, dropped, turned })
}

/// The triangles that the faces of `obj` consist of: the index of the face, and the places of their corners in the indices of `obj`. Faces of
/// fewer than three corners have none.
fn triangles(obj: &tobj::Mesh, positions: &[Vec3]) -> Vec<(usize, [usize; 3])> {
    // No numbers of corners are given if all faces are triangles.
    if obj.face_arities.is_empty() {
        let corners = |face| std::array::from_fn(|corner| 3 * face + corner);
        return (0..obj.indices.len() / 3).map(|face| (face, corners(face))).collect();
    }
    let mut next = 0;
    let triangles_of_face = |(face, &arity): (usize, &u32)| {
        let first = next;
        next += arity as usize;
        let polygon = obj.indices[first..next].iter().map(|&position| positions[position as usize].as_dvec3());
        let triangles = triangles_of(&polygon.collect::<Vec<_>>()).into_iter();
        triangles.map(move |corners| (face, corners.map(|corner| first + corner)))
    };
    obj.face_arities.iter().enumerate().flat_map(triangles_of_face).collect()
}

/// Every three numbers as a vector.
fn vectors(numbers: &[f32]) -> Vec<Vec3> {
    numbers.as_chunks().0.iter().map(|&vector| Vec3::from_array(vector)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_backslash_continues_a_line_of_the_mesh_and_nothing_else() {
        let whole = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
        let broken = "# C:\\models\\\nv 0 \\\n0 0\nv 1 0 0\no a\\\nv 0 1 0\nf 1\\ \r\n 2 \\\n3\n";
        let parse = |text: &str| parse(Path::new("a.obj"), text.as_bytes(), &());
        let [whole, broken] = [whole, broken].map(|text| parse(text).unwrap());
        assert_eq!((whole.positions, whole.indices), (broken.positions, broken.indices));
        // Errors name the line in the file; at its end there is nothing to go on with.
        let error = parse("v 0 \\\n0 0\nv 1 0 0\nv 0 1 0\nf 1//9 2 3\n").unwrap_err().to_string();
        assert!(error.contains("line 5"), "{error}");
        assert!(parse("v 0 0 0\nf 1 1 \\").is_err());
    }

    #[test]
    fn a_comment_may_end_any_line() {
        let corners = "v 0 0 0# x\nv 1 0 0 # v 2 2 2\nv 0 1 0\n";
        let mesh =
            parse(Path::new("a.obj"), format!("{corners}f 1 2 3 # f 9 9 9 \\\nf 1 \\ # x\n 2 3\n").as_bytes(), &());
        assert_eq!(mesh.unwrap().indices, [0, 1, 2, 0, 1, 2]);
    }

    #[test]
    fn lines_may_end_in_any_of_three_ways() {
        let text = "# x\nv 0 0 0\nv 1 0 0\nv 0 1 \\\n0\nf 1 2 3\n";
        for end in ["\n", "\r\n", "\r"] {
            let parse = |text: &str| parse(Path::new("a.obj"), text.replace('\n', end).as_bytes(), &());
            assert_eq!(parse(text).unwrap().positions.len(), 3, "{end:?}");
            let error = parse(&format!("{text}f 1//9 2 3\n")).unwrap_err().to_string();
            assert!(error.contains("line 7"), "{end:?} {error}");
        }
    }

    #[test]
    fn missing_normals_are_smoothed_as_smoothing_groups_say() {
        // Two faces of a cube, which meet in the edge from (1, 0, 0) to (1, 1, 0).
        let corners = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 1 0 1\nv 1 1 1\nvn 0.6 0 0.8\n";
        let normals = |faces: &str| {
            let Mesh { positions, normals, indices, .. } =
                parse(Path::new("a.obj"), format!("{corners}{faces}").as_bytes(), &()).unwrap();
            let at_edge = |&&index: &&u32| positions[index as usize].x == 1.0 && positions[index as usize].z == 0.0;
            indices.iter().filter(at_edge).map(|&index| normals[index as usize]).collect::<Vec<_>>()
        };
        let (up, left, between) = (Vec3::Z, -Vec3::X, Vec3::new(-1.0, 0.0, 1.0).normalize());
        let check = |faces: &str, expected: &[Vec3]| {
            let found = normals(faces);
            let are_among = |some: &[Vec3], all: &[Vec3]| {
                some.iter().all(|one| all.iter().any(|other| one.distance(*other) < 1e-6))
            };
            assert!(are_among(&found, expected) && are_among(expected, &found), "{faces} {found:?}");
        };
        let (bottom, side) = ("f 1 2 3 4\n", "f 2 5 6 3\n");
        check(&format!("{bottom}{side}"), &[between]);
        check(&format!("s 1\n{bottom}{side}"), &[between]);
        check(&format!("s on\n{bottom}s 1\n{side}"), &[between]);
        check(&format!("s off\n{bottom}{side}"), &[up, left]);
        check(&format!("s 0\n{bottom}{side}"), &[up, left]);
        check(&format!("s 1\n{bottom}s 2\n{side}"), &[up, left]);
        check(&format!("{bottom}s off\n{side}"), &[up, left]);
        check(&format!("s off\n{bottom}s 3\n{side}s 4\n{bottom}s 3\n{bottom}"), &[up, between]);
        // Normals of the file count whatever it says.
        check(&format!("s off\nf 1//1 2//1 3//1 4//1\n{side}"), &[Vec3::new(0.6, 0.0, 0.8), left]);
    }

    #[test]
    fn faces_that_are_wound_against_their_neighbours_are_shaded_as_all_others() {
        let columns = 6;
        let corner = |i: u32| {
            let (x, y) = (f64::from(i % columns), f64::from(i / columns));
            format!("v {x} {y} {}\n", (0.7 * x).sin() + (0.9 * y).cos())
        };
        let corners: String = (0..columns * columns).map(corner).collect();
        let firsts: Vec<_> = (0..columns * (columns - 1)).filter(|first| first % columns + 1 < columns).collect();
        let faces = |is_turned: fn(u32) -> bool| -> String {
            let face = |&first: &u32| {
                let mut face = [1, 2, columns + 2, columns + 1].map(|corner| first + corner);
                if is_turned(first) {
                    face.reverse();
                }
                format!("f {}\n", face.map(|corner| corner.to_string()).join(" "))
            };
            firsts.iter().map(face).collect()
        };
        let normals = |faces: String| -> Vec<(Vec3, Vec3)> {
            let mesh = parse(Path::new("a.obj"), (corners.clone() + &faces).as_bytes(), &()).unwrap();
            let mut all: Vec<_> = mesh.positions.into_iter().zip(mesh.normals).collect();
            all.sort_by(|(a, _), (b, _)| {
                a.to_array().map(|x| (x * 8.0) as i64).cmp(&b.to_array().map(|x| (x * 8.0) as i64))
            });
            all
        };
        let alike = normals(faces(|_| false));
        let mixed = normals(faces(|first| first % 3 == 1));
        assert_eq!((alike.len(), mixed.len()), ((columns * columns) as usize, (columns * columns) as usize));
        assert!(alike.iter().zip(&mixed).all(|((_, a), (_, b))| a.dot(*b) > 1.0 - 1e-6));
    }

    #[test]
    fn a_sheet_with_both_sides_is_as_smooth_as_one_with_its_front_alone() {
        let at = |x: u32, y: u32| x + 9 * y + 1;
        let mut corners = String::new();
        for (y, x) in (0..9).flat_map(|y| (0..9).map(move |x| (y, x))) {
            corners += &format!("v {x} {y} {}\n", (f64::from(x) * 0.7 + f64::from(y) * 0.2).sin());
        }
        let quads = (0..8).flat_map(|y| (0..8).map(move |x| [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)]));
        let quads: Vec<_> = quads.collect();
        let face = |[a, b, c, d]: [u32; 4]| format!("f {a} {b} {c}\nf {a} {c} {d}\n");
        let back = |[a, b, c, d]: [u32; 4]| format!("f {c} {b} {a}\nf {d} {c} {a}\n");
        // Either side may come first anywhere.
        let both = |(index, &quad): (usize, &[u32; 4])| match index % 2 {
            0 => face(quad) + &back(quad),
            _ => back(quad) + &face(quad),
        };
        let parse = |faces: String| parse(Path::new("a.obj"), (corners.clone() + &faces).as_bytes(), &()).unwrap();
        let single = parse(quads.iter().map(|&quad| face(quad)).collect());
        for smoothing in ["", "s 1\n"] {
            let double = parse(smoothing.to_owned() + &quads.iter().enumerate().map(both).collect::<String>());
            assert_eq!((double.positions.len(), double.indices.len()), (2 * 81, 2 * single.indices.len()));
            for triangle in double.indices.as_chunks().0 {
                let [a, b, c] = triangle.map(|index| double.positions[index as usize]);
                let side = (b - a).cross(c - a).z.signum();
                for index in triangle.map(|index| index as usize) {
                    let alone = single.positions.iter().position(|position| *position == double.positions[index]);
                    let expected = side * single.normals[alone.unwrap()];
                    assert!(double.normals[index].distance(expected) < 1e-6, "{} {expected}", double.normals[index]);
                }
            }
        }
    }

    #[test]
    fn no_mixture_of_hostile_words_panics_or_gives_a_mesh_that_cannot_be_drawn() {
        const WORDS: &[&str] = &[
            "\nv",
            "\nvn",
            "\nvt",
            "\nf",
            "\nf 1 2 3",
            "\nv 0 0",
            "\nl",
            "\np",
            "\no",
            "\ng a",
            "\nusemtl",
            "\nmtllib",
            "\ns off",
            "\ns 2",
            "#",
            "",
            "0",
            "1",
            "2",
            "3",
            "-1",
            "-2",
            "0.5",
            "1e30",
            "1e-40",
            "nan",
            "inf",
            "x",
            "\u{e9}",
            "1//1",
            "2//1",
            "3//1",
            "1/1/1",
            "3/2/-1",
            "2//",
            "//",
            "/",
            "1/2/3/4",
            "4294967297",
            "9223372036854775807",
            "-9223372036854775808",
            "18446744073709551616",
            "1//6148914691236517206",
            "1//-6148914691236517206",
            "1/9223372036854775807/1",
        ];
        // Knuth's MMIX generator; its high bits are the good ones.
        let mut state = 1_u64;
        let mut next = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            WORDS[(state >> 33) as usize % WORDS.len()]
        };
        let (mut meshes, mut brushed_meshes) = (0, 0);
        for _ in 0..20_000 {
            let mut text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1/1 2/2 3/3".to_owned();
            (0..8).for_each(|_| text.extend([" ", next()]));
            let textured = read_obj(&text, true, &()).map(|obj| clean(&obj, &()).unwrap().textured);
            let Ok(obj) = read_obj(&text, false, &()) else { continue };
            let mesh = clean(&obj, &()).unwrap().textured.mesh;
            meshes += 1;
            // Wrong indices of texture coordinates are errors where these are wanted.
            if let Ok(textured) = textured {
                assert!(
                    textured.mesh.indices.len() == mesh.indices.len()
                        && textured.uvs.len() == textured.mesh.positions.len()
                );
                let brushed = textured.with_tangents("test.obj");
                assert!(brushed.indices.len() == mesh.indices.len(), "{text}");
                assert!(brushed.tangents.iter().all(|tangent| tangent.is_normalized()), "{text}");
                brushed_meshes += usize::from(!brushed.tangents.is_empty());
            }
            assert!(mesh.positions.iter().all(|position| position.is_finite()), "{text}");
            assert!(mesh.normals.len() == mesh.positions.len() && mesh.indices.len().is_multiple_of(3), "{text}");
            assert!(mesh.normals.iter().all(|normal| normal.is_normalized()), "{text}");
            assert!(mesh.indices.iter().all(|&index| (index as usize) < mesh.positions.len()), "{text}");
        }
        assert!(meshes > 1000 && brushed_meshes > 10, "{meshes}, {brushed_meshes}");
    }
}
