//! Plans of frames in a window, one after another: what changes runs again, and nothing else does.
use super::*;
use crate::graph::{Kept, MemoryRequirement, Plan, ResourceInfo, ResourceKind, Work};
use crate::method::Method;
use crate::prepare::prepare;
use crate::scene::Scene;
use crate::vulkan::test_device;

/// Memory as a plain device would ask for it, so that plans are the same on all: 16 bytes a texel, multiples of 64 KiB.
fn memory(info: &ResourceInfo) -> MemoryRequirement {
    let (bytes, alignment) = match info.kind {
        ResourceKind::Buffer(desc) => (desc.size_bytes, 256),
        ResourceKind::Image(desc) => (16 * u64::from(desc.width) * u64::from(desc.height), 65536),
    };
    MemoryRequirement { size_bytes: bytes.next_multiple_of(alignment), alignment, memory_type_bits: 1 }
}

/// What frames are drawn with.
struct Stage {
    device_scene: DeviceScene,
    painter: UiPainter,
    panel: UiFrame,
}

impl Stage {
    fn new() -> Self {
        let device = test_device::open();
        let mut scene = Scene::default();
        (scene.image.width, scene.image.height) = (640, 480);
        scene.shading.method = Method::Cosine;
        let memo = crate::memo::Memo::default();
        let round = memo.round(&());
        let prepared = prepare(&scene, &round).expect("a scene that can be prepared");
        Self {
            device_scene: DeviceScene::new(&device, &prepared, &round).expect("a scene on the device"),
            painter: UiPainter::new(&device, Swapchain::FORMATS[0], FRAMES).expect("a painter"),
            panel: UiFrame::default(),
        }
    }

    /// The plan of a frame of `device_scene` as `view` sees it, after others, which left `kept`.
    fn plan<'a>(&'a self, device_scene: &'a DeviceScene, view: &'a View, kept: Option<&Kept>) -> Plan<Work<'a>> {
        let mut graph = FrameGraph::new();
        let area = Area { left: 0, top: 0, width: view.width, height: view.height };
        let picture = ShownPicture { device_scene, view, area, is_compiled: true };
        declare_window(&mut graph, Some(&picture), &self.painter, &self.panel, [940, 480]);
        match kept {
            Some(kept) => graph.compile_keeping(kept, &mut memory),
            None => graph.compile(&mut memory),
        }
        .expect("a valid graph")
    }
}

/// Names of the passes that run.
fn names<'p>(plan: &'p Plan<Work>) -> Vec<&'p str> {
    plan.passes.iter().map(|pass| pass.name.as_str()).collect()
}

/// Compares a plan with its text in `tests/plans`. Where they differ on purpose, put what is printed into that file.
fn assert_text(plan: &Plan<Work>, expected: &str) {
    let text = plan.to_string();
    assert!(text == expected, "the plan is not the expected one but\n{text}");
}

/// What is in every frame.
const WINDOW: [&str; 3] = ["clear_window", "present", "ui"];

#[test]
fn the_first_frame_in_a_window_makes_everything_and_the_next_keeps_it() {
    let stage = Stage::new();
    let view = &stage.device_scene.view;
    let first = stage.plan(&stage.device_scene, view, Some(&Kept::default()));
    assert_text(&first, include_str!("../../tests/plans/window_first.txt"));
    let next = stage.plan(&stage.device_scene, view, Some(&first.kept));
    assert_eq!(names(&next), WINDOW);
    assert_text(&next, include_str!("../../tests/plans/window_unchanged.txt"));
    // And so it stays.
    assert_eq!(names(&stage.plan(&stage.device_scene, view, Some(&next.kept))), WINDOW);
}

#[test]
fn another_exposure_runs_neither_geometry_nor_shading() {
    let stage = Stage::new();
    let view = &stage.device_scene.view;
    let first = stage.plan(&stage.device_scene, view, Some(&Kept::default()));
    let exposed = View { exposure: 2.0 * view.exposure, ..view.clone() };
    let brighter = stage.plan(&stage.device_scene, &exposed, Some(&first.kept));
    assert_eq!(names(&brighter), [&["tone_map"][..], &WINDOW].concat());
    assert_text(&brighter, include_str!("../../tests/plans/window_exposure.txt"));
}

