//! The viewer in a window of a virtual X server, on the test device, with validation.
#![cfg(all(feature = "viewer", target_os = "linux"))]
mod common;
#[path = "common/display.rs"]
mod display;

use common::{device_flags, folder_of_run, program_with_cache};
use display::Display;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tempfile::TempDir;
use threadlight::low_level::picture::{PictureFile, read_image};

/// Held by each viewer: some are timed, and others would take the processor from them.
static ALONE: Mutex<()> = Mutex::new(());

/// A viewer in a folder of its own.
struct Viewer {
    display: Display,
    folder: TempDir,
    _alone: MutexGuard<'static, ()>,
}

/// What a viewer leaves.
struct Ended {
    success: bool,
    /// Its log.
    log: Vec<String>,
}

impl Viewer {
    fn new() -> Option<Self> {
        // Another test that failed is no reason to fail.
        let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
        Some(Self { display: Display::open()?, folder: tempfile::tempdir().expect("a folder"), _alone })
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn write(&self, name: &str, contents: impl AsRef<[u8]>) -> PathBuf {
        std::fs::write(self.path(name), contents).expect("a file");
        self.path(name)
    }

    /// `threadlight`, on the test device, with the caches of all tests.
    fn threadlight(&self, arguments: &[&str]) -> Command {
        let cache = folder_of_run().unwrap_or_else(|| Path::new(env!("CARGO_TARGET_TMPDIR")).join("viewer"));
        let mut command = program_with_cache(&self.folder, cache);
        command.env("DISPLAY", &self.display.name).env_remove("WAYLAND_DISPLAY");
        command.args(arguments).args(device_flags());
        command
    }

    fn start(&self, arguments: &[&str]) -> Child {
        let mut command = self.threadlight(&[&["view", "--validate", "-vv"], arguments].concat());
        command.stderr(Stdio::piped()).spawn().expect("a viewer")
    }

    /// Plays `replay` until the viewer ends.
    fn play(&self, arguments: &[&str], replay: &str) -> Ended {
        self.write("replay.jsonl", replay);
        let viewer = self.start(&[arguments, &["--replay", "replay.jsonl"]].concat());
        Ended::of(viewer.wait_with_output().expect("an end"))
    }

    /// `name`, rendered without a window out of the scene file `scene`.
    fn render(&self, scene: &str, name: &str) -> PictureFile {
        let status = self.threadlight(&["render", scene, "-o", name]).status().expect("a rendering");
        assert!(status.success());
        self.picture(name)
    }

    fn picture(&self, name: &str) -> PictureFile {
        read_image(&self.path(name)).expect("a picture")
    }
}

impl Ended {
    fn of(output: Output) -> Self {
        let log: Vec<_> = String::from_utf8_lossy(&output.stderr).lines().map(str::to_owned).collect();
        Self { success: output.status.success(), log }
    }

    fn expect_success(&self) {
        let problems: Vec<_> =
            self.log.iter().filter(|line| line.contains("validation") || line.contains("ERROR")).collect();
        assert!(
            self.success && problems.is_empty(),
            "{:#?}",
            if problems.is_empty() { self.log.iter().collect() } else { problems }
        );
    }

