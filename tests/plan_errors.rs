//! Everything that makes a graph meaningless is an error that names the pass and the resource; no GPU.
#[path = "common/graphs.rs"]
mod graphs;
use graphs::*;
use threadlight::low_level::graph::*;

fn error(graph: Graph<()>) -> String {
    compile(graph).expect_err("an invalid graph").to_string()
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
        let image = graph.import_image("image", COLOR, Some(Access::SampledCompute), None);
        let depth = graph.import_image("depth", DEPTH, Some(Access::SampledCompute), None);
        let buffer = graph.import_buffer("buffer", SMALL, Some(Access::TransferWrite), None);
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
        let buffer = graph.import_buffer("buffer", SMALL, Some(Access::TransferWrite), None);
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
