//! The plan of the renderer's frame as text, and each promise of the frame graph by itself, for which no GPU is needed.
//!
//! The plans of the viewer's frames are tested beside the viewer (src/viewer/presenter_tests.rs).
mod common;
use ash::vk;
use threadlight::graph::*;
use threadlight::pipeline::Wanted;

/// Memory as a plain device would ask for it: images in multiples of 64 KiB, buffers of 256 bytes.
fn memory(info: &ResourceInfo) -> MemoryRequirement {
    let (bytes, alignment) = match info.kind {
        ResourceKind::Buffer(desc) => (desc.size_bytes, 256),
        ResourceKind::Image(desc) => {
            let texel_bytes = match desc.format {
                vk::Format::R32G32B32A32_SFLOAT => 16,
                vk::Format::R32G32_UINT => 8,
                _ => 4,
            };
            (u64::from(desc.width) * u64::from(desc.height) * texel_bytes, 65536)
        }
    };
    MemoryRequirement { size_bytes: bytes.next_multiple_of(alignment), alignment, memory_type_bits: 0b11 }
}

fn compile(graph: Graph<()>) -> Result<Plan<()>, GraphError> {
    graph.compile(&mut memory)
}

fn plan(graph: Graph<()>) -> Plan<()> {
    compile(graph).expect("a valid graph")
}

fn error(graph: Graph<()>) -> String {
    compile(graph).expect_err("an invalid graph").to_string()
}

const SMALL: BufferDesc = BufferDesc { size_bytes: 256 };
const COLOR: ImageDesc = ImageDesc { format: vk::Format::R8G8B8A8_UNORM, width: 64, height: 64 };
const DEPTH: ImageDesc = ImageDesc { format: vk::Format::D32_SFLOAT, ..COLOR };

