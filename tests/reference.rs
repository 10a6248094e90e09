//! Whole pictures against those of an independent renderer (Mitsuba 3): a small one that is kept here, and larger ones where these lie beside
//! the project.
mod common;

use common::{EVERYTHING, Validated, difference, model, ready, sphere};
use glam::{DVec3, Vec3, Vec4};
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use threadlight::Method;
use threadlight::low_level::evaluate::Display;
use threadlight::low_level::evaluate::reference::{
    Integrator, Processor, ReferenceImage, ReferenceSettings, TOLERANCE, reference, tone_map,
};
use threadlight::low_level::picture::{read_image, write_exr};
use threadlight::low_level::pipeline::{Wanted, render_geometry};
use threadlight::low_level::prepare::Prepared;
use threadlight::low_level::scene::{Background, Camera, MaterialSource, Scene, Source, TangentRule};
use threadlight::low_level::shading::display_value;

/// RMS of display values over the sphere's pixels in `found`, leaving out those within two pixels of its rim.
fn rms_inside(found: &[[f32; 4]], reference: &[[f32; 4]], width: usize) -> f64 {
    let covered = |x: usize, y: usize| found.get(y * width + x).is_some_and(|texel| texel[3] >= 1.0);
    let height = found.len() / width;
    let (mut sum, mut count) = (0.0, 0);
    for (y, x) in (2..height - 2).flat_map(|y| (2..width - 2).map(move |x| (y, x))) {
        let inside = (y - 2..=y + 2).all(|v| (x - 2..=x + 2).all(|u| covered(u, v)));
        if inside {
            for channel in 0..3 {
                let [a, b] = [found, reference].map(|image| display_value(image[y * width + x][channel], 1.0, 2.2));
                sum += f64::from(a - b).powi(2);
                count += 1;
            }
        }
    }
    assert!(count > 300_000, "only {count} values compared");
    (sum / f64::from(count)).sqrt()
}

/// The folder of Mitsuba's pictures, where there is one.
fn reference_folder() -> Option<PathBuf> {
    let folder = std::env::var_os("THREADLIGHT_REFERENCE").map_or_else(|| "../shared/reference".into(), PathBuf::from);
    if !folder.is_dir() {
        println!("skipped: {} is not there", folder.display());
    }
    folder.is_dir().then_some(folder)
}

/// The scene of one of the pictures: one ray through each pixel's centre, nothing behind the sphere.
fn scene_of(folder: &Path, material: MaterialSource, environment: &str) -> Scene {
    let mut scene = sphere(material, "white", 100, (640, 480));
    scene.environment.source = Source::File(folder.join(format!("env/{environment}.exr")));
    scene.image.subpixels = 1;
    scene.image.background = Background::None;
    scene
}

fn conductor(alpha: f64) -> MaterialSource {
    model(&format!(
        "model = 'conductor'\ndistribution = 'ggx'\nalpha = {alpha}\neta = [0.2, 0.924, 1.102]\nk = [3.912, 2.448, 2.142]"
    ))
}

fn diffuse() -> MaterialSource {
    model("model = 'lambert'\nreflectance = [0.8, 0.5, 0.2]")
}

#[test]
fn the_reference_agrees_with_mitsuba() {
    let Some(folder) = reference_folder() else { return };
    let gpu = Validated::new();
    let mut scenes = vec![
        ("diffuse__proc_nosun", diffuse(), "proc_nosun"),
        ("ggx02__proc_nosun", conductor(0.2), "proc_nosun"),
        ("ggx02__proc_sun", conductor(0.2), "proc_sun"),
        ("ggx005__proc_sun", conductor(0.05), "proc_sun"),
    ];
    // A table that a script beside the pictures writes.
    if let Some(table) = std::env::var_os("THREADLIGHT_MERL_MIX") {
        scenes.push(("merl_mix_tri__sunset", MaterialSource::File(table.into()), "sunset"));
    }
    for (name, material, environment) in scenes {
        let mut scene = scene_of(&folder, material, environment);
        scene.shading.method = Method::Reference;
        let prepared = ready(&scene);
        let Prepared { view, environment, materials, .. } = &prepared;
        let geometry = render_geometry(&gpu.device, &prepared, &gpu.round()).expect("a geometry cache");
        let covered = |x: usize, y: usize| geometry[y * 640 + x][1] != 0;
        let inside = |x: usize, y: usize| (y - 2..=y + 2).all(|v| (x - 2..=x + 2).all(|u| covered(u, v)));
        // One pixel of 41 x 41, all over the sphere.
        let pixels = (2..478).step_by(41).flat_map(|y| (2..638).step_by(41).map(move |x| (x, y)));
        let pixels: Vec<_> = pixels.filter(|&(x, y)| inside(x, y)).collect();
        assert!(pixels.len() > 50, "only {} pixels", pixels.len());

        let integrator = Integrator::new(environment, 1.0, materials.iter().map(|material| &*material.brdf), 1);
        let picture = read_image(&folder.join(format!("images/{name}.exr"))).expect("a reference picture");
        let square = |&(x, y): &(usize, usize)| {
            let points = integrator.points(view, &geometry, x, y);
            let found = integrator.pixel(&points, TOLERANCE, Display { exposure: 1.0, gamma: 2.2 }).radiance.as_vec3();
            let shown = |value: f32| f64::from(display_value(value, 1.0, 2.2));
            let error = |channel: usize| shown(found[channel]) - shown(picture.rgba[y * 640 + x][channel]);
            (0..3).map(|channel| error(channel).powi(2)).sum::<f64>() / 3.0
        };
        let rms = (pixels.par_iter().map(square).sum::<f64>() / pixels.len() as f64).sqrt();
        println!("{name}: RMS {rms:.1e}");
        // Their own standard errors are up to 6e-5, and 3e-4 for the last; ours is 1.5e-4.
        assert!(rms < if environment.name.ends_with("sunset.exr") { 5e-4 } else { 2.5e-4 }, "{name}: RMS {rms}");
    }
    gpu.finish();
}

