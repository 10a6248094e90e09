//! `threadlight devices`: the Vulkan devices of this machine.
use std::io::Write;
use threadlight::Error;
use threadlight::low_level::vulkan::{Instance, describe_devices};

/// Lists the Vulkan devices that --device can name.
#[derive(clap::Args)]
pub struct Devices {}

impl Devices {
    pub fn run(self) -> anyhow::Result<()> {
        let instance = Instance::new(false).map_err(Error::from)?;
        let mut out = std::io::stdout().lock();
        for device in describe_devices(&instance).map_err(Error::from)? {
            let verdict = match device.lacks.as_slice() {
                [] => String::new(),
                lacks => format!("; cannot be used, lacks {}", lacks.join(" and ")),
            };
            let kind = format!("{:?}", device.kind).to_lowercase();
            let (index, name, driver, version) = (device.index, device.name, device.driver, device.api_version);
            writeln!(out, "{index}  {name}  ({kind}, Vulkan {version}, {driver}{verdict})")?;
        }
        Ok(())
    }
}
