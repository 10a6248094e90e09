//! The viewer without its window: what dropped files and changes ask for.
#![cfg(feature = "viewer")]
mod common;

use common::{Validated, sphere};
use glam::DVec3;
use std::time::{Duration, Instant};
use threadlight::low_level::memo::Memo;
use threadlight::low_level::scene::{MaterialSource, Source};
use threadlight::low_level::viewer::change::Change;
use threadlight::low_level::viewer::input::Input;
use threadlight::low_level::viewer::interaction::Viewer;

/// Waits until what is wanted has been loaded.
fn wait(viewer: &mut Viewer) {
    let start = Instant::now();
    while viewer.is_loading() {
        viewer.take_loaded().expect("a scene that can be loaded");
        assert!(start.elapsed() < Duration::from_secs(100), "nothing was loaded");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Reflectance, in red, of what is shown.
fn red(viewer: &Viewer) -> f64 {
    let brdf = &viewer.loaded().expect("something is shown").prepared.materials[0].brdf;
    std::f64::consts::PI * brdf.evaluate(DVec3::Z, DVec3::Z).x
}

#[test]
fn an_edited_file_that_is_dropped_again_is_seen_as_it_is_now() {
    let gpu = Validated::new();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("paint.toml");
    let write =
        |red: f64| std::fs::write(&path, format!("model = \"lambert\"\nreflectance = [{red}, 0.5, 0.5]\n")).unwrap();
    let scene = sphere(MaterialSource::Builtin("clay".into()), "white", 2, (32, 24));
    let mut viewer = Viewer::new(scene, &gpu.device, Memo::default(), || ());
    wait(&mut viewer);
    write(0.25);
    viewer.handle(&Input::Drop(path.clone()));
    wait(&mut viewer);
    assert!((red(&viewer) - 0.25).abs() < 1e-9);
    write(0.75);
    // Something else is changed: the file counts as it was when it was dropped.
    viewer.handle(&Input::Set(Change::Threads(Some(3))));
    wait(&mut viewer);
    assert!((red(&viewer) - 0.25).abs() < 1e-9);
    viewer.handle(&Input::Drop(path.clone()));
    wait(&mut viewer);
    assert!((red(&viewer) - 0.75).abs() < 1e-9);
    // What cannot be read changes nothing, and is told.
    std::fs::write(&path, "model = \"lambert\"\nreflectance = [nan").unwrap();
    viewer.handle(&Input::Drop(path.clone()));
    wait(&mut viewer);
    assert!(viewer.notice.as_ref().is_some_and(|notice| notice.is_error && notice.text.contains("paint.toml")));
    assert!((red(&viewer) - 0.75).abs() < 1e-9);
    drop(viewer);
    gpu.finish();
}

#[test]
fn moving_the_camera_does_not_begin_again_what_is_being_made() {
    let gpu = Validated::new();
    let scene = sphere(MaterialSource::Builtin("clay".into()), "white", 2, (32, 24));
    let mut viewer = Viewer::new(scene, &gpu.device, Memo::default(), || ());
    wait(&mut viewer);
    viewer.handle(&Input::Set(Change::Environment(Source::Builtin("studio".into()))));
    assert!(viewer.is_loading());
    for step in 0..20 {
        viewer.handle(&Input::Set(Change::Rotation(f64::from(step))));
        viewer.handle(&Input::Set(Change::Exposure(1.0 + f64::from(step))));
    }
    let shown = viewer.session.shown();
    assert_eq!((shown.environment.rotation_deg, shown.image.exposure), (19.0, 20.0));
    assert_eq!(shown.environment.source, Source::Builtin("white".into()));
    wait(&mut viewer);
    assert_eq!(viewer.session.shown(), viewer.session.wanted());
    assert_eq!(viewer.session.shown().environment.source, Source::Builtin("studio".into()));
    drop(viewer);
    gpu.finish();
}
