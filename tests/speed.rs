//! Times on the device: what is measured is what was asked for, and the floor makes the lookups that it says.
mod common;

use common::{Farthest, Validated, analytic_materials, ready, sphere};
use threadlight::Error;
use threadlight::glam::Vec4;
use threadlight::low_level::environment::Pyramid;
use threadlight::low_level::evaluate::bare_lookups::time_bare_lookups;
use threadlight::low_level::evaluate::speed::{self, Growth, Speed, Timings};
use threadlight::low_level::evaluate::{Cases, Shard};
use threadlight::low_level::method::Method;
use threadlight::low_level::passes::{BareLookup, BareLookups};
use threadlight::low_level::scene::{Camera, Scene, Source};
use threadlight::low_level::vulkan::PipelineCache;

/// A small sphere of one material under white light.
fn speed() -> Speed {
    let mut scene = Scene::default();
    (scene.image.width, scene.image.height) = (40, 30);
    let (name, material) = analytic_materials().remove(0);
    let cases = Cases {
        methods: vec![Method::Paper.into(), Method::Uniform.into()],
        counts: vec![2, 4],
        materials: vec![(name.into(), material)],
        environments: vec![("white".into(), Source::Builtin("white".into()))],
        scenes: vec![("sphere".into(), scene)],
        seed: 0,
        shard: Shard::WHOLE,
    };
    Speed { cases, threads: 4, repeat: 1 }
}

#[test]
fn bare_lookups_see_the_environment_as_often_as_asked_for() {
    let gpu = Validated::new();
    let (_, material) = analytic_materials().remove(0);
    let environment = ready(&sphere(material, "white", 1, (8, 8))).environment;
    let pyramid = Pyramid::box_filtered(&environment);
    let cache = PipelineCache::new(&gpu.device, None).unwrap();
    for (pixels, lookups) in [(1, 1), (1000, 16), (70_000, 3)] {
        let rows: Vec<_> =
            (0..7 * lookups).map(|k| BareLookup { direction: [0.6, 0.0, 0.8], level: k as f32 }).collect();
        let bare = BareLookups::new(&gpu.device, &cache, &pyramid, [pixels, lookups], &rows, None).unwrap();
        let (gpu_ms, sums) = time_bare_lookups(&gpu.device, &bare).unwrap();
        assert!(gpu_ms > 0.0);
        assert_eq!(sums.len(), pixels as usize);
        // White is 1 in every direction, up to the rounding of half floats and of filtering.
        let expected = lookups as f32;
        for sum in sums {
            assert!(sum[..3].iter().all(|value| (value / expected - 1.0).abs() < 1e-3), "{sum:?} of {lookups}");
        }
    }
    drop(cache);
    gpu.finish();
}

#[test]
fn bare_lookups_are_of_the_row_the_turn_and_the_level_that_their_cpu_form_has() {
    let gpu = Validated::new();
    let (_, material) = analytic_materials().remove(0);
    let pyramid = Pyramid::box_filtered(&ready(&sphere(material, "sky", 1, (8, 8))).environment);
    let cache = PipelineCache::new(&gpu.device, None).unwrap();
    // Groups are no multiple of the rows: none but the first is where two meet.
    let (counts, rows) = ([70_000, 3], 7);
    let lookup = |k: u32| {
        let (sin, cos) = (0.2 + 0.05 * k as f32).sin_cos();
        BareLookup { direction: [sin, 0.0, cos], level: 0.4 * (k % 9) as f32 }
    };
    let rows: Vec<_> = (0..rows * counts[1]).map(lookup).collect();
    let bare = BareLookups::new(&gpu.device, &cache, &pyramid, counts, &rows, None).unwrap();
    let (_, sums) = time_bare_lookups(&gpu.device, &bare).unwrap();
    for (pixel, sum) in sums.iter().enumerate().step_by(101) {
        let expected = bare.sum(&rows, &pyramid, pixel as u32) / pyramid.radiance_scale();
        // Weights of a lookup have 8 bits.
        let off = (Vec4::from(*sum).truncate() / expected - 1.0).farthest();
        assert!(off < 5e-3, "{pixel}: {sum:?}, expected {expected}");
    }
    drop((bare, cache));
    gpu.finish();
}

#[test]
fn every_method_is_timed_at_every_count_and_in_every_series() {
    let gpu = Validated::new();
    let mut timings = Timings::default();
    speed::run(&speed(), &gpu.device, &gpu.memo, &(), &mut timings).unwrap();

    let frames: Vec<_> = timings.frames.iter().map(|frame| (&*frame.method, frame.threads)).collect();
    assert_eq!(frames, [("paper", 2), ("paper", 4), ("uniform", 2), ("uniform", 4)]);
    for frame in timings.frames.iter().chain(timings.growths.iter().map(|growth| &growth.frame)) {
        assert!(frame.floor_ms > 0.0 && frame.frame_ms > 0.0 && frame.ns_per_lookup > 0.0, "{frame:?}");
        for pass in ["geometry_cache", "classify", "shade", "tone_map"] {
            assert!(frame.pass_ms(pass) > 0.0, "{pass}: {frame:?}");
        }
        let sum: f64 = frame.passes.iter().map(|pass| pass.gpu_ms).sum();
        assert!((frame.gpu_ms - sum).abs() < 1e-9 * sum && frame.pass_ms("read_display") == 0.0, "{frame:?}");
    }
    assert_eq!(timings.frames[3].lookups, 2 * timings.frames[2].lookups);

    let series = |method: &str, what: &str| -> Vec<Growth> {
        let here = timings.growths.iter().filter(|growth| growth.frame.method == method && growth.what == what);
        here.cloned().collect()
    };
    for method in ["paper", "uniform"] {
        for (what, quantities) in [
            ("pixels", [20 * 15, 28 * 21, 40 * 30]),
            ("sub-pixels", [1, 4, 16]),
            ("threads", [1, 2, 4]),
            ("triangles", [49_152, 4 * 49_152, 16 * 49_152]),
        ] {
            let series = series(method, what);
            assert_eq!(series.iter().map(|growth| growth.quantity).collect::<Vec<_>>(), quantities, "{method} {what}");
            assert_eq!(series[0].ratio, None);
            let expected = series[2].frame.gpu_ms / series[1].frame.gpu_ms;
            assert_eq!(series[2].ratio, Some(expected));
        }
    }
    let frame = &timings.growths.last().unwrap().frame;
    assert_eq!((frame.width, frame.height, frame.subpixels, frame.threads), (40, 30, 2, 4));
    gpu.finish();
}

#[test]
fn a_scene_without_a_surface_is_refused() {
    let gpu = Validated::new();
    let mut speed = speed();
    let camera = Camera::framing(glam::DVec3::new(0.0, 100.0, 0.0), 1.0, 4.0 / 3.0);
    speed.cases.scenes[0].1.camera = Some(camera);
    let error = speed::run(&speed, &gpu.device, &gpu.memo, &(), &mut Timings::default()).unwrap_err();
    assert!(matches!(error, Error::Input { .. }) && error.to_string().contains("sphere: shows no surface"), "{error}");
    gpu.finish();
}
