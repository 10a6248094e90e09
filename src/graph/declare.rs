//! Declare: the graph as the passes describe it, resources by version, nothing checked yet.
use super::access::{Access, Mode};
use super::error::GraphError;
use super::resource::{
    BufferDesc, BufferHandle, Handle, ImageDesc, ImageHandle, ResourceInfo, ResourceKind, Versioned,
};
use std::hash::{DefaultHasher, Hash, Hasher};

/// A frame as it is being declared. `W` is what a pass has to record: a closure in the renderer, `()` in tests.
pub struct Graph<W> {
    pub(super) resources: Vec<Resource>,
    pub(super) passes: Vec<Pass<W>>,
    pub(super) outputs: Vec<Handle>,
    /// The first thing that was found wrong while it was declared.
    pub(super) problem: Option<GraphError>,
}

/// A declared resource.
pub(super) struct Resource {
    pub name: String,
    pub kind: ResourceKind,
    /// `None` for a transient resource, and for one to be kept.
    pub import: Option<Import>,
    /// Whether it outlives the frame where somebody keeps such resources; otherwise it is transient.
    pub keep: bool,
}

/// What the owner of an imported resource says about it.
pub(super) struct Import {
    pub before: Option<Access>,
    pub after: Option<Access>,
}

/// A declared pass.
pub(super) struct Pass<W> {
    pub name: String,
    /// The pass that it is a later portion of.
    pub portion_of: Option<String>,
    pub uses: Vec<Use>,
    /// Hash of what it depends on besides resources; none if it does not say.
    pub inputs: Option<u64>,
    /// Whether it depends on something that is not known yet: then nothing that it makes is ever still good.
    pub depends_on_unknown: bool,
    pub work: Option<W>,
}

/// One use of a resource by a pass. `handle` is the version found; a write leaves the next one.
#[derive(Clone, Copy)]
pub(super) struct Use {
    pub handle: Handle,
    pub access: Access,
    pub mode: Mode,
}

impl Use {
    /// The version whose contents the pass depends on.
    pub fn needs(self) -> Option<Handle> {
        (self.mode != Mode::Write).then_some(self.handle)
    }

    /// The version that the pass leaves behind.
    pub fn makes(self) -> Option<Handle> {
        (self.mode != Mode::Read).then_some(self.handle.next())
    }
}

impl<W> Default for Graph<W> {
    fn default() -> Self {
        Self { resources: Vec::new(), passes: Vec::new(), outputs: Vec::new(), problem: None }
    }
}

impl<W> Graph<W> {
    /// An empty frame.
    pub fn new() -> Self {
        Self::default()
    }

    /// A transient image: it exists inside the frame only, and its memory may be shared with others.
    pub fn image(&mut self, name: &str, desc: ImageDesc) -> ImageHandle {
        self.resource(name, ResourceKind::Image(desc), None).into()
    }

    /// A transient buffer: it exists inside the frame only, and its memory may be shared with others.
    pub fn buffer(&mut self, name: &str, desc: BufferDesc) -> BufferHandle {
        self.resource(name, ResourceKind::Buffer(desc), None).into()
    }

    /// An image that is worth keeping: where frames are compiled one after another with what was kept
    /// ([`Graph::compile_keeping`]), passes that would make the same contents again do not run. Elsewhere it is transient.
    pub fn kept_image(&mut self, name: &str, desc: ImageDesc) -> ImageHandle {
        let handle = self.resource(name, ResourceKind::Image(desc), None);
        self.resources[handle.resource].keep = true;
        handle.into()
    }

    /// A buffer that is worth keeping: see [`Graph::kept_image`].
    pub fn kept_buffer(&mut self, name: &str, desc: BufferDesc) -> BufferHandle {
        let handle = self.resource(name, ResourceKind::Buffer(desc), None);
        self.resources[handle.resource].keep = true;
        handle.into()
    }

    /// An image that someone else owns: a swapchain image.
    ///
    /// `before` is the access it was last used with; what was written must already be visible to that access. `None`: its
    /// contents are undefined, and its first use waits for everything earlier on the queue. `after` is the access that it
    /// is to be ready for when the frame ends; `None`: whatever the last pass left. A resource that no pass of the plan uses
    /// is not in the plan and stays as it was.
    pub fn import_image(
        &mut self,
        name: &str,
        desc: ImageDesc,
        before: Option<Access>,
        after: Option<Access>,
    ) -> ImageHandle {
        self.resource(name, ResourceKind::Image(desc), Some(Import { before, after })).into()
    }

