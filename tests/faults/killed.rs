//! Killed or told to stop at random moments: files are whole or not there, and the next run is as if nothing had been.
use super::*;
use std::collections::BTreeMap;
use std::os::unix::process::ExitStatusExt;
use std::process::{Child, ExitStatus, Stdio};
use std::time::{Duration, Instant, SystemTime};
use threadlight::Scene;

fn temporary_files(folder: &Path) -> Vec<PathBuf> {
    names(folder).into_iter().filter(|name| name.starts_with(TEMPORARY)).map(|name| folder.join(name)).collect()
}

/// Ends `child` by a signal of that name: after a part of `time`, or as soon as it begins to write a file to one of `folders`.
fn end(mut child: Child, signal: &str, random: &mut Random, time: Duration, folders: &[PathBuf]) -> ExitStatus {
    let files = || folders.iter().map(|folder| names(folder).len()).sum::<usize>();
    let (start, before) = (Instant::now(), files());
    // Writing is a small part of the time: half of the moments are in it, at one of the first files.
    let (moment, count) = match random.next() < 0.5 {
        true => (2.0, 1 + (6.0 * random.next()) as usize),
        false => (1.1 * random.next(), usize::MAX),
    };
    while start.elapsed() < time.mul_f64(moment) && files() < before.saturating_add(count) {
        if child.try_wait().expect("a child").is_some() {
            break;
        }
        std::thread::sleep(Duration::from_micros(100));
    }
    let mut kill = Command::new("kill");
    drop(kill.args([&format!("-{signal}"), &child.id().to_string()]).stderr(Stdio::null()).status());
    child.wait().expect("an end")
}

/// Makes what killed writers left as old as it has to be for being swept up.
fn let_time_pass(folders: &[PathBuf]) -> usize {
    let left: Vec<_> = folders.iter().flat_map(|folder| temporary_files(folder)).collect();
    for path in &left {
        let file = std::fs::OpenOptions::new().write(true).open(path).expect("a file");
        file.set_modified(SystemTime::now() - Duration::from_secs(3600)).expect("a time");
    }
    left.len()
}

#[test]
fn a_program_that_is_ended_at_any_moment_leaves_whole_files_and_the_next_run_the_same_bytes() {
    let place = Place::new();
    let (outputs, cache) = (place.path("out"), place.cache());
    std::fs::create_dir(&outputs).unwrap();
    let arguments = [&RENDER[..RENDER.len() - 1], &["out/picture.png", "--stats", "out/stats.json"]].concat();
    let start = Instant::now();
    assert!(place.threadlight(&arguments).status().unwrap().success());
    let time = start.elapsed();
    let is_lavapipe = device_name().is_some_and(|device| device == "lavapipe");
    let (picture, mut kept) = (contents(&outputs)["picture.png"].clone(), contents(&cache));
    assert!(kept.len() > 3, "{:?}", kept.keys());
    // What other drivers keep of pipelines may differ from run to run; NVIDIA's does.
    let differs = |name: &str| !is_lavapipe && name.starts_with("pipelines-");
    kept.retain(|name, _| !differs(name));
    let folders = [outputs.clone(), cache.clone()];
    let (mut random, mut ended, mut strays) = (Random(1), BTreeMap::new(), 0);
    for round in 0..moments(4) {
        let signal = ["KILL", "TERM", "KILL", "HUP", "KILL", "INT"][round as usize % 6];
        // Where the last one was ended early there is none.
        let _ = std::fs::remove_dir_all(place.path("cache"));
        let command = &mut place.threadlight(&arguments);
        let status = end(command.stderr(Stdio::null()).spawn().unwrap(), signal, &mut random, time, &folders);
        // As shells have it: ended by the signal, or 128 and its number. Or it was done before.
        let number = status.signal().or(status.code()).filter(|&code| code != 0);
        let numbers: &[i32] = match signal {
            "KILL" => &[9],
            "TERM" => &[15, 130],
            "HUP" => &[1],
            _ => &[2, 130],
        };
        assert!(number.is_none_or(|number| numbers.contains(&number)), "{signal}: {status:?}");
        *ended.entry((signal, number)).or_insert(0) += 1;
        assert!(contents(&outputs)["picture.png"] == picture, "{signal}");
        let stats = &contents(&outputs)["stats.json"];
        assert!(serde_json::from_slice::<serde_json::Value>(stats).is_ok(), "{signal}");
        for (name, bytes) in contents(&cache).into_iter().filter(|(name, _)| !differs(name)) {
            assert!(kept.get(&name) == Some(&bytes), "{signal}: {name} is not what it is to be");
        }
        strays += let_time_pass(&folders);
    }
    println!("{ended:?}, {strays} temporary files left, a run takes {time:?}");
    assert!(ended.keys().any(|(_, number)| number.is_some()), "each was done before");
    let _ = std::fs::remove_dir_all(place.path("cache"));
    assert!(place.threadlight(&arguments).status().unwrap().success());
    assert_eq!(names(&outputs), ["picture.png", "stats.json"]);
    assert!(contents(&outputs)["picture.png"] == picture);
    let mut kept_again = contents(&cache);
    kept_again.retain(|name, _| !differs(name));
    assert!(kept_again == kept && temporary_files(&cache).is_empty());
}

