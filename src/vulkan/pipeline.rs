//! Pipelines, with every layout taken from the shaders themselves.
use super::deletion::Garbage;
use super::device::Device;
use super::error::{Result, VulkanError, call};
use super::identity::Identity;
use super::pipeline_cache::PipelineCache;
use super::shader::{Binding, Interface, Shader, ShaderStage};
use ash::vk;
use std::collections::BTreeMap;
use std::sync::Arc;

/// A pipeline, its layout, and what it expects to be bound.
pub(super) struct Pipeline {
    pub raw: vk::Pipeline,
    pub layout: vk::PipelineLayout,
    pub set_layout: vk::DescriptorSetLayout,
    pub bindings: BTreeMap<String, Binding>,
    pub push_constant_bytes: u32,
    pub stages: vk::ShaderStageFlags,
    pub name: &'static str,
    pub identity: Identity,
    pub device: Arc<Device>,
}

impl Pipeline {
    /// Makes the layouts that `shaders` declare together; the pipeline itself is still missing.
    fn new(device: &Arc<Device>, name: &'static str, shaders: &[(&Shader, &Interface)]) -> Result<Self> {
        let Declared { bindings, stages, push_constant_bytes } = Declared::by(shaders)?;
        let set_layout = set_layout(&device.raw, name, &bindings, stages)?;
        let (raw, layout, identity) = (vk::Pipeline::null(), vk::PipelineLayout::null(), Identity::new());
        let owner = device.clone();
        // Destroyed with this from here on, whatever fails.
        let mut pipeline =
            Self { raw, layout, set_layout, bindings, push_constant_bytes, stages, name, identity, device: owner };
        pipeline.layout = layout_of(&device.raw, name, set_layout, push_constant_bytes, stages)?;
        Ok(pipeline)
    }

    /// An error for what does not fit its shaders.
    pub fn refuse(&self, problem: impl ToString) -> VulkanError {
        VulkanError::Shader { shader: self.name.to_owned(), problem: problem.to_string() }
    }
}

/// What the shaders of a pipeline declare together.
#[derive(Default)]
pub(super) struct Declared {
    pub bindings: BTreeMap<String, Binding>,
    pub stages: vk::ShaderStageFlags,
    pub push_constant_bytes: u32,
}

impl Declared {
    /// An error for a name that two of them declare differently.
    pub fn by(shaders: &[(&Shader, &Interface)]) -> Result<Self> {
        let mut all = Self::default();
        for (shader, interface) in shaders {
            all.stages |= shader.stage.flags();
            all.push_constant_bytes = all.push_constant_bytes.max(interface.push_constant_bytes);
            for (name, binding) in &interface.bindings {
                let known = all.bindings.insert(name.clone(), *binding);
                if known.is_some_and(|known| known != *binding) {
                    return Err(shader.refuse(format!("{name} is declared differently by another stage")));
                }
            }
            shader.check_bindings(&all.bindings)?;
        }
        Ok(all)
    }
}

pub(super) fn set_layout(
    device: &ash::Device,
    name: &str,
    bindings: &BTreeMap<String, Binding>,
    stages: vk::ShaderStageFlags,
) -> Result<vk::DescriptorSetLayout> {
    let of_binding = |binding: &Binding| {
        let layout = vk::DescriptorSetLayoutBinding::default().binding(binding.index).descriptor_type(binding.kind);
        layout.descriptor_count(1).stage_flags(stages)
    };
    let bindings: Vec<_> = bindings.values().map(of_binding).collect();
    let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
    // SAFETY: plain creation; the caller destroys it.
    call("vkCreateDescriptorSetLayout", name, || unsafe { device.create_descriptor_set_layout(&info, None) })
}

pub(super) fn layout_of(
    device: &ash::Device,
    name: &str,
    set_layout: vk::DescriptorSetLayout,
    push_constant_bytes: u32,
    stages: vk::ShaderStageFlags,
) -> Result<vk::PipelineLayout> {
    let set_layouts = [set_layout];
    let ranges: Vec<_> = (push_constant_bytes > 0)
        .then(|| vk::PushConstantRange::default().stage_flags(stages).size(push_constant_bytes))
        .into_iter()
        .collect();
    let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&set_layouts).push_constant_ranges(&ranges);
    // SAFETY: plain creation; the caller destroys it.
    call("vkCreatePipelineLayout", name, || unsafe { device.create_pipeline_layout(&info, None) })
}

impl Drop for Pipeline {
    fn drop(&mut self) {
        self.device.delete_later(Garbage::Pipeline(self.raw));
        self.device.delete_later(Garbage::PipelineLayout(self.layout));
        self.device.delete_later(Garbage::DescriptorSetLayout(self.set_layout));
    }
}