/// The plan of the renderer's frame at 640x480 pixels, 2x2 sub-pixels, as text.
fn frame(wanted: Wanted) -> Option<String> {
    let renderer = common::Validated::new();
    let mut scene =
        common::sphere(common::model("model = 'lambert'\nreflectance = [0.8, 0.5, 0.2]"), "studio", 16, (640, 480));
    scene.shading.method = "cosine".to_owned();
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

/// A pass that writes `handle` and nothing else.
fn write<H: Versioned>(graph: &mut Graph<()>, name: &str, handle: H, access: Access) -> H {
    let mut pass = graph.pass(name);
    let written = pass.write(handle, access);
    pass.record(());
    written
}

/// A pass that reads `handles` and writes an output of its own.
fn read(graph: &mut Graph<()>, name: &str, handles: &[(Handle, Access)]) {
    let result = graph.import_buffer(&format!("{name}_result"), SMALL, Some(Access::HostRead), None);
    let mut pass = graph.pass(name);
    for (handle, access) in handles {
        pass.read(*handle, *access);
    }
    let result = pass.write(result, Access::StorageWriteCompute);
    pass.record(());
    graph.output(result);
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
    read(&mut graph, "draw", &[(new.into(), Access::VertexInput)]);
    let plan = plan(graph);
    assert_eq!(waits(&plan, "dispatch", "buffer"), ["transfer(write) -> indirect|compute(read arguments, read)"]);
    assert!(waits(&plan, "compute", "buffer").is_empty() && waits(&plan, "again", "buffer").is_empty());
    assert_eq!(waits(&plan, "refill", "buffer"), ["indirect|compute -> transfer(write)"]);
    assert_eq!(waits(&plan, "draw", "buffer"), ["transfer(write) -> vertex input(read vertices)"]);
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
    read(&mut graph, "of_old", &[(old.into(), Access::UniformGraphics)]);
    let plan = plan(graph);
    let order: Vec<_> = plan.passes.iter().map(|pass| pass.name.as_str()).collect();
    assert_eq!(order, ["first", "of_old", "second", "of_new"]);
    assert_eq!(waits(&plan, "second", "buffer"), ["vertex|fragment -> compute(write)"]);
}

#[test]
fn memory_is_shared_and_its_next_user_waits_for_the_last_also_across_frames() {
    let mut graph = Graph::new();
    let (early, late) = (graph.image("early", COLOR), graph.image("late", COLOR));
    let early = write(&mut graph, "draw_early", early, Access::ColorAttachment);
    read(&mut graph, "use_early", &[(early.into(), Access::SampledFragment)]);
    let late = write(&mut graph, "draw_late", late, Access::StorageWriteCompute);
    read(&mut graph, "use_late", &[(late.into(), Access::TransferRead)]);
    let plan = plan(graph);
    assert_eq!((plan.aliased_bytes(), plan.unaliased_bytes()), (65536, 2 * 65536));
    let text = waits(&plan, "draw_late", "late");
    let expected = "fragment|transfer -> compute(write), undefined => general  (memory of early, the frame before)";
    assert_eq!(text, [expected]);
    let text = waits(&plan, "draw_early", "early");
    let expected = "fragment|transfer -> color output(write), undefined => color  (memory of late, the frame before)";
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
    let kept = Some(Access::SampledCompute);
    let mut graph = Graph::new();
    let geometry = graph.import_image("geometry", COLOR, kept, kept);
    read(&mut graph, "draw", &[(geometry.into(), Access::SampledFragment)]);
    let plan = plan(graph);
    assert_eq!(waits(&plan, "draw", "geometry"), ["compute -> fragment(sample)"]);
    assert_eq!(waits(&plan, "left", "geometry"), ["fragment -> compute(sample)"]);
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

/// The error of a graph made by `declare`, to which a valid pass and output are added.
fn error_of(declare: impl FnOnce(&mut Graph<()>)) -> String {
    let mut graph = Graph::new();
    declare(&mut graph);
    read(&mut graph, "valid", &[]);
    error(graph)
}

/// A pass that does `uses` to one image and one buffer with contents, and writes something else.
fn error_of_uses(uses: impl FnOnce(&mut PassBuilder<()>, ImageHandle, BufferHandle, ImageHandle)) -> String {
    error_of(|graph| {
        let image = graph.import_image("image", COLOR, Some(Access::SampledFragment), None);
        let depth = graph.import_image("depth", DEPTH, Some(Access::SampledFragment), None);
        let buffer = graph.import_buffer("buffer", SMALL, Some(Access::HostWrite), None);
        let other = graph.buffer("other", SMALL);
        let mut pass = graph.pass("wrong");
        uses(&mut pass, image, buffer, depth);
        pass.write(other, Access::TransferWrite);
        pass.record(());
    })
}

#[test]
fn reading_before_anything_is_written_is_an_error() {
    let expected =
        "pass `look` reads `image` before anything has written it; write it first, or import it with contents";
    let transient = error_of(|graph| {
        let image = graph.image("image", COLOR);
        read(graph, "look", &[(image.into(), Access::SampledCompute)]);
    });
    assert_eq!(transient, expected);
    let undefined_import = error_of(|graph| {
        let image = graph.import_image("image", COLOR, None, None);
        let mut pass = graph.pass("look");
        pass.modify(image, Access::StorageWriteCompute);
        pass.record(());
    });
    assert_eq!(undefined_import, expected);
}

#[test]
fn two_writers_of_one_version_are_an_error() {
    let text = error_of(|graph| {
        let image = graph.image("image", COLOR);
        write(graph, "one", image, Access::TransferWrite);
        write(graph, "two", image, Access::TransferWrite);
    });
    let expected =
        "passes `one` and `two` both write the same version of `image`; give `two` the handle that `one` returns";
    assert_eq!(text, expected);
}

#[test]
fn outputs_must_exist_be_newest_and_be_imported() {
    let text = error_of(|graph| {
        let image = graph.import_image("image", COLOR, None, None);
        graph.output(image);
    });
    assert_eq!(text, "output `image` is never written; output the handle that the last pass to write it returns");
    let text = error_of(|graph| {
        let image = graph.import_image("image", COLOR, None, None);
        let old = write(graph, "one", image, Access::TransferWrite);
        write(graph, "two", old, Access::TransferWrite);
        graph.output(old);
    });
    assert_eq!(text, "output `image` is overwritten by pass `two`; output the handle that this pass returns");
    let text = error_of(|graph| {
        let image = graph.image("image", COLOR);
        let image = write(graph, "one", image, Access::TransferWrite);
        graph.output(image);
    });
    let expected =
        "output `image` is transient, so nobody sees it after the frame; import it, or copy it to something imported";
    assert_eq!(text, expected);
    assert_eq!(error(Graph::new()), "the graph has no output, so no pass is needed; call `output`");
}

#[test]
fn wrong_usage_is_an_error_that_says_why() {
    let wrong = |access: &str, resource: &str, why: &str| format!("pass `wrong` uses `{resource}` as {access}: {why}");
    let text = error_of_uses(|pass, _, buffer, _| {
        pass.write(buffer, Access::ColorAttachment);
    });
    assert_eq!(text, wrong("ColorAttachment", "buffer", "that access is for images, and this is a buffer"));
    let text = error_of_uses(|pass, image, _, _| {
        pass.read(image, Access::Indirect);
    });
    assert_eq!(text, wrong("Indirect", "image", "that access is for buffers, and this is an image"));
    let text = error_of_uses(|pass, image, _, _| {
        pass.write(image, Access::DepthAttachment);
    });
    assert_eq!(text, wrong("DepthAttachment", "image", "its format has no depth"));
    let text = error_of_uses(|pass, _, _, depth| {
        pass.write(depth, Access::ColorAttachment);
    });
    assert_eq!(text, wrong("ColorAttachment", "depth", "its format is a depth format"));
    let text = error_of_uses(|pass, _, _, depth| {
        pass.read(depth, Access::StorageReadCompute);
    });
    assert_eq!(text, wrong("StorageReadCompute", "depth", "depth formats cannot be storage images"));
    let text = error_of_uses(|pass, image, _, _| {
        pass.write(image, Access::SampledCompute);
    });
    assert_eq!(text, wrong("SampledCompute", "image", "that access only reads; declare a read"));
    let text = error_of_uses(|pass, image, _, _| {
        pass.read(image, Access::TransferWrite);
    });
    assert_eq!(text, wrong("TransferWrite", "image", "that access writes; declare a write or a modify"));
    let text = error_of_uses(|pass, _, buffer, _| {
        pass.read(buffer, Access::HostRead);
    });
    let why = "only the owner of an imported resource does that; say so when importing it";
    assert_eq!(text, wrong("HostRead", "buffer", why));
    let text = error_of(|graph| {
        graph.import_buffer("buffer", SMALL, None, Some(Access::Present));
    });
    assert_eq!(text, "`buffer` is imported as Present: that access is for images, and this is a buffer");
}

#[test]
fn conflicting_uses_in_one_pass_are_an_error() {
    let conflict = |resource: &str, first: &str, second: &str| {
        let rule = "only reads of one version in one layout go together";
        format!("pass `wrong` uses `{resource}` as {first} and as {second}; {rule}")
    };
    let text = error_of_uses(|pass, image, _, _| {
        pass.read(image, Access::SampledCompute).read(image, Access::StorageReadCompute);
    });
    assert_eq!(text, conflict("image", "SampledCompute", "StorageReadCompute"));
    let text = error_of_uses(|pass, _, buffer, _| {
        pass.read(buffer, Access::Indirect);
        pass.modify(buffer, Access::StorageWriteCompute);
    });
    assert_eq!(text, conflict("buffer", "Indirect", "StorageWriteCompute"));
    let text = error_of_uses(|pass, _, buffer, _| {
        let newer = pass.modify(buffer, Access::StorageWriteCompute);
        pass.modify(newer, Access::StorageWriteCompute);
    });
    assert_eq!(text, conflict("buffer", "StorageWriteCompute", "StorageWriteCompute"));
}

#[test]
fn a_cycle_is_an_error_that_names_its_passes() {
    let mut graph = Graph::new();
    let (buffer, sum) = (graph.buffer("buffer", SMALL), graph.buffer("sum", SMALL));
    let old = write(&mut graph, "fill", buffer, Access::TransferWrite);
    let mut pass = graph.pass("refill");
    pass.modify(old, Access::StorageWriteCompute);
    let sum = pass.write(sum, Access::StorageWriteCompute);
    pass.record(());
    read(&mut graph, "compare", &[(old.into(), Access::UniformCompute), (sum.into(), Access::UniformCompute)]);
    let expected = "cycle: `compare` must run before `refill` because of `buffer`, `refill` must run before `compare` because \
                    of `sum`; read the newer version, or copy the older one first";
    assert_eq!(error(graph), expected);
}

#[test]
fn empty_sizes_double_names_and_idle_passes_are_errors() {
    let no_size = |name: &str| format!("`{name}` has no size; all of its dimensions must be at least 1");
    let text = error_of(|graph| {
        graph.image("image", ImageDesc { width: 0, ..COLOR });
    });
    assert_eq!(text, no_size("image"));
    let text = error_of(|graph| {
        graph.buffer("buffer", BufferDesc { size_bytes: 0 });
    });
    assert_eq!(text, no_size("buffer"));
    let text = error_of(|graph| {
        graph.image("same", COLOR);
        graph.buffer("same", SMALL);
    });
    assert_eq!(text, "two resources are named `same`; names must differ");
    let text = error_of(|graph| {
        let (a, b) = (graph.buffer("a", SMALL), graph.buffer("b", SMALL));
        write(graph, "same", a, Access::TransferWrite);
        write(graph, "same", b, Access::TransferWrite);
    });
    assert_eq!(text, "two passes are named `same`; names must differ");
    let text = error_of(|graph| {
        let buffer = graph.import_buffer("buffer", SMALL, Some(Access::HostWrite), None);
        let mut pass = graph.pass("look");
        pass.read(buffer, Access::UniformCompute);
        pass.record(());
    });
    assert_eq!(text, "pass `look` writes nothing, so it has no effect; declare what it writes or remove it");
    let text = error_of(|graph| {
        let buffer = graph.buffer("buffer", SMALL);
        graph.pass("idle").write(buffer, Access::TransferWrite);
    });
    assert_eq!(text, "pass `idle` records nothing; call `record`");
    let text = error_of(|graph| {
        let mut elsewhere = Graph::new();
        elsewhere.buffer("buffer", SMALL);
        let foreign = elsewhere.buffer("foreign", SMALL);
        let foreign = write(&mut elsewhere, "write", foreign, Access::TransferWrite);
        write(graph, "stray", foreign, Access::TransferWrite);
    });
    assert_eq!(text, "`stray` uses a handle that is not of this graph");
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
