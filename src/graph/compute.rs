//! Compute passes: what the shader says of its bindings is not said again.
//!
//! Whether it reads or writes a resource follows from the qualifiers (`readonly`, `writeonly`) in its GLSL, how many workgroups
//! cover an image from their size there. A declaration gives each binding its resource, by the name that the GLSL gives it,
//! and says how it is meant: an error where the shader means it otherwise.
use super::access::Access;
use super::declare::PassBuilder;
use super::error::GraphError;
use super::resource::{BufferHandle, Handle, Versioned};
use super::work::{DeviceResource, FrameGraph, Resources, Work};
use crate::Result;
use crate::vulkan::{Binding, BindingAccess, Bound, Commands, ComputePipeline, Groups, Image, Sampler};
use ash::vk::DescriptorType;
use bytemuck::Pod;

/// Push constants of a dispatch.
enum Push<'a> {
    Known(Vec<u8>),
    /// Known when the pass is recorded.
    Later(Box<dyn Fn() -> Vec<u8> + 'a>),
}

/// What a binding is given.
#[derive(Clone, Copy)]
enum Given<'a> {
    Resource(Handle),
    Outside(Bound<'a>),
}

/// How many workgroups.
#[derive(Clone, Copy)]
enum Count {
    Direct([u32; 3]),
    Indirect(BufferHandle, u64),
}

/// By what, how many workgroups, and with which push constants.
type Dispatch<'a> = (&'a ComputePipeline, Count, Push<'a>);

/// A compute pass that is being declared: [`ComputePass::cover`] and its like end it.
#[must_use = "a pass without a dispatch records nothing"]
pub struct ComputePass<'g, 'a> {
    pass: PassBuilder<'g, Work<'a>>,
    pipeline: &'a ComputePipeline,
    given: Vec<(&'a str, Given<'a>)>,
    push: Push<'a>,
}

impl<'a> FrameGraph<'a> {
    /// Adds a pass that runs `pipeline`.
    pub fn compute(&mut self, name: &str, pipeline: &'a ComputePipeline) -> ComputePass<'_, 'a> {
        ComputePass { pass: self.pass(name), pipeline, given: Vec::new(), push: Push::Known(Vec::new()) }
    }
}

