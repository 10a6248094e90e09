//! Sweeps on the device, against reference pictures that are made up, so that what must come out is known.
mod common;

use common::{Validated, model, ready, sphere};
use std::sync::atomic::{AtomicUsize, Ordering};
use tempfile::TempDir;
use threadlight::low_level::evaluate::reference::ReferenceImage;
use threadlight::low_level::evaluate::sweep::{self, Measured};
use threadlight::low_level::evaluate::{Cases, Shard, Sweep, gallery};
use threadlight::low_level::memo::Round;
use threadlight::low_level::method::Method;
use threadlight::low_level::picture::{ExrHeader, write_exr};
use threadlight::low_level::pipeline::Wanted;
use threadlight::low_level::prepare::Prepared;
use threadlight::low_level::progress::Observer;
use threadlight::low_level::scene::{MaterialSource, Scene, Source};
use threadlight::low_level::steps::FitThreads;
use threadlight::low_level::threads::{ThreadKind, ThreadSettings};
use threadlight::{Error, Result};

fn grey() -> MaterialSource {
    model("model = 'lambert'\nreflectance = 0.5")
}

/// Two materials and two environments, one of them small and uneven, which it puts in `folder`, on a small sphere with `paper` at
/// 4 and 16 threads.
fn sweep(folder: &TempDir) -> Sweep {
    let map = folder.path().join("map.exr");
    let texel = |i: usize| [(i % 7) as f32 / 3.0, (i % 5) as f32 / 2.0, (i / 16) as f32 / 8.0, 1.0];
    write_exr(&map, 16, 8, &(0..128).map(texel).collect::<Vec<_>>(), false, &ExrHeader::default()).unwrap();
    let mut scene = Scene::default();
    (scene.image.width, scene.image.height) = (40, 30);
    let metal =
        model("model = 'conductor'\ndistribution = 'ggx'\nalpha = 0.3\neta = [0.2, 0.9, 1.1]\nk = [3.9, 2.4, 2.1]");
    let cases = Cases {
        methods: vec![Method::Paper.into()],
        counts: vec![4, 16],
        materials: vec![("grey".into(), grey()), ("metal".into(), metal)],
        environments: vec![("white".into(), Source::Builtin("white".into())), ("map".into(), Source::File(map))],
        scenes: vec![("sphere".into(), scene)],
        seed: 0,
        shard: Shard::WHOLE,
    };
    Sweep { cases, repeat: 1, whole_picture: false, expected: false, keep_pictures: false }
}

/// The picture with 16 threads of `paper`, as if it were the truth.
fn sixteen_threads(gpu: &Validated, prepared: &Prepared) -> Result<ReferenceImage> {
    // What is asked for has the material and the environment, but threads of any number.
    let settings = ThreadSettings { kind: ThreadKind::Paper, count: 16, ..ThreadSettings::default() };
    let material = &prepared.materials[0];
    let threads = gpu.round().ask(&FitThreads { brdf: &material.brdf, settings })?;
    let mut own = ready(&sphere(grey(), "white", 1, (1, 1)));
    (own.view, own.environment, own.show_environment) = (prepared.view.clone(), prepared.environment.clone(), false);
    own.materials[0].brdf = material.brdf.clone();
    own.materials[0].threads = Some(threads);
    own.sampling.count = 16;
    own.method = Method::Paper;
    let rendering = gpu.render(&own, Wanted { radiance: true, ..Wanted::default() });
    Ok(ReferenceImage { radiance: rendering.radiance, error_estimate: 1e-4, ..ReferenceImage::default() })
}