#[test]
fn light_that_is_turned_or_dimmed_keeps_the_geometry() {
    let stage = Stage::new();
    let view = &stage.device_scene.view;
    let first = stage.plan(&stage.device_scene, view, Some(&Kept::default()));
    for changed in [View { rotation_deg: 10.0, ..view.clone() }, View { intensity: 2.0, ..view.clone() }] {
        let plan = stage.plan(&stage.device_scene, &changed, Some(&first.kept));
        let of_light = ["clear_lookups", "shade", "background", "tone_map"];
        let names = names(&plan);
        assert!(names.contains(&"shade") && names.contains(&"background"), "{plan}");
        assert!(names.iter().all(|name| of_light.contains(name) || WINDOW.contains(name)), "{plan}");
    }
}

#[test]
fn other_random_numbers_keep_the_geometry_and_another_camera_size_or_scene_keeps_nothing() {
    let stage = Stage::new();
    let view = &stage.device_scene.view;
    let first = stage.plan(&stage.device_scene, view, Some(&Kept::default()));
    let all = names(&first);
    let mut reseeded = stage.device_scene.clone();
    reseeded.reseed(7);
    let shaded = stage.plan(&reseeded, view, Some(&first.kept));
    assert!(!names(&shaded).contains(&"geometry_cache") && names(&shaded).contains(&"shade"), "{shaded}");
    let mut moved = view.clone();
    moved.camera.eye.x += 0.1;
    assert_eq!(names(&stage.plan(&stage.device_scene, &moved, Some(&first.kept))), all);
    let wider = View { width: 641, ..view.clone() };
    let larger = stage.plan(&stage.device_scene, &wider, Some(&first.kept));
    assert_eq!(names(&larger), all);
    // What was before the change is forgotten with it.
    assert_eq!(names(&stage.plan(&stage.device_scene, view, Some(&larger.kept))), all);
    // The same scene in other buffers, which might hold anything.
    let other = Stage::new();
    assert_eq!(names(&stage.plan(&other.device_scene, view, Some(&first.kept))), all);
}

#[test]
fn a_frame_without_a_store_makes_kept_images_transient() {
    let stage = Stage::new();
    let plan = stage.plan(&stage.device_scene, &stage.device_scene.view, None);
    assert!(names(&plan).contains(&"shade"));
    assert!(plan.resources.iter().all(|resource| resource.imported || resource.placement.is_some()));
}

#[test]
fn what_is_kept_waits_for_its_last_use_in_the_frame_before() {
    let stage = Stage::new();
    let view = &stage.device_scene.view;
    let first = stage.plan(&stage.device_scene, view, Some(&Kept::default()));
    let waits = |plan: &Plan<Work>, pass: &str, resource: &str| {
        let text = plan.to_string();
        let lines = text.lines().skip_while(|line| line.split_whitespace().nth(1) != Some(pass)).skip(1);
        let own = lines.take_while(|line| !line.is_empty()).filter_map(|line| line.trim().strip_prefix("wait"));
        own.filter_map(|line| Some(line.trim().strip_prefix(resource)?.trim().to_owned())).collect::<Vec<_>>()
    };
    // `present` of the frame before read it; that frame's tone mapping need not be waited for again.
    let exposed = View { exposure: 2.0 * view.exposure, ..view.clone() };
    let brighter = stage.plan(&stage.device_scene, &exposed, Some(&first.kept));
    assert_eq!(waits(&brighter, "tone_map", "display"), ["transfer -> compute(write), undefined => general"]);
    assert!(waits(&brighter, "tone_map", "radiance").is_empty());
    let mut moved = view.clone();
    moved.camera.eye.x += 0.1;
    let moved = stage.plan(&stage.device_scene, &moved, Some(&first.kept));
    assert_eq!(waits(&moved, "geometry_cache", "geometry"), ["compute -> color output(write), undefined => color"]);
}
