//! The Vulkan instance: loader, validation layer, and the messages it sends.
#[cfg(feature = "viewer")]
use super::error::During;
use super::error::{Result, VulkanError, call};
use ash::{ext, khr, vk};
use std::ffi::{CStr, c_void};
use std::ops::Range;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

const VALIDATION_LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";
/// What errors call it.
const NAME: &str = "instance";

/// Messages of the validation layer, shared between the instance and whoever reports them.
#[derive(Clone, Default)]
pub struct Messages(Arc<Mutex<Vec<String>>>);

impl Messages {
    /// Every message so far, oldest first.
    pub fn all(&self) -> Vec<String> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn push(&self, message: String) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(message);
    }
}

/// A Vulkan instance, 1.3 where the loader has it, else 1.2.
pub struct Instance {
    pub(super) raw: ash::Instance,
    pub(super) debug_names: bool,
    messenger: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    messages: Messages,
    // The callback's user data: at one address for as long as the messenger lives.
    user_data: Box<Messages>,
    validates: bool,
    /// Whether it was made for a window system.
    #[cfg(feature = "viewer")]
    pub(super) presents: bool,
    // Unloads the loader when dropped: last.
    pub(super) entry: ash::Entry,
}

/// The first instance that was let go, and its loader: it stays, so that drivers stay loaded. The loader unloads them with the last instance,
/// and NVIDIA's (580.159, with glibc 2.36) cannot be loaded more than 30 times in one process.
static DRIVERS: OnceLock<(ash::Instance, ash::Entry)> = OnceLock::new();

/// Where Homebrew and the SDK put the loader: macOS looks in neither.
const LOADERS: &[&str] = if cfg!(target_os = "macos") {
    &["/opt/homebrew/lib/libvulkan.dylib", "/usr/local/lib/libvulkan.dylib"]
} else {
    &[]
};

fn load() -> std::result::Result<ash::Entry, ash::LoadingError> {
    // SAFETY: loads the system's Vulkan loader; it is unloaded after every object made through it (order of the fields of `Instance`).
    let loaded = unsafe { ash::Entry::load() };
    // SAFETY: the same of these.
    LOADERS.iter().fold(loaded, |loaded, path| loaded.or_else(|_| unsafe { ash::Entry::load_from(path) }))
}

impl Instance {
    /// Loads the Vulkan loader and makes an instance, with core and synchronisation validation when `validate` is set.
    ///
    /// # Errors
    /// No loader, no driver, or no validation layer where one was asked for; each says what to install.
    pub fn new(validate: bool) -> Result<Arc<Self>> {
        Self::with_extensions(validate, &[])
    }

    /// The same for one that can present to windows of `display`.
    ///
    /// # Errors
    /// Those of [`Instance::new`], and a window system that the driver does not present to.
    #[cfg(feature = "viewer")]
    pub fn for_display(validate: bool, display: raw_window_handle::RawDisplayHandle) -> Result<Arc<Self>> {
        let extensions =
            ash_window::enumerate_required_extensions(display).during("vkCreateInstance", "window system")?;
        // SAFETY: they are names in static memory.
        let extensions: Vec<_> = extensions.iter().map(|name| unsafe { CStr::from_ptr(*name) }).collect();
        Self::with_extensions(validate, &extensions)
    }