#[test]
fn every_combination_is_measured_once_against_the_reference_of_its_place() {
    let gpu = Validated::new();
    let folder = tempfile::tempdir().unwrap();
    let asked = AtomicUsize::new(0);
    let reference = |prepared: &Prepared, _: &Round| {
        asked.fetch_add(1, Ordering::Relaxed);
        sixteen_threads(&gpu, prepared)
    };
    let mut measured = Measured::default();
    sweep::run(&sweep(&folder), &gpu.device, &gpu.memo, &reference, &(), &mut measured).unwrap();
    assert_eq!(asked.into_inner(), 4);
    assert_eq!(measured.reference_error, 1e-4);

    let places: Vec<_> = measured.rows.iter().map(|row| (&*row.material, &*row.environment, row.threads)).collect();
    let expected: Vec<_> = ["grey", "metal"]
        .iter()
        .flat_map(|material| {
            ["white", "map"].iter().flat_map(|light| [(*material, *light, 4), (*material, *light, 16)])
        })
        .collect();
    assert_eq!(places, expected);
    for row in &measured.rows {
        assert_eq!((&*row.method, &*row.scene, row.nan), ("paper", "sphere", 0));
        assert!(row.gpu_ms > 0.0 && row.frame_ms > 0.0 && row.lookups > 0, "{row:?}");
        match row.threads {
            16 => assert_eq!((row.rms, row.rms_linear, row.max, row.flip), (0.0, 0.0, 0.0, 0.0), "{row:?}"),
            _ => assert!(row.max >= row.rms && (row.environment == "white" || row.rms > 1e-3), "{row:?}"),
        }
        assert!(row.ssim <= 1.0 + 1e-12 && (row.threads == 4 || row.ssim > 1.0 - 1e-12), "{row:?}");
    }
    let lookups = |threads| measured.rows.iter().find(|row| row.threads == threads).map(|row| row.lookups);
    assert_eq!(lookups(4).map(|lookups| 4 * lookups), lookups(16));
    gpu.finish();
}

#[test]
fn background_pixels_thin_the_error_out() {
    let gpu = Validated::new();
    let folder = tempfile::tempdir().unwrap();
    let rms = |whole_picture| {
        let mut sweep = Sweep { whole_picture, ..sweep(&folder) };
        sweep.cases.counts = vec![4];
        sweep.cases.environments.remove(0);
        let mut measured = Measured::default();
        let reference = |prepared: &Prepared, _: &Round| sixteen_threads(&gpu, prepared);
        sweep::run(&sweep, &gpu.device, &gpu.memo, &reference, &(), &mut measured).unwrap();
        measured.rows[0].rms
    };
    let (surface, whole) = (rms(false), rms(true));
    assert!(0.4 * surface < whole && whole < 0.8 * surface, "{surface} {whole}");
    gpu.finish();
}

#[test]
fn methods_with_and_without_threads_are_measured_side_by_side_and_shown() {
    let gpu = Validated::new();
    let folder = tempfile::tempdir().unwrap();
    let mut sweep = Sweep { keep_pictures: true, ..sweep(&folder) };
    sweep.cases.methods = vec![Method::Paper.into(), Method::Importance.into(), Method::Paper.into()];
    sweep.cases.materials.truncate(1);
    let mut measured = Measured::default();
    sweep::run(&sweep, &gpu.device, &gpu.memo, &|prepared, _| sixteen_threads(&gpu, prepared), &(), &mut measured)
        .unwrap();
    let [paper, importance, again] = [0, 1, 2].map(|method| measured.rows[2 * method + 1].clone());
    assert_eq!((&*paper.method, &*importance.method), ("paper", "importance"));
    assert!(paper.rms == 0.0 && again.rms == 0.0 && importance.rms > 0.0, "{paper:?} {importance:?} {again:?}");

    assert_eq!((measured.pictures.len(), measured.references.len()), (12, 2));
    assert!(measured.pictures[1] == measured.references[0].1, "the picture is the reference");
    let sheets = gallery::comparison_sheets(&measured);
    assert_eq!(sheets.iter().map(|(name, _)| &**name).collect::<Vec<_>>(), ["grey_white_sphere", "grey_map_sphere"]);
    gpu.finish();
}

#[test]
fn measurements_made_before_an_error_or_an_interruption_are_kept() {
    struct After(AtomicUsize);
    impl Observer for After {
        fn progress(&self, done: usize, total: usize) {
            assert_eq!(total, 8);
            self.0.store(done, Ordering::Relaxed);
        }
        fn cancelled(&self) -> bool {
            self.0.load(Ordering::Relaxed) >= 3
        }
    }
    let gpu = Validated::new();
    let folder = tempfile::tempdir().unwrap();
    let mut measured = Measured::default();
    let reference = |prepared: &Prepared, _: &Round| sixteen_threads(&gpu, prepared);
    let error =
        sweep::run(&sweep(&folder), &gpu.device, &gpu.memo, &reference, &After(AtomicUsize::new(0)), &mut measured)
            .unwrap_err();
    assert!(matches!(error, Error::Cancelled), "{error}");
    assert_eq!(measured.rows.len(), 3);
    gpu.finish();
}
