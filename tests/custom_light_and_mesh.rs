//! Light and meshes that a user of the crate makes, against files of the same numbers.
mod common;

use common::{Validated, model, ready, sphere};
use glam::{UVec2, Vec3};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use threadlight::Method;
use threadlight::low_level::geometry_texel::GeometryTexel;
use threadlight::low_level::memo::{Asked, Memo, Origin};
use threadlight::low_level::pipeline::{DeviceScene, Wanted};
use threadlight::low_level::prepare::{key_of, prepare};
use threadlight::low_level::scene::{EnvironmentSource, MeshSource, Scene, TangentRule};
use threadlight::{CustomEnvironment, CustomMesh};

const SIZE: [usize; 2] = [32, 16];

/// A bright pixel, one that is NaN and a negative one among others.
fn pixels() -> Vec<[f32; 3]> {
    let pixel = |i: usize| match i {
        137 => [90.0, 70.0, 50.0],
        200 => [f32::NAN, 1.0, 1.0],
        138 => [-0.5, 0.2, 0.1],
        _ => [(i % 7) as f32 / 7.0, (i / SIZE[0]) as f32 / 16.0, 0.4],
    };
    (0..SIZE[0] * SIZE[1]).map(pixel).collect()
}

fn light(pixels: Vec<[f32; 3]>) -> EnvironmentSource {
    CustomEnvironment::new("light", SIZE[0], SIZE[1], pixels).unwrap().into()
}

/// The same in a file of this folder.
fn light_file(folder: &Path) -> EnvironmentSource {
    let path = folder.join("light.exr");
    let [width, height] = SIZE.map(|size| size as u32);
    let pixels: Vec<_> = pixels().iter().map(|&[r, g, b]| [r, g, b, 1.0]).collect();
    threadlight::low_level::picture::write_exr(&path, width, height, &pixels, false, &Default::default()).unwrap();
    EnvironmentSource::File(path)
}

/// A wavy sheet: positions, triangles of which one has no area, texture coordinates.
type Sheet = (Vec<[f32; 3]>, Vec<[u32; 3]>, Vec<[f32; 2]>);

fn sheet() -> Sheet {
    const CELLS: u32 = 8;
    let places =
        || (0..=CELLS).flat_map(|row| (0..=CELLS).map(move |column| [column, row].map(|i| i as f32 / CELLS as f32)));
    let positions = places().map(|[u, v]| [2.0 * u - 1.0, 2.0 * v - 1.0, 0.2 * (5.0 * u + 3.0 * v).sin()]).collect();
    let mut triangles = vec![[0, 1, 1]];
    for (row, column) in (0..CELLS).flat_map(|row| (0..CELLS).map(move |column| (row, column))) {
        let first = row * (CELLS + 1) + column;
        let [right, above] = [first + 1, first + CELLS + 1];
        triangles.extend([[first, right, above + 1], [first, above + 1, above]]);
    }
    (positions, triangles, places().map(|[u, v]| [u + 0.3 * v, v * v]).collect())
}

fn mesh() -> MeshSource {
    let (positions, triangles, uvs) = sheet();
    CustomMesh::new("sheet", positions, triangles, None, Some(uvs)).unwrap().into()
}

/// The same in a file of this folder.
fn mesh_file(folder: &Path) -> MeshSource {
    let ((positions, triangles, uvs), mut text) = (sheet(), String::new());
    positions.iter().for_each(|[x, y, z]| writeln!(text, "v {x} {y} {z}").unwrap());
    uvs.iter().for_each(|[u, v]| writeln!(text, "vt {u} {v}").unwrap());
    for [a, b, c] in triangles.iter().map(|corners| corners.map(|corner| corner + 1)) {
        writeln!(text, "f {a}/{a} {b}/{b} {c}/{c}").unwrap();
    }
    let path: PathBuf = folder.join("sheet.obj");
    std::fs::write(&path, text).unwrap();
    MeshSource::File(path)
}

/// A sheet of brushed metal.
fn scene(environment: EnvironmentSource, mesh: MeshSource) -> Scene {
    let metal = model("model = 'conductor'\ndistribution = 'ggx'\nmetal = 'Al'\nalpha_x = 0.1\nalpha_y = 0.4");
    let mut scene = sphere(metal, "white", 4, (48, 36));
    scene.environment.source = environment;
    scene.objects[0].mesh = mesh;
    scene.objects[0].tangent = Some(TangentRule::Uv);
    scene.shading.method = Method::Mis;
    scene
}

