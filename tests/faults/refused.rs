//! What the system refuses: room on the disk, folders, readers, memory of the device.
use super::*;
use std::process::Stdio;
use std::sync::atomic::{AtomicBool, Ordering};

/// Checks that a command failed with this exit code, and with one line that has these `words` in it.
fn assert_refused(output: &Output, code: i32, words: &[&str]) {
    let said = said(output);
    let reasons: Vec<_> = said.lines().filter(|line| line.starts_with("threadlight: ")).collect();
    assert!(output.status.code() == Some(code) && reasons.len() == 1, "{:?}: {said}", output.status);
    assert!(words.iter().all(|word| reasons[0].contains(word)) && !said.contains("panicked"), "{said}");
}

/// Checks that `command` makes the `picture`; what it said.
fn assert_made(place: &Place, mut command: Command, picture: &[u8]) -> String {
    let output = command.output().unwrap();
    assert!(output.status.success() && !said(&output).contains("panicked"), "{command:?}: {}", said(&output));
    assert!(std::fs::read(place.path("picture.png")).unwrap() == picture, "{command:?}");
    std::fs::remove_file(place.path("picture.png")).unwrap();
    said(&output)
}

#[test]
fn a_file_that_may_not_grow_is_an_error_that_names_it_and_leaves_nothing() {
    let place = Place::new();
    place.fill_cache();
    let before = names(place.folder.path());
    for (arguments, name) in [
        (&RENDER[..], "picture.png"),
        (&["threads", "clay", "--count", "1", "-o", "clay.threads"], "clay.threads"),
        (&["materials", "plot", "clay", "-o", "clay.svg"], "clay.svg"),
        (&["materials", "export", "clay", "-o", "clay.binary"], "clay.binary"),
    ] {
        // One block, of 512 bytes or 1024.
        let output = place.by_shell("ulimit -f 1; exec ", arguments).output().unwrap();
        assert_refused(&output, 1, &[name, "File too large", "make room"]);
        assert!(!said(&output).contains(TEMPORARY), "{}", said(&output));
        assert_eq!(names(place.folder.path()), before, "{name}");
    }
}

#[test]
fn a_full_disk_is_an_error_that_names_the_file() {
    let place = Place::new();
    let full = "No space left on device";
    std::os::unix::fs::symlink("/dev/full", place.path("full.svg")).unwrap();
    let output = place.threadlight(&["materials", "plot", "clay", "-o", "full.svg"]).output().unwrap();
    assert_refused(&output, 1, &["full.svg", full]);
    for arguments in [&["materials"][..], &["--help"], &["render", "--help"], &["--version"]] {
        let output = place.by_shell("exec >/dev/full; exec ", arguments).output().unwrap();
        assert_refused(&output, 1, &["standard output", full]);
    }
    // A disk of 64 KiB, in name spaces of its own: for the cache, which has to do without, and for what is written.
    let picture = place.picture();
    std::fs::create_dir_all(place.path("cache")).unwrap();
    let mount =
        |folder: &str| format!("unshare --mount sh -c 'mount -t tmpfs -o size=64k none {folder} && exec \"$@\"' sh ");
    let is_possible = place.by_shell(&mount("cache"), &["materials"]).output().unwrap().status.success();
    if !is_possible {
        return println!("not tested: no disk can be mounted here");
    }
    assert_made(&place, place.by_shell(&mount("cache"), &RENDER), picture);
    let export = ["materials", "export", "clay", "-o", "small/clay.binary"];
    std::fs::create_dir(place.path("small")).unwrap();
    assert_refused(&place.by_shell(&mount("small"), &export).output().unwrap(), 1, &["small/clay.binary", full]);
}