    fn with_extensions(validate: bool, wanted: &[&CStr]) -> Result<Arc<Self>> {
        let entry = load().map_err(|cause| VulkanError::NoLoader { cause: cause.to_string() })?;
        let offer = Offer::of(&entry, validate)?;
        if let Some(missing) = wanted.iter().find(|wanted| !offer.has(wanted)) {
            return Err(VulkanError::NoPresentation { extension: missing.to_string_lossy().into_owned() });
        }
        let messages = Messages::default();
        let user_data = Box::new(messages.clone());
        // Names and labels cost nothing without a tool that listens, and are what a frame debugger shows.
        let debug_names = validate || offer.has(ext::debug_utils::NAME);
        let raw = create(&entry, &offer, validate.then_some(&*user_data), wanted, debug_names)?;
        // Destroyed with this from here on, whatever fails.
        let mut instance = Self {
            raw,
            debug_names,
            messenger: None,
            messages,
            user_data,
            validates: validate,
            #[cfg(feature = "viewer")]
            presents: !wanted.is_empty(),
            entry,
        };
        if validate {
            let functions = ext::debug_utils::Instance::new(&instance.entry, &instance.raw);
            let info = messenger_info(&instance.user_data);
            // SAFETY: the instance was made with VK_EXT_debug_utils; the user data outlives the messenger.
            let messenger = call("vkCreateDebugUtilsMessengerEXT", NAME, || unsafe {
                functions.create_debug_utils_messenger(&info, None)
            })?;
            instance.messenger = Some((functions, messenger));
        }
        Ok(Arc::new(instance))
    }

    /// What the validation layer has said so far; stays readable after the instance is gone.
    pub fn messages(&self) -> Messages {
        self.messages.clone()
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        if let Some((functions, messenger)) = self.messenger.take() {
            // SAFETY: made by this instance, destroyed once, before it.
            unsafe { functions.destroy_debug_utils_messenger(messenger, None) };
        }
        // With validation, what is left behind is to be told.
        if !self.validates && DRIVERS.set((self.raw.clone(), self.entry.clone())).is_ok() {
            return;
        }
        // SAFETY: every device holds an `Arc` of this instance, so none is left.
        unsafe { self.raw.destroy_instance(None) };
    }
}

/// Versions of the validation layer that look for hazards across submissions, but do not know of waits for timeline semaphores between them:
/// they find some where there are none (issue 7457 of Vulkan-ValidationLayers). Ubuntu 24.04 has 1.3.275. They are told to look within each
/// submission alone.
const WITHOUT_TIMELINES: Range<u32> = vk::make_api_version(0, 1, 3, 272)..vk::make_api_version(0, 1, 3, 297);

/// What the loader offers.
struct Offer {
    version: u32,
    /// The version of Vulkan that the validation layer is of; 0 without one.
    validation: u32,
    extensions: Vec<vk::ExtensionProperties>,
}

impl Offer {
    /// An error if the validation layer is `needed` and not there.
    fn of(entry: &ash::Entry, needs_validation: bool) -> Result<Self> {
        // SAFETY: plain query of the loader.
        let version = call("vkEnumerateInstanceVersion", NAME, || unsafe { entry.try_enumerate_instance_version() })?;
        // SAFETY: plain query of the loader.
        let layers = call("vkEnumerateInstanceLayerProperties", NAME, || unsafe {
            entry.enumerate_instance_layer_properties()
        })?;
        let validation = layers.iter().find(|layer| layer.layer_name_as_c_str() == Ok(VALIDATION_LAYER));
        if needs_validation && validation.is_none() {
            return Err(VulkanError::NoValidationLayer);
        }
        // SAFETY: plain query of the loader.
        let extensions = call("vkEnumerateInstanceExtensionProperties", NAME, || unsafe {
            entry.enumerate_instance_extension_properties(None)
        })?;
        let validation = validation.map_or(0, |layer| layer.spec_version);
        Ok(Self { version: version.unwrap_or(vk::API_VERSION_1_0), validation, extensions })
    }

    fn has(&self, wanted: &CStr) -> bool {
        self.extensions.iter().any(|extension| extension.extension_name_as_c_str() == Ok(wanted))
    }
}