/// A matt one, which has kernels and threads.
fn matt(environment: EnvironmentSource, mesh: MeshSource) -> Scene {
    let mut scene = scene(environment, mesh);
    scene.materials[0].source = model("model = 'lambert'\nreflectance = [0.8, 0.5, 0.2]");
    scene.shading.method = Method::Fitted;
    scene
}

#[test]
fn pictures_are_to_the_byte_those_of_files_of_the_same_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let (in_file, as_file) = (light_file(folder.path()), mesh_file(folder.path()));
    for scene in [scene, matt] {
        let picture = |environment: &EnvironmentSource, mesh: &MeshSource| {
            // One each, so that none is made of what was made for another.
            let gpu = Validated::with_own_memo();
            let wanted = Wanted { radiance: true, display: true, geometry: true };
            let prepared = prepare(&scene(environment.clone(), mesh.clone()), &gpu.round()).expect("a scene");
            let rendering = gpu.render(&prepared, wanted);
            gpu.finish();
            let bits: Vec<_> = rendering.radiance.iter().map(|texel| texel.map(f32::to_bits)).collect();
            (bits, rendering.display, rendering.geometry)
        };
        let expected = picture(&in_file, &as_file);
        assert!(expected.1.chunks(4).any(|pixel| pixel[..3] != expected.1[..3]));
        for (environment, mesh) in [(&light(pixels()), &as_file), (&in_file, &mesh()), (&light(pixels()), &mesh())] {
            assert!(picture(environment, mesh) == expected, "{environment:?} {mesh:?}");
        }
    }
}

#[test]
fn what_was_made_for_a_file_is_found_again_for_the_same_numbers_and_not_for_others() {
    let (folder, cache) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let gpu = Validated::new();
    // Where the threads and the blurred map come from, of another run of the program each time.
    let origins = |scene: &Scene| {
        let memo = Memo::new(Some(cache.path()));
        let round = memo.round(&());
        DeviceScene::new(&gpu.device, &prepare(scene, &round).unwrap(), &round).unwrap();
        let of = |name: &str| round.asked(name).iter().map(|Asked { origin, .. }| *origin).collect::<Vec<_>>();
        [of("threads"), of("environment")]
    };
    let [threads, environment] = origins(&matt(light_file(folder.path()), mesh()));
    assert!(threads == [Origin::Made] && !environment.contains(&Origin::Disk), "{threads:?} {environment:?}");
    let [threads, environment] = origins(&matt(light(pixels()), mesh()));
    assert!(threads == [Origin::Disk] && environment.contains(&Origin::Disk), "{threads:?} {environment:?}");
    let mut others = pixels();
    others[300][2] += 0.1;
    let [threads, environment] = origins(&matt(light(others.clone()), mesh()));
    assert!(threads == [Origin::Disk] && !environment.contains(&Origin::Disk), "{threads:?} {environment:?}");
    gpu.finish();

    let (mut positions, triangles, uvs) = sheet();
    positions[7][2] += 0.1;
    let other_mesh: MeshSource = CustomMesh::new("sheet", positions, triangles, None, Some(uvs)).unwrap().into();
    let memo = Memo::default();
    let key = |light, mesh| key_of(&matt(light, mesh), &memo).unwrap();
    let first = key(light(pixels()), mesh());
    assert_eq!(key(light(pixels()), mesh()), first);
    assert!(key(light(others), mesh()) != first && key(light(pixels()), other_mesh) != first);
}

#[test]
fn renderers_share_the_pixels_that_a_program_gave() {
    // Of a map that needs no more pixels.
    let pixels = (0..128 * 64).map(|i| [i as f32, 0.5, 0.2]).collect();
    let light = CustomEnvironment::new("light", 128, 64, pixels).unwrap();
    let scene = scene(light.into(), mesh());
    let [first, second] = [&scene, &scene.clone()].map(|scene| ready(scene).environment);
    assert!(std::ptr::eq(first.texels(), second.texels()));
}

