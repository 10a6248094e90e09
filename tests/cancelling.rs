//! Long computations stop soon after they are told to: a window waits for them when it closes.
mod common;
use common::{Validated, data, device_flags, model, program, ready, sphere};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};
use threadlight::Method;
use threadlight::low_level::brdf::Brdf;
use threadlight::low_level::evaluate::reference::{ReferenceSettings, STAGES, progressive, reference};
use threadlight::low_level::pipeline::{Wanted, render_geometry};
use threadlight::low_level::prepare::Prepared;
use threadlight::low_level::progress::Observer;
use threadlight::low_level::scene::{MaterialSource, Mesh, Scene, Source};
use threadlight::low_level::steps::{LoadEnvironment, blurred_light};
use threadlight::low_level::threads::{ThreadKind, ThreadSettings, generate};
use threadlight::{Error, Result};

/// Longest time from the word to the end. It is a tenth of a second where the processor has nothing else to do, as the times printed say;
/// the bound is for machines that have, and far below what the work itself takes.
const SOON: Duration = Duration::from_secs(5);

/// Held by each test: their work shares one pool of threads.
static ALONE: Mutex<()> = Mutex::new(());

struct Flag(AtomicBool);

impl Observer for Flag {
    fn progress(&self, _done: usize, _total: usize) {}
    fn cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// Starts `work`, cancels it after each of `moments`, and checks that it does not go on for long. Of one that it was done at there is nothing to
/// say, but not of all.
fn expect_to_stop<T: Send>(
    name: &str,
    moments_ms: impl IntoIterator<Item = u64>,
    work: impl Fn(&Flag) -> Result<T> + Sync,
) {
    let mut cancelled = 0;
    for after in moments_ms.into_iter().map(Duration::from_millis) {
        let time = time_to_stop(after, &work);
        println!("{name}, cancelled after {after:?}: {time:?}");
        assert!(time.is_none_or(|time| time < SOON), "{name}, cancelled after {after:?}: {time:?}");
        cancelled += usize::from(time.is_some());
    }
    assert!(cancelled > 0, "{name}: it was done each time");
}

/// How long `work` goes on when it is cancelled after `after`; none if it is done by then.
fn time_to_stop<T: Send>(after: Duration, work: impl FnOnce(&Flag) -> Result<T> + Send) -> Option<Duration> {
    let flag = Flag(AtomicBool::new(false));
    std::thread::scope(|scope| {
        let working = scope.spawn(|| work(&flag));
        std::thread::sleep(after);
        let was_done = working.is_finished();
        flag.0.store(true, Ordering::Relaxed);
        let start = Instant::now();
        match working.join().unwrap() {
            Err(Error::Cancelled) => Some(start.elapsed()),
            Err(error) => panic!("{error}"),
            Ok(_) => {
                assert!(was_done, "it did not stop");
                None
            }
        }
    })
}

#[test]
fn threads_stop_being_made_at_once() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let narrow = Brdf::builtin("chrome").unwrap();
    for (kind, count) in [(ThreadKind::Fitted, 128), (ThreadKind::Paper, 1024)] {
        let settings = ThreadSettings { kind, count, ..ThreadSettings::default() };
        expect_to_stop(kind.name(), [10, 100, 300, 1000], |flag| generate(&narrow, &settings, flag));
    }
}

/// A narrow lobe on a diffuse base, under a captured map where there is one, from nearby: pixels that take long.
fn hard_scene() -> Prepared {
    let material: MaterialSource =
        model("model = 'plastic'\ndistribution = 'ggx'\nalpha = 0.003\nior = 1.5\ndiffuse = [0.3, 0.08, 0.04]");
    let mut scene: Scene = sphere(material, "studio", 1, (640, 480));
    if let Some(map) = data("env/studio_small_03_1k.hdr") {
        scene.environment.source = Source::File(map);
    }
    scene.shading.method = Method::Reference;
    ready(&scene)
}

