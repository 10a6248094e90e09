//! Passes on a device: what their shaders, and what they have declared, hold them to.
use super::*;
use crate::vulkan::{Buffer, BufferUse, ComputePipeline, Device, Frames, PipelineCache, compiled, test_device};
use ash::vk;
use std::sync::Arc;

fn pipeline(device: &Arc<Device>, shader: &crate::vulkan::Shader) -> ComputePipeline {
    let cache = PipelineCache::new(device, None).expect("a cache");
    ComputePipeline::new(device, &cache, shader, &[]).expect("a pipeline")
}

const IMAGE: ImageDesc = ImageDesc { format: vk::Format::R32G32B32A32_SFLOAT, width: 8, height: 8 };
/// Of the size of the push constants of tone mapping.
const PUSH: [u32; 4] = [0; 4];

/// Tone mapping as `declare` says it, between an image that it could read and one that it could write.
fn error_of<'a>(
    pipeline: &'a ComputePipeline,
    declare: impl FnOnce(ComputePass<'_, 'a>, &mut ImageHandle, &mut ImageHandle),
) -> String {
    let mut graph = FrameGraph::new();
    let mut source = graph.import_image("source", IMAGE, Some(Access::StorageReadCompute), None);
    let mut target = graph.import_image("target", IMAGE, Some(Access::StorageReadCompute), None);
    declare(graph.compute("wrong", pipeline), &mut source, &mut target);
    graph.output(target);
    let mut memory = |_: &ResourceInfo| MemoryRequirement { size_bytes: 1, alignment: 1, memory_type_bits: 1 };
    graph.compile(&mut memory).err().expect("an invalid graph").to_string()
}

#[test]
fn a_declaration_that_the_shader_contradicts_is_an_error_that_names_pass_and_resource() {
    let device = test_device::open();
    let tone_map = &pipeline(&device, &compiled::TONE_MAP);
    let (size, wrong) = ([8, 8, 1], |resource: &str, problem: &str| {
        format!("pass `wrong`, `{resource}` of shader tone_map: {problem}")
    });
    let text = error_of(tone_map, |pass, source, target| {
        pass.read("radiance", *source).read("display", *target).push(&PUSH).cover(size);
    });
    assert_eq!(text, wrong("display", "the shader writes it; declare a write or a modify"));
    let text = error_of(tone_map, |pass, source, target| {
        pass.write("radiance", source).write("display", target).push(&PUSH).cover(size);
    });
    assert_eq!(text, wrong("radiance", "the shader only reads it; declare a read"));
    let text = error_of(tone_map, |pass, source, target| {
        pass.modify("radiance", source).write("display", target).push(&PUSH).cover(size);
    });
    assert_eq!(text, wrong("radiance", "the shader only reads it; declare a read"));
    let text = error_of(tone_map, |pass, source, target| {
        pass.read("radiant", *source).write("display", target).push(&PUSH).cover(size);
    });
    assert_eq!(text, wrong("radiant", "the shader has no binding of that name"));
    let text = error_of(tone_map, |pass, _, target| pass.write("display", target).push(&PUSH).cover(size));
    assert_eq!(text, wrong("radiance", "nothing is given for it"));
    let text = error_of(tone_map, |pass, source, target| {
        pass.read("radiance", *source).read("radiance", *source).write("display", target).push(&PUSH).cover(size);
    });
    assert_eq!(text, wrong("radiance", "it is given twice"));
    let text = error_of(tone_map, |pass, source, target| {
        pass.read("radiance", *source).write("display", target).push(&PUSH[..3].len()).cover(size);
    });
    assert_eq!(text, wrong("push constants", "the shader declares another number of bytes"));
}

#[test]
fn what_a_shader_writes_has_to_be_of_the_graph() {
    let device = test_device::open();
    let bare_lookups = &pipeline(&device, &compiled::BARE_LOOKUPS);
    let usage = vk::BufferUsageFlags::STORAGE_BUFFER;
    let outside = &Buffer::new(&device, "outside", 64, usage, BufferUse::Device).expect("a buffer");
    let text = error_of(bare_lookups, |pass, _, _| pass.bind("Sums", outside).groups([1, 1, 1]));
    let problem = "the shader may write it, and only resources of the graph are written";
    assert_eq!(text, format!("pass `wrong`, `Sums` of shader bare_lookups: {problem}"));
}

#[test]
fn workgroups_cover_all_invocations_and_access_follows_from_the_shader() {
    let device = test_device::open();
    let tone_map = pipeline(&device, &compiled::TONE_MAP);
    assert_eq!(tone_map.group_size(), [8, 8, 1]);
    let mut graph = FrameGraph::new();
    let source = graph.import_image("source", IMAGE, Some(Access::StorageReadCompute), None);
    let mut target = graph.import_image("target", IMAGE, None, None);
    graph
        .compute("tone_map", &tone_map)
        .read("radiance", source)
        .write("display", &mut target)
        .push(&PUSH)
        .cover([9, 8, 1]);
    graph.output(target);
    let mut memory = |_: &ResourceInfo| MemoryRequirement { size_bytes: 1, alignment: 1, memory_type_bits: 1 };
    let plan = graph.compile(&mut memory).expect("a valid graph");
    let uses: Vec<_> = plan.passes[0].uses.iter().map(|use_| (use_.access, use_.mode)).collect();
    assert_eq!(uses, [(Access::StorageReadCompute, Mode::Read), (Access::StorageWriteCompute, Mode::Write)]);
}

