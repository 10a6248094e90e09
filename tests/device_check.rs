//! A device computes as Vulkan promises, at least by a way around; what was found is kept on disk.
mod common;

use common::Validated;
use threadlight::low_level::device_check::{Verdict, fault_by};
use threadlight::low_level::memo::{Memo, Origin, Step};
use threadlight::low_level::passes::WayAround;
use threadlight::low_level::steps::CheckDevice;
use threadlight::low_level::vulkan::PipelineCache;

#[test]
fn the_device_is_checked_once_and_can_be_trusted() {
    let gpu = Validated::new();
    let folder = tempfile::tempdir().unwrap();
    let ask = || {
        let memo = Memo::new(Some(folder.path()));
        let round = memo.round(&());
        let verdict = (*round.ask(&CheckDevice(&gpu.device)).expect("an answer")).clone();
        let asked = round.asked(CheckDevice::NAME)[0];
        println!("{verdict:?}: {:?}, {:.1} ms", asked.origin, asked.time.as_secs_f64() * 1e3);
        (verdict, asked.origin)
    };
    let (verdict, origin) = ask();
    assert!(verdict.way_around(&gpu.device).is_ok(), "{verdict:?}");
    assert_eq!(origin, Origin::Made);
    assert_eq!(ask(), (verdict.clone(), Origin::Disk));
    // A damaged file is as good as none.
    let kept = std::fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().path());
    let kept = kept.filter(|path| path.extension().is_some_and(|extension| extension == "device")).collect::<Vec<_>>();
    assert_eq!(kept.len(), 1);
    std::fs::write(&kept[0], "{").unwrap();
    assert_eq!(ask(), (verdict, Origin::Made));
    gpu.finish();
}

#[test]
fn the_way_around_is_right_on_every_device() {
    let gpu = Validated::new();
    let cache = PipelineCache::new(&gpu.device, None).unwrap();
    assert_eq!(fault_by(Some(WayAround::DrawWithCubeMaps), &gpu.device, &cache).unwrap(), None);
    drop(cache);
    gpu.finish();
}

#[test]
fn a_device_that_computes_wrongly_is_refused_with_the_reason() {
    let gpu = Validated::new();
    let refused = Verdict::Wrong("atomics lose counts".to_owned()).way_around(&gpu.device).unwrap_err().to_string();
    assert!(refused.contains(&gpu.device.description().name), "{refused}");
    assert!(refused.contains("atomics lose counts") && refused.contains("choose another device"), "{refused}");
    gpu.finish();
}
