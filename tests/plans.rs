//! The plan of the renderer's frame as text, and each promise of the frame graph by itself, for which no GPU is needed.
//!
//! The plans of the viewer's frames are tested beside the viewer (src/viewer/presenter_tests.rs).
mod common;
#[path = "common/graphs.rs"]
mod graphs;
use ash::vk;
use graphs::*;
use threadlight::Method;
use threadlight::low_level::graph::*;
use threadlight::low_level::pipeline::Wanted;

fn plan(graph: Graph<()>) -> Plan<()> {
    compile(graph).expect("a valid graph")
}

/// The plan of the renderer's frame at 640x480 pixels, 2x2 sub-pixels, as text.
fn frame(wanted: Wanted) -> Option<String> {
    let renderer = common::Validated::new();
    let mut scene =
        common::sphere(common::model("model = 'lambert'\nreflectance = [0.8, 0.5, 0.2]"), "studio", 16, (640, 480));
    scene.shading.method = Method::Cosine;
    let is_lavapipe = renderer.device.description().driver.starts_with("llvmpipe");
    let plan = is_lavapipe.then(|| renderer.render(&common::ready(&scene), wanted).plan);
    renderer.finish();
    if plan.is_none() {
        println!("skipped: other devices than lavapipe need other sizes of memory");
    }
    plan
}

/// Compares a plan with its text in `tests/plans`. Where they differ on purpose, put what is printed into that file.
fn assert_text(plan: &str, expected: &str) {
    assert!(plan == expected, "the plan is not the expected one but\n{plan}");
}

#[test]
fn the_frame_with_png_and_exr_has_this_plan() {
    let Some(plan) = frame(Wanted { display: true, radiance: true, geometry: false }) else { return };
    assert_text(&plan, include_str!("plans/png_and_exr.txt"));
}

#[test]
fn the_frame_with_exr_only_culls_tone_mapping() {
    let Some(plan) = frame(Wanted { display: false, radiance: true, geometry: false }) else { return };
    assert_text(&plan, include_str!("plans/exr_only.txt"));
}

/// The barriers on `resource` before `pass`, in the words of the plan.
fn waits(plan: &Plan<()>, pass: &str, resource: &str) -> Vec<String> {
    let text = plan.to_string();
    let lines = text.lines().skip_while(|line| line.split_whitespace().nth(1) != Some(pass)).skip(1);
    let of_pass = lines.take_while(|line| !line.is_empty()).filter_map(|line| line.trim().strip_prefix("wait"));
    let of_resource = of_pass.filter_map(|line| line.trim().strip_prefix(resource)?.strip_prefix(' '));
    of_resource.map(|line| line.trim().to_owned()).collect()
}

#[test]
fn a_read_waits_for_the_write_and_changes_the_layout() {
    let mut graph = Graph::new();
    let image = graph.image("image", COLOR);
    let image = write(&mut graph, "draw", image, Access::ColorAttachment);
    read(&mut graph, "look", &[(image.into(), Access::SampledCompute)]);
    assert_eq!(waits(&plan(graph), "look", "image"), ["color output(write) -> compute(sample), color => sampled"]);
}

#[test]
fn one_barrier_serves_all_reads_in_one_layout_and_a_later_write_waits_for_all_of_them() {
    let mut graph = Graph::new();
    let buffer = graph.buffer("buffer", SMALL);
    let old = write(&mut graph, "fill", buffer, Access::TransferWrite);
    read(&mut graph, "dispatch", &[(old.into(), Access::Indirect)]);
    read(&mut graph, "compute", &[(old.into(), Access::StorageReadCompute)]);
    read(&mut graph, "again", &[(old.into(), Access::StorageReadCompute)]);
    let new = write(&mut graph, "refill", old, Access::TransferWrite);
    read(&mut graph, "draw", &[(new.into(), Access::UniformCompute)]);
    let plan = plan(graph);
    assert_eq!(waits(&plan, "dispatch", "buffer"), ["transfer(write) -> indirect|compute(read arguments, read)"]);
    assert!(waits(&plan, "compute", "buffer").is_empty() && waits(&plan, "again", "buffer").is_empty());
    assert_eq!(waits(&plan, "refill", "buffer"), ["indirect|compute -> transfer(write)"]);
    assert_eq!(waits(&plan, "draw", "buffer"), ["transfer(write) -> compute(read uniform)"]);
}