/// Saves one of two scenes after the other, until the process is killed.
#[test]
#[ignore = "the test below runs it"]
fn scenes_are_saved_for_ever() {
    for step in 0.. {
        scene(step % 2 == 0).save(Path::new("scene.toml")).unwrap();
    }
}

/// A scene of many objects, or the built-in one.
fn scene(is_long: bool) -> Scene {
    let mut scene = Scene::default();
    let object = scene.objects[0].clone();
    scene.objects.resize(if is_long { 500 } else { 1 }, object);
    scene
}

#[test]
fn a_saved_scene_is_one_or_the_other_however_its_writer_is_killed() {
    let place = Place::new();
    let whole = [true, false].map(|is_long| scene(is_long).to_toml(Some(place.folder.path())).unwrap());
    let (mut random, mut strays, folders) = (Random(2), 0, [place.folder.path().to_owned()]);
    let mut seen = 0;
    let name = module_path!().split_once("::").expect("a crate").1.to_owned() + "::scenes_are_saved_for_ever";
    for _ in 0..moments(20) {
        let mut command = place.command(std::env::current_exe().unwrap().to_str().expect("UTF-8"));
        let child = command.args(["--ignored", "--exact", &name]).stdout(Stdio::null()).spawn().unwrap();
        let status = end(child, "KILL", &mut random, Duration::from_millis(60), &folders);
        assert_eq!(status.signal(), Some(9));
        if let Ok(saved) = std::fs::read_to_string(place.path("scene.toml")) {
            assert!(whole.contains(&saved), "{saved}");
            seen += 1;
        }
        strays += let_time_pass(&folders);
    }
    println!("{seen} scenes, {strays} temporary files left");
    assert!(seen > 0, "none was saved");
    scene(true).save(&place.path("scene.toml")).unwrap();
    assert!(temporary_files(place.folder.path()).is_empty() && names(place.folder.path()).len() == 2);
}

#[test]
fn processes_that_share_an_empty_cache_all_make_the_same_picture() {
    let place = Place::new();
    let picture = place.picture();
    let _ = std::fs::remove_dir_all(place.path("cache"));
    let outputs: Vec<_> = (0..8).map(|number| format!("{number}.png")).collect();
    let start = |output: &String| {
        let arguments = [&RENDER[..RENDER.len() - 1], &[output]].concat();
        place.threadlight(&arguments).stderr(Stdio::piped()).spawn().unwrap()
    };
    let children: Vec<_> = outputs.iter().map(start).collect();
    for (child, name) in children.into_iter().zip(&outputs) {
        let output = child.wait_with_output().unwrap();
        assert!(output.status.success() && said(&output).is_empty(), "{}", said(&output));
        assert!(std::fs::read(place.path(name)).unwrap() == *picture, "{name}");
    }
    assert!(temporary_files(&place.cache()).is_empty() && names(&place.cache()).len() > 3);
}
