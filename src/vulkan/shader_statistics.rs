//! What a driver's compiler says of shaders: registers, spills, cycles. Nothing runs, so drivers without their GPU do.
use super::device::{choose, create_device};
use super::error::{Result, VulkanError, call};
use super::instance::Instance;
use super::physical_device::{CUBE_ARRAYS, DYNAMIC_RENDERING, DeviceDescription, candidates, has_extension};
use super::pipeline::{Constants, Declared, GraphicsState, check_stage, layout_of, make_graphics, set_layout, stage};
use super::shader::{Interface, Shader, ShaderStage};
use ash::{khr, vk};
use std::sync::Arc;

/// A device that only compiles. It needs neither memory nor semaphores, which Mesa's RADV does not have without a GPU.
pub struct CompilingDevice {
    raw: ash::Device,
    executables: khr::pipeline_executable_properties::Device,
    description: DeviceDescription,
    // Destroyed after the device.
    _instance: Arc<Instance>,
}

/// What a driver made of a shader.
#[derive(Clone, Debug, PartialEq)]
pub struct CompiledShader {
    /// Invocations that it runs in one vector, a wave; 0 if the driver does not say.
    pub subgroup_size: u32,
    /// The driver's figures, by the names that it gives them.
    pub statistics: Vec<(String, f64)>,
}

impl CompilingDevice {
    /// Opens the device that `asked` names (index, or part of its name), or the best one, to compile only.
    ///
    /// # Errors
    /// No driver, no device of that name, one that lacks what shaders need, or one whose driver tells nothing of the shaders that it compiles.
    pub fn new(instance: &Arc<Instance>, asked: Option<&str>) -> Result<Self> {
        let chosen = choose(candidates(instance)?, asked)?;
        let DeviceDescription { name, lacks, .. } = chosen.description.clone();
        if let Some(feature) = lacks.into_iter().find(|lack| [CUBE_ARRAYS, DYNAMIC_RENDERING].contains(lack)) {
            return Err(VulkanError::Unsuitable { device: name, feature: feature.to_owned() });
        }
        if !has_extension(instance, chosen.physical, &name, khr::pipeline_executable_properties::NAME)? {
            return Err(VulkanError::NoStatistics { device: name });
        }
        let extensions = [khr::pipeline_executable_properties::NAME, khr::dynamic_rendering::NAME];
        let mut tells =
            vk::PhysicalDevicePipelineExecutablePropertiesFeaturesKHR::default().pipeline_executable_info(true);
        let raw = create_device(instance, &chosen, &extensions, vk::DeviceCreateInfo::default().push_next(&mut tells))?;
        let executables = khr::pipeline_executable_properties::Device::new(&instance.raw, &raw);
        Ok(Self { raw, executables, description: chosen.description, _instance: instance.clone() })
    }

    /// Name, driver and kind.
    pub fn description(&self) -> &DeviceDescription {
        &self.description
    }

    /// Compiles the compute shader with its specialisation constants set by name, as
    /// [`ComputePipeline`](super::ComputePipeline) does, and asks what it became.
    ///
    /// # Errors
    /// A constant that the shader does not have, or a driver that cannot compile it.
    pub fn compile(&self, shader: &Shader, constants: &[(&str, u32)]) -> Result<CompiledShader> {
        check_stage(shader, ShaderStage::Compute)?;
        let interface = shader.reflect()?;
        let constants = Constants::new(shader, &interface, constants)?;
        let mut made = Made::but_the_pipeline(&self.raw, &[(shader, &interface)])?;
        let specialization = constants.info();
        let info = [vk::ComputePipelineCreateInfo::default()
            .flags(vk::PipelineCreateFlags::CAPTURE_STATISTICS_KHR)
            .stage(stage(made.modules[0], shader).specialization_info(&specialization))
            .layout(made.layout)];
        // SAFETY: `info` and all it points to outlive the call.
        made.pipeline = call("vkCreateComputePipelines", shader.name, || unsafe {
            let made = self.raw.create_compute_pipelines(vk::PipelineCache::null(), &info, None);
            made.map_err(|(_, result)| result)
        })?[0];
        self.ask(shader, made.pipeline)
    }

    /// Compiles the pair as [`GraphicsPipeline`](super::GraphicsPipeline) does, and asks what each became.
    ///
    /// # Errors
    /// Stages that declare one name differently, a driver that cannot compile them or makes one of both.
    pub(crate) fn compile_graphics(
        &self,
        vertex: &Shader,
        fragment: &Shader,
        state: &GraphicsState,
    ) -> Result<[CompiledShader; 2]> {
        check_stage(vertex, ShaderStage::Vertex)?;
        check_stage(fragment, ShaderStage::Fragment)?;
        let interfaces = [vertex.reflect()?, fragment.reflect()?];
        let mut made = Made::but_the_pipeline(&self.raw, &[(vertex, &interfaces[0]), (fragment, &interfaces[1])])?;
        let stages = [stage(made.modules[0], vertex), stage(made.modules[1], fragment)];
        let info = vk::GraphicsPipelineCreateInfo::default()
            .flags(vk::PipelineCreateFlags::CAPTURE_STATISTICS_KHR)
            .stages(&stages)
            .layout(made.layout);
        made.pipeline = make_graphics(&self.raw, vk::PipelineCache::null(), fragment.name, info, state)?;
        Ok([self.ask(vertex, made.pipeline)?, self.ask(fragment, made.pipeline)?])
    }

