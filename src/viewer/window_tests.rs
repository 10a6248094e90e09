//! The viewer in a window whose surface is lost, or whose device is. A process has one event loop, so each is in one of its own.
#![cfg(target_os = "linux")]
#[path = "../../tests/common/display.rs"]
mod display;

use super::*;
use crate::scene::Source;
use crate::vulkan::faults::{Fault, with_fault};
use crate::vulkan::test_device;
use ash::vk::Result as Call;
use display::Display;
use std::path::Path;
use std::process::Command;

/// The child's name of what fails: a call, how many pictures are shown before, and the index of the result in [`RESULTS`].
const FAULT: &str = "FAULT_OF_CHILD";
const RESULTS: [Call; 3] = [Call::ERROR_SURFACE_LOST_KHR, Call::ERROR_OUT_OF_DATE_KHR, Call::ERROR_DEVICE_LOST];

/// Runs the viewer in a process of its own, where a call fails; `None` where there is no display.
fn child(name: &str, of: &str, shown: usize, result: usize) -> Option<()> {
    let display = Display::open()?;
    let folder = tempfile::tempdir().unwrap();
    let (_, module) = module_path!().split_once("::").expect("a crate");
    let child = Command::new(std::env::current_exe().expect("a name"))
        .args(["--exact", &format!("{module}::{name}"), "--ignored", "--nocapture"])
        .env(FAULT, format!("{of} {shown} {result}"))
        .env("DISPLAY", &display.name)
        .env_remove("WAYLAND_DISPLAY")
        .current_dir(&folder)
        .output()
        .expect("a process");
    let said = [child.stdout, child.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
    assert!(child.status.success() && said.contains("1 passed"), "{of} {shown} {result}: {said}");
    Some(())
}

/// Plays a session of a hundred frames with the fault that the parent asks for; a device that is lost stays so.
fn play() -> Result<Ended> {
    let fault = std::env::var(FAULT).expect("a fault");
    let [of, shown, result] = fault.split(' ').collect::<Vec<_>>()[..] else { panic!("{fault}") };
    let result = RESULTS[result.parse::<usize>().unwrap()];
    let (of, shown): (&str, usize) = (of.to_owned().leak(), shown.parse().unwrap());
    let exposures: String = (1..=99).map(|step| format!("{{\"set\": {{\"exposure\": 0.{step:02}}}}}\n")).collect();
    let clay = r#"{"set": {"material": {"builtin": "clay"}}}"#;
    let replay = format!("{clay}\n{exposures}\"wait\"\n{{\"save_scene\": \"end.toml\"}}\n\"quit\"\n");
    let mut scene = Scene::default();
    (scene.image.width, scene.image.height) = (160, 120);
    scene.environment.source = Source::Builtin("white".to_owned());
    scene.shading.threads = Some(1);
    let settings = ViewerSettings {
        scene,
        device: test_device::name(),
        validate: true,
        cache: Some("cache".into()),
        replay: input::parse_replay(&replay, Path::new(""))?,
        replay_limit: Duration::from_secs(100),
        ..ViewerSettings::default()
    };
    let fault = Fault {
        of: Some(of),
        after: Some(("vkQueuePresentKHR", shown)),
        index: 0,
        result,
        lasts: result == Call::ERROR_DEVICE_LOST,
    };
    let (ended, calls) = with_fault(Some(fault), || run(settings, drop));
    let shows = calls.iter().enumerate().filter(|(_, call)| **call == "vkQueuePresentKHR").map(|(at, _)| at + 1);
    let armed = std::iter::once(0).chain(shows).nth(shown).expect("so many pictures");
    assert!(calls[armed..].contains(&of), "no call of {of} after {shown} pictures");
    ended
}

#[test]
fn a_lost_surface_is_made_anew() {
    for (of, shown, result) in [
        ("vkAcquireNextImageKHR", 0, 0),
        ("vkAcquireNextImageKHR", 7, 0),
        ("vkAcquireNextImageKHR", 7, 1),
        ("vkQueuePresentKHR", 0, 0),
        ("vkQueuePresentKHR", 7, 0),
        ("vkQueuePresentKHR", 7, 1),
        ("vkGetPhysicalDeviceSurfaceCapabilitiesKHR", 0, 0),
        ("vkCreateSwapchainKHR", 0, 0),
    ] {
        if child("the_surface_is_lost", of, shown, result).is_none() {
            return;
        }
    }
}

#[test]
#[ignore = "the test above runs it"]
fn the_surface_is_lost() {
    let ended = play().expect("a session");
    assert_eq!(ended.messages, Vec::<String>::new());
    let scene = Scene::load(Path::new("end.toml")).expect("a scene");
    assert_eq!((scene.image.exposure, scene.materials[0].name.as_str()), (0.99, "clay"));
}

#[test]
fn what_was_edited_is_kept_when_the_device_is_lost() {
    for of in ["vkAcquireNextImageKHR", "vkQueuePresentKHR", "vkQueueSubmit2", "vkWaitSemaphores"] {
        // By then something was edited: the replay makes one edit for each picture that is shown.
        if child("the_device_is_lost", of, 60, 2).is_none() {
            return;
        }
    }
}

#[test]
#[ignore = "the test above runs it"]
fn the_device_is_lost() {
    let error = play().map(drop).expect_err("a device that is lost").to_string();
    assert!(error.contains("device") && error.contains("try again") && !error.contains('\n'), "{error}");
    let of_cache = std::fs::read_dir("cache").expect("a cache").map(|entry| entry.expect("an entry").path());
    let kept = of_cache.filter(|path| path.extension().is_some_and(|extension| extension == "toml"));
    let [kept] = &kept.collect::<Vec<_>>()[..] else { panic!("not kept, after {error}") };
    let scene = Scene::load(kept).unwrap_or_else(|unread| panic!("{unread}, after {error}"));
    assert!(scene.materials[0].name == "clay" && scene.image.exposure < 1.0, "{scene:?}");
    assert!(!Path::new("end.toml").exists());
}
