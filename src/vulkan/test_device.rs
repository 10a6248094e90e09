//! The device that tests run on, for tests: which one it is and how it is opened is said here alone.
use super::{Device, Instance, Messages, VulkanError};
use std::sync::Arc;

/// The name or index that THREADLIGHT_TEST_DEVICE has; without one tests run on the best device.
pub(crate) fn name() -> Option<String> {
    std::env::var("THREADLIGHT_TEST_DEVICE").ok()
}

/// Opens it without validation, which is slow and says nothing new where another test does the same with it.
pub(crate) fn open() -> Arc<Device> {
    let instance = Instance::new(false).expect("an instance");
    Device::new(&instance, name().as_deref()).expect("a device")
}

/// Opens it with validation, which is to have said nothing when the device is gone.
pub(crate) fn open_validated() -> (Arc<Device>, Messages) {
    let mut messages = Messages::default();
    let device = try_open_validated(&mut messages).expect("a device");
    (device, messages)
}

/// The same where calls fail on purpose: what is said before there is a device, or none, counts too.
pub(super) fn try_open_validated(messages: &mut Messages) -> Result<Arc<Device>, VulkanError> {
    let instance = Instance::new(true)?;
    *messages = instance.messages();
    Device::new(&instance, name().as_deref())
}
