//! Whole pictures against those of an independent renderer (Mitsuba 3), where these lie beside the project.
mod common;

use common::{Validated, model, ready, sphere};
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use threadlight::low_level::evaluate::Display;
use threadlight::low_level::evaluate::reference::{Integrator, Processor, ReferenceSettings, TOLERANCE, reference};
use threadlight::low_level::output::read_image;
use threadlight::low_level::pipeline::{Wanted, render_geometry};
use threadlight::low_level::prepare::Prepared;
use threadlight::low_level::scene::{Background, MaterialSource, Scene, Source};
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
        scene.shading.method = "reference".to_owned();
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
        for (method, threads, limit) in [("paper", 100, limits[0]), ("fitted", 16, limits[1])] {
            let mut scene = scene_of(&folder, material.clone(), environment);
            (scene.shading.method, scene.shading.threads) = (method.to_owned(), Some(threads));
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
fn the_reference_on_the_gpu_converges_on_that_of_the_cpu() {
    let gpu = Validated::new();
    for (name, material, environment) in [("diffuse", diffuse(), "sky"), ("conductor 0.2", conductor(0.2), "studio")] {
        let mut scene = sphere(material, environment, 1, (32, 24));
        scene.image.background = Background::None;
        scene.shading.method = "reference".to_owned();
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
