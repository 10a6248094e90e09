//! A device that cannot be opened leaves nothing behind, and a cache of pipelines that cannot be read is made again.
//!
//! Mesa's driver for AMD's GPUs has a device without hardware, "Null hardware", for compiling shaders. It has no semaphores.
mod common;

use common::radv;
use std::process::Command;
use threadlight::low_level::vulkan::{Device, Instance, PipelineCache};

#[test]
fn a_device_without_semaphores_is_refused_and_nothing_of_it_is_left() {
    let Some(driver) = radv() else { return };
    // In a process of its own: the loader reads these once.
    let test = Command::new(std::env::current_exe().expect("a name"))
        .args(["--exact", "the_null_device_does_not_open", "--ignored", "--nocapture"])
        .env("RADV_FORCE_FAMILY", "navi21")
        .envs([("VK_DRIVER_FILES", driver), ("VK_ICD_FILENAMES", driver)])
        .output()
        .expect("a process");
    let said = String::from_utf8_lossy(&test.stdout);
    // Of a name that there is not no test fails.
    assert!(test.status.success() && said.contains("1 passed"), "{said}{}", String::from_utf8_lossy(&test.stderr));
}

#[test]
#[ignore = "the test above runs it with the driver that it is about"]
fn the_null_device_does_not_open() {
    let instance = Instance::new(true).expect("an instance with validation");
    let messages = instance.messages();
    let error = Device::new(&instance, None).map(drop).expect_err("the null device has no semaphores");
    assert!(error.to_string().contains("vkCreateSemaphore"), "{error}");
    drop(instance);
    assert_eq!(messages.all(), Vec::<String>::new());
}

#[test]
fn a_pipe_or_a_folder_in_place_of_cached_pipelines_is_put_away() {
    let gpu = common::Validated::new();
    let folder = tempfile::tempdir().unwrap();
    let open_and_close = || PipelineCache::new(&gpu.device, Some(folder.path())).map(drop).expect("a cache");
    open_and_close();
    let file = std::fs::read_dir(folder.path()).unwrap().next().expect("it was written").unwrap().path();
    let kept = std::fs::read(&file).unwrap();
    for command in ["mkfifo", "mkdir"] {
        std::fs::remove_file(&file).unwrap();
        assert!(Command::new(command).arg(&file).status().unwrap().success());
        open_and_close();
        assert!(file.is_file(), "{command}");
        assert_eq!(std::fs::read(&file).unwrap(), kept, "{command}");
    }
    gpu.finish();
}