    /// The passes of each frame, in order.
    fn frames(&self) -> impl Iterator<Item = Vec<&str>> {
        let frames = self.log.iter().filter_map(|line| line.split("frame: ").nth(1));
        frames.map(|passes| passes.split_whitespace().collect())
    }
}

/// Small, so that lavapipe is quick.
const SMALL: [&str; 2] = ["--size", "160x120"];

#[test]
fn a_session_can_be_saved_and_rendered_to_the_bit() {
    let Some(viewer) = Viewer::new() else { return };
    let mut replay = "\"wait\"\n".to_owned();
    for step in 0..20 {
        replay += &format!("{{\"resize\": [{}, {}]}}\n", 160 + 7 * (step % 5), 120 + 11 * (step % 3));
    }
    replay += r#"
        {"resize": [170, 130]}
        {"minimise": true}
        {"minimise": false}
        "wait"
        {"drag": {"button": "left", "from": [80, 60], "by": [21, -9]}}
        {"drag": {"button": "right", "from": [80, 60], "by": [-5, 4]}}
        {"drag": {"button": "left", "from": [80, 60], "by": [30, 0], "control": true}}
        {"scroll": {"lines": 1}}
        {"set": {"material": {"builtin": "clay"}}}
        {"set": {"method": "paper"}}
        {"set": {"threads": 16}}
        {"set": {"exposure": 1.3}}
        "wait"
        {"save_picture": "saved.png"}
        {"save_picture": "saved.exr"}
        {"save_scene": "saved.toml"}
        "quit""#;
    viewer.play(&SMALL, &replay).expect_success();
    let scene = std::fs::read_to_string(viewer.path("saved.toml")).expect("a scene");
    for part in ["clay", "paper", "width = 170", "height = 130", "[camera]", "exposure = 1.3"] {
        assert!(scene.contains(part), "{part} is not in\n{scene}");
    }
    assert!(viewer.render("saved.toml", "again.png") == viewer.picture("saved.png"));
    assert!(viewer.render("saved.toml", "again.exr").rgba == viewer.picture("saved.exr").rgba);
    assert_eq!(std::fs::read(viewer.path("again.png")).unwrap(), std::fs::read(viewer.path("saved.png")).unwrap());
}

#[test]
fn the_screenshot_shows_picture_and_panel_and_only_what_has_changed_runs() {
    let Some(viewer) = Viewer::new() else { return };
    let ended = viewer.play(
        &[&SMALL[..], &["--frames", "2", "--screenshot", "window.png"]].concat(),
        r#""wait"
           {"set": {"exposure": 2}}
           "wait"
           {"set": {"material": {"builtin": "clay"}}}
           "wait"
           {"set": {"parameter": {"material": "clay", "key": "reflectance", "value": [0.1, 0.2, 0.3]}}}
           "wait""#,
    );
    ended.expect_success();
    let of_picture = ["geometry_cache", "classify", "shade", "background", "tone_map"];
    let made: Vec<Vec<_>> = ended
        .frames()
        .map(|frame| frame.into_iter().filter(|pass| of_picture.contains(pass)).collect::<Vec<_>>())
        .filter(|passes| !passes.is_empty())
        .collect();
    // The first picture, the brighter one, and the other material, whose lobe lets other pixels share a sum: geometry once, its classes twice.
    let (before, recoloured) = made.split_at_checked(3).expect("three pictures");
    assert_eq!(before, [&of_picture[..], &of_picture[4..], &of_picture[1..]]);
    // The same in another colour, which may have a draft first.
    assert!(
        (1..=2).contains(&recoloured.len()) && recoloured.iter().all(|passes| *passes == of_picture[2..]),
        "{made:?}"
    );
    let window = viewer.picture("window.png");
    assert_eq!((window.width, window.height), (460, 240));
    let distinct = |columns: std::ops::Range<u32>| {
        let texels = (0..window.height).flat_map(|y| columns.clone().map(move |x| (y * 460 + x) as usize));
        let colors = texels.map(|at| window.rgba[at].map(|value| (value * 255.0) as u8));
        colors.collect::<std::collections::BTreeSet<_>>().len()
    };
    assert!(distinct(0..160) > 100 && distinct(160..460) > 20, "{} {}", distinct(0..160), distinct(160..460));
}

#[test]
fn a_window_that_is_closed_before_its_screenshot_is_an_error() {
    let Some(viewer) = Viewer::new() else { return };
    let ended = viewer.play(&[&SMALL[..], &["--screenshot", "window.png"]].concat(), "\"quit\"");
    assert!(!ended.success && !viewer.path("window.png").exists());
    assert!(
        ended.log.last().is_some_and(|line| line.contains("window.png: the window was closed")),
        "{:#?}",
        ended.log
    );
}

#[test]
fn a_dragged_parameter_is_seen_by_drafts_and_ends_as_if_it_had_never_been_dragged() {
    let Some(viewer) = Viewer::new() else { return };
    let mut replay = "\"wait\"\n".to_owned();
    let alpha = |value: f64| {
        format!("{{\"set\": {{\"parameter\": {{\"material\": \"gold\", \"key\": \"alpha\", \"value\": {value}}}}}}}\n")
    };
    let values: Vec<f64> = (0..12).map(|step| 0.25 + f64::from(step) / 64.0).collect();
    values.iter().for_each(|value| replay += &alpha(*value));
    replay += "\"wait\"\n{\"save_picture\": \"saved.png\"}\n{\"save_scene\": \"scene.toml\"}\n\"quit\"\n";
    let arguments = ["--threads", "4", "--no-cache", "--stats", "stats.json", "--stats-error"];
    let most_have_drafts = || {
        viewer.play(&[&SMALL[..], &arguments].concat(), &replay).expect_success();
        let stats = std::fs::read(viewer.path("stats.json")).unwrap();
        let stats: serde_json::Value = serde_json::from_slice(&stats).unwrap();
        assert_eq!(stats["size"], serde_json::json!([160, 240]));
        // Others are of the window, which gets its size.
        let events = stats["events"].as_array().expect("events").iter();
        let events: Vec<_> = events.filter(|event| event["input"]["set"]["parameter"].is_object()).collect();
        assert_eq!(events.len(), values.len());
        let ms = |event: &serde_json::Value, key: &str| event[key].as_f64();
        for (event, value) in events.iter().copied().zip(&values) {
            assert_eq!(event["input"]["set"]["parameter"]["value"].as_f64(), Some(*value));
            assert!(ms(event, "shown_ms") > Some(0.0), "{event}");
            // Unlike the finished picture, but like it.
            assert!(ms(event, "rms_to_finished").is_none_or(|rms| rms > 0.0 && rms < 0.02), "{event}");
        }
        let last = events.last().unwrap();
        assert!(ms(last, "finished_ms") > ms(last, "shown_ms"), "{last}");
        events.iter().filter(|event| event["rms_to_finished"].is_number()).count() > values.len() / 2
    };
    // A draft that other work on the machine delays gives way to the next value.
    assert!((0..3).any(|_| most_have_drafts()));
    viewer.render("scene.toml", "again.png");
    assert!(std::fs::read(viewer.path("again.png")).unwrap() == std::fs::read(viewer.path("saved.png")).unwrap());
}

#[test]
fn a_picture_that_is_saved_while_it_is_a_draft_is_that_of_the_scene_that_is_saved_with_it() {
    let Some(viewer) = Viewer::new() else { return };
    let replay = r#""wait"
        {"set": {"parameter": {"material": "gold", "key": "alpha", "value": 0.31}}}
        {"save_picture": "saved.png"}
        {"save_scene": "scene.toml"}
        "quit""#;
    viewer.play(&[&SMALL[..], &["--threads", "4", "--no-cache"]].concat(), replay).expect_success();
    viewer.render("scene.toml", "again.png");
    assert!(std::fs::read(viewer.path("again.png")).unwrap() == std::fs::read(viewer.path("saved.png")).unwrap());
}

#[test]
fn a_viewer_that_is_told_to_end_keeps_what_was_edited() {
    let Some(viewer) = Viewer::new() else { return };
    for (signal, exposure) in [("INT", 0.5), ("TERM", 0.25)] {
        let edit = format!("{{\"set\": {{\"exposure\": {exposure}}}}}");
        let replay = format!("\"wait\"\n{edit}\n{{\"save_scene\": \"edited.toml\"}}\n");
        viewer.write("replay.jsonl", replay);
        let arguments = [&SMALL[..], &["--threads", "1", "--replay", "replay.jsonl"]].concat();
        let child = viewer.start(&[&arguments[..], &["--environment", "white", "--material", "clay"]].concat());
        let start = Instant::now();
        while !viewer.path("edited.toml").exists() {
            assert!(start.elapsed() < Duration::from_secs(120), "nothing is edited");
            std::thread::sleep(Duration::from_millis(20));
        }
        let sent = Command::new("kill").args(["-s", signal, &child.id().to_string()]).status().expect("a signal");
        let output = child.wait_with_output().expect("an end");
        assert!(sent.success() && output.status.code() == Some(130), "{signal}: {:?}", output.status);
        let log = String::from_utf8_lossy(&output.stderr).into_owned();
        let kept = log.lines().find_map(|line| line.split("is kept: threadlight view ").nth(1)).expect(&log);
        let read = |path: &Path| std::fs::read_to_string(path).expect("a scene");
        assert_eq!(read(Path::new(kept)), read(&viewer.path("edited.toml")));
        assert!(read(Path::new(kept)).contains(&format!("exposure = {exposure}")));
        std::fs::remove_file(viewer.path("edited.toml")).expect("a scene");
    }
}

#[test]
fn a_file_that_the_scene_is_made_of_is_not_written_over() {
    let Some(viewer) = Viewer::new() else { return };
    viewer.write("m.toml", "model = 'lambert'\nreflectance = 0.5");
    let replay = "\"wait\"\n{\"save_scene\": \"m.toml\"}\n{\"save_scene\": \"other.toml\"}\n\"quit\"";
    let arguments = ["--threads", "1", "--environment", "white", "--material", "m.toml"];
    let ended = viewer.play(&[&SMALL[..], &arguments].concat(), replay);
    assert!(!ended.success && ended.log.iter().any(|line| line.contains("m.toml: is also read")), "{:#?}", ended.log);
    assert!(std::fs::read_to_string(viewer.path("m.toml")).expect("a material").contains("lambert"));
    assert!(viewer.path("other.toml").exists());
}

#[test]
fn a_broken_file_is_told_and_changes_nothing() {
    let Some(viewer) = Viewer::new() else { return };
    viewer.write("broken.binary", b"not a table");
    viewer.write("broken.obj", b"f 1 2 3\n");
    viewer.write("letter.txt", b"hello");
    let ended = viewer.play(
        &[&SMALL[..], &["--frames", "1", "--screenshot", "window.png"]].concat(),
        r#""wait"
           {"save_scene": "before.toml"}
           {"save_picture": "before.png"}
           {"drop": "letter.txt"}
           {"drop": "broken.obj"}
           "wait"
           {"drop": "broken.binary"}
           "wait"
           {"key": "escape"}
           {"save_scene": "after.toml"}
           {"save_picture": "after.png"}
           {"drop": "broken.binary"}
           "wait""#,
    );
    // A script learns of it in the end.
    assert!(
        !ended.success && ended.log.last().is_some_and(|line| line.contains("4 of what it asks for")),
        "{:#?}",
        ended.log
    );
    for name in ["letter.txt", "broken.obj", "broken.binary"] {
        assert!(ended.log.iter().any(|line| line.contains("WARN") && line.contains(name)), "{:#?}", ended.log);
    }
    let read = |name| std::fs::read(viewer.path(name)).expect("a file");
    assert_eq!(read("before.toml"), read("after.toml"));
    assert_eq!(read("before.png"), read("after.png"));
    // The message is on a red ground, over the picture.
    let window = viewer.picture("window.png");
    let red = window.rgba.iter().filter(|[r, g, b, _]| *r > 3.0 * g && *r > 3.0 * b && *r > 0.3).count();
    assert!(red > 500, "{red} red pixels");
}

#[test]
fn what_is_undone_looks_as_before_and_is_seen_from_where_the_camera_is() {
    let Some(viewer) = Viewer::new() else { return };
    let replay = r#"{"set": {"exposure": 2}}
        "wait"
        {"save_picture": "bright.png"}
        {"set": {"material": {"builtin": "clay"}}}
        {"set": {"environment": {"builtin": "sky"}}}
        "wait"
        {"save_picture": "last.png"}
        {"drag": {"button": "left", "from": [80, 60], "by": [21, -9]}}
        {"save_scene": "turned.toml"}
        "undo"
        "undo"
        {"save_scene": "undone.toml"}
        {"key": "home"}
        "wait"
        {"save_picture": "undone.png"}
        "redo"
        "redo"
        "redo"
        "wait"
        {"save_picture": "redone.png"}
        "undo"
        "undo"
        "undo"
        "undo"
        {"save_scene": "first.toml"}
        "quit""#;
    viewer.play(&SMALL, replay).expect_success();
    let read = |name| std::fs::read(viewer.path(name)).expect("a file");
    assert!(read("bright.png") == read("undone.png") && read("last.png") == read("redone.png"));
    assert!(read("bright.png") != read("last.png"));
    let text = |name| String::from_utf8(read(name)).expect("a scene");
    let camera = |name| Some(text(name).split_once("[camera]")?.1.split("\n[").next()?.to_owned());
    assert!(camera("turned.toml").is_some() && camera("turned.toml") == camera("undone.toml"));
    assert!(text("first.toml").contains("gold") && text("first.toml").contains("exposure = 1"));
}

#[test]
fn a_replay_goes_on_while_the_turntable_turns() {
    let Some(viewer) = Viewer::new() else { return };
    let replay = r#"{"key": "t"}
        "wait"
        {"save_scene": "turned.toml"}
        {"key": "t"}
        "wait"
        "quit""#;
    viewer.play(&[&SMALL[..], &["--replay-limit", "120"]].concat(), replay).expect_success();
    let turned = std::fs::read_to_string(viewer.path("turned.toml")).expect("a scene");
    assert!(turned.contains("[camera]"), "{turned}");
}

#[test]
fn a_wait_has_a_limit() {
    let Some(viewer) = Viewer::new() else { return };
    let replay = r#""wait"
        {"set": {"threads": 128}}
        "wait""#;
    let few = ["--material", "silver", "--environment", "white", "--no-cache", "--replay-limit", "1"];
    let Ended { success, log } = viewer.play(&[&SMALL[..], &few].concat(), replay);
    assert!(!success && log.iter().any(|line| line.contains("the replay: waits for more than 1 s")), "{log:#?}");
}

/// Plays `replay`, which ends by quitting, and returns how long the window then takes to close.
fn time_to_close(viewer: &Viewer, arguments: &[&str], replay: &str) -> Duration {
    viewer.write("replay.jsonl", replay);
    let mut child = viewer.start(&[&SMALL[..], arguments, &["--no-cache", "--replay", "replay.jsonl"]].concat());
    let mut log = BufReader::new(child.stderr.take().expect("piped"));
    let mut line = String::new();
    while log.read_line(&mut line).expect("a log") > 0 && !line.contains("closing") {
        line.clear();
    }
    let start = Instant::now();
    assert!(line.contains("closing"), "the viewer ended without closing");
    let mut rest = String::new();
    log.read_to_string(&mut rest).expect("a log");
    let status = child.wait().expect("an end");
    assert!(status.success() && !rest.contains("validation"), "{rest}");
    start.elapsed()
}

#[test]
fn closing_takes_less_than_a_second_whatever_is_being_made() {
    let Some(viewer) = Viewer::new() else { return };
    let alpha = |step: i32| {
        let value = 0.1 + 0.02 * f64::from(step);
        format!("{{\"set\": {{\"parameter\": {{\"material\": \"gold\", \"key\": \"alpha\", \"value\": {value}}}}}}}\n")
    };
    // Minutes of work, and drafts of a drag.
    let many_threads = "\"wait\"\n{\"set\": {\"threads\": 128}}\n{\"move\": [10, 10]}\n\"quit\"".to_owned();
    let drag = format!("\"wait\"\n{}\"quit\"", (0..10).map(alpha).collect::<String>());
    for (material, replay) in [("silver", many_threads), ("gold", drag)] {
        let time = time_to_close(&viewer, &["--material", material, "--environment", "white"], &replay);
        println!("{material}: {time:?}");
        assert!(time < Duration::from_secs(1), "{time:?}: {replay}");
    }
}

/// Fails the test if a viewer that nothing happens to draws frames or takes time.
fn expect_rest(viewer: &Viewer, arguments: &[&str]) {
    let mut child = viewer.start(&[&SMALL[..], arguments].concat());
    let (send, lines) = std::sync::mpsc::channel();
    let log = BufReader::new(child.stderr.take().expect("piped"));
    let reader = std::thread::spawn(move || log.lines().map_while(Result::ok).try_for_each(|line| send.send(line)));
    // Until the picture is there, and egui has settled.
    let wait = Duration::from_secs(120);
    while !lines.recv_timeout(wait).expect("a picture").contains(" shade ") {}
    let shown = Instant::now();
    while lines.recv_timeout(Duration::from_secs(3)).is_ok() && shown.elapsed() < wait {}
    let ticks = || {
        let stat = std::fs::read_to_string(format!("/proc/{}/stat", child.id())).expect("a process");
        let fields: Vec<_> = stat.rsplit(')').next().expect("fields").split_whitespace().collect();
        // Fields 14 and 15 of the line are user and system time; these count from the third.
        fields[11..=12].iter().map(|field| field.parse::<u64>().expect("a number")).sum::<u64>()
    };
    let before = ticks();
    std::thread::sleep(Duration::from_secs(3));
    let used = ticks() - before;
    let drawn = lines.try_iter().filter(|line| line.contains("frame: ")).count();
    child.kill().expect("a running viewer");
    child.wait().expect("an end");
    let _ = reader.join();
    println!("in 3 s: {used} ticks of processor time, {drawn} frames");
    // A tick is a hundredth of a second.
    assert!(used <= 2 && drawn == 0, "{used} ticks, {drawn} frames");
}

#[test]
fn a_still_window_costs_nothing() {
    let Some(viewer) = Viewer::new() else { return };
    expect_rest(&viewer, &[]);
}

#[test]
fn nor_does_a_minimised_one_whose_turntable_turns() {
    let Some(viewer) = Viewer::new() else { return };
    viewer.write("replay.jsonl", "\"wait\"\n{\"minimise\": true}\n{\"key\": \"t\"}\n");
    expect_rest(&viewer, &["--replay", "replay.jsonl"]);
}

#[test]
fn a_window_goes_through_any_number_of_sizes() {
    let Some(viewer) = Viewer::new() else { return };
    let runs = std::env::var("THREADLIGHT_FAULT_RUNS").ok();
    let count: u32 = runs.map_or(20, |runs| runs.parse().expect("THREADLIGHT_FAULT_RUNS has to be a number"));
    let sizes =
        (0..count).map(|step| format!("{{\"resize\": [{}, {}]}}\n", 160 + step * 67 % 190, 240 + step * 41 % 120));
    let replay = format!("\"wait\"\n{}{{\"resize\": [160, 250]}}\n\"wait\"\n", sizes.collect::<String>());
    let arguments =
        ["--threads", "1", "--material", "clay", "--environment", "white", "--frames", "1", "--stats", "s.json"];
    viewer.play(&[&SMALL[..], &arguments].concat(), &replay).expect_success();
    let stats: serde_json::Value = serde_json::from_slice(&std::fs::read(viewer.path("s.json")).unwrap()).unwrap();
    assert_eq!(stats["size"], serde_json::json!([160, 250]));
}

#[test]
fn sizes_that_no_picture_has_are_told_and_the_window_stays_as_it_is() {
    let Some(viewer) = Viewer::new() else { return };
    let replay = r#""wait"
        {"set": {"size": [20000, 20000]}}
        {"resize": [100000, 100000]}
        {"set": {"size": [0, 0]}}
        "wait"
        {"save_scene": "scene.toml"}
        "quit""#;
    let ended = viewer.play(&["--size", "200x250", "--method", "cosine", "--environment", "white"], replay);
    assert!(
        !ended.success && ended.log.last().is_some_and(|line| line.contains("3 of what it asks for")),
        "{:#?}",
        ended.log
    );
    for side in ["20000", "100000", "0"] {
        let problem = format!("size: {side} is out of range");
        assert!(ended.log.iter().any(|line| line.contains(&problem)), "{problem}: {:#?}", ended.log);
    }
    let scene = std::fs::read_to_string(viewer.path("scene.toml")).expect("a scene");
    assert!(scene.contains("width = 200") && scene.contains("height = 250"), "{scene}");
}

#[test]
fn a_window_is_no_larger_than_images_can_be() {
    let Some(viewer) = Viewer::new() else { return };
    // With the panel both have more columns than the widest image of lavapipe, which has 16384.
    let replay = r#""wait"
        {"resize": [16384, 250]}
        "wait"
        {"save_scene": "wide.toml"}
        "quit""#;
    let ended = viewer.play(&["--size", "16384x240", "--method", "cosine", "--environment", "white"], replay);
    assert!(ended.log.iter().all(|line| !line.contains("validation")), "{:#?}", ended.log);
    let last = ended.log.last().expect("a log");
    assert!(last.contains("1 of what it asks for") && last.contains("16684 x 250 is out of range"), "{:#?}", ended.log);
    let scene = std::fs::read_to_string(viewer.path("wide.toml")).expect("a scene");
    assert!(scene.contains("width = 16084") && scene.contains("height = 240"), "{scene}");
}

#[test]
fn a_window_wider_than_images_of_its_sub_pixels_shows_a_coarser_picture() {
    let Some(viewer) = Viewer::new() else { return };
    // The widest image of lavapipe has 16384 columns.
    let replay = r#""wait"
        {"resize": [4200, 240]}
        "wait"
        {"set": {"exposure": 2}}
        {"set": {"material": {"builtin": "silver"}}}
        "wait"
        {"save_scene": "wide.toml"}
        "quit""#;
    let arguments = ["--subpixels", "4", "--method", "cosine", "--environment", "white"];
    viewer.play(&[&SMALL[..], &arguments].concat(), replay).expect_success();
    let scene = std::fs::read_to_string(viewer.path("wide.toml")).expect("a scene");
    assert!(scene.contains("width = 4200") && scene.contains("silver"), "{scene}");
}

#[test]
fn a_picture_that_there_is_no_memory_for_is_told_and_shown_with_fewer_pixels() {
    let Some(viewer) = Viewer::new() else { return };
    viewer.write("replay.jsonl", "\"wait\"\n{\"set\": {\"subpixels\": 4}}\n\"wait\"\n{\"key\": \"escape\"}\n");
    let mut command = viewer.threadlight(&["view", "--validate", "-vv", "--replay", "replay.jsonl"]);
    command.args(["--size", "1000x1000", "--method", "cosine", "--environment", "white", "--background", "none"]);
    command.args(["--frames", "1", "--screenshot", "window.png"]).env("THREADLIGHT_DEVICE_MEMORY_MIB", "150");
    let ended = Ended::of(command.output().expect("an end"));
    let told = ended.log.iter().any(|line| line.contains("WARN") && line.contains("no memory for"));
    assert!(told && ended.log.iter().all(|line| !line.contains("validation")), "{:#?}", ended.log);
    let window = viewer.picture("window.png");
    let at = |x: u32, y: u32| window.rgba[(y * window.width + x) as usize];
    assert!(at(500, 500) != at(2, 2), "the object is not there");
}

#[test]
fn bad_arguments_are_said_before_a_window_opens() {
    let Some(viewer) = Viewer::new() else { return };
    viewer.write("bad.jsonl", "{\"jump\": 3}\n");
    for (arguments, words) in [
        (&["--replay", "bad.jsonl"][..], &["bad.jsonl", "line 1", "jump"][..]),
        (&["--screenshot", "x.jpg"], &["x.jpg"]),
        (&["--present-mode", "warp"], &["warp", "fifo"]),
        (&["--material", "missing.binary"], &["missing.binary"]),
        (&["--method", "reference"], &["reference"]),
    ] {
        let output = viewer.threadlight(&[&["view", "--frames", "1"], arguments].concat()).output().expect("an end");
        let text = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{text}");
        assert!(words.iter().all(|word| text.contains(word)) && text.trim().lines().count() == 1, "{text}");
    }
}