/// Makes an instance with the extensions that are `wanted`, all of which there are, and the validation layer where somebody
/// listens to it.
fn create(
    entry: &ash::Entry,
    offer: &Offer,
    listener: Option<&Messages>,
    wanted: &[&CStr],
    debug_names: bool,
) -> Result<ash::Instance> {
    let layers: Vec<_> = listener.map(|_| VALIDATION_LAYER.as_ptr()).into_iter().collect();
    let mut extensions: Vec<_> = wanted.iter().map(|extension| extension.as_ptr()).collect();
    let mut flags = vk::InstanceCreateFlags::empty();
    if debug_names {
        extensions.push(ext::debug_utils::NAME.as_ptr());
    }
    // MoltenVK is a portability driver: invisible unless the application says that it can cope.
    if offer.has(khr::portability_enumeration::NAME) {
        extensions.push(khr::portability_enumeration::NAME.as_ptr());
        flags |= vk::InstanceCreateFlags::ENUMERATE_PORTABILITY_KHR;
    }
    let application = vk::ApplicationInfo::default()
        .application_name(c"threadlight")
        .engine_name(c"threadlight")
        .api_version(if offer.version >= vk::API_VERSION_1_3 { vk::API_VERSION_1_3 } else { vk::API_VERSION_1_2 });
    let mut messenger_info = listener.map(messenger_info);
    let enabled = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
    let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(&enabled);
    let mut info = vk::InstanceCreateInfo::default()
        .flags(flags)
        .application_info(&application)
        .enabled_layer_names(&layers)
        .enabled_extension_names(&extensions);
    let no = [vk::FALSE];
    let across_submissions = [vk::LayerSettingEXT {
        ty: vk::LayerSettingTypeEXT::BOOL32,
        value_count: 1,
        p_values: no.as_ptr().cast(),
        ..vk::LayerSettingEXT::default().layer_name(VALIDATION_LAYER).setting_name(c"sync_queue_submit")
    }];
    let mut settings = vk::LayerSettingsCreateInfoEXT::default().settings(&across_submissions);
    if let Some(messenger_info) = &mut messenger_info {
        info = info.push_next(&mut features).push_next(messenger_info);
        if WITHOUT_TIMELINES.contains(&offer.validation) {
            info = info.push_next(&mut settings);
        }
    }
    // SAFETY: `info` and all it points to outlive the call; whoever listens does so for as long as there is the instance.
    call("vkCreateInstance", NAME, || unsafe { entry.create_instance(&info, None) }).map_err(|error| match error {
        VulkanError::Call { result: vk::Result::ERROR_INCOMPATIBLE_DRIVER, .. } => VulkanError::NoDriver,
        other => other,
    })
}

/// Validation and performance warnings and errors, sent to `messages`.
fn messenger_info(messages: &Messages) -> vk::DebugUtilsMessengerCreateInfoEXT<'static> {
    use vk::{DebugUtilsMessageSeverityFlagsEXT as Severity, DebugUtilsMessageTypeFlagsEXT as Type};
    vk::DebugUtilsMessengerCreateInfoEXT::default()
        .message_severity(Severity::WARNING | Severity::ERROR)
        .message_type(Type::VALIDATION | Type::PERFORMANCE)
        .pfn_user_callback(Some(on_message))
        .user_data(std::ptr::from_ref(messages).cast_mut().cast())
}

/// Called by the validation layer, possibly from any thread.
unsafe extern "system" fn on_message(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _kind: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user_data: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the layer passes a valid structure for the time of the call, and the user data given at creation,
    // which is the `Messages` that the instance keeps alive.
    let (text, messages) = unsafe {
        let text = (*data).message_as_c_str().map(|text| text.to_string_lossy().into_owned());
        (text.unwrap_or_default(), &*user_data.cast::<Messages>())
    };
    tracing::error!("validation: {text}");
    messages.push(text);
    vk::FALSE
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn instances_can_be_made_again_and_again() {
        for made in 0..100 {
            let instance = Instance::new(made % 10 == 9).unwrap_or_else(|error| panic!("instance {made}: {error}"));
            // SAFETY: plain query of an instance.
            let devices = unsafe { instance.raw.enumerate_physical_devices() };
            assert!(devices.is_ok_and(|devices| !devices.is_empty()), "instance {made}");
        }
    }
}
