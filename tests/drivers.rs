//! Every device of this machine draws the picture that the one draws that tests use, and draws it twice the same.
//!
//! `ci/drivers` runs this with several drivers; with one there is nothing to compare.
mod common;

use common::{EVERYTHING, Validated, analytic_materials, sphere, texels_of};
use glam::UVec2;
use std::path::Path;
use threadlight::Method;
use threadlight::low_level::evaluate::{Comparable, Display};
use threadlight::low_level::geometry_texel::GeometryTexel;
use threadlight::low_level::memo::Memo;
use threadlight::low_level::picture::write_exr;
use threadlight::low_level::prepare::{Prepared, prepare};
use threadlight::low_level::rendering::Rendering;
use threadlight::low_level::scene::{Background, Scene, Source};
use threadlight::low_level::vulkan::{Instance, describe_devices};

/// Of display values, over all pixels that see the same surface on both devices.
const MOST_RMS: f64 = 1e-3;
/// Of one of them.
const MOST: f32 = 0.02;
/// The part of the covered pixels in which the devices may see different things: where edges run between the fractions of a pixel that they
/// tell apart, which need not be finer than 1/16 ("subPixelPrecisionBits").
const MOST_AT_EDGES: f64 = 0.01;

/// Metal and plastic, under a lamp and a gradient, by the methods that look cube maps up.
fn scenes(folder: &Path) -> Vec<(String, Scene)> {
    // Small, as it is blurred by the way.
    let path = folder.join("lamp.exr");
    let lamp = [90.0, 70.0, 50.0, 1.0];
    let texel = |i: usize| if i == 64 * 9 + 20 { lamp } else { [(i % 7) as f32, (i / 64) as f32 / 8.0, 0.5, 1.0] };
    write_exr(&path, 64, 32, &(0..64 * 32).map(texel).collect::<Vec<_>>(), false, &Default::default()).unwrap();
    let cases = analytic_materials().into_iter().skip(1).flat_map(|(name, material)| {
        let path = path.clone();
        [Method::Fitted, Method::Paper].map(move |method| {
            let mut scene = sphere(material.clone(), "white", 8, (160, 120));
            scene.environment.source = Source::File(path.clone());
            scene.shading.method = method;
            // Not in the middle of faces.
            scene.environment.rotation_deg = 73.0;
            scene.image.exposure = 0.3;
            scene.image.background = Background::None;
            (format!("{name}, {method}"), scene)
        })
    });
    cases.collect()
}

/// The normals and materials of a pixel, as far as it sees any.
fn seen(prepared: &Prepared, rendering: &Rendering, pixel: usize) -> Vec<Option<GeometryTexel>> {
    let pixel = pixel as u32;
    let at = UVec2::new(pixel % prepared.view.width, pixel / prepared.view.width);
    texels_of(prepared, rendering, at).into_iter().map(GeometryTexel::unpack).collect()
}

/// Whether two devices saw the same in a pixel: normals within a quarter of a degree. At the rim of the sphere they turn by more than that
/// in the sixteenth of a pixel that a device may move a vertex by, and a highlight there turns twice as far.
fn is_same(a: &[Option<GeometryTexel>], b: &[Option<GeometryTexel>]) -> bool {
    a.iter().zip(b).all(|pair| match pair {
        (Some(a), Some(b)) => a.material == b.material && a.normal.dot(b.normal) > 0.99999,
        (None, None) => true,
        _ => false,
    })
}

#[test]
fn every_device_draws_the_same_picture_twice_as_the_others_do() {
    let instance = Instance::new(false).expect("an instance");
    let usable = describe_devices(&instance).expect("devices").into_iter().filter(|device| device.lacks.is_empty());
    let devices: Vec<_> = usable.map(|device| (device.index.to_string(), device.driver)).collect();
    drop(instance);
    let folder = tempfile::tempdir().unwrap();
    // What does not depend on the device is made once.
    let open = |device: Option<&str>| {
        let mut gpu = device.map_or_else(Validated::new, |device| Validated::on(Some(device)));
        gpu.memo = Memo::new(Some(folder.path()));
        gpu
    };
    for (name, scene) in scenes(folder.path()) {
        let of_tests = open(None);
        let own = of_tests.device.description().index.to_string();
        let prepared = prepare(&scene, &of_tests.round()).expect("a scene that can be prepared");
        let expected = of_tests.render(&prepared, EVERYTHING);
        of_tests.finish();
        for (index, driver) in &devices {
            let pictures = [0, 1].map(|_| {
                let gpu = open(Some(index));
                let picture = gpu.render(&prepared, EVERYTHING);
                gpu.finish();
                picture
            });
            let [found, again] = &pictures;
            assert!(found.radiance == again.radiance, "{name}: two pictures by {driver}");
            match *index == own {
                true => assert!(found.radiance == expected.radiance, "{name}: two pictures by {driver}"),
                false => compare(&name, driver, &prepared, found, &expected),
            }
        }
    }
}

/// Fails where `found` is not the picture that was `expected`.
fn compare(name: &str, driver: &str, prepared: &Prepared, found: &Rendering, expected: &Rendering) {
    let (width, height) = (prepared.view.width as usize, prepared.view.height as usize);
    let display = |rendering: &Rendering| {
        Comparable::from_radiance(width, height, &rendering.radiance, false, Display::default()).display
    };
    let (shown, wanted) = (display(found), display(expected));
    let (mut squares, mut covered, mut count, mut most) = (0.0, 0, 0, 0.0_f32);
    for pixel in 0..shown.len() {
        let (here, there) = (seen(prepared, found, pixel), seen(prepared, expected, pixel));
        if here.iter().chain(&there).all(Option::is_none) {
            continue;
        }
        covered += 1;
        if is_same(&here, &there) {
            let differences = [0, 1, 2].map(|channel| shown[pixel][channel] - wanted[pixel][channel]);
            squares += differences.iter().map(|difference| f64::from(difference * difference)).sum::<f64>() / 3.0;
            most = differences.iter().fold(most, |most, difference| most.max(difference.abs()));
            count += 1;
        }
    }
    let (rms, at_edges) = ((squares / f64::from(count)).sqrt(), 1.0 - f64::from(count) / f64::from(covered));
    println!(
        "{name}, {driver}: RMS {rms:.1e}, at most {most:.1e}; {:.2} % of the pixels see other things",
        100.0 * at_edges
    );
    assert!(rms <= MOST_RMS && most <= MOST && at_edges <= MOST_AT_EDGES, "{name}, {driver}: {rms} {most} {at_edges}");
}