/// How many passes run to tone map by `pipeline`, as `declare` ends the pass, after frames that left `kept`; and what is kept then.
fn passes_after<'a>(
    kept: &Kept,
    pipeline: &'a ComputePipeline,
    declare: impl FnOnce(ComputePass<'_, 'a>),
) -> (usize, Kept) {
    let mut graph = FrameGraph::new();
    let (source, mut target) = (graph.image("source", IMAGE), graph.kept_image("target", IMAGE));
    let mut pass = graph.pass("fill");
    let source = pass.write(source, Access::TransferWrite);
    pass.depends_on(&()).record(Box::new(|_, _| Ok(())));
    declare(graph.compute("tone_map", pipeline).read("radiance", source).write("display", &mut target));
    graph.output(target);
    let mut memory = |_: &ResourceInfo| MemoryRequirement { size_bytes: 1, alignment: 1, memory_type_bits: 1 };
    let plan = graph.compile_keeping(kept, &mut memory).expect("a valid graph");
    (plan.passes.len(), plan.kept)
}

#[test]
fn a_pass_runs_again_if_what_it_is_given_differs_or_is_not_known_yet() {
    let device = test_device::open();
    let (tone_map, other) = (&pipeline(&device, &compiled::TONE_MAP), &pipeline(&device, &compiled::TONE_MAP));
    let size = [8, 8, 1];
    let (first, kept) = passes_after(&Kept::default(), tone_map, |pass| pass.push(&PUSH).cover(size));
    assert_eq!(first, 2);
    assert_eq!(passes_after(&kept, tone_map, |pass| pass.push(&PUSH).cover(size)).0, 0);
    assert_eq!(passes_after(&kept, tone_map, |pass| pass.push(&[1_u32; 4]).cover(size)).0, 2);
    assert_eq!(passes_after(&kept, tone_map, |pass| pass.push(&PUSH).cover([16, 8, 1])).0, 2);
    assert_eq!(passes_after(&kept, other, |pass| pass.push(&PUSH).cover(size)).0, 2);
    let (later, kept) = passes_after(&kept, tone_map, |pass| pass.push_later(|| PUSH).cover(size));
    assert_eq!(later, 2);
    assert_eq!(passes_after(&kept, tone_map, |pass| pass.push_later(|| PUSH).cover(size)).0, 2);
}

/// Copies through a planted pass, which declares to read `old` or `new`, and takes `taken` of both.
fn planted(device: &Arc<Device>, taken: usize) -> crate::Result<()> {
    let desc = BufferDesc { size_bytes: 16 };
    let usage = vk::BufferUsageFlags::TRANSFER_DST;
    let target = Arc::new(Buffer::new(device, "target", 16, usage, BufferUse::Readback)?);
    let mut graph = FrameGraph::new();
    let (mut declared, mut other) = (graph.buffer("declared", desc), graph.buffer("other", desc));
    let before = declared;
    graph.clear_buffer("clear_declared", &mut declared);
    graph.clear_buffer("clear_other", &mut other);
    let result = graph.import_buffer("result", desc, None, Some(Access::HostRead));
    let mut pass = graph.pass("planted");
    let result = pass.read(declared, Access::TransferRead).write(result, Access::TransferWrite);
    let taken = [declared, other, before][taken];
    pass.record(Box::new(move |commands, resources| {
        Ok(commands.copy_buffer(resources.buffer(taken)?, resources.buffer(result)?)?)
    }));
    graph.output(result);
    // `other` is needed by another pass, so that there is an object to be taken by mistake.
    let mut copy = graph.import_buffer("copy", desc, None, Some(Access::HostRead));
    graph.copy_buffer("copy_other", other, &mut copy);
    graph.output(copy);
    let imports =
        [(result.into(), DeviceResource::Buffer(target.clone())), (copy.into(), DeviceResource::Buffer(target))];
    let mut frames = Frames::new(device, "planted", 1)?;
    Executable::new(device, graph, &imports)?.execute(&mut frames)?;
    frames.wait()?;
    Ok(())
}

#[test]
fn a_pass_that_takes_what_it_has_not_declared_is_an_error_that_names_both() {
    let device = test_device::open();
    planted(&device, 0).expect("what was declared");
    let wrong = |resource: &str| {
        format!(
            "frame graph: pass `planted` uses `{resource}`, which it has not declared; declare a read, a write or a modify of it"
        )
    };
    assert_eq!(planted(&device, 1).expect_err("another resource").to_string(), wrong("other"));
    assert_eq!(planted(&device, 2).expect_err("another version").to_string(), wrong("declared"));
}
