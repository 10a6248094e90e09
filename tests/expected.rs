//! Expected errors: near what is measured, and enough to choose the number of threads by.
mod common;

use common::{Validated, model, ready, sphere};
use tempfile::TempDir;
use threadlight::Method;
use threadlight::low_level::evaluate::expected::{TrueSample, prepare_within};
use threadlight::low_level::evaluate::metrics::{Comparable, Display, compare};
use threadlight::low_level::evaluate::reference::TOLERANCE;
use threadlight::low_level::evaluate::reference::{ReferenceSettings, reference};
use threadlight::low_level::picture::{ExrHeader, write_exr};
use threadlight::low_level::pipeline::Wanted;
use threadlight::low_level::scene::{Background, Scene, Source};

/// A glossy sphere in an uneven environment with a lamp, small so that little has to be blurred; it is put into `folder`.
fn glossy(folder: &TempDir) -> Scene {
    let map = folder.path().join("map.exr");
    let texel = |i: usize| {
        let lamp = if i == 300 { 80.0 } else { 0.0 };
        [lamp + (i % 7) as f32 / 6.0, lamp + (i % 5) as f32 / 4.0, lamp + (i / 64) as f32 / 16.0, 1.0]
    };
    write_exr(&map, 64, 32, &(0..2048).map(texel).collect::<Vec<_>>(), false, &ExrHeader::default()).unwrap();
    let material = "model = 'plastic'\ndistribution = 'ggx'\nalpha = 0.2\nior = 1.5\ndiffuse = [0.6, 0.1, 0.1]";
    let mut scene = sphere(model(material), "white", 1, (48, 36));
    scene.environment.source = Source::File(map);
    scene.image.background = Background::None;
    scene
}

const RADIANCE: Wanted = Wanted { radiance: true, display: false, geometry: false };

#[test]
fn what_is_expected_is_within_a_factor_of_two_of_what_is_measured() {
    let (gpu, folder) = (Validated::new(), TempDir::new().unwrap());
    let mut scene = glossy(&folder);
    let truth = reference(&ready(&scene), &gpu.device, &ReferenceSettings::default(), &gpu.round()).unwrap();
    let sample = TrueSample::new(&ready(&scene), &gpu.device, TOLERANCE, &gpu.round()).unwrap();
    for (method, threads) in [(Method::Fitted, 1), (Method::Fitted, 6), (Method::Paper, 8), (Method::Importance, 16)] {
        (scene.shading.method, scene.shading.threads) = (method, Some(threads));
        let rendering = gpu.render(&ready(&scene), RADIANCE);
        let expected = sample.expected_rms(&rendering.radiance);
        let comparable = |radiance| Comparable::from_radiance(48, 36, radiance, true, Display::default());
        let measured = compare(&comparable(&rendering.radiance), &comparable(&truth.radiance), true).unwrap().rms;
        println!("{method} {threads}: expected {expected:.5}, measured {measured:.5}");
        assert!((0.5..2.0).contains(&(expected / measured)), "{method} {threads}: {expected}, not {measured}");
    }
    gpu.finish();
}

#[test]
fn the_fewest_threads_that_are_within_an_error_are_chosen() {
    let (gpu, folder) = (Validated::new(), TempDir::new().unwrap());
    let scene = glossy(&folder);
    let expected_of = |threads: u32| {
        let mut scene = scene.clone();
        scene.shading.threads = Some(threads);
        let prepared = ready(&scene);
        let rendering = gpu.render(&prepared, RADIANCE);
        TrueSample::new(&prepared, &gpu.device, TOLERANCE, &gpu.round()).unwrap().expected_rms(&rendering.radiance)
    };
    let errors = [1, 2, 3].map(expected_of);
    let most = 1.01 * errors[2];
    let (count, error) = [1, 2, 3].into_iter().zip(errors).find(|(_, error)| *error <= most).unwrap();
    let (prepared, expected) = prepare_within(&scene, most, &gpu.device, &gpu.round()).unwrap();
    let threads = prepared.materials[0].threads.as_ref().unwrap();
    assert_eq!((prepared.sampling.count, threads.size()[1]), (count, count as usize), "{errors:?}");
    assert!((expected - error).abs() < 1e-9, "{expected}, not {error}");
    gpu.finish();
}

#[test]
fn an_error_that_no_number_of_threads_reaches_is_refused_with_the_one_that_is() {
    let (gpu, folder) = (Validated::new(), TempDir::new().unwrap());
    let mut scene = glossy(&folder);
    scene.shading.method = Method::Cosine;
    let error = prepare_within(&scene, 1e-6, &gpu.device, &gpu.round()).err().unwrap().to_string();
    assert!(error.contains("--error") && error.contains("8192") && error.contains("cosine"), "{error}");
    gpu.finish();
}
