//! Fitted threads against the reference: lobes and lights that are hard to blur for. How near they come is the method's, the same on every driver.
mod common;

use common::{EVERYTHING, MATT_ALONG_ITS_NORMAL, Validated, map, model, ready, sphere};
use glam::DVec3;
use threadlight::low_level::evaluate::reference::{ReferenceSettings, reference};
use threadlight::low_level::evaluate::{Comparable, Display, compare};
use threadlight::low_level::scene::{Background, Camera, EnvironmentSource, Scene, Source};
use threadlight::{CustomEnvironment, CustomMesh};

/// That what `scene`, 80 x 60, shows without a background errs beside the reference by an RMS of less than `most`.
fn assert_near_reference(gpu: &Validated, mut scene: Scene, most: f64) {
    scene.image.background = Background::None;
    let prepared = ready(&scene);
    let rendering = gpu.render(&prepared, EVERYTHING);
    let settings = ReferenceSettings { tolerance: 1e-3, ..Default::default() };
    let truth = reference(&prepared, &gpu.device, &settings, &gpu.round()).unwrap();
    let [found, expected] = [&rendering.radiance, &truth.radiance]
        .map(|radiance| Comparable::from_radiance(80, 60, radiance, true, Display::default()));
    let rms = compare(&found, &expected, true).unwrap().rms;
    println!("RMS {rms:.4}");
    assert!(rms < most, "{rms}");
}

#[test]
fn a_narrow_lobe_shows_a_lamp_with_dim_edges_as_the_reference_does() {
    let gpu = Validated::new();
    let folder = tempfile::tempdir().unwrap();
    let map = folder.path().join("lamp.exr");
    // Both white on a display, one a hundred times as bright as the other. Without parts that follow that, a dark ring of 0.5 is around it.
    let texel = |(x, y): (i32, i32)| match f64::from((x - 150).pow(2) + (y - 50).pow(2)).sqrt() {
        0.0..5.0 => [3000.0, 3000.0, 3000.0, 1.0],
        5.0..10.0 => [20.0, 40.0, 60.0, 1.0],
        _ => [0.05, 0.05, 0.05, 1.0],
    };
    let texels: Vec<_> = (0..128).flat_map(|y| (0..256).map(move |x| texel((x, y)))).collect();
    threadlight::low_level::picture::write_exr(&map, 256, 128, &texels, false, &Default::default()).unwrap();
    for (name, parameters, most) in [
        ("Beckmann", "model = 'conductor'\ndistribution = 'beckmann'\nalpha = 0.02\nmetal = 'Cr'", 0.01),
        ("Torrance-Sparrow", "model = 'torrance_sparrow'\ndiffuse = 0\nspread_deg = 3\nmetal = 'Au'", 0.007),
    ] {
        let mut scene = sphere(model(parameters), "white", 16, (80, 60));
        scene.environment.source = Source::File(map.clone());
        println!("{name}");
        assert_near_reference(&gpu, scene, most);
    }
    gpu.finish();
}

/// A wall, 80 x 60 pixels, whose corners have these normals, or its own.
fn wall(
    material: &str,
    environment: EnvironmentSource,
    normals: Option<Vec<[f32; 3]>>,
    eye: DVec3,
    fov_y_deg: f64,
) -> Scene {
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, y]| [x, y, 0.0]);
    let mesh = CustomMesh::new("wall", corners.into(), vec![[0, 1, 2], [0, 2, 3]], normals, None).unwrap();
    let mut scene = sphere(model(material), "white", 16, (80, 60)).with_environment(environment).with_mesh(mesh);
    scene.camera = Some(Camera { eye, target: DVec3::ZERO, up: DVec3::Y, fov_y_deg });
    scene
}

#[test]
fn a_wide_lobe_with_steep_flanks_shows_a_lamp_beside_the_horizon_as_the_reference_does() {
    let gpu = Validated::new();
    // As an umbrella before a flash, to the left: in the light of its edge the wall is seen at a slant.
    let umbrella = map([256, 128], |direction| {
        let away_deg = direction.angle_between(DVec3::new(-0.95, 0.1, 0.15)).to_degrees();
        if away_deg < 22.0 { 4.0 + 60.0 * (-(away_deg / 7.0).powi(2)).exp() } else { 0.02 }
    });
    let normals = vec![[-1.0, -1.0, 3.0], [1.0, -1.0, 3.0], [1.0, 1.0, 3.0], [-1.0, 1.0, 3.0]];
    let metal = "model = 'conductor'\ndistribution = 'beckmann'\nalpha = 0.2\nmetal = 'Au'";
    let scene = wall(metal, umbrella, Some(normals), DVec3::new(2.2, 0.5, 1.6), 45.0);
    // 0.006 where flanks are as wide as they are seen along the normal, or four points lean to one side.
    assert_near_reference(&gpu, scene, 0.002);
    gpu.finish();
}

#[test]
fn a_lobe_that_is_narrow_at_grazing_views_alone_shows_a_lamp_there_as_the_reference_does() {
    let gpu = Validated::new();
    // A lamp behind the sphere.
    let lamp = map([256, 128], |direction| {
        let away_deg = direction.angle_between(DVec3::new(-0.5, 0.2, -1.0)).to_degrees();
        if away_deg < 16.0 { 10.0 } else { 0.1 }
    });
    let scene = sphere(model(MATT_ALONG_ITS_NORMAL), "white", 64, (80, 60)).with_environment(lamp);
    // 0.021 where its lobe is as wide there as along the normal.
    assert_near_reference(&gpu, scene, 0.004);
    gpu.finish();
}