    /// What became of `shader`, which is of `pipeline`.
    fn ask(&self, shader: &Shader, pipeline: vk::Pipeline) -> Result<CompiledShader> {
        let info = vk::PipelineInfoKHR::default().pipeline(pipeline);
        // SAFETY: the pipeline is alive and this device's, which was made with the extension and its feature.
        let executables = call("vkGetPipelineExecutablePropertiesKHR", shader.name, || unsafe {
            self.executables.get_pipeline_executable_properties(&info)
        })?;
        let is_made_of_it = |made: &vk::PipelineExecutablePropertiesKHR| made.stages.contains(shader.stage.flags());
        let index = executables.iter().position(is_made_of_it);
        let index = index.ok_or_else(|| shader.refuse("the driver made nothing of it"))?;
        let info = vk::PipelineExecutableInfoKHR::default().pipeline(pipeline).executable_index(index as u32);
        // SAFETY: as above, and the pipeline was made to have statistics captured.
        let statistics = call("vkGetPipelineExecutableStatisticsKHR", shader.name, || unsafe {
            self.executables.get_pipeline_executable_statistics(&info)
        })?;
        let statistic = |statistic: &vk::PipelineExecutableStatisticKHR| {
            let name = statistic.name_as_c_str().map(|name| name.to_string_lossy().into_owned());
            (name.unwrap_or_default(), value_of(statistic))
        };
        Ok(CompiledShader {
            subgroup_size: executables[index].subgroup_size,
            statistics: statistics.iter().map(statistic).collect(),
        })
    }
}

impl Drop for CompilingDevice {
    fn drop(&mut self) {
        // SAFETY: nothing was submitted, and what was made of the device was destroyed by the call that made it.
        unsafe { self.raw.destroy_device(None) };
    }
}

fn value_of(statistic: &vk::PipelineExecutableStatisticKHR) -> f64 {
    use vk::PipelineExecutableStatisticFormatKHR as Format;
    let value = &statistic.value;
    // SAFETY: the format says which of the union's fields the driver wrote.
    unsafe {
        match statistic.format {
            Format::BOOL32 => f64::from(value.b32),
            Format::INT64 => value.i64 as f64,
            Format::UINT64 => value.u64 as f64,
            _ => value.f64,
        }
    }
}

/// What is made for a pipeline, and destroyed with it.
struct Made<'a> {
    set_layout: vk::DescriptorSetLayout,
    layout: vk::PipelineLayout,
    modules: Vec<vk::ShaderModule>,
    pipeline: vk::Pipeline,
    device: &'a ash::Device,
}

impl<'a> Made<'a> {
    /// The layouts that `shaders` declare together, and the module of each.
    fn but_the_pipeline(device: &'a ash::Device, shaders: &[(&Shader, &Interface)]) -> Result<Self> {
        let name = shaders.last().map_or("", |(shader, _)| shader.name);
        let Declared { bindings, stages, push_constant_bytes } = Declared::by(shaders)?;
        // Destroyed with this from here on, whatever fails.
        let mut made = Self {
            set_layout: set_layout(device, name, &bindings, stages)?,
            layout: vk::PipelineLayout::null(),
            modules: Vec::new(),
            pipeline: vk::Pipeline::null(),
            device,
        };
        made.layout = layout_of(device, name, made.set_layout, push_constant_bytes, stages)?;
        for (shader, _) in shaders {
            let words = shader.words();
            let info = vk::ShaderModuleCreateInfo::default().code(&words);
            // SAFETY: the words come from the GLSL compiler, as those of every shader.
            let module =
                call("vkCreateShaderModule", shader.name, || unsafe { device.create_shader_module(&info, None) })?;
            made.modules.push(module);
        }
        Ok(made)
    }
}

impl Drop for Made<'_> {
    fn drop(&mut self) {
        // SAFETY: all of it was made by this device and never submitted; what was not made is null, which is allowed.
        unsafe {
            self.device.destroy_pipeline(self.pipeline, None);
            self.modules.iter().for_each(|module| self.device.destroy_shader_module(*module, None));
            self.device.destroy_pipeline_layout(self.layout, None);
            self.device.destroy_descriptor_set_layout(self.set_layout, None);
        }
    }
}