#[test]
fn a_write_waits_for_the_write_before_and_drops_contents_only_if_the_layout_changes() {
    let mut graph = Graph::new();
    let image = graph.import_image("image", COLOR, None, Some(Access::Present));
    let image = write(&mut graph, "one", image, Access::StorageWriteCompute);
    let mut pass = graph.pass("two");
    let image = pass.modify(image, Access::StorageWriteCompute);
    pass.record(());
    let mut pass = graph.pass("three");
    let image = pass.modify(image, Access::ColorAttachment);
    pass.record(());
    graph.output(image);
    let kept = plan(graph);
    assert_eq!(waits(&kept, "one", "image"), ["everything(write) -> compute(write), undefined => general"]);
    assert_eq!(waits(&kept, "two", "image"), ["compute(write) -> compute(read, write)"]);
    assert_eq!(waits(&kept, "three", "image"), ["compute(write) -> color output(read, write), general => color"]);
    assert_eq!(waits(&kept, "left", "image"), ["color output(write) -> everything, color => present"]);
    assert!(kept.passes.iter().all(|pass| pass.uses[0].kept));
}

#[test]
fn a_reader_of_an_older_version_runs_before_the_write_though_declared_after_it() {
    let mut graph = Graph::new();
    let buffer = graph.buffer("buffer", SMALL);
    let old = write(&mut graph, "first", buffer, Access::TransferWrite);
    let new = write(&mut graph, "second", old, Access::StorageWriteCompute);
    read(&mut graph, "of_new", &[(new.into(), Access::Indirect)]);
    read(&mut graph, "of_old", &[(old.into(), Access::UniformCompute)]);
    let plan = plan(graph);
    let order: Vec<_> = plan.passes.iter().map(|pass| pass.name.as_str()).collect();
    assert_eq!(order, ["first", "of_old", "second", "of_new"]);
    assert_eq!(waits(&plan, "second", "buffer"), ["compute -> compute(write)"]);
}

#[test]
fn memory_is_shared_and_its_next_user_waits_for_the_last_also_across_frames() {
    let mut graph = Graph::new();
    let (early, late) = (graph.image("early", COLOR), graph.image("late", COLOR));
    let early = write(&mut graph, "draw_early", early, Access::ColorAttachment);
    read(&mut graph, "use_early", &[(early.into(), Access::SampledCompute)]);
    let late = write(&mut graph, "draw_late", late, Access::StorageWriteCompute);
    read(&mut graph, "use_late", &[(late.into(), Access::TransferRead)]);
    let plan = plan(graph);
    assert_eq!((plan.aliased_bytes(), plan.unaliased_bytes()), (65536, 2 * 65536));
    let text = waits(&plan, "draw_late", "late");
    let expected = "compute|transfer -> compute(write), undefined => general  (memory of early, the frame before)";
    assert_eq!(text, [expected]);
    let text = waits(&plan, "draw_early", "early");
    let expected = "compute|transfer -> color output(write), undefined => color  (memory of late, the frame before)";
    assert_eq!(text, [expected]);
    assert!(plan.passes[0].barriers[0].is_aliasing());
}

#[test]
fn a_transient_alone_in_its_memory_waits_for_itself_in_the_frame_before() {
    let mut graph = Graph::new();
    let depth = graph.image("depth", DEPTH);
    let color = graph.import_image("color", COLOR, None, None);
    let mut pass = graph.pass("draw");
    pass.write(depth, Access::DepthAttachment);
    let color = pass.write(color, Access::ColorAttachment);
    pass.record(());
    graph.output(color);
    let plan = plan(graph);
    let expected = "depth test(write) -> depth test(read, write), undefined => depth  (memory of the frame before)";
    assert_eq!(waits(&plan, "draw", "depth"), [expected]);
    assert!(!plan.passes[0].barriers[0].is_aliasing());
    let kept: Vec<bool> = plan.passes[0].uses.iter().map(|use_| use_.kept).collect();
    assert_eq!(kept, [false, true], "nothing looks at the depth after the pass, the owner looks at the colour");
}

