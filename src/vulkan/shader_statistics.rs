//! What a driver's compiler says of compute shaders: registers, spills, cycles. Nothing runs, so drivers without their GPU do.
use super::device::choose;
use super::error::{Result, VulkanError, call};
use super::instance::Instance;
use super::physical_device::{DeviceDescription, candidates, has_extension};
use super::pipeline::{Constants, check_stage, compute_stage, layout_of, set_layout};
use super::shader::{Shader, ShaderStage};
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
    /// No driver, no device of that name, or one whose driver tells nothing of the shaders that it compiles.
    pub fn new(instance: &Arc<Instance>, asked: Option<&str>) -> Result<Self> {
        let chosen = choose(candidates(instance)?, asked)?;
        let name = chosen.description.name.clone();
        if !has_extension(instance, chosen.physical, &name, khr::pipeline_executable_properties::NAME)? {
            return Err(VulkanError::NoStatistics { device: name });
        }
        let priorities = [1.0];
        let queues = [vk::DeviceQueueCreateInfo::default()
            .queue_family_index(chosen.queue_family)
            .queue_priorities(&priorities)];
        let extensions = [khr::pipeline_executable_properties::NAME.as_ptr()];
        let mut tells =
            vk::PhysicalDevicePipelineExecutablePropertiesFeaturesKHR::default().pipeline_executable_info(true);
        let info = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queues)
            .enabled_extension_names(&extensions)
            .push_next(&mut tells);
        // SAFETY: the physical device is this instance's; `info` and all it points to outlive the call.
        let raw =
            call("vkCreateDevice", &name, || unsafe { instance.raw.create_device(chosen.physical, &info, None) })?;
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
        let mut made = Made::nothing(&self.raw);
        let stages = vk::ShaderStageFlags::COMPUTE;
        made.set_layout = set_layout(&self.raw, shader.name, &interface.bindings, stages)?;
        made.layout = layout_of(&self.raw, shader.name, made.set_layout, interface.push_constant_bytes, stages)?;
        let words = shader.words();
        let info = vk::ShaderModuleCreateInfo::default().code(&words);
        // SAFETY: the words come from the GLSL compiler, as those of every shader.
        made.module =
            call("vkCreateShaderModule", shader.name, || unsafe { self.raw.create_shader_module(&info, None) })?;
        let specialization = constants.info();
        let info = [vk::ComputePipelineCreateInfo::default()
            .flags(vk::PipelineCreateFlags::CAPTURE_STATISTICS_KHR)
            .stage(compute_stage(made.module, &specialization))
            .layout(made.layout)];
        // SAFETY: `info` and all it points to outlive the call.
        made.pipeline = call("vkCreateComputePipelines", shader.name, || unsafe {
            let made = self.raw.create_compute_pipelines(vk::PipelineCache::null(), &info, None);
            made.map_err(|(_, result)| result)
        })?[0];
        self.ask(shader, made.pipeline)
    }

    fn ask(&self, shader: &Shader, pipeline: vk::Pipeline) -> Result<CompiledShader> {
        let info = vk::PipelineInfoKHR::default().pipeline(pipeline);
        // SAFETY: the pipeline is alive and this device's, which was made with the extension and its feature.
        let executables = call("vkGetPipelineExecutablePropertiesKHR", shader.name, || unsafe {
            self.executables.get_pipeline_executable_properties(&info)
        })?;
        // A compute pipeline is one executable.
        let executable = executables.first().ok_or_else(|| shader.refuse("the driver made nothing of it"))?;
        let info = vk::PipelineExecutableInfoKHR::default().pipeline(pipeline).executable_index(0);
        // SAFETY: as above, and the pipeline was made to have statistics captured.
        let statistics = call("vkGetPipelineExecutableStatisticsKHR", shader.name, || unsafe {
            self.executables.get_pipeline_executable_statistics(&info)
        })?;
        let statistic = |statistic: &vk::PipelineExecutableStatisticKHR| {
            let name = statistic.name_as_c_str().map(|name| name.to_string_lossy().into_owned());
            (name.unwrap_or_default(), value_of(statistic))
        };
        Ok(CompiledShader {
            subgroup_size: executable.subgroup_size,
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
    module: vk::ShaderModule,
    pipeline: vk::Pipeline,
    device: &'a ash::Device,
}

impl<'a> Made<'a> {
    fn nothing(device: &'a ash::Device) -> Self {
        Self {
            set_layout: vk::DescriptorSetLayout::null(),
            layout: vk::PipelineLayout::null(),
            module: vk::ShaderModule::null(),
            pipeline: vk::Pipeline::null(),
            device,
        }
    }
}

impl Drop for Made<'_> {
    fn drop(&mut self) {
        // SAFETY: all of it was made by this device and never submitted; what was not made is null, which is allowed.
        unsafe {
            self.device.destroy_pipeline(self.pipeline, None);
            self.device.destroy_shader_module(self.module, None);
            self.device.destroy_pipeline_layout(self.layout, None);
            self.device.destroy_descriptor_set_layout(self.set_layout, None);
        }
    }
}
