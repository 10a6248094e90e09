//! What Vulkan refused, with the call and the object's name kept.
use ash::vk;

pub(crate) type Result<T> = std::result::Result<T, VulkanError>;

/// An error of the Vulkan layer.
#[derive(Debug, thiserror::Error)]
pub enum VulkanError {
    /// The loader library is not on this machine.
    #[error(
        "no Vulkan loader: {cause}; install it (Debian, Ubuntu: apt-get install libvulkan1 mesa-vulkan-drivers; macOS: brew install vulkan-loader molten-vk)"
    )]
    NoLoader {
        /// What the dynamic linker said.
        cause: String,
    },
    /// The loader found no driver.
    #[error(
        "no Vulkan driver: the loader found no usable device; install your GPU's driver, or the CPU one (Debian, Ubuntu: apt-get install mesa-vulkan-drivers), and check VK_DRIVER_FILES if it is set"
    )]
    NoDriver,
    /// Validation was asked for, but its layer is not installed.
    #[error(
        "validation: the layer VK_LAYER_KHRONOS_validation is not installed; install it (Debian, Ubuntu: apt-get install vulkan-validationlayers) or do without validation"
    )]
    NoValidationLayer,
    /// The driver cannot show anything in windows.
    #[error(
        "no Vulkan driver presents to this window system ({extension} is missing); install one that does, or use `threadlight render`"
    )]
    NoPresentation {
        /// What it would take.
        extension: String,
    },
    /// An environment variable holds what cannot be used.
    #[error("{variable}: {problem}; {remedy}")]
    Variable {
        /// Its name.
        variable: &'static str,
        /// What is wrong with what it holds.
        problem: String,
        /// What it can hold.
        remedy: &'static str,
    },
    /// None of the devices is called so.
    #[error("device {asked:?}: no such Vulkan device; name one of: {available}")]
    NoSuchDevice {
        /// The name or index that was asked for.
        asked: String,
        /// The devices there are, with their indices.
        available: String,
    },
    /// The device lacks something that the renderer needs.
    #[error("{device}: lacks {feature}, which Threadlight needs; update its driver or choose another device")]
    Unsuitable {
        /// Device name.
        device: String,
        /// What is missing.
        feature: String,
    },
    /// The device computes wrongly.
    #[error("{device}: does not compute as Vulkan promises: {fault}; update its driver or choose another device")]
    Faulty {
        /// Device name.
        device: String,
        /// What is wrong with its answers.
        fault: String,
    },
    /// The driver tells nothing of the shaders that it compiles.
    #[error(
        "{device}: its driver does not say what shaders compile to (it lacks VK_KHR_pipeline_executable_properties); choose another device"
    )]
    NoStatistics {
        /// Device name.
        device: String,
    },
    /// A Vulkan call failed.
    #[error("{call} failed for {object}: {result}{}", remedy(*result))]
    Call {
        /// The Vulkan function.
        call: &'static str,
        /// Debug name of the object concerned.
        object: String,
        /// What it returned.
        result: vk::Result,
    },
    /// Memory for an object could not be had.
    #[error("no memory for {object}: {cause}; a smaller size or fewer sub-pixels need less")]
    Memory {
        /// Debug name of the object concerned.
        object: String,
        /// What the allocator said.
        cause: String,
    },
    /// An object is used for what it was not made for.
    #[error("{object}: {problem}")]
    Unfit {
        /// Debug name of the object concerned.
        object: String,
        /// What does not fit.
        problem: String,
    },
    /// A shader and its caller disagree.
    #[error("shader {shader}: {problem}")]
    Shader {
        /// Name of the shader.
        shader: String,
        /// What does not match.
        problem: String,
    },
}

impl From<VulkanError> for crate::Error {
    fn from(error: VulkanError) -> Self {
        match error {
            // Input as any other, though it is this layer that reads it.
            VulkanError::Variable { variable, problem, remedy } => Self::input(variable, problem, remedy),
            other => Self::Vulkan(Box::new(other)),
        }
    }
}

impl VulkanError {
    /// Whether there was too little memory: what needs less may be had.
    pub fn is_lack_of_memory(&self) -> bool {
        let lacks = [vk::Result::ERROR_OUT_OF_DEVICE_MEMORY, vk::Result::ERROR_OUT_OF_HOST_MEMORY];
        match self {
            Self::Memory { .. } => true,
            Self::Call { result, .. } => lacks.contains(result),
            _ => false,
        }
    }

    /// A [`VulkanError::Unfit`] about the object of this name.
    pub(super) fn unfit(object: &str, problem: impl ToString) -> Self {
        Self::Unfit { object: object.to_owned(), problem: problem.to_string() }
    }
}

/// What can be done about it, where something can.
fn remedy(result: vk::Result) -> &'static str {
    match result {
        vk::Result::ERROR_DEVICE_LOST => {
            "; the driver has given the device up: try again, with a smaller size if it happens again, or on another device"
        }
        vk::Result::ERROR_OUT_OF_DEVICE_MEMORY | vk::Result::ERROR_OUT_OF_HOST_MEMORY => {
            "; a smaller size or fewer sub-pixels need less"
        }
        _ => "",
    }
}

/// Makes the Vulkan call of this `name`, and attaches that and the object's name to what it returns.
pub(super) fn call<T>(name: &'static str, object: &str, make: impl FnOnce() -> ash::prelude::VkResult<T>) -> Result<T> {
    bare_call(name, make).during(name, object)
}

/// Makes the Vulkan call of this `name`. Tests make it fail instead.
pub(super) fn bare_call<T>(
    #[cfg_attr(not(test), allow(unused_variables))] name: &'static str,
    make: impl FnOnce() -> ash::prelude::VkResult<T>,
) -> ash::prelude::VkResult<T> {
    #[cfg(test)]
    super::faults::before(name)?;
    make()
}

/// Attaches the call and the object's name to a bare `vk::Result`.
pub(super) trait During<T> {
    fn during(self, call: &'static str, object: &str) -> Result<T>;
}

impl<T> During<T> for ash::prelude::VkResult<T> {
    fn during(self, call: &'static str, object: &str) -> Result<T> {
        self.map_err(|result| VulkanError::Call { call, object: object.to_owned(), result })
    }
}