#[test]
fn the_reference_stops_at_once_and_comes_in_stages() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let gpu = Validated::with_own_memo();
    let prepared = hard_scene();
    let settings = ReferenceSettings { tolerance: 1e-6, ..ReferenceSettings::default() };
    expect_to_stop("reference", [100, 1000, 3000], |flag| {
        reference(&prepared, &gpu.device, &settings, &gpu.memo.round(flag))
    });

    let mut small = sphere(MaterialSource::Builtin("gold".into()), "studio", 1, (48, 36));
    small.shading.method = Method::Reference;
    let prepared = ready(&small);
    let geometry = render_geometry(&gpu.device, &prepared, &gpu.round()).unwrap();
    let truth = reference(&prepared, &gpu.device, &ReferenceSettings::default(), &gpu.round()).unwrap();
    let mut estimates = Vec::new();
    progressive(&prepared, &geometry, STAGES, &(), &mut |estimate| estimates.push(estimate)).unwrap();
    assert_eq!(estimates.len(), STAGES.len());
    for (estimate, stage) in estimates.iter().zip(STAGES) {
        assert_eq!((estimate.stage, estimate.radiance.len()), (*stage, 48 * 36));
        assert!(estimate.error_estimate > 0.0 && estimate.error_estimate < stage.tolerance);
        for (i, (found, expected)) in estimate.radiance.iter().zip(&truth.radiance).enumerate() {
            let (x, y) = (i % 48, i / 48);
            if x.is_multiple_of(stage.step) && y.is_multiple_of(stage.step) {
                let shown = |value: f32| value.clamp(0.0, 1.0).powf(1.0 / 2.2);
                let error = (0..3).map(|c| (shown(found[c]) - shown(expected[c])).abs()).fold(0.0, f32::max);
                assert!(error < 4.0 * stage.tolerance as f32, "{stage:?} at {x}, {y}: {error}");
            } else {
                let own = y / stage.step * stage.step * 48 + x / stage.step * stage.step;
                assert_eq!(*found, estimate.radiance[own]);
            }
        }
    }
    assert_eq!(estimates.last().unwrap().radiance, truth.radiance);
    gpu.finish();
}

#[test]
fn an_environment_stops_being_blurred_at_once() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let gpu = Validated::with_own_memo();
    let source = data("env/studio_small_03_1k.hdr").map_or(Source::Builtin("studio".into()), Source::File);
    let start = Instant::now();
    let environment = gpu.round().ask(&LoadEnvironment(&source)).unwrap();
    println!("loaded in {:?}", start.elapsed());
    expect_to_stop("blur", [20, 200, 1000], |flag| {
        blurred_light(&gpu.memo.round(flag), Some(&gpu.device), &environment, &[], false)
    });
    gpu.finish();
}

#[test]
fn a_mesh_stops_being_read_at_once() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let columns = 1000;
    let corners = (0..columns * columns).map(|i| format!("v {} {} {}\n", i % columns, i / columns, i % 7));
    let first = (1..columns * (columns - 1)).filter(|corner| corner % columns != 0);
    let faces = first.map(|a| format!("f {a} {} {} {}\n", a + 1, a + columns + 1, a + columns));
    let text: String = corners.chain(faces).collect();
    let name = format!("a mesh of {} bytes", text.len());
    expect_to_stop(&name, [10, 300, 1000], |flag| {
        Mesh::FILES.parse_watched(Path::new("large.obj"), text.as_bytes(), flag)
    });
}

