//! Changes of a scene do not grow memory: in a process of its own, whose memory is measured.
mod common;
use common::{Validated, model, sphere};
use std::process::Command;
use threadlight::Method;
use threadlight::low_level::pipeline::{DeviceScene, Wanted};
use threadlight::low_level::prepare::prepare;
use threadlight::low_level::scene::{MaterialSource, Source};

/// Resident memory of this process, in bytes; none where the system does not tell.
fn resident_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmRSS:"))?;
    Some(1024 * line.split_whitespace().nth(1)?.parse::<u64>().ok()?)
}

#[test]
fn two_hundred_changes_do_not_grow_memory() {
    // By which of glibc's arenas gets what, and by what was freed before it takes large blocks from the system, resident memory grew by 3 to 15 % in the
    // same changes. With one arena, and all blocks of 128 KiB and more from the system, it grew by 4.7 % in each of seven runs.
    let test = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "memory_that_is_given_back_at_once_does_not_grow", "--ignored", "--nocapture"])
        .envs([("MALLOC_ARENA_MAX", "1"), ("MALLOC_MMAP_THRESHOLD_", "131072")])
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&test.stdout);
    // Of a name that there is not no test fails.
    assert!(test.status.success() && said.contains("1 passed"), "{said}{}", String::from_utf8_lossy(&test.stderr));
    println!("{said}");
}

#[test]
#[ignore = "the test above runs it"]
fn memory_that_is_given_back_at_once_does_not_grow() {
    let gpu = Validated::with_own_memo();
    let environments = ["white", "sky"];
    let mut scene = sphere(MaterialSource::Builtin("clay".into()), "white", 4, (32, 24));
    let mut used = Vec::new();
    let mut renderer = None;
    for change in 0..200 {
        let alpha = 0.2 + 0.003 * f64::from(change);
        scene.materials[0].source = model(&format!("model = 'lambert'\nreflectance = [{alpha}, 0.5, 0.5]"));
        scene.environment.source = Source::Builtin(environments[change as usize / 20 % 2].into());
        scene.shading.method = if change % 15 == 0 { Method::Cosine } else { Method::Paper };
        scene.objects[0].scale = 1.0 + change as f32 / 100.0;
        let next = {
            let round = gpu.round();
            DeviceScene::new(&gpu.device, &prepare(&scene, &round).unwrap(), &round).unwrap()
        };
        next.render(Wanted { display: true, ..Wanted::default() }, 1).unwrap();
        renderer = Some(next);
        used.push((gpu.memo.outputs_in_memory(), gpu.device.allocated_bytes(), resident_bytes().unwrap_or_default()));
    }
    // All that is seen from the 40th change on was seen before: each environment, each method.
    let most =
        |of: fn(&(usize, u64, u64)) -> u64, range: std::ops::Range<usize>| used[range].iter().map(of).max().unwrap();
    for (name, of) in [
        ("outputs", (|used| used.0 as u64) as fn(&(usize, u64, u64)) -> u64),
        ("bytes on the device", |used| used.1),
        ("resident bytes", |used| used.2),
    ] {
        let (early, late) = (most(of, 40..120), most(of, 120..200));
        println!("{name}: at most {early} in changes 40 to 120, {late} in changes 120 to 200");
        // The validation layer keeps some of what is freed (measured: a twentieth; without the layer a hundredth), and alignment
        // moves some on the device.
        let slack = match name {
            "resident bytes" => early / 10,
            "bytes on the device" => 1 << 16,
            _ => 0,
        };
        assert!(late <= early + slack, "{name}: {early}, then {late}");
    }
    drop(renderer);
    assert_eq!(gpu.memo.outputs_in_memory(), 0);
    gpu.finish();
}
