//! Reads meshes from Wavefront OBJ files, and cleans them so that nothing degenerate reaches the rasteriser.
use std::collections::HashMap;
use std::fmt::Write;
use std::path::Path;

use glam::{DVec3, Vec3};

use super::Mesh;
use crate::error::{Error, Result};
use crate::file_format::FileFormat;

pub(super) const FORMAT: FileFormat<Mesh> =
    FileFormat { extension: "obj", name: "a Wavefront .obj", is_of_format: |_| true, parse };

/// Reads all triangles and polygons as one mesh; objects, groups, materials, texture coordinates and
/// lines are ignored. Polygons become fans. Where a normal is missing, zero or not finite, the mean normal of the
/// faces that share the position takes its place, weighted by their angles there. Degenerate triangles are dropped.
fn parse(path: &Path, bytes: &[u8]) -> Result<Mesh> {
    // Names in old files are in any encoding; the numbers are ASCII in all of them.
    let obj = read_obj(&String::from_utf8_lossy(bytes))
        .map_err(|problem| Error::in_file(path, problem, "repair or export it again"))?;
    let (mesh, dropped) = clean(&obj);
    if mesh.indices.is_empty() {
        return Err(Error::in_file(path, "has no triangle with an area", "give a mesh with faces"));
    }
    if dropped > 0 {
        tracing::warn!("{}: dropped {dropped} degenerate triangles", path.display());
    }
    tracing::debug!("{}: {} triangles, {} vertices", path.display(), mesh.indices.len() / 3, mesh.positions.len());
    Ok(mesh)
}

/// The triangles in the text of an OBJ, each corner with an index into the positions and one into the normals; a corner
/// without a normal has one of length 0. The error is what is wrong.
fn read_obj(text: &str) -> Result<tobj::Mesh, String> {
    let options = tobj::LoadOptions { triangulate: true, ..Default::default() };
    let no_materials = |_: &Path| Ok(Default::default());
    let (models, _) = tobj::load_obj_buf(&mut geometry_lines(text)?.as_bytes(), &options, no_materials)
        .map_err(|cause| format!("is not a sound OBJ: {cause}"))?;
    // Without o, g and usemtl there is one model.
    let mesh = models.into_iter().next().map(|model| model.mesh).unwrap_or_default();
    match vectors(&mesh.positions).into_iter().find(|position| !position.is_finite()) {
        Some(position) => Err(format!("has a vertex that is not finite, {position}")),
        None => Ok(mesh),
    }
}

/// The lines of an OBJ that are the mesh, such that tobj reads them right: of `v` the coordinates, `vn`, and `f` with its
/// corners as `position//normal`.
///
/// The rest goes since tobj takes polylines (`l`) for faces, wants colours for all vertices or none, and begins a new mesh at
/// every group and material, whose vertices then are no longer shared. Corners without a normal get one of length 0,
/// the last in the file, as from tobj they would get that of the corner before. Indices of normals are checked here: unlike
/// those of positions, tobj takes 0 for none, and multiplies absurd ones until they overflow.
fn geometry_lines(text: &str) -> Result<String, String> {
    let normals = text.lines().filter(|line| line.split_ascii_whitespace().next() == Some("vn")).count() as i64;
    let (mut lines, mut normals_before) = (String::with_capacity(text.len()), 0);
    for (index, line) in text.lines().enumerate() {
        let mut words = line.split_ascii_whitespace();
        let Some(keyword @ ("v" | "vn" | "f")) = words.next() else { continue };
        lines += keyword;
        normals_before += i64::from(keyword == "vn");
        if keyword == "f" {
            for word in words {
                let mut numbers = word.split('/');
                let position = numbers.next().unwrap_or_default();
                let normal = match numbers.nth(1).unwrap_or_default() {
                    "" => normals + 1,
                    number => number
                        .parse()
                        .ok()
                        .filter(|number| (1..=normals).contains(number) || (-normals_before..0).contains(number))
                        .ok_or_else(|| format!("line {}: there is no normal {number}", index + 1))?,
                };
                // Writing to a string cannot fail.
                let _ = write!(lines, " {position}//{normal}");
            }
        } else {
            words.take(3).for_each(|word| lines.extend([" ", word]));
        }
        lines.push('\n');
    }
    Ok(lines + "vn 0 0 0\n")
}

/// Joins corners with the same position and normal into vertices; gives also the number of dropped triangles.
fn clean(obj: &tobj::Mesh) -> (Mesh, usize) {
    let (positions, normals) = (vectors(&obj.positions), vectors(&obj.normals));
    // Normals that are none count as missing.
    let normal_at = |index: u32| {
        let normal = normals[index as usize].as_dvec3();
        (normal.is_finite() && normal.length_squared() > 0.0).then(|| normal.normalize())
    };
    let mut mean_normals = vec![DVec3::ZERO; positions.len()];
    let mut vertices = HashMap::new();
    let (mut mesh, mut dropped, mut missing) = (Mesh::default(), 0, Vec::new());
    let triangles = obj.indices.as_chunks::<3>().0.iter().zip(obj.normal_indices.as_chunks::<3>().0);
    for (triangle, triangle_normals) in triangles {
        let [a, b, c] = triangle.map(|position| positions[position as usize].as_dvec3());
        let area = (b - a).cross(c - a);
        let longest = (b - a).length_squared().max((c - a).length_squared()).max((c - b).length_squared());
        // A height of a millionth of the length is rounding of single precision, and the normal is noise.
        if area.length() <= 1e-6 * longest {
            dropped += 1;
            continue;
        }
        let face_normal = area.normalize();
        for (&position, [at, next, before]) in triangle.iter().zip([[a, b, c], [b, c, a], [c, a, b]]) {
            mean_normals[position as usize] += (next - at).angle_between(before - at) * face_normal;
        }
        for (&position, &normal) in triangle.iter().zip(triangle_normals) {
            let normal = normal_at(normal).map(|direction| (normal, direction));
            let index = *vertices.entry((position, normal.map(|(index, _)| index))).or_insert_with(|| {
                if normal.is_none() {
                    missing.push((mesh.positions.len(), position));
                }
                mesh.positions.push(positions[position as usize]);
                mesh.normals.push(normal.map(|(_, direction)| direction).unwrap_or_default().as_vec3());
                mesh.positions.len() as u32 - 1
            });
            mesh.indices.push(index);
        }
    }
    for (vertex, position) in missing {
        // Faces back to back cancel: any direction is as good, as long as it is one.
        mesh.normals[vertex] = mean_normals[position as usize].try_normalize().unwrap_or(DVec3::Y).as_vec3();
    }
    (mesh, dropped)
}

/// Every three numbers as a vector.
fn vectors(numbers: &[f32]) -> Vec<Vec3> {
    numbers.as_chunks().0.iter().map(|&vector| Vec3::from_array(vector)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let mut meshes = 0;
        for _ in 0..20_000 {
            let mut text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2 3".to_owned();
            (0..8).for_each(|_| text.extend([" ", next()]));
            let Ok(obj) = read_obj(&text) else { continue };
            let (mesh, _) = clean(&obj);
            meshes += 1;
            assert!(mesh.positions.iter().all(|position| position.is_finite()), "{text}");
            assert!(mesh.normals.len() == mesh.positions.len() && mesh.indices.len() % 3 == 0, "{text}");
            assert!(mesh.normals.iter().all(|normal| normal.is_normalized()), "{text}");
            assert!(mesh.indices.iter().all(|&index| (index as usize) < mesh.positions.len()), "{text}");
        }
        assert!(meshes > 1000, "{meshes}");
    }
}