#[test]
fn images_and_buffers_and_memory_types_are_kept_apart() {
    let mut graph = Graph::new();
    let size = BufferDesc { size_bytes: 65536 };
    let (image, other, buffer) =
        (graph.image("image", COLOR), graph.image("other", COLOR), graph.buffer("buffer", size));
    let image = write(&mut graph, "a", image, Access::TransferWrite);
    read(&mut graph, "b", &[(image.into(), Access::TransferRead)]);
    let buffer = write(&mut graph, "c", buffer, Access::TransferWrite);
    read(&mut graph, "d", &[(buffer.into(), Access::TransferRead)]);
    let other = write(&mut graph, "e", other, Access::TransferWrite);
    read(&mut graph, "f", &[(other.into(), Access::TransferRead)]);
    let plan = graph.compile(&mut |info| MemoryRequirement {
        memory_type_bits: if info.name == "other" { 0b10 } else { 0b01 },
        ..memory(info)
    });
    assert_eq!(plan.map(|plan| plan.blocks.len()), Ok(3));
}

#[test]
fn a_cache_kept_from_the_frame_before_needs_no_barrier() {
    let kept = Some(Access::SampledCompute);
    let mut graph = Graph::new();
    let geometry = graph.import_image("geometry", COLOR, kept, kept);
    read(&mut graph, "shade", &[(geometry.into(), Access::SampledCompute)]);
    let kept = plan(graph);
    assert!(waits(&kept, "shade", "geometry").is_empty() && kept.final_barriers.is_empty(), "{kept}");
}

#[test]
fn an_owner_gets_its_resource_back_behind_readers_in_other_stages() {
    let kept = Some(Access::StorageReadCompute);
    let mut graph = Graph::new();
    let counters = graph.import_buffer("counters", SMALL, kept, kept);
    read(&mut graph, "dispatch", &[(counters.into(), Access::Indirect)]);
    let plan = plan(graph);
    assert_eq!(waits(&plan, "dispatch", "counters"), ["compute -> indirect(read arguments)"]);
    assert_eq!(waits(&plan, "left", "counters"), ["indirect -> compute(read)"]);
}

#[test]
fn an_output_that_already_has_its_contents_runs_nothing() {
    let mut graph: Graph<()> = Graph::new();
    let image = graph.import_image("image", COLOR, Some(Access::Present), Some(Access::Present));
    graph.output(image);
    let plan = plan(graph);
    assert!(plan.passes.is_empty() && plan.resources.is_empty() && plan.final_barriers.is_empty());
    assert_eq!(plan.find(image), None);
}

#[test]
fn resources_have_the_usage_of_all_that_is_done_with_them() {
    let mut graph = Graph::new();
    let (counters, image) = (graph.buffer("counters", SMALL), graph.image("image", COLOR));
    let counters = write(&mut graph, "clear", counters, Access::TransferWrite);
    let image = write(&mut graph, "draw", image, Access::ColorAttachment);
    read(&mut graph, "shade", &[(counters.into(), Access::Indirect), (image.into(), Access::SampledCompute)]);
    let mut pass = graph.pass("count");
    let counters = pass.modify(counters, Access::StorageWriteCompute);
    pass.record(());
    read(&mut graph, "save", &[(counters.into(), Access::TransferRead), (image.into(), Access::TransferRead)]);
    let plan = plan(graph);
    let info = |name: &str| plan.resources.iter().map(|resource| &resource.info).find(|info| info.name == name);
    use vk::{BufferUsageFlags as B, ImageUsageFlags as I};
    let all = B::TRANSFER_DST | B::INDIRECT_BUFFER | B::STORAGE_BUFFER | B::TRANSFER_SRC;
    assert_eq!(info("counters").map(|info| info.buffer_usage), Some(all));
    let all = I::COLOR_ATTACHMENT | I::SAMPLED | I::TRANSFER_SRC;
    assert_eq!(info("image").map(|info| info.image_usage), Some(all));
}

/// The plan of a frame after another, which left `kept`.
fn after(kept: &Kept, graph: Graph<()>) -> Plan<()> {
    graph.compile_keeping(kept, &mut memory).expect("a valid graph")
}

/// Names of the passes that run.
fn names(plan: &Plan<()>) -> Vec<&str> {
    plan.passes.iter().map(|pass| pass.name.as_str()).collect()
}

