//! `threadlight devices`: the Vulkan devices of this machine, and whether they can be trusted.
use std::sync::Arc;
use threadlight::low_level::memo::Memo;
use threadlight::low_level::passes::WayAround;
use threadlight::low_level::steps::CheckDevice;
use threadlight::low_level::vulkan::{Device, DeviceDescription, Instance, describe_devices};
use threadlight::{Error, Result};

/// Lists the Vulkan devices that --device can name.
///
/// Each is checked once: whether it looks up textures, unpacks numbers and counts as Vulkan promises.
#[derive(clap::Args)]
pub struct Devices {}

impl Devices {
    pub fn run(self) -> anyhow::Result<()> {
        let instance = Instance::new(false).map_err(Error::from)?;
        let memo = super::memo(false);
        for device in describe_devices(&instance).map_err(Error::from)? {
            let verdict = match way_around(&instance, &device, &memo) {
                _ if !device.lacks.is_empty() => format!("; cannot be used, lacks {}", device.lacks.join(" and ")),
                Ok(None) => String::new(),
                Ok(Some(way_around)) => format!("; used by {}", way_around.name()),
                Err(error) => format!("; cannot be used: {error}"),
            };
            let kind = format!("{:?}", device.kind).to_lowercase();
            let (index, name, driver, version) = (device.index, device.name, device.driver, device.api_version);
            super::print(format_args!("{index}  {name}  ({kind}, Vulkan {version}, {driver}{verdict})\n"))?;
        }
        Ok(())
    }
}

/// How `device` is used; an error if it cannot be.
fn way_around(instance: &Arc<Instance>, device: &DeviceDescription, memo: &Memo) -> Result<Option<WayAround>> {
    let device = Device::new(instance, Some(&device.index.to_string()))?;
    memo.round(&()).ask(&CheckDevice(&device))?.way_around(&device)
}