#[test]
fn the_first_stages_of_a_large_reference_come_soon() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let gpu = Validated::with_own_memo();
    let mut scene = sphere(MaterialSource::Builtin("gold".into()), "studio", 1, (640, 480));
    scene.shading.method = Method::Reference;
    let prepared = ready(&scene);
    let geometry = render_geometry(&gpu.device, &prepared, &gpu.round()).unwrap();
    let start = Instant::now();
    let mut came = Vec::new();
    progressive(&prepared, &geometry, &STAGES[..2], &(), &mut |estimate| {
        println!("{:?} after {:?}: within {:.1e}", estimate.stage, start.elapsed(), estimate.error_estimate);
        came.push((estimate.stage, start.elapsed()));
    })
    .unwrap();
    assert!(came.iter().map(|(stage, _)| stage).eq(&STAGES[..2]), "{came:?}");
    // Measured: 1 and 4 s. The whole takes minutes.
    assert!(came.iter().all(|(_, time)| *time < 4 * SOON), "{came:?}");
    gpu.finish();
}

#[test]
fn repeated_frames_stop_between_two() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let gpu = Validated::with_own_memo();
    let prepared = ready(&sphere(MaterialSource::Builtin("gold".into()), "white", 1, (48, 36)));
    let renderer = gpu.renderer(&prepared);
    expect_to_stop("frames", [500], |flag| {
        renderer.render_watched(Wanted { radiance: true, ..Wanted::default() }, u32::MAX, flag).map(drop)
    });
    drop(renderer);
    gpu.finish();
}

#[test]
#[cfg(unix)]
fn a_program_that_waits_for_its_input_has_answered_what_it_read_and_ends_when_it_is_told_to() {
    use std::io::{BufRead, Write};
    use std::process::Stdio;
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = tempfile::tempdir().unwrap();
    for signal in ["INT", "TERM"] {
        let mut command = program(&folder);
        command.args(["materials", "evaluate", "clay"]).stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let mut input = child.stdin.take().unwrap();
        let mut answers = std::io::BufReader::new(child.stdout.take().unwrap()).lines();
        for _ in 0..2 {
            input.write_all(b"30 30 180\n").unwrap();
            assert_eq!(answers.next().unwrap().unwrap().split(' ').count(), 3);
        }
        std::process::Command::new("kill").args(["-s", signal, &child.id().to_string()]).status().unwrap();
        assert_eq!(child.wait().unwrap().code(), Some(130), "{signal}");
    }
}

#[test]
#[cfg(unix)]
fn an_interrupted_rendering_ends_soon_and_leaves_no_file() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = tempfile::tempdir().unwrap();
    // As wide as captured maps are: blurring it takes seconds.
    let (width, height) = (1024, 512);
    let texels: Vec<[f32; 4]> = (0..width * height).map(|i| [(i % 97) as f32, (i % 31) as f32, 1.0, 1.0]).collect();
    let map = folder.path().join("map.exr");
    threadlight::low_level::picture::write_exr(&map, width, height, &texels, false, &Default::default()).unwrap();
    let mut interrupted = BTreeSet::new();
    let moments = [300, 1500, 3000].map(Duration::from_millis);
    for (after, signal) in moments.into_iter().flat_map(|after| ["INT", "TERM"].map(|signal| (after, signal))) {
        let mut command = program(&folder);
        command.args(["render", "--no-cache", "--environment", "map.exr", "--size", "64x48", "-o", "picture.png"]);
        let mut child = command.args(device_flags()).stderr(std::process::Stdio::piped()).spawn().unwrap();
        std::thread::sleep(after);
        let start = Instant::now();
        let sent = std::process::Command::new("kill").args(["-s", signal, &child.id().to_string()]).status().unwrap();
        let status = child.wait().unwrap();
        println!("render, {signal} after {after:?}: {:?}, {status}", start.elapsed());
        // Before the handler is there, and after the work is done, there is nothing to say.
        if sent.success() && status.code() == Some(130) {
            interrupted.insert(signal);
            assert!(start.elapsed() < SOON, "{:?}", start.elapsed());
            let left: Vec<_> =
                std::fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().file_name()).collect();
            assert_eq!(left, ["map.exr"], "{signal} after {after:?}");
        }
    }
    assert_eq!(interrupted.len(), 2, "only by {interrupted:?}");
}