#[test]
fn a_pass_that_does_not_say_what_it_depends_on_runs_each_time() {
    let frame = || {
        let mut graph = Graph::new();
        let image = graph.kept_image("image", COLOR);
        let image = write(&mut graph, "draw", image, Access::ColorAttachment);
        read(&mut graph, "look", &[(image.into(), Access::SampledCompute)]);
        graph
    };
    let first = after(&Kept::default(), frame());
    assert_eq!(names(&after(&first.kept, frame())), ["draw", "look"]);
}

#[test]
fn what_another_result_of_a_pass_needs_is_made_anew_from_its_start() {
    // `count` makes a kept image and a transient buffer, which somebody wants in the second frame.
    let frame = |counts: bool| {
        let mut graph = Graph::new();
        let (image, buffer) = (graph.kept_image("image", COLOR), graph.buffer("buffer", SMALL));
        let mut pass = graph.pass("draw");
        let image = pass.write(image, Access::StorageWriteCompute);
        pass.depends_on(&()).record(());
        let mut pass = graph.pass("count");
        let image = pass.modify(image, Access::StorageWriteCompute);
        let buffer = pass.write(buffer, Access::StorageWriteCompute);
        pass.depends_on(&()).record(());
        read(&mut graph, "look", &[(image.into(), Access::SampledCompute)]);
        if counts {
            read(&mut graph, "read", &[(buffer.into(), Access::StorageReadCompute)]);
        }
        graph
    };
    let first = after(&Kept::default(), frame(false));
    assert_eq!(names(&first), ["draw", "count", "look"]);
    assert_eq!(names(&after(&first.kept, frame(false))), ["look"]);
    assert_eq!(names(&after(&first.kept, frame(true))), ["draw", "count", "look", "read"]);
}

#[test]
fn what_is_made_of_several_things_is_made_anew_when_any_of_them_is_another() {
    let frame = |contents: [u32; 3]| {
        let mut graph = Graph::new();
        let sources = ["first", "second", "third"].map(|name| graph.kept_image(name, COLOR));
        let mut made = graph.kept_image("sum", COLOR);
        let mut handles = Vec::new();
        for (source, (name, content)) in sources.into_iter().zip(["a", "b", "c"].into_iter().zip(contents)) {
            let mut pass = graph.pass(name);
            handles.push(pass.write(source, Access::StorageWriteCompute));
            pass.depends_on(&content).record(());
        }
        let mut pass = graph.pass("add");
        for handle in handles {
            pass.read(handle, Access::StorageReadCompute);
        }
        made = pass.write(made, Access::StorageWriteCompute);
        pass.depends_on(&()).record(());
        read(&mut graph, "look", &[(made.into(), Access::SampledCompute)]);
        graph
    };
    let first = after(&Kept::default(), frame([0; 3]));
    assert_eq!(names(&first), ["a", "b", "c", "add", "look"]);
    assert_eq!(names(&after(&first.kept, frame([0; 3]))), ["look"]);
    for (changed, name) in [([1, 0, 0], "a"), ([0, 1, 0], "b"), ([0, 0, 1], "c")] {
        assert_eq!(names(&after(&first.kept, frame(changed))), [name, "add", "look"]);
    }
}

#[test]
fn a_kept_image_that_is_to_be_used_in_another_way_is_made_anew_once() {
    let frame = |save: bool| {
        let mut graph = Graph::new();
        let image = graph.kept_image("image", COLOR);
        let mut pass = graph.pass("draw");
        let image = pass.write(image, Access::StorageWriteCompute);
        pass.depends_on(&()).record(());
        read(&mut graph, "look", &[(image.into(), Access::SampledCompute)]);
        if save {
            let result = graph.import_buffer("file", SMALL, None, Some(Access::HostRead));
            let mut pass = graph.pass("save");
            pass.read(image, Access::TransferRead);
            let result = pass.write(result, Access::TransferWrite);
            pass.record(());
            graph.output(result);
        }
        graph
    };
    let first = after(&Kept::default(), frame(false));
    let saved = after(&first.kept, frame(true));
    assert_eq!(names(&saved), ["draw", "look", "save"]);
    let next = after(&saved.kept, frame(false));
    assert_eq!(names(&next), ["look"]);
    assert_eq!(names(&after(&next.kept, frame(true))), ["look", "save"]);
}
