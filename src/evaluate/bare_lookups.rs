//! The floor of shading, timed.
use std::sync::Arc;

use crate::error::Result;
use crate::graph::{Executable, FrameGraph};
use crate::passes::{BareLookups, Readbacks, bare_lookups, texels};
use crate::vulkan::{Device, Frames, PassTime};

/// Milliseconds on the GPU that `bare` takes, and the sums of its lookups, rgb.
///
/// # Errors
/// Whatever Vulkan refuses.
pub fn time_bare_lookups(device: &Arc<Device>, bare: &BareLookups) -> Result<(f64, Vec<[f32; 4]>)> {
    let mut graph = FrameGraph::new();
    let sums = bare_lookups(&mut graph, bare);
    let mut readbacks = Readbacks::new(device, graph);
    let target = readbacks.buffer("sums", sums, bare.sums_bytes())?;
    let Readbacks { graph, imports, .. } = readbacks;
    let executable = Executable::new(device, graph, &imports)?;
    let mut frames = Frames::new(device, "bare lookups", 1)?;
    let passes = executable.execute_timed(device, &mut frames, &())?;
    Ok((PassTime::ms_but_readbacks(&passes), texels(Some(&target))))
}