/// A shader module for as long as a pipeline is being made.
struct Module {
    raw: vk::ShaderModule,
    device: Arc<Device>,
}

impl Module {
    fn new(device: &Arc<Device>, shader: &Shader) -> Result<Self> {
        let words = shader.words();
        let info = vk::ShaderModuleCreateInfo::default().code(&words);
        // SAFETY: the words come from the GLSL compiler, as those of every shader.
        let raw =
            call("vkCreateShaderModule", shader.name, || unsafe { device.raw.create_shader_module(&info, None) })?;
        device.set_name(raw, shader.name);
        Ok(Self { raw, device: device.clone() })
    }
}

impl Drop for Module {
    fn drop(&mut self) {
        // SAFETY: a module is not needed once its pipeline exists.
        unsafe { self.device.raw.destroy_shader_module(self.raw, None) };
    }
}

/// An error for a shader that is not of the stage it is wanted for.
pub(super) fn check_stage(shader: &Shader, wanted: ShaderStage) -> Result<()> {
    if shader.stage == wanted { Ok(()) } else { Err(shader.refuse(format!("it is not a {wanted:?} shader"))) }
}

/// Values of a shader's specialisation constants.
pub(super) struct Constants {
    entries: Vec<vk::SpecializationMapEntry>,
    data: Vec<u8>,
}

impl Constants {
    /// An error for a constant that the shader does not have.
    pub fn new(shader: &Shader, interface: &Interface, constants: &[(&str, u32)]) -> Result<Self> {
        let mut entries = Vec::new();
        let mut data = Vec::new();
        for (name, value) in constants {
            let id = interface.constants.get(*name);
            let id = id.ok_or_else(|| shader.refuse(format!("it has no specialisation constant {name}")))?;
            let offset = data.len() as u32;
            entries.push(vk::SpecializationMapEntry { constant_id: *id, offset, size: 4 });
            data.extend_from_slice(&value.to_ne_bytes());
        }
        Ok(Self { entries, data })
    }

    pub fn info(&self) -> vk::SpecializationInfo<'_> {
        vk::SpecializationInfo::default().map_entries(&self.entries).data(&self.data)
    }
}

/// The stage of a pipeline that is `shader`, of which `module` was made.
pub(super) fn stage<'a>(module: vk::ShaderModule, shader: &Shader) -> vk::PipelineShaderStageCreateInfo<'a> {
    vk::PipelineShaderStageCreateInfo::default().stage(shader.stage.flags()).module(module).name(c"main")
}

/// A compute shader, ready to dispatch.
pub struct ComputePipeline(pub(super) Pipeline, [u32; 3]);

impl ComputePipeline {
    /// Compiles `shader` with its specialisation constants set by name.
    ///
    /// # Errors
    /// A constant that the shader does not have, or a driver that cannot compile it.
    pub fn new(
        device: &Arc<Device>,
        cache: &PipelineCache,
        shader: &Shader,
        constants: &[(&str, u32)],
    ) -> Result<Self> {
        check_stage(shader, ShaderStage::Compute)?;
        device.check_same(&cache.device, "pipeline cache")?;
        let interface = shader.reflect()?;
        let mut pipeline = Pipeline::new(device, shader.name, &[(shader, &interface)])?;
        let module = Module::new(device, shader)?;
        let constants = Constants::new(shader, &interface, constants)?;
        let specialization = constants.info();
        let stage = stage(module.raw, shader).specialization_info(&specialization);
        let info = [vk::ComputePipelineCreateInfo::default().stage(stage).layout(pipeline.layout)];
        // SAFETY: `info` and all it points to outlive the call.
        pipeline.raw = call("vkCreateComputePipelines", shader.name, || unsafe {
            device.raw.create_compute_pipelines(cache.raw, &info, None).map_err(|(_, result)| result)
        })?[0];
        device.set_name(pipeline.raw, shader.name);
        Ok(Self(pipeline, interface.group_size))
    }

    /// Invocations of a workgroup along each axis, as the shader has them.
    pub fn group_size(&self) -> [u32; 3] {
        self.1
    }

    /// Name of the shader.
    pub(crate) fn name(&self) -> &'static str {
        self.0.name
    }

    /// What is to be bound, by its name in GLSL.
    pub(crate) fn bindings(&self) -> &BTreeMap<String, Binding> {
        &self.0.bindings
    }

    /// What is to be pushed.
    pub(crate) fn push_constant_bytes(&self) -> u32 {
        self.0.push_constant_bytes
    }

    /// Which pipeline this is.
    pub(crate) fn identity(&self) -> Identity {
        self.0.identity
    }
}

