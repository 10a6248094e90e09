//! The device that tests run on, with validation or without.
use super::{folder_of_run, memo_of_run};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use tempfile::TempDir;
use threadlight::low_level::memo::{Memo, Round};
use threadlight::low_level::pipeline::{DeviceScene, Wanted};
use threadlight::low_level::prepare::Prepared;
use threadlight::low_level::rendering::Rendering;
use threadlight::low_level::vulkan::{Device, DeviceKind, Instance, Messages};

/// The name or index that THREADLIGHT_TEST_DEVICE has; without one tests run on the best device.
pub fn device_name() -> Option<String> {
    std::env::var("THREADLIGHT_TEST_DEVICE").ok()
}

/// That device without validation, for tests of other things than Vulkan.
pub fn bare_device() -> Arc<Device> {
    let instance = Instance::new(false).expect("an instance");
    Device::new(&instance, device_name().as_deref()).expect("a device")
}

/// A device with validation on; `finish` fails the test if validation said anything, from first call to last.
pub struct Validated {
    pub device: Arc<Device>,
    /// [`memo_of_run`], if no other takes its place.
    pub memo: Memo,
    /// What the twin's memo keeps, where it shares nothing with other tests.
    of_twin: TempDir,
    /// Holds what the next renderer may have in common with it.
    last: Mutex<Option<DeviceScene>>,
    messages: Messages,
}

impl Validated {
    /// The device of tests: see [`device_name`].
    pub fn new() -> Self {
        Self::on(device_name().as_deref())
    }

    /// The same, with a memo of its own in memory: for tests of what is made, and when.
    pub fn with_own_memo() -> Self {
        Self { memo: Memo::default(), ..Self::new() }
    }

    /// The device of this name or index.
    pub fn on(wanted: Option<&str>) -> Self {
        let instance = Instance::new(true).expect("an instance with validation");
        let device = Device::new(&instance, wanted).expect("a device");
        let of_twin = tempfile::tempdir().expect("a folder");
        Self { device, memo: memo_of_run(), of_twin, last: Mutex::default(), messages: instance.messages() }
    }

    /// Whether exp, log, sin and the like are good to the last bits, as on the CPU. Vulkan promises less ("Precision and Operation of
    /// SPIR-V Instructions"), and what evaluates BRDFs of narrow lobes multiplies that.
    pub fn has_exact_functions(&self) -> bool {
        self.device.description().driver.starts_with("llvmpipe")
    }

    /// Whether lookups weight texels by floats, as on the CPU. Vulkan promises as many bits as `subTexelPrecisionBits` and
    /// `mipmapPrecisionBits` say; GPUs have 8.
    pub fn has_exact_lookups(&self) -> bool {
        self.device.description().kind == DeviceKind::Cpu
    }

    /// For the CPU twin. A GPU blurs maps itself, so there the twin has a folder of its own: what the CPU blurs is compared with what the device
    /// does.
    pub fn memo_of_twin(&self) -> Memo {
        let of_run = folder_of_run().filter(|_| self.device.description().kind == DeviceKind::Cpu);
        Memo::new(Some(of_run.as_deref().unwrap_or(self.of_twin.path())))
    }

    pub fn render(&self, prepared: &Prepared, wanted: Wanted) -> Rendering {
        self.renderer(prepared).render(wanted, 1).expect("a rendering")
    }

    pub fn renderer(&self, prepared: &Prepared) -> DeviceScene {
        let renderer = DeviceScene::new(&self.device, prepared, &self.round()).expect("a renderer");
        *self.last.lock().expect("no test panics here") = Some(renderer.clone());
        renderer
    }

    pub fn round(&self) -> Round<'_> {
        self.memo.round(&())
    }

    pub fn finish(self) {
        let Self { device, messages, memo, last, .. } = self;
        drop((last, memo));
        // Background work that a closed viewer has left behind ends by itself.
        let left = Instant::now() + Duration::from_secs(20);
        while Arc::strong_count(&device) > 1 && Instant::now() < left {
            std::thread::sleep(Duration::from_millis(10));
        }
        assert_eq!(Arc::strong_count(&device), 1, "something still holds the device");
        drop(device);
        assert_eq!(messages.all(), Vec::<String>::new());
    }
}