#[test]
fn a_cache_that_is_of_no_use_costs_time_and_nothing_else() {
    let place = Place::new();
    let picture = place.picture();
    let with_cache = |cache: &str| {
        let mut command = place.threadlight(&RENDER);
        command.env("THREADLIGHT_CACHE", place.path(cache));
        command
    };
    // A file, a folder in which nobody may make one, a device.
    for cache in ["light.hdr", "/proc/self", "/dev/full"] {
        let said = assert_made(&place, with_cache(cache), picture);
        assert_eq!(said.matches("is not kept on disk").count(), 1, "{said}");
        assert_eq!(said.lines().count(), 1, "{said}");
    }
    // Nobody is root for whom a folder is read-only.
    std::fs::create_dir(place.path("locked")).unwrap();
    let mut locked = std::fs::metadata(place.path("locked")).unwrap().permissions();
    locked.set_readonly(true);
    std::fs::set_permissions(place.path("locked"), locked).unwrap();
    assert_made(&place, with_cache("locked"), picture);
    // Files have room for the picture, not for a pyramid.
    assert_made(&place, place.by_shell("ulimit -f 8; exec ", &RENDER), picture);
    assert!(names(&place.cache()).iter().all(|name| !name.starts_with(TEMPORARY) && !name.ends_with("pyramid")));
    // No folder for caches is said, nor a home, or one that does not exist.
    for home in [None, Some("/nonexistent")] {
        let mut command = place.threadlight(&RENDER);
        command.env_remove("XDG_CACHE_HOME").env_remove("HOME").envs(home.map(|home| ("HOME", home)));
        // The user's own is then that of the system's list of users.
        if home.is_none() {
            command.arg("--no-cache");
        }
        assert_made(&place, command, picture);
    }
}

#[test]
fn a_cache_that_vanishes_again_and_again_is_no_matter() {
    let place = Place::new();
    let picture = place.picture();
    let is_over = AtomicBool::new(false);
    std::thread::scope(|scope| {
        // Also where an assertion fails: the scope waits for the thread.
        let _ends = OnDrop(|| is_over.store(true, Ordering::Relaxed));
        scope.spawn(|| {
            while !is_over.load(Ordering::Relaxed) {
                let _ = std::fs::remove_dir_all(place.path("cache"));
                std::thread::sleep(std::time::Duration::from_millis(1));
            }
        });
        for _ in 0..moments(1) {
            assert_made(&place, place.threadlight(&RENDER), picture);
        }
    });
}

/// Does something when it goes out of scope.
struct OnDrop<F: Fn()>(F);

impl<F: Fn()> Drop for OnDrop<F> {
    fn drop(&mut self) {
        (self.0)();
    }
}

#[test]
fn nobody_has_to_listen() {
    let place = Place::new();
    let picture = place.picture();
    place.fill_cache();
    // Whoever reads it has seen enough: `head` has, and so has a pipe without a reader.
    for arguments in [&["materials"][..], &["completions", "bash"], &["--help"], &["devices"]] {
        let mut child = place.threadlight(arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        assert!(output.status.success() && said(&output).is_empty(), "{arguments:?}: {}", said(&output));
    }
    // Nor is anything read that goes wrong, or what the log says; the work is done all the same.
    for (arguments, code) in [
        (&["rendre"][..], 2),
        (&["materials", "plot", "unobtainium", "-o", "x.svg"], 2),
        (&["threads", "clay", "--count", "1", "-o", "clay.threads"], 0),
        (&[&RENDER[..], &["-vv"]].concat(), 0),
    ] {
        for redirection in ["2>/dev/full", "2>&-"] {
            let words = format!("exec {redirection}; exec ");
            let output = place.by_shell(&words, arguments).stdin(Stdio::null()).output().unwrap();
            assert_eq!(output.status.code(), Some(code), "{arguments:?} {redirection}");
        }
        let mut child = place.threadlight(arguments).stderr(Stdio::piped()).spawn().unwrap();
        drop(child.stderr.take());
        assert_eq!(child.wait().unwrap().code(), Some(code), "{arguments:?} into a pipe without a reader");
    }
    assert!(std::fs::read(place.path("picture.png")).unwrap() == picture && place.path("clay.threads").exists());
}

#[test]
fn a_device_without_memory_is_an_error_until_there_is_enough() {
    let place = Place::new();
    let picture = place.picture();
    place.fill_cache();
    let with_mib = |mib: &str| {
        let mut command = place.threadlight(&RENDER);
        command.args(["--validate"]).env("THREADLIGHT_DEVICE_MEMORY_MIB", mib);
        command
    };
    // That is not the machine's fault.
    for wrong in ["much", "-1", "1.5", "18446744073709551615"] {
        let words = ["THREADLIGHT_DEVICE_MEMORY_MIB: ", wrong, "is no number of MiB", "unset it"];
        assert_refused(&with_mib(wrong).output().unwrap(), 2, &words);
    }
    for mib in ["0", "1"] {
        let words = ["no memory for", "THREADLIGHT_DEVICE_MEMORY_MIB", "a smaller size"];
        assert_refused(&with_mib(mib).output().unwrap(), 1, &words);
        assert!(!place.path("picture.png").exists());
    }
    assert_made(&place, with_mib("1000"), picture);
}
