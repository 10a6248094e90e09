//! The geometry cache (pass 1 of the paper) sees what rays meet, from near, from far and along a horizon.
mod common;

use common::{Validated, model, ready, sphere};
use glam::{DVec3, UVec2, dvec3};
use threadlight::CustomMesh;
use threadlight::low_level::geometry_texel::GeometryTexel;
use threadlight::low_level::pipeline::render_geometry;
use threadlight::low_level::scene::{Camera, MeshSource, ObjectSettings, Scene, Source};

const SIZE: [u32; 2] = [160, 120];

fn grey_sphere() -> Scene {
    let mut scene = sphere(model("model = 'lambert'\nreflectance = 0.5"), "white", 1, SIZE.into());
    scene.image.subpixels = 1;
    scene
}

/// What each pixel of `scene` sees, row by row, and the direction in which it looks.
fn seen(gpu: &Validated, scene: &Scene) -> Vec<(Option<GeometryTexel>, DVec3)> {
    let texels = render_geometry(&gpu.device, &ready(scene), &gpu.round()).unwrap();
    let camera = scene.camera.unwrap();
    let [width, height] = SIZE;
    let ray = |i: u32| camera.ray(f64::from(i % width), f64::from(i / width), width, height);
    texels.iter().enumerate().map(|(i, &texel)| (GeometryTexel::unpack(UVec2::from(texel)), ray(i as u32))).collect()
}

/// How near a ray from `eye` passes the centre of a sphere of radius 1, and where on it, from its centre, the ray first meets it.
fn meet(eye: DVec3, ray: DVec3, centre: DVec3) -> (f64, Option<DVec3>) {
    let to_centre = centre - eye;
    let nearest = to_centre.reject_from(ray);
    let within = 1.0 - nearest.length_squared();
    (nearest.length(), (within > 0.0).then(|| -nearest - within.sqrt() * ray))
}

/// Two spheres that pass through each other.
#[test]
fn spheres_are_seen_where_rays_meet_them_however_narrow_the_camera_is() {
    let gpu = Validated::new();
    let apart = dvec3(0.5, 0.25, -0.375);
    for place in [DVec3::ZERO, dvec3(3e5, 0.0, -2e5)] {
        for fov_y_deg in [60.0, 1.0, 0.01, 1e-3, 1e-4] {
            let mut scene = grey_sphere();
            let mut second = ObjectSettings::new(Source::Builtin("sphere".into()), "other");
            scene.materials.push(scene.materials[0].clone());
            scene.materials[1].name = "other".into();
            (scene.objects[0].translate, second.translate) = (place.as_vec3(), (place + apart).as_vec3());
            scene.objects.push(second);
            let distance = 2.0 / (0.5_f64 * fov_y_deg).to_radians().tan();
            let eye = place + distance * dvec3(0.2, 0.3, 1.0).normalize();
            scene.camera = Some(Camera { eye, target: place, up: DVec3::Y, fov_y_deg });
            let mut compared = [0; 2];
            for (texel, ray) in seen(&gpu, &scene) {
                let [first, second] = [place, place + apart].map(|centre| meet(eye, ray, centre));
                // Facets of the mesh are up to 2e-4 within the sphere.
                if [first, second].iter().any(|(near, _)| (near - 1.0).abs() < 2e-3) {
                    continue;
                }
                let ahead = |point: DVec3| point.dot(-ray);
                let expected = match (first.1, second.1.map(|point| (point, ahead(point + apart)))) {
                    (None, None) => None,
                    (Some(first), None) => Some((0, first)),
                    (None, Some((second, _))) => Some((1, second)),
                    (Some(first), Some((_, at))) if ahead(first) > at + 1e-3 => Some((0, first)),
                    (Some(first), Some((second, at))) if at > ahead(first) + 1e-3 => Some((1, second)),
                    _ => continue,
                };
                assert_eq!(
                    texel.map(|texel| texel.material),
                    expected.map(|(material, _)| material),
                    "{fov_y_deg} {ray}"
                );
                let Some((texel, (material, normal))) = texel.zip(expected) else { continue };
                let off = texel.normal.as_dvec3().distance(normal);
                assert!(off < 0.03, "{fov_y_deg}: {} is not {normal}", texel.normal);
                compared[material] += 1;
            }
            assert!(compared.iter().all(|&pixels| pixels > 1000), "{fov_y_deg}: {compared:?}");
        }
    }
    gpu.finish();
}

