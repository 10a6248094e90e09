//! The viewer without its window: what dropped files and changes ask for.
#![cfg(feature = "viewer")]
mod common;

use common::{Validated, sphere};
use glam::DVec3;
use std::time::{Duration, Instant};
use threadlight::Method;
use threadlight::low_level::memo::Memo;
use threadlight::low_level::prepare::{Prepared, PreparedMaterial};
use threadlight::low_level::scene::{MaterialSettings, MaterialSource, ObjectSettings, Scene, ShadingSettings, Source};
use threadlight::low_level::threads::Threads;
use threadlight::low_level::viewer::change::Change;
use threadlight::low_level::viewer::comparison::Other;
use threadlight::low_level::viewer::input::{Input, Scroll};
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

/// The threads of each material.
fn threads_of(prepared: &Prepared) -> Vec<Threads> {
    let of = |material: &PreparedMaterial| (*material.threads.clone().unwrap()).clone();
    prepared.materials.iter().map(of).collect()
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
fn a_file_that_is_shown_and_then_broken_is_told_once_each_time_it_is_opened_and_stays_as_it_was() {
    let gpu = Validated::new();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("paint.toml");
    std::fs::write(&path, "model = \"lambert\"\nreflectance = 0.25\n").unwrap();
    let material = MaterialSource::File(path.clone());
    let mut viewer = Viewer::new(sphere(material.clone(), "white", 2, (32, 24)), &gpu.device, Memo::default(), || ());
    wait(&mut viewer);
    let open = Input::Set(Change::Material(material));
    let failures = |viewer: &mut Viewer, expected: usize| {
        viewer.handle(&open);
        wait(viewer);
        assert_eq!(viewer.failures.len(), expected, "{:?}", viewer.failures);
        assert!((red(viewer) - 0.25).abs() < 1e-9 && viewer.session.shown() == viewer.session.wanted());
    };
    std::fs::write(&path, "model = \"lambert\"\nreflectance = 7\n").unwrap();
    failures(&mut viewer, 1);
    std::fs::remove_file(&path).unwrap();
    failures(&mut viewer, 2);
    assert!(viewer.notice.as_ref().is_some_and(|notice| notice.is_error));
    // All else can be changed.
    viewer.handle(&Input::Set(Change::Threads(Some(3))));
    wait(&mut viewer);
    assert_eq!((viewer.failures.len(), viewer.session.shown().shading.threads), (2, Some(3)));
    assert_eq!(viewer.notice, None);
    std::fs::write(&path, "model = \"lambert\"\nreflectance = 0.75\n").unwrap();
    viewer.handle(&open);
    assert_eq!(viewer.notice, None);
    wait(&mut viewer);
    assert!((red(&viewer) - 0.75).abs() < 1e-9);
    drop(viewer);
    gpu.finish();
}

#[test]
fn what_cannot_be_loaded_takes_nothing_else_with_it_not_even_before_the_first_picture() {
    let gpu = Validated::new();
    let scene = sphere(MaterialSource::Builtin("clay".into()), "white", 2, (32, 24));
    let mut viewer = Viewer::new(scene, &gpu.device, Memo::default(), || ());
    let absent = Change::Mesh(Source::File("absent.obj".into()));
    viewer.handle(&Input::Set(absent.clone()));
    wait(&mut viewer);
    assert!(viewer.notice.as_ref().is_some_and(|notice| notice.text.contains("absent.obj")));
    assert!(viewer.loaded().is_some(), "the scene that it was started with");
    for change in [Change::Environment(Source::Builtin("sky".into())), absent, Change::Threads(Some(3))] {
        viewer.handle(&Input::Set(change));
    }
    wait(&mut viewer);
    let shown = viewer.session.shown();
    assert_eq!((&shown.environment.source, shown.shading.threads), (&Source::Builtin("sky".into()), Some(3)));
    assert_eq!(shown, viewer.session.wanted());
    drop(viewer);
    gpu.finish();
}

#[test]
fn of_two_materials_that_are_edited_in_turn_each_keeps_its_threads() {
    let gpu = Validated::new();
    let scene = |color: f64, alpha: f64| {
        let paint = common::model(&format!(
            "model = 'plastic'\ndistribution = 'ggx'\nalpha = 0.2\nior = 1.5\ndiffuse = [{color}, 0.1, 0.1]"
        ));
        let mut scene = sphere(paint, "white", 2, (32, 24));
        let metal = common::model(&format!(
            "model = 'conductor'\ndistribution = 'ggx'\nalpha = {alpha}\neta = [0.2, 0.9, 1.1]\nk = [3.9, 2.4, 2.1]"
        ));
        scene.materials.push(MaterialSettings { name: "metal".into(), source: metal });
        scene.objects.push(ObjectSettings::new(Source::Builtin("sphere".into()), "metal"));
        scene
    };
    let mut viewer = Viewer::new(scene(0.2, 0.3), &gpu.device, Memo::default(), || ());
    wait(&mut viewer);
    let set = |material: &str, key: &str, value: toml::Value| {
        Input::Set(Change::Parameter { material: material.into(), key: key.into(), value })
    };
    // The first thing that is loaded after an input.
    let next = |viewer: &mut Viewer, input: &Input| {
        viewer.handle(input);
        let start = Instant::now();
        while !viewer.take_loaded().unwrap() || viewer.draft_awaited_until().is_some() {
            assert!(start.elapsed() < Duration::from_secs(100), "nothing was loaded");
        }
        let loaded = viewer.loaded().unwrap();
        (loaded.is_draft(), threads_of(&loaded.prepared))
    };
    let finished = threads_of(&viewer.loaded().unwrap().prepared);
    let (is_draft, of_metal) = next(&mut viewer, &set("metal", "alpha", 0.31.into()));
    assert!(is_draft && of_metal[0] == finished[0] && of_metal[1] != finished[1]);
    // Another input before anything is finished: without a window, no frame asks for it, so it waits for the draft to be taken.
    viewer.frame_was_drawn();
    let (is_draft, of_both) = next(&mut viewer, &set("m", "diffuse", vec![0.25, 0.1, 0.1].into()));
    assert!(is_draft && of_both[0] != finished[0] && of_both[1] == of_metal[1]);
    // What is saved has finished threads.
    let folder = tempfile::tempdir().unwrap();
    let [early, late] = ["early.png", "late.png"].map(|name| folder.path().join(name));
    viewer.handle(&Input::SavePicture(early.clone()));
    assert!(!early.exists() && viewer.notice.as_ref().is_some_and(|notice| notice.text.contains("when its threads")));
    // It is as it was wanted then.
    viewer.handle(&Input::Set(Change::Exposure(3.0)));
    viewer.frame_was_drawn();
    wait(&mut viewer);
    let expected = common::ready(&scene(0.25, 0.31));
    let loaded = viewer.loaded().unwrap();
    assert!(!loaded.is_draft());
    assert!(threads_of(&loaded.prepared) == threads_of(&expected));
    viewer.handle(&Input::Set(Change::Exposure(1.0)));
    viewer.handle(&Input::SavePicture(late.clone()));
    assert!(std::fs::read(early).unwrap() == std::fs::read(late).unwrap());
    drop(viewer);
    gpu.finish();
}

#[test]
fn a_draft_is_finished_though_something_else_cannot_be_loaded_meanwhile() {
    let gpu = Validated::new();
    let folder = tempfile::tempdir().unwrap();
    let broken = folder.path().join("broken.toml");
    std::fs::write(&broken, "model = \"lambert\"\nreflectance = [nan").unwrap();
    let material = |red: f64| common::model(&format!("model = 'lambert'\nreflectance = [{red}, 0.5, 0.5]"));
    let mut viewer = Viewer::new(sphere(material(0.25), "white", 2, (32, 24)), &gpu.device, Memo::default(), || ());
    wait(&mut viewer);
    let value = vec![0.75, 0.5, 0.5].into();
    viewer.handle(&Input::Set(Change::Parameter { material: "m".into(), key: "reflectance".into(), value }));
    let start = Instant::now();
    while !viewer.loaded().unwrap().is_draft() {
        viewer.take_loaded().unwrap();
        assert!(start.elapsed() < Duration::from_secs(100), "no draft");
    }
    viewer.handle(&Input::Drop(broken));
    wait(&mut viewer);
    assert!(viewer.notice.as_ref().is_some_and(|notice| notice.is_error));
    assert!(!viewer.loaded().unwrap().is_draft() && (red(&viewer) - 0.75).abs() < 1e-9);
    drop(viewer);
    gpu.finish();
}

#[test]
fn a_picture_that_is_to_be_saved_and_changed_before_it_is_finished_is_told() {
    let gpu = Validated::new();
    let folder = tempfile::tempdir().unwrap();
    let [scene, first, second] = ["s.toml", "first.png", "second.png"].map(|name| folder.path().join(name));
    let mut viewer = Viewer::new(quick(), &gpu.device, Memo::default(), || ());
    viewer.handle(&Input::SavePicture(first.clone()));
    viewer.handle(&Input::Set(Change::Threads(Some(3))));
    // Picture and scene are of the same.
    viewer.handle(&Input::SavePicture(second.clone()));
    viewer.handle(&Input::SaveScene(scene.clone()));
    wait(&mut viewer);
    assert!(viewer.failures.len() == 1 && viewer.failures[0].contains("first.png"), "{:?}", viewer.failures);
    assert!(!first.exists() && second.exists());
    assert_eq!(Scene::load(&scene).unwrap().shading.threads, Some(3));
    // Nor is there a picture of what cannot be loaded.
    viewer.handle(&Input::Set(Change::Mesh(Source::File("absent.obj".into()))));
    viewer.handle(&Input::SavePicture(first.clone()));
    wait(&mut viewer);
    assert!(viewer.failures.len() == 3 && viewer.failures[1].contains("first.png") && !first.exists());
    drop(viewer);
    gpu.finish();
}

#[test]
fn a_comparison_that_cannot_be_is_told_and_leaves_the_one_before() {
    let gpu = Validated::new();
    let mut viewer = Viewer::new(quick(), &gpu.device, Memo::default(), || ());
    viewer.handle(&Input::Compare(Some(Other::Reference)));
    let shading = ShadingSettings { threads: Some(500), ..ShadingSettings::default() };
    viewer.handle(&Input::Compare(Some(Other::Shading(shading))));
    assert!(viewer.failures.len() == 1 && viewer.failures[0].contains("500"), "{:?}", viewer.failures);
    assert_eq!(viewer.comparer.other, Some(Other::Reference));
    drop(viewer);
    gpu.finish();
}

#[test]
fn lines_and_keys_that_there_are_not_are_told_and_change_nothing() {
    let gpu = Validated::new();
    let mut viewer = Viewer::new(quick(), &gpu.device, Memo::default(), || ());
    viewer.handle(&Input::Wipe(0.25));
    for (count, (input, what)) in [
        (Input::Wipe(5.0), "wipe"),
        (Input::Wipe(-1.0), "wipe"),
        (Input::Key("nope".into()), "nope"),
        (Input::Key(String::new()), "key"),
    ]
    .into_iter()
    .enumerate()
    {
        viewer.handle(&input);
        assert!(viewer.failures.len() == count + 1 && viewer.failures[count].contains(what), "{:?}", viewer.failures);
    }
    // A key that does nothing is pressed in vain, as it is in a window.
    viewer.handle(&Input::Key("q".into()));
    assert_eq!((viewer.failures.len(), viewer.comparer.wipe.part()), (4, 0.25));
    drop(viewer);
    gpu.finish();
}

/// A scene of which no drafts are made.
fn quick() -> Scene {
    let mut scene = sphere(MaterialSource::Builtin("clay".into()), "white", 2, (32, 24));
    scene.shading.method = Method::Cosine;
    scene
}

#[test]
fn what_could_not_be_loaded_is_not_asked_for_again_by_undoing_what_came_after() {
    let gpu = Validated::new();
    let mut viewer = Viewer::new(quick(), &gpu.device, Memo::default(), || ());
    wait(&mut viewer);
    viewer.handle(&Input::Set(Change::Mesh(Source::File("absent.obj".into()))));
    viewer.handle(&Input::Set(Change::Exposure(2.0)));
    wait(&mut viewer);
    assert_eq!((viewer.failures.len(), viewer.session.shown().image.exposure), (1, 2.0));
    viewer.handle(&Input::Undo);
    wait(&mut viewer);
    assert_eq!((viewer.failures.len(), viewer.session.shown().image.exposure), (1, 1.0));
    assert_eq!(viewer.history.has(), [false, true]);
    drop(viewer);
    gpu.finish();
}

#[test]
fn another_scene_is_framed_though_the_camera_is_moved_while_it_loads() {
    let gpu = Validated::new();
    let folder = tempfile::tempdir().unwrap();
    let mut viewer = Viewer::new(quick(), &gpu.device, Memo::default(), || ());
    wait(&mut viewer);
    let scroll = Input::Scroll(Scroll::Lines(1.0));
    viewer.handle(&scroll);
    assert!(viewer.session.wanted().camera.is_some());
    let mut large = quick();
    large.objects[0].scale = 100.0;
    let path = folder.path().join("large.toml");
    large.save(&path).unwrap();
    viewer.handle(&Input::Drop(path));
    assert!(viewer.is_loading());
    viewer.handle(&scroll);
    wait(&mut viewer);
    assert_eq!((viewer.session.shown().objects[0].scale, viewer.session.shown().camera), (100.0, None));
    // Where only the material is another, what is seen is what was moved.
    viewer.handle(&Input::Undo);
    wait(&mut viewer);
    viewer.handle(&Input::Set(Change::Material(MaterialSource::Builtin("silver".into()))));
    assert!(viewer.is_loading());
    let before = viewer.session.shown().camera;
    viewer.handle(&scroll);
    assert!(before.is_some() && viewer.session.shown().camera != before);
    wait(&mut viewer);
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
    // What had begun again would have been made for the last of the rotations.
    let made_for = viewer.loaded().expect("a scene").prepared.scene.environment.rotation_deg;
    assert_eq!(made_for, 0.0);
    drop(viewer);
    gpu.finish();
}