#[test]
fn threads_come_near_to_mitsuba() {
    let Some(folder) = reference_folder() else { return };
    let gpu = Validated::new();
    // The paper reports an RMS of 0.0131 for its threads, on average over materials; narrow lobes under a sun are worse.
    for (name, material, environment, limits) in [
        ("diffuse__proc_nosun", diffuse(), "proc_nosun", [0.01, 0.002]),
        ("ggx02__proc_nosun", conductor(0.2), "proc_nosun", [0.02, 0.002]),
        ("ggx005__proc_sun", conductor(0.05), "proc_sun", [0.06, 0.01]),
    ] {
        for (method, threads, limit) in [(Method::Paper, 100, limits[0]), (Method::Fitted, 16, limits[1])] {
            let mut scene = scene_of(&folder, material.clone(), environment);
            (scene.shading.method, scene.shading.threads) = (method, Some(threads));
            let rendering = gpu.render(&ready(&scene), Wanted { radiance: true, ..Wanted::default() });
            let reference = read_image(&folder.join(format!("images/{name}.exr"))).expect("a reference picture");
            let rms = rms_inside(&rendering.radiance, &reference.rgba, 640);
            println!("{name}: RMS {rms:.5} at {threads} threads of method {method}");
            assert!(rms < limit, "{name}, {method}: RMS {rms}");
        }
    }
    gpu.finish();
}

#[test]
fn the_reference_has_the_background_and_the_display_values_of_other_pictures() {
    let gpu = Validated::new();
    let mut scene = sphere(diffuse(), "sky", 1, (32, 24));
    (scene.environment.rotation_deg, scene.environment.intensity) = (73.0, 1.7);
    (scene.image.exposure, scene.image.gamma) = (0.1, 1.8);
    scene.shading.method = Method::Reference;
    let truth = |prepared: &Prepared| {
        let settings = ReferenceSettings { tolerance: 0.05, processor: Processor::Cpu };
        reference(prepared, &gpu.device, &settings, &gpu.round()).expect("a reference").rendering(prepared)
    };
    let expected = truth(&ready(&scene));
    scene.shading.method = Method::Cosine;
    let over_environment = ready(&scene);
    let found = gpu.render(&over_environment, EVERYTHING);
    // Corners, where no sphere is.
    for pixel in [0, 31, 23 * 32, 24 * 32 - 1] {
        let [found, expected] = [&found, &expected].map(|picture| Vec4::from(picture.radiance[pixel]));
        assert!(difference(found / expected, Vec4::ONE) < 0.01, "{found}, not {expected} at {pixel}");
    }
    let whole = found.radiance;
    scene.image.background = Background::None;
    let prepared = ready(&scene);
    let found = gpu.render(&prepared, Wanted { display: true, ..EVERYTHING });
    assert!(found.radiance.iter().filter(|pixel| (0.1..0.9).contains(&pixel[3])).count() > 20);
    // Edges have as much of it as they are open.
    let bare = ReferenceImage { radiance: found.radiance.clone(), ..ReferenceImage::default() };
    for (found, expected) in whole.into_iter().zip(bare.over_background(&over_environment)) {
        let [found, expected] = [found, expected].map(Vec4::from);
        assert!(difference(found / expected, Vec4::ONE) < 0.01, "{found}, not {expected}");
    }
    let expected = tone_map(&found.radiance, &prepared.view);
    assert_eq!(expected.len(), found.display.len());
    for (expected, found) in expected.into_iter().zip(found.display) {
        assert!(expected.abs_diff(found) <= 1, "{found}, not {expected}");
    }
    gpu.finish();
}