#[test]
fn no_scene_file_holds_light_or_a_mesh_from_memory() {
    for (scene, what) in [
        (scene(light(pixels()), MeshSource::Builtin("sphere".into())), "environment \"light\""),
        (scene(EnvironmentSource::Builtin("sky".into()), mesh()), "mesh \"sheet\""),
    ] {
        let error = scene.to_toml(None).unwrap_err().to_string();
        assert!(error.contains(what) && error.contains("defined by a program"), "{error}");
    }
}

#[test]
fn a_mesh_far_from_its_own_origin_is_seen_as_near_it() {
    let gpu = Validated::new();
    let (positions, triangles, _) = sheet();
    // On a grid that single precision has out there, too.
    let positions: Vec<_> = positions.into_iter().map(|at| at.map(|x| (64.0 * x).round() / 64.0)).collect();
    let seen = |shift: Vec3, rule: TangentRule| {
        let moved = positions.iter().map(|at| (Vec3::from(*at) + shift).to_array()).collect();
        let mesh = CustomMesh::new("sheet", moved, triangles.clone(), None, None).unwrap();
        let brushed = model("model = 'conductor'\ndistribution = 'ggx'\nmetal = 'Al'\nalpha_x = 0.1\nalpha_y = 0.4");
        let mut scene = sphere(brushed, "white", 1, (48, 36));
        scene.shading.method = Method::Uniform;
        scene.objects[0].mesh = mesh.into();
        scene.objects[0].translate = -shift;
        scene.objects[0].tangent = Some(rule);
        let prepared = ready(&scene);
        gpu.render(&prepared, Wanted { geometry: true, ..Wanted::default() }).geometry
    };
    let axis = Vec3::new(0.6, 0.0, 0.8);
    for shift in [Vec3::new(1024.0, -4096.0, 0.0), Vec3::new(0.0, 65536.0, 131072.0)] {
        assert!(seen(shift, TangentRule::Along(axis)) == seen(Vec3::ZERO, TangentRule::Along(axis)), "{shift}");
        // Circles around an axis that far away are straight.
        let around = seen(shift, TangentRule::Around(axis));
        let straight = seen(Vec3::ZERO, TangentRule::Along(axis.cross(shift)));
        let mut count = 0;
        for (around, straight) in around.into_iter().zip(straight) {
            let texels = [around, straight].map(|texel| GeometryTexel::unpack(UVec2::from_array(texel)));
            let [Some(around), Some(straight)] = texels else { continue };
            let apart = around.tangent.unwrap().distance(straight.tangent.unwrap());
            assert!(apart < 1e-3, "{shift}: {around:?}, {straight:?}");
            count += 1;
        }
        assert!(count > 1000, "{count}");
    }
    gpu.finish();
}

#[test]
fn a_mesh_of_any_size_in_its_own_units_is_seen_as_one_of_usual_size() {
    let gpu = Validated::new();
    let (positions, triangles, _) = sheet();
    // So wavy that facets and the normals between them are far apart.
    let normals: Vec<_> = positions.iter().map(|at| Vec3::new(at[0], at[1], 1.0).normalize().to_array()).collect();
    let seen = |size: f32| {
        let scaled = positions.iter().map(|at| at.map(|x| x * size)).collect();
        let mesh = CustomMesh::new("sheet", scaled, triangles.clone(), Some(normals.clone()), None).unwrap();
        let mut scene = sphere(model("model = 'lambert'\nreflectance = 0.5"), "white", 1, (48, 36));
        scene.shading.method = Method::Uniform;
        scene.objects[0].mesh = mesh.into();
        scene.objects[0].scale = 1.0 / size;
        let geometry = gpu.render(&ready(&scene), Wanted { geometry: true, ..Wanted::default() }).geometry;
        geometry.into_iter().map(|texel| GeometryTexel::unpack(UVec2::from_array(texel))).collect::<Vec<_>>()
    };
    let expected = seen(1.0);
    for size in [1e-21, 1e-10, 1e10, 1e21] {
        let mut count = 0;
        for (found, expected) in seen(size).into_iter().zip(&expected) {
            let (Some(found), Some(expected)) = (found, expected) else { continue };
            assert!(found.normal.distance(expected.normal) < 1e-3, "{size}: {} {}", found.normal, expected.normal);
            count += 1;
        }
        assert!(count > 1000, "{size}: {count}");
    }
    gpu.finish();
}
