//! Pipelines, with every layout taken from the shaders themselves, and the cache of compiled ones on disk.
use super::deletion::Garbage;
use super::device::Device;
use super::error::{During, Result};
use super::shader::{Binding, Interface, Shader};
use ash::vk;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The driver's cache of compiled pipelines, kept in a file.
///
/// A missing, foreign or damaged file is only a slower start: drivers check the header of what they are given.
pub struct PipelineCache {
    raw: vk::PipelineCache,
    file: Option<PathBuf>,
    device: Arc<Device>,
}

impl PipelineCache {
    /// Opens the cache of this device in `folder`; without a folder it lives in memory only.
    ///
    /// # Errors
    /// The driver cannot make a cache.
    pub fn new(device: &Arc<Device>, folder: Option<&Path>) -> Result<Self> {
        let uuid: String = device.properties.pipeline_cache_uuid.iter().map(|byte| format!("{byte:02x}")).collect();
        let file = folder.map(|folder| folder.join(format!("pipelines-{uuid}.bin")));
        let contents = file.as_deref().and_then(|file| std::fs::read(file).ok()).unwrap_or_default();
        let info = vk::PipelineCacheCreateInfo::default().initial_data(&contents);
        // SAFETY: `contents` outlives the call; the driver validates it.
        let raw = unsafe { device.raw.create_pipeline_cache(&info, None) }
            .during("vkCreatePipelineCache", "pipeline cache")?;
        Ok(Self { raw, file, device: device.clone() })
    }

    /// Writes the file. A folder that cannot be written costs time at the next start, nothing else, so it only warns.
    fn save(&self) {
        let Some(file) = &self.file else { return };
        // SAFETY: plain query of a live cache.
        let contents = match unsafe { self.device.raw.get_pipeline_cache_data(self.raw) } {
            Ok(contents) => contents,
            Err(result) => return tracing::warn!("vkGetPipelineCacheData failed: {result}"),
        };
        if std::fs::read(file).is_ok_and(|old| old == contents) {
            return;
        }
        // If the folder cannot be made, neither can the file, and that is what to say.
        let _ = file.parent().map(std::fs::create_dir_all);
        if let Err(cause) = crate::output::write_whole(file, &contents) {
            tracing::warn!("the pipeline cache was not saved: {cause}");
        }
    }
}

impl Drop for PipelineCache {
    fn drop(&mut self) {
        self.save();
        // SAFETY: pipelines do not need their cache after creation, and this one is destroyed once.
        unsafe { self.device.raw.destroy_pipeline_cache(self.raw, None) };
    }
}

/// A pipeline, its layout, and what it expects to be bound.
pub(super) struct Pipeline {
    pub raw: vk::Pipeline,
    pub layout: vk::PipelineLayout,
    pub set_layout: vk::DescriptorSetLayout,
    pub bindings: BTreeMap<String, Binding>,
    pub push_constant_bytes: u32,
    pub stages: vk::ShaderStageFlags,
    pub name: &'static str,
    device: Arc<Device>,
}

impl Pipeline {
    /// Makes the layouts that `shaders` declare together; the pipeline itself is still missing.
    fn new(device: &Arc<Device>, name: &'static str, shaders: &[(&Shader, &Interface)]) -> Result<Self> {
        let mut bindings = BTreeMap::new();
        let mut stages = vk::ShaderStageFlags::empty();
        let mut push_constant_bytes = 0;
        for (shader, interface) in shaders {
            stages |= shader.stage.flags();
            push_constant_bytes = push_constant_bytes.max(interface.push_constant_bytes);
            for (binding_name, binding) in &interface.bindings {
                let known = bindings.insert(binding_name.clone(), *binding);
                if known.is_some_and(|known| known != *binding) {
                    return Err(shader.refuse(format!("{binding_name} is declared differently by another stage")));
                }
            }
            shader.check_bindings(&bindings)?;
        }
        let set_bindings: Vec<_> = bindings
            .values()
            .map(|binding| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(binding.index)
                    .descriptor_type(binding.kind)
                    .descriptor_count(1)
                    .stage_flags(stages)
            })
            .collect();
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&set_bindings);
        // SAFETY: plain creation; destroyed through the deletion queue.
        let set_layout = unsafe { device.raw.create_descriptor_set_layout(&info, None) }
            .during("vkCreateDescriptorSetLayout", name)?;
        let set_layouts = [set_layout];
        let ranges: Vec<_> = (push_constant_bytes > 0)
            .then(|| vk::PushConstantRange::default().stage_flags(stages).size(push_constant_bytes))
            .into_iter()
            .collect();
        let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&set_layouts).push_constant_ranges(&ranges);
        // SAFETY: as above.
        let layout =
            unsafe { device.raw.create_pipeline_layout(&info, None) }.during("vkCreatePipelineLayout", name)?;
        let raw = vk::Pipeline::null();
        let device = device.clone();
        Ok(Self { raw, layout, set_layout, bindings, push_constant_bytes, stages, name, device })
    }
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
        // SAFETY: the words come from the GLSL compiler.
        let raw =
            unsafe { device.raw.create_shader_module(&info, None) }.during("vkCreateShaderModule", shader.name)?;
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