#[test]
fn the_reference_on_the_gpu_converges_on_that_of_the_cpu() {
    let gpu = Validated::new();
    for (name, material, environment) in [("diffuse", diffuse(), "sky"), ("conductor 0.2", conductor(0.2), "studio")] {
        let mut scene = sphere(material, environment, 1, (32, 24));
        scene.image.background = Background::None;
        scene.shading.method = Method::Reference;
        let prepared = ready(&scene);
        let picture = |processor, tolerance| {
            let settings = ReferenceSettings { tolerance, processor };
            reference(&prepared, &gpu.device, &settings, &gpu.round()).expect("a reference")
        };
        let truth = picture(Processor::Cpu, 5e-5);
        for tolerance in [1e-2, 1e-3] {
            let image = picture(Processor::Gpu, tolerance);
            let covered = truth.radiance.iter().zip(&image.radiance).filter(|(truth, _)| truth[3] > 0.0);
            let (mut sum, mut count) = (0.0, 0);
            for (truth, found) in covered {
                assert_eq!(truth[3], found[3], "coverage");
                for channel in 0..3 {
                    sum += f64::from(display_value(truth[channel], 1.0, 2.2) - display_value(found[channel], 1.0, 2.2))
                        .powi(2);
                    count += 1;
                }
            }
            let (rms, estimate) = ((sum / f64::from(count)).sqrt(), image.error_estimate);
            println!(
                "{name}: RMS {rms:.1e}, by its own estimate {estimate:.1e}, with {} evaluations",
                image.evaluations
            );
            assert!(estimate <= tolerance, "{name}: {estimate}");
            // Of four frames or more and hundreds of pixels the estimate is good to a few percent; neighbours in the
            // sequences are not independent, and single precision is not exact.
            assert!((0.7..1.4).contains(&(rms / estimate)), "{name}: RMS {rms}, estimate {estimate}");
        }
    }
    gpu.finish();
}

/// `radiance` of tests/picture_by_mitsuba.py.
fn gradient_and_two_lights(d: DVec3) -> DVec3 {
    let light = |towards: [f64; 3], sharpness: f64, colour: [f64; 3]| {
        (sharpness * (d.dot(towards.into()) - 1.0)).exp() * DVec3::from(colour)
    };
    DVec3::new(0.25 + 0.15 * d.y, 0.3 + 0.1 * d.x, 0.35 - 0.1 * d.z)
        + light([0.6, 0.64, 0.48], 12.0, [1.2, 0.96, 0.6])
        + light([-0.48, 0.36, 0.8], 25.0, [0.8, 1.4, 2.0])
}

#[test]
fn a_brushed_sphere_looks_as_mitsuba_has_it() {
    const SIZE: (u32, u32) = (32, 24);
    let gpu = Validated::new();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("lights.exr");
    // Fine enough for what is linear between pixels to be within 3e-4 of the function.
    let (columns, rows) = (512, 256);
    let texel = |i: u32| {
        let phi = std::f64::consts::TAU * (f64::from(i % columns) + 0.5) / f64::from(columns);
        let (sin, cos) = (std::f64::consts::PI * (f64::from(i / columns) + 0.5) / f64::from(rows)).sin_cos();
        gradient_and_two_lights(DVec3::new(sin * phi.sin(), cos, -sin * phi.cos())).as_vec3().extend(1.0).to_array()
    };
    let texels: Vec<_> = (0..columns * rows).map(texel).collect();
    write_exr(&path, columns, rows, &texels, false, &Default::default()).unwrap();
    let metal = "model = 'conductor'\ndistribution = 'ggx'\neta = [0.143, 0.375, 1.442]\nk = [3.983, 2.386, 1.603]";
    for roughness in ["alpha_x = 0.1\nalpha_y = 0.4", "alpha_x = 0.4\nalpha_y = 0.1\nrotation_deg = 90"] {
        let mut scene = sphere(model(&format!("{metal}\n{roughness}")), "white", 1, SIZE);
        scene.environment.source = Source::File(path.clone());
        scene.shading.method = Method::Reference;
        scene.image.subpixels = 1;
        scene.image.background = Background::None;
        let eye = DVec3::new(1.5, 1.0, 3.5);
        scene.camera = Some(Camera { eye, target: DVec3::ZERO, up: DVec3::Y, fov_y_deg: 36.0 });
        scene.objects[0].tangent = Some(TangentRule::Around(Vec3::Y));
        let settings = ReferenceSettings { tolerance: 2e-4, processor: Processor::Cpu };
        let found = reference(&ready(&scene), &gpu.device, &settings, &gpu.round()).expect("a reference").radiance;
        let (mut square, mut count, mut worst) = (0.0, 0, 0.0f64);
        for line in include_str!("picture_by_mitsuba.csv").lines().skip(1) {
            let numbers: Vec<f32> = line.split(',').map(|word| word.parse().expect("a number")).collect();
            let pixel = found[(numbers[1] as u32 * SIZE.0 + numbers[0] as u32) as usize];
            assert_eq!(pixel[3], 1.0, "{line}");
            for (value, expected) in pixel.into_iter().zip(&numbers[2..5]) {
                let error = f64::from(display_value(value, 1.0, 2.2) - display_value(*expected, 1.0, 2.2));
                (square, count, worst) = (square + error * error, count + 1, worst.max(error.abs()));
            }
        }
        let rms = (square / f64::from(count)).sqrt();
        println!("{roughness:?}: RMS {rms:.1e} of {count} values, {worst:.1e} at most");
        assert!(count > 800 && rms < 1e-3, "{roughness}: RMS {rms}");
    }
    gpu.finish();
}