impl<'a> ComputePass<'_, 'a> {
    /// The pass is a later portion of the one of this name: see [`PassBuilder::portion_of`].
    pub fn portion_of(mut self, name: &str) -> Self {
        self.pass.portion_of(name);
        self
    }

    /// The shader looks at `handle` as its binding `name`.
    pub fn read(mut self, name: &'a str, handle: impl Into<Handle>) -> Self {
        let handle = handle.into();
        if let Some(binding) = self.give(name, Given::Resource(handle)) {
            match read_access(binding) {
                Ok(access) => drop(self.pass.read(handle, access)),
                Err(problem) => self.refuse(name, problem),
            }
        }
        self
    }

    /// The shader replaces all contents of `handle`, its binding `name`; earlier ones are lost. `handle` becomes the new version.
    pub fn write<H: Versioned>(mut self, name: &'a str, handle: &mut H) -> Self {
        if let Some(binding) = self.give(name, Given::Resource((*handle).into())) {
            match binding.access {
                BindingAccess::WriteOnly => *handle = self.pass.write(*handle, Access::StorageWriteCompute),
                BindingAccess::ReadOnly => self.refuse(name, ONLY_READ),
                BindingAccess::ReadWrite => {
                    self.refuse(name, "the shader may read it; declare a modify, or make it `writeonly`")
                }
            }
        }
        self
    }

    /// The shader changes some contents of `handle`, its binding `name`, or reads and writes it; earlier ones must exist.
    /// `handle` becomes the new version.
    pub fn modify<H: Versioned>(mut self, name: &'a str, handle: &mut H) -> Self {
        if let Some(binding) = self.give(name, Given::Resource((*handle).into())) {
            match binding.access {
                BindingAccess::ReadOnly => self.refuse(name, ONLY_READ),
                _ => *handle = self.pass.modify(*handle, Access::StorageWriteCompute),
            }
        }
        self
    }

    /// The shader looks at what is no resource of the graph, as its binding `name`.
    pub fn bind(mut self, name: &'a str, outside: impl Into<Bound<'a>>) -> Self {
        let outside = outside.into();
        self.pass.depends_on(&outside.identity());
        let binding = self.give(name, Given::Outside(outside));
        if binding.is_some_and(|binding| binding.access != BindingAccess::ReadOnly) {
            self.refuse(name, "the shader may write it, and only resources of the graph are written");
        }
        self
    }

    /// The same for an image with its sampler.
    pub fn sampled(self, name: &'a str, image: &'a Image, sampler: &'a Sampler) -> Self {
        self.bind(name, Bound::Sampled(image, sampler))
    }

    /// The same for several.
    pub fn bind_all(self, outside: impl IntoIterator<Item = (&'a str, Bound<'a>)>) -> Self {
        outside.into_iter().fold(self, |pass, (name, outside)| pass.bind(name, outside))
    }

    /// The push constants.
    pub fn push(mut self, constants: &impl Pod) -> Self {
        self.push = Push::Known(bytemuck::bytes_of(constants).to_vec());
        self
    }

    /// The push constants as they are when the pass is recorded: nothing that it makes is ever still good.
    pub fn push_later<P: Pod>(mut self, constants: impl Fn() -> P + 'a) -> Self {
        self.push = Push::Later(Box::new(move || bytemuck::bytes_of(&constants()).to_vec()));
        self
    }

    /// As many workgroups as cover so many invocations along each axis.
    pub fn cover(self, invocations: [u32; 3]) {
        let size = self.pipeline.group_size();
        self.groups([0, 1, 2].map(|axis| invocations[axis].div_ceil(size[axis].max(1))));
    }

    /// So many workgroups along each axis.
    pub fn groups(mut self, counts: [u32; 3]) {
        let push = std::mem::replace(&mut self.push, Push::Known(Vec::new()));
        self.pass.depends_on(&counts);
        let pipeline = self.pipeline;
        self.record(vec![(pipeline, Count::Direct(counts), push)]);
    }

    /// One dispatch after another, each by a pipeline of the same shader, with the byte offset of its number of workgroups (three u32) in
    /// `arguments`, and with its push constants. None waits for another.
    pub fn indirect<P: Pod>(
        mut self,
        arguments: BufferHandle,
        dispatches: impl IntoIterator<Item = (&'a ComputePipeline, u64, P)>,
    ) {
        if !matches!(&self.push, Push::Known(bytes) if bytes.is_empty()) {
            self.refuse("push constants", "each dispatch has its own");
        }
        self.pass.read(arguments, Access::Indirect);
        let dispatch = |(pipeline, offset, push): (&'a ComputePipeline, u64, P)| {
            self.pass.depends_on(&offset);
            (pipeline, Count::Indirect(arguments, offset), Push::Known(bytemuck::bytes_of(&push).to_vec()))
        };
        let dispatches = dispatches.into_iter().map(dispatch).collect();
        self.record(dispatches);
    }

    fn record(mut self, dispatches: Vec<Dispatch<'a>>) {
        self.check_complete(&dispatches);
        let Self { mut pass, given, .. } = self;
        pass.depends_on(&given.iter().map(|(name, _)| *name).collect::<Vec<_>>());
        for (pipeline, _, push) in &dispatches {
            pass.depends_on(&pipeline.identity());
            match push {
                Push::Known(bytes) => drop(pass.depends_on(bytes)),
                Push::Later(_) => pass.depends_on_unknown(),
            }
        }
        pass.record(Box::new(move |commands, resources| {
            dispatches
                .iter()
                .try_for_each(|(pipeline, count, push)| dispatch(commands, resources, pipeline, &given, *count, push))
        }));
    }

    /// What the shader declares as `name`, which is given `what`; none, and an error of the graph, if it declares nothing or is
    /// given something already.
    fn give(&mut self, name: &'a str, what: Given<'a>) -> Option<Binding> {
        if self.given.iter().any(|(given, _)| *given == name) {
            self.refuse(name, "it is given twice");
            return None;
        }
        self.given.push((name, what));
        let binding = self.pipeline.bindings().get(name).copied();
        if binding.is_none() {
            self.refuse(name, "the shader has no binding of that name");
        }
        binding
    }

    /// An error of the graph where a binding or push constants are missing.
    fn check_complete(&mut self, dispatches: &[Dispatch]) {
        let missing = |name: &&String| self.given.iter().all(|(given, _)| given != name);
        if let Some(name) = dispatches.iter().find_map(|(pipeline, ..)| pipeline.bindings().keys().find(missing)) {
            self.refuse(name, "nothing is given for it");
        }
        let fits = |(pipeline, _, push): &Dispatch| match push {
            Push::Known(bytes) => bytes.len() == pipeline.push_constant_bytes() as usize,
            Push::Later(_) => true,
        };
        if !dispatches.iter().all(fits) {
            self.refuse("push constants", "the shader declares another number of bytes");
        }
    }

    fn refuse(&mut self, resource: &str, problem: &'static str) {
        let (shader, resource) = (self.pipeline.name().to_owned(), resource.to_owned());
        let pass = self.pass.name().to_owned();
        self.pass.refuse(GraphError::WrongBinding { pass, resource, shader, problem });
    }
}

const ONLY_READ: &str = "the shader only reads it; declare a read";

/// How the shader reads a binding of the graph, or why it does not just do that.
fn read_access(binding: Binding) -> std::result::Result<Access, &'static str> {
    match (binding.access, binding.kind) {
        (BindingAccess::WriteOnly, _) => Err("the shader writes it; declare a write or a modify"),
        (BindingAccess::ReadWrite, _) => Err("the shader may write it; declare a modify, or make it `readonly`"),
        (_, DescriptorType::UNIFORM_BUFFER) => Ok(Access::UniformCompute),
        (_, DescriptorType::SAMPLED_IMAGE) => Ok(Access::SampledCompute),
        (_, DescriptorType::COMBINED_IMAGE_SAMPLER) => Err("the shader wants a sampler with it; make it a texture"),
        _ => Ok(Access::StorageReadCompute),
    }
}

fn dispatch(
    commands: &mut Commands,
    resources: &Resources,
    pipeline: &ComputePipeline,
    given: &[(&str, Given)],
    count: Count,
    push: &Push,
) -> Result<()> {
    let mut bindings = Vec::new();
    for (name, given) in given {
        let bound = match given {
            Given::Outside(bound) => *bound,
            Given::Resource(handle) => match resources.object(*handle)? {
                DeviceResource::Image(image) => Bound::Image(image),
                DeviceResource::Buffer(buffer) => Bound::Buffer(buffer),
            },
        };
        bindings.push((*name, bound));
    }
    let groups = match count {
        Count::Direct(counts) => Groups::Direct(counts),
        Count::Indirect(arguments, offset) => Groups::Indirect(resources.buffer(arguments)?, offset),
    };
    match push {
        Push::Known(bytes) => commands.dispatch(pipeline, &bindings, bytes, groups)?,
        Push::Later(bytes) => commands.dispatch(pipeline, &bindings, &bytes(), groups)?,
    }
    Ok(())
}