/// A compute shader, ready to dispatch.
pub struct ComputePipeline(pub(super) Pipeline);

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
        let interface = shader.reflect()?;
        let mut pipeline = Pipeline::new(device, shader.name, &[(shader, &interface)])?;
        let module = Module::new(device, shader)?;
        let mut entries = Vec::new();
        let mut data = Vec::new();
        for (name, value) in constants {
            let id = interface.constants.get(*name);
            let id = id.ok_or_else(|| shader.refuse(format!("it has no specialisation constant {name}")))?;
            let offset = data.len() as u32;
            entries.push(vk::SpecializationMapEntry { constant_id: *id, offset, size: 4 });
            data.extend_from_slice(&value.to_ne_bytes());
        }
        let specialization = vk::SpecializationInfo::default().map_entries(&entries).data(&data);
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(module.raw)
            .name(c"main")
            .specialization_info(&specialization);
        let info = [vk::ComputePipelineCreateInfo::default().stage(stage).layout(pipeline.layout)];
        // SAFETY: `info` and all it points to outlive the call.
        let made = unsafe { device.raw.create_compute_pipelines(cache.raw, &info, None) };
        pipeline.raw = made.map_err(|(_, result)| result).during("vkCreateComputePipelines", shader.name)?[0];
        device.set_name(pipeline.raw, shader.name);
        Ok(Self(pipeline))
    }
}

/// The fixed-function part of a graphics pipeline: triangles, depth test by greater (reversed depth), no blending.
pub struct GraphicsState<'a> {
    /// Format of each vertex attribute, by location; attribute `i` comes from vertex buffer `i`, tightly packed.
    pub attributes: &'a [(vk::Format, u32)],
    /// Format of each colour target.
    pub colors: &'a [vk::Format],
    /// Format of the depth target.
    pub depth: vk::Format,
}

/// A vertex and a fragment shader, ready to draw with.
pub struct GraphicsPipeline(pub(super) Pipeline);

impl GraphicsPipeline {
    /// Compiles the pair.
    ///
    /// # Errors
    /// Stages that declare one name differently, or a driver that cannot compile them.
    pub fn new(
        device: &Arc<Device>,
        cache: &PipelineCache,
        vertex: &Shader,
        fragment: &Shader,
        state: &GraphicsState,
    ) -> Result<Self> {
        let interfaces = [vertex.reflect()?, fragment.reflect()?];
        let mut pipeline =
            Pipeline::new(device, fragment.name, &[(vertex, &interfaces[0]), (fragment, &interfaces[1])])?;
        let modules = [Module::new(device, vertex)?, Module::new(device, fragment)?];
        let stages: Vec<_> = [vertex, fragment]
            .iter()
            .zip(&modules)
            .map(|(shader, module)| {
                vk::PipelineShaderStageCreateInfo::default()
                    .stage(shader.stage.flags())
                    .module(module.raw)
                    .name(c"main")
            })
            .collect();
        let vertex_buffers: Vec<_> = (0..)
            .zip(state.attributes)
            .map(|(binding, (_, stride))| vk::VertexInputBindingDescription::default().binding(binding).stride(*stride))
            .collect();
        let attributes: Vec<_> = (0..)
            .zip(state.attributes)
            .map(|(location, (format, _))| {
                vk::VertexInputAttributeDescription::default().location(location).binding(location).format(*format)
            })
            .collect();
        let vertex_input = vk::PipelineVertexInputStateCreateInfo::default()
            .vertex_binding_descriptions(&vertex_buffers)
            .vertex_attribute_descriptions(&attributes);
        let assembly =
            vk::PipelineInputAssemblyStateCreateInfo::default().topology(vk::PrimitiveTopology::TRIANGLE_LIST);
        let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
        // Both sides are drawn: meshes from the wild are not wound consistently.
        let raster = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
        let multisample =
            vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(vk::SampleCountFlags::TYPE_1);
        let depth = vk::PipelineDepthStencilStateCreateInfo::default()
            .depth_test_enable(true)
            .depth_write_enable(true)
            .depth_compare_op(vk::CompareOp::GREATER);
        let blends: Vec<_> = state
            .colors
            .iter()
            .map(|_| vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA))
            .collect();
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&blends);
        let dynamic = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic);
        let mut rendering = vk::PipelineRenderingCreateInfo::default()
            .color_attachment_formats(state.colors)
            .depth_attachment_format(state.depth);
        let info = [vk::GraphicsPipelineCreateInfo::default()
            .stages(&stages)
            .vertex_input_state(&vertex_input)
            .input_assembly_state(&assembly)
            .viewport_state(&viewport)
            .rasterization_state(&raster)
            .multisample_state(&multisample)
            .depth_stencil_state(&depth)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .layout(pipeline.layout)
            .push_next(&mut rendering)];
        // SAFETY: `info` and all it points to outlive the call.
        let made = unsafe { device.raw.create_graphics_pipelines(cache.raw, &info, None) };
        pipeline.raw = made.map_err(|(_, result)| result).during("vkCreateGraphicsPipelines", fragment.name)?[0];
        device.set_name(pipeline.raw, fragment.name);
        Ok(Self(pipeline))
    }
}