/// The fixed-function part of a graphics pipeline: triangles, depth test by greater (reversed depth), no blending.
pub(crate) struct GraphicsState<'a> {
    /// Format of each vertex attribute, by location; attribute `i` comes from vertex buffer `i`, tightly packed.
    pub attributes: &'a [(vk::Format, u32)],
    /// Format of each colour target.
    pub colors: &'a [vk::Format],
    /// Format of the depth target.
    pub depth: vk::Format,
}

/// A vertex and a fragment shader, ready to draw with.
pub struct GraphicsPipeline {
    pub(super) layouts: Pipeline,
    /// Bytes of a vertex in each buffer.
    pub(super) strides: Vec<u32>,
    pub(super) colors: Vec<vk::Format>,
    pub(super) depth: vk::Format,
}

impl GraphicsPipeline {
    /// Compiles the pair.
    ///
    /// # Errors
    /// Stages that declare one name differently, or a driver that cannot compile them.
    pub(crate) fn new(
        device: &Arc<Device>,
        cache: &PipelineCache,
        vertex: &Shader,
        fragment: &Shader,
        state: &GraphicsState,
    ) -> Result<Self> {
        device.check_same(&cache.device, "pipeline cache")?;
        check_stage(vertex, ShaderStage::Vertex)?;
        check_stage(fragment, ShaderStage::Fragment)?;
        let interfaces = [vertex.reflect()?, fragment.reflect()?];
        let mut layouts =
            Pipeline::new(device, fragment.name, &[(vertex, &interfaces[0]), (fragment, &interfaces[1])])?;
        let modules = [Module::new(device, vertex)?, Module::new(device, fragment)?];
        let stages = [stage(modules[0].raw, vertex), stage(modules[1].raw, fragment)];
        let info = vk::GraphicsPipelineCreateInfo::default().stages(&stages).layout(layouts.layout);
        layouts.raw = make_graphics(&device.raw, cache.raw, fragment.name, info, state)?;
        device.set_name(layouts.raw, fragment.name);
        let strides = state.attributes.iter().map(|(_, stride)| *stride).collect();
        Ok(Self { layouts, strides, colors: state.colors.to_vec(), depth: state.depth })
    }

    /// Which pipeline this is.
    pub(crate) fn identity(&self) -> Identity {
        self.layouts.identity
    }
}

/// The pipeline of `info`, which has stages and layout, and of `state`.
pub(super) fn make_graphics(
    device: &ash::Device,
    cache: vk::PipelineCache,
    name: &str,
    info: vk::GraphicsPipelineCreateInfo,
    state: &GraphicsState,
) -> Result<vk::Pipeline> {
    let buffer = |(binding, (_, stride)): (u32, &(vk::Format, u32))| {
        vk::VertexInputBindingDescription::default().binding(binding).stride(*stride)
    };
    let attribute = |(location, (format, _)): (u32, &(vk::Format, u32))| {
        vk::VertexInputAttributeDescription::default().location(location).binding(location).format(*format)
    };
    let buffers: Vec<_> = (0..).zip(state.attributes).map(buffer).collect();
    let attributes: Vec<_> = (0..).zip(state.attributes).map(attribute).collect();
    let vertex_input = vk::PipelineVertexInputStateCreateInfo::default()
        .vertex_binding_descriptions(&buffers)
        .vertex_attribute_descriptions(&attributes);
    let assembly = vk::PipelineInputAssemblyStateCreateInfo::default().topology(vk::PrimitiveTopology::TRIANGLE_LIST);
    let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
    // Both sides are drawn: meshes from the wild are not wound consistently.
    let raster = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
    let multisample =
        vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(vk::SampleCountFlags::TYPE_1);
    let depth = vk::PipelineDepthStencilStateCreateInfo::default()
        .depth_test_enable(true)
        .depth_write_enable(true)
        .depth_compare_op(vk::CompareOp::GREATER);
    let all = vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA);
    let blends = vec![all; state.colors.len()];
    let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&blends);
    let dynamic = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
    let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic);
    let mut rendering = vk::PipelineRenderingCreateInfo::default()
        .color_attachment_formats(state.colors)
        .depth_attachment_format(state.depth);
    let info = [info
        .vertex_input_state(&vertex_input)
        .input_assembly_state(&assembly)
        .viewport_state(&viewport)
        .rasterization_state(&raster)
        .multisample_state(&multisample)
        .depth_stencil_state(&depth)
        .color_blend_state(&blend)
        .dynamic_state(&dynamic)
        .push_next(&mut rendering)];
    // SAFETY: `info` and all it points to outlive the call.
    let made = call("vkCreateGraphicsPipelines", name, || unsafe {
        device.create_graphics_pipelines(cache, &info, None).map_err(|(_, result)| result)
    })?;
    Ok(made[0])
}