    /// What the image of this handle is; none if it is of another graph.
    pub fn image_desc(&self, handle: ImageHandle) -> Option<ImageDesc> {
        match self.resources.get(Handle::from(handle).resource)?.kind {
            ResourceKind::Image(desc) => Some(desc),
            ResourceKind::Buffer(_) => None,
        }
    }

    /// A buffer that someone else owns and keeps: see [`Graph::import_image`].
    pub fn import_buffer(
        &mut self,
        name: &str,
        desc: BufferDesc,
        before: Option<Access>,
        after: Option<Access>,
    ) -> BufferHandle {
        self.resource(name, ResourceKind::Buffer(desc), Some(Import { before, after })).into()
    }

    fn resource(&mut self, name: &str, kind: ResourceKind, import: Option<Import>) -> Handle {
        self.resources.push(Resource { name: name.to_owned(), kind, import, keep: false });
        Handle { resource: self.resources.len() - 1, version: 0 }
    }

    /// Adds a pass; the builder says what it uses and what it records.
    pub fn pass(&mut self, name: &str) -> PassBuilder<'_, W> {
        let index = self.passes.len();
        self.passes.push(Pass {
            name: name.to_owned(),
            portion_of: None,
            uses: Vec::new(),
            inputs: None,
            depends_on_unknown: false,
            work: None,
        });
        PassBuilder { pass: &mut self.passes[index], problem: &mut self.problem }
    }

    /// What resource number `index` must be to be used as all declared passes use it, whether they run or not.
    pub(super) fn info(&self, index: usize) -> ResourceInfo {
        let resource = &self.resources[index];
        let uses = self.passes.iter().flat_map(|pass| &pass.uses).filter(|use_| use_.handle.resource == index);
        ResourceInfo::used_as(&resource.name, resource.kind, uses.map(|use_| use_.access))
    }

    /// The frame exists for this: the newest version of an imported resource. Passes that no output needs are culled;
    /// nothing else keeps a pass alive, not even a write to an imported resource.
    pub fn output(&mut self, handle: impl Into<Handle>) {
        self.outputs.push(handle.into());
    }
}

/// Says what a pass uses and what it records.
pub struct PassBuilder<'a, W> {
    pass: &'a mut Pass<W>,
    problem: &'a mut Option<GraphError>,
}

impl<W> PassBuilder<'_, W> {
    /// The pass looks at `handle`. Several reads of one resource in one pass may differ in access, not in layout.
    pub fn read(&mut self, handle: impl Into<Handle>, access: Access) -> &mut Self {
        self.pass.uses.push(Use { handle: handle.into(), access, mode: Mode::Read });
        self
    }

    /// The pass replaces all contents of the resource; earlier ones are lost. Returns the new version.
    pub fn write<H: Versioned>(&mut self, handle: H, access: Access) -> H {
        self.change(handle, access, Mode::Write)
    }

    /// The pass changes some contents of the resource, or reads and writes it; earlier ones must exist. Returns the new
    /// version.
    pub fn modify<H: Versioned>(&mut self, handle: H, access: Access) -> H {
        self.change(handle, access, Mode::Modify)
    }

    fn change<H: Versioned>(&mut self, handle: H, access: Access, mode: Mode) -> H {
        let handle = handle.into();
        self.pass.uses.push(Use { handle, access, mode });
        handle.next().into()
    }

    /// Says that the pass is a later portion of the one of this name. Together they would take longer than systems let a GPU be busy: a frame
    /// that has portions is to be submitted pass by pass.
    pub fn portion_of(&mut self, name: &str) -> &mut Self {
        self.pass.portion_of = Some(name.to_owned());
        self
    }

    /// Says what the pass depends on besides the resources that it uses: everything else that, when it changes, changes what
    /// the pass makes. Where this is not said, nothing that the pass makes is ever still good.
    pub fn depends_on(&mut self, inputs: &impl Hash) -> &mut Self {
        let mut hasher = DefaultHasher::new();
        (self.pass.inputs, inputs).hash(&mut hasher);
        self.pass.inputs = Some(hasher.finish());
        self
    }

    /// Says that the pass depends on something that is not known yet.
    pub(super) fn depends_on_unknown(&mut self) {
        self.pass.depends_on_unknown = true;
    }

    /// Its name.
    pub(super) fn name(&self) -> &str {
        &self.pass.name
    }

    /// Notes what is wrong with its declaration; the graph will not compile.
    pub(super) fn refuse(&mut self, problem: GraphError) {
        self.problem.get_or_insert(problem);
    }

    /// What the pass records when it runs.
    pub fn record(&mut self, work: W) {
        self.pass.work = Some(work);
    }
}