/// A wall that faces the eye, with normals of its corners so many degrees from it, and this part of each up.
fn wall_beside_the_eye(material: &str, environment: EnvironmentSource, corners: [(f32, f32); 4]) -> Scene {
    let normals = corners.map(|(theta_o_deg, y)| {
        let (sin, cos) = theta_o_deg.to_radians().sin_cos();
        [sin * (1.0 - 0.5 * y * y).sqrt(), sin * 0.5_f32.sqrt() * y, cos]
    });
    let mut scene = wall(material, environment, Some(normals.into()), DVec3::new(0.0, 0.0, 60.0), 1.9);
    scene.image.subpixels = 1;
    scene
}

#[test]
fn what_is_seen_up_to_the_horizon_and_what_turns_from_the_eye_is_shaded_as_the_reference_does() {
    let gpu = Validated::new();
    let bright_above = map([64, 32], |direction| (1.5 * direction.y).exp() + 0.3 * direction.x);
    // As interpolated normals of a coarse mesh: 87 to 97 degrees from the eye.
    let corners = [(87.0, -1.0), (97.0, -0.6), (97.0, 0.6), (87.0, 1.0)];
    let plastic = "model = 'plastic'\ndistribution = 'ggx'\nalpha = 0.05\nior = 1.5\ndiffuse = 0.6";
    let scene = wall_beside_the_eye(plastic, bright_above, corners);
    // 0.010 where views beyond 89 degrees are taken for that.
    assert_near_reference(&gpu, scene, 0.005);
    gpu.finish();
}

#[test]
fn what_grows_without_bound_towards_the_horizon_does_so_as_the_reference_does() {
    let gpu = Validated::new();
    let bright_above = map([64, 32], |direction| (1.5 * direction.y).exp() + 0.3 * direction.x);
    let corners = [(88.0, -1.0), (91.0, -0.6), (91.0, 0.6), (88.0, 1.0)];
    let ward = "model = 'ward'\ndiffuse = [0.2, 0.1, 0.05]\nspecular = 0.02\nalpha = 0.2\nnormalisation = 'duer'";
    let mut scene = wall_beside_the_eye(ward, bright_above, corners);
    scene.image.exposure = 0.2;
    // 0.22 where albedos go evenly from the last row but one to the last.
    assert_near_reference(&gpu, scene, 0.006);
    gpu.finish();
}

#[test]
fn a_brushed_metal_shows_a_lamp_at_grazing_views_as_the_reference_does() {
    let gpu = Validated::new();
    // A lamp behind what is seen at 78 to 89 degrees.
    let lamp = map([256, 128], |direction| {
        let away_deg = direction.angle_between(DVec3::new(0.17, 0.05, -0.98)).to_degrees();
        if away_deg < 5.0 { 60.0 } else { 0.1 }
    });
    let corners = [(78.0, -1.0), (89.5, -0.6), (89.5, 0.6), (78.0, 1.0)];
    let metal = "model = 'conductor'\ndistribution = 'ggx'\nalpha_x = 0.28\nalpha_y = 0.06\nmetal = 'Al'";
    let scene = wall_beside_the_eye(metal, lamp, corners);
    // 0.076 where the lamp is as far from a lobe across the plane of incidence as along it.
    assert_near_reference(&gpu, scene, 0.04);
    gpu.finish();
}

#[test]
fn a_map_of_few_pixels_shows_in_a_narrow_lobe_as_the_reference_has_it() {
    let gpu = Validated::new();
    let metal = |alpha| model(&format!("model = 'conductor'\ndistribution = 'ggx'\nalpha = {alpha}\nmetal = 'Al'"));
    let chequered = map([8, 4], |w| if w.x * w.y * w.z > 0.0 { 1.0 } else { 0.1 });
    let tube = map([64, 32], |w| if (w.y / w.length() - 0.55).abs() < 0.05 && w.x > 0.0 { 60.0 } else { 0.1 });
    // 0.0062 and 0.0031 where blurs and parts of lamps are no finer than these pixels.
    for (light, alpha) in [(chequered, 0.15), (tube, 0.02)] {
        let scene = sphere(metal(alpha), "white", 64, (80, 60)).with_environment(light);
        assert_near_reference(&gpu, scene, 0.002);
    }
    gpu.finish();
}

#[test]
fn a_flat_near_mirror_shows_all_that_a_pixel_sees_of_it() {
    let gpu = Validated::new();
    let texel = |(x, y): (u32, u32)| if (x / 16 + y / 16) % 2 == 0 { [1.0; 3] } else { [0.2, 0.1, 0.05] };
    let texels = (0..256).flat_map(|y| (0..512).map(move |x| texel((x, y)))).collect();
    let checks = CustomEnvironment::new("checks", 512, 256, texels).unwrap();
    let metal = "model = 'conductor'\ndistribution = 'beckmann'\nalpha = 0.003\nmetal = 'Al'";
    let scene = wall(metal, checks.into(), None, DVec3::new(0.3, 0.2, 2.2), 50.0);
    // 0.013 where a pixel is one direction.
    assert_near_reference(&gpu, scene, 0.005);
    gpu.finish();
}