/// A pixel beside the horizon has neighbours that look past it, and a ground that goes on behind the eye.
#[test]
fn both_sides_of_a_wide_ground_face_the_eye_up_to_the_horizon() {
    let gpu = Validated::new();
    let corners = [[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]].map(|[x, z]| [1e3 * x, 0.0, 1e3 * z]);
    for triangles in [vec![[0, 1, 2], [0, 2, 3]], vec![[0, 2, 1], [0, 3, 2]]] {
        // The horizon is between the two rows of what derivatives are taken of, or beside them.
        for (height, tilt_px) in [2.0, -2.0].into_iter().flat_map(|height| [0.0, 1.0, 1.3].map(|px| (height, px))) {
            let mesh = CustomMesh::new("ground", corners.into(), triangles.clone(), None, None).unwrap();
            let mut scene = grey_sphere().with_mesh(MeshSource::from(mesh));
            let eye = height * DVec3::Y;
            let pixel = 2.0 * 30_f64.to_radians().tan() / f64::from(SIZE[1]);
            let target = eye + dvec3(0.1, tilt_px * pixel, -1.0);
            scene.camera = Some(Camera { eye, target, up: DVec3::Y, fov_y_deg: 60.0 });
            let mut covered = 0;
            for (texel, ray) in seen(&gpu, &scene) {
                let Some(texel) = texel else { continue };
                assert!(texel.normal.y * height.signum() as f32 > 0.999, "{height} {ray}: {}", texel.normal);
                covered += 1;
            }
            assert!(covered >= SIZE[0] * SIZE[1] * 47 / 100, "{height} {tilt_px}: {covered}");
        }
    }
    gpu.finish();
}

/// A patch of ground in small triangles, far from the middle of a mesh that has two others at its ends.
#[test]
fn ground_near_the_eye_faces_it_however_large_its_mesh_is() {
    let gpu = Validated::new();
    let (end, place, cells) = (4e5_f32, [1.4e5_f32, -6e4], 40);
    let mut corners = vec![[end, 0.0, end], [end, 0.0, 0.0], [0.0, 0.0, end]];
    corners.extend([[-end, 0.0, -end], [-end, 0.0, 0.0], [0.0, 0.0, -end]]);
    let mut triangles = vec![[0, 1, 2], [3, 4, 5]];
    let first = corners.len() as u32;
    let along = |cell: u32, axis: usize| place[axis] + (cell as f32 - cells as f32 / 2.0) * 0.5;
    corners.extend((0..=cells).flat_map(|z| (0..=cells).map(move |x| [along(x, 0), 0.0, along(z, 1)])));
    for (x, z) in (0..cells).flat_map(|z| (0..cells).map(move |x| (x, z))) {
        let corner = |right, down| first + (z + down) * (cells + 1) + x + right;
        triangles.extend([[corner(0, 0), corner(0, 1), corner(1, 1)], [corner(0, 0), corner(1, 1), corner(1, 0)]]);
    }
    let mesh = CustomMesh::new("ground", corners, triangles, None, None).unwrap();
    let mut scene = grey_sphere().with_mesh(MeshSource::from(mesh));
    let target = dvec3(f64::from(place[0]), 0.0, f64::from(place[1]));
    let eye = target + dvec3(0.5, 1.0, 0.75);
    scene.camera = Some(Camera { eye, target, up: DVec3::Y, fov_y_deg: 60.0 });
    for (texel, ray) in seen(&gpu, &scene) {
        let normal = texel.expect("ground all over the picture").normal;
        assert!(normal.y > 0.999, "{ray}: {normal}");
    }
    gpu.finish();
}
