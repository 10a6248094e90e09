//! The plan as text: what runs, what waits for what, what does not run, and where everything lies.
use super::access::{Access, Mode};
use super::plan::{Barrier, Plan, PlannedResource, PlannedUse};
use super::resource::ResourceKind;
use ash::vk::{AccessFlags2, ImageLayout, PipelineStageFlags2};
use std::fmt::{Display, Formatter, Result};

impl<W> Display for Plan<W> {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let barriers = || self.passes.iter().flat_map(|pass| &pass.barriers).chain(&self.final_barriers);
        let changes = barriers().filter(|barrier| barrier.old_layout != barrier.new_layout).count();
        let (passes, culled) = (count(self.passes.len(), "pass", "passes"), self.culled.len());
        let waits = count(barriers().count(), "barrier", "barriers");
        writeln!(f, "frame: {passes}, {culled} culled; {waits}, {changes} of them with a change of layout")?;
        let width = self.resources.iter().map(|resource| resource.info.name.len()).max().unwrap_or(0);
        for (position, pass) in self.passes.iter().enumerate() {
            writeln!(f, "\n{position:>3}  {}", pass.name)?;
            pass.barriers.iter().try_for_each(|barrier| self.barrier(f, barrier, width))?;
            pass.uses.iter().try_for_each(|use_| self.use_(f, use_, width))?;
        }
        if !self.final_barriers.is_empty() {
            writeln!(f, "\nend  left for the owners")?;
            self.final_barriers.iter().try_for_each(|barrier| self.barrier(f, barrier, width))?;
        }
        if !self.culled.is_empty() {
            writeln!(f, "\nculled")?;
            let width = self.culled.iter().map(|(pass, _)| pass.len()).max().unwrap_or(0);
            self.culled.iter().try_for_each(|(pass, reason)| writeln!(f, "     {pass:width$}  {reason}"))?;
        }
        self.memory(f, width)
    }
}

impl<W> Plan<W> {
    fn barrier(&self, f: &mut Formatter<'_>, barrier: &Barrier, width: usize) -> Result {
        let name = |resource: usize| self.resources[resource].info.name.as_str();
        let (src, dst) = (scope(barrier.src_stage, barrier.src_access), scope(barrier.dst_stage, barrier.dst_access));
        write!(f, "     wait    {:width$}  {src} -> {dst}", name(barrier.resource))?;
        if barrier.old_layout != barrier.new_layout {
            write!(f, ", {} => {}", layout(barrier.old_layout), layout(barrier.new_layout))?;
        }
        if !barrier.takes_over.is_empty() {
            let others = barrier.takes_over.iter().filter(|&&other| other != barrier.resource);
            let others: String = others.map(|&other| format!("{}, ", name(other))).collect();
            write!(f, "  (memory of {others}the frame before)")?;
        }
        writeln!(f)
    }

    fn use_(&self, f: &mut Formatter<'_>, use_: &PlannedUse, width: usize) -> Result {
        let mode = match use_.mode {
            Mode::Read => "read",
            Mode::Write => "write",
            Mode::Modify => "modify",
        };
        let unread = if use_.mode == Mode::Read || use_.kept { "" } else { ", not kept" };
        let name = &self.resources[use_.resource].info.name;
        writeln!(f, "     {mode:6}  {name:width$}  {}{unread}", access(use_.access))
    }

    fn memory(&self, f: &mut Formatter<'_>, width: usize) -> Result {
        let whats: Vec<String> = self.resources.iter().map(|resource| what(&resource.info.kind)).collect();
        let what_width = whats.iter().map(String::len).max().unwrap_or(0);
        writeln!(f, "\nmemory")?;
        for (resource, what) in self.resources.iter().zip(whats) {
            let PlannedResource { info, lifetime, placement, .. } = resource;
            let alive = |pass: usize| if (lifetime.first..=lifetime.last).contains(&pass) { '#' } else { '.' };
            let chart: String = (0..self.passes.len()).map(alive).collect();
            let owned = if resource.kept { "kept" } else { "imported" };
            let place = placement.map_or(format!("{owned:>10}"), |at| {
                format!("{:>10}  block {} + {}", bytes(at.size_bytes), at.block, bytes(at.offset_bytes))
            });
            writeln!(f, "     {:width$}  {what:what_width$}  {chart}  {place}", info.name)?;
        }
        for (index, block) in self.blocks.iter().enumerate() {
            writeln!(f, "     block {index}: {}", bytes(block.size_bytes))?;
        }
        let (aliased, unaliased) = (self.aliased_bytes(), self.unaliased_bytes());
        let saved_percent = 100.0 * (1.0 - aliased as f64 / unaliased.max(1) as f64);
        let saving = if aliased < unaliased { format!(", {saved_percent:.0} % saved") } else { String::new() };
        writeln!(f, "     {} with aliasing, {} without{saving}", bytes(aliased), bytes(unaliased))
    }
}

fn count(number: usize, one: &str, many: &str) -> String {
    format!("{number} {}", if number == 1 { one } else { many })
}

fn what(kind: &ResourceKind) -> String {
    match kind {
        ResourceKind::Image(desc) => format!("{}x{} {:?}", desc.width, desc.height, desc.format),
        ResourceKind::Buffer(desc) => format!("buffer of {}", bytes(desc.size_bytes)),
    }
}

/// Three significant digits and a binary unit.
fn bytes(bytes: u64) -> String {
    let (mut value, mut unit) = (bytes as f64, "B");
    for larger in ["KiB", "MiB", "GiB", "TiB"] {
        if value >= 1024.0 {
            (value, unit) = (value / 1024.0, larger);
        }
    }
    let decimals = if unit == "B" || value >= 100.0 { 0 } else { 1 + usize::from(value < 10.0) };
    format!("{value:.decimals$} {unit}")
}

fn access(access: Access) -> &'static str {
    match access {
        Access::ColorAttachment => "color attachment",
        Access::DepthAttachment => "depth attachment",
        Access::UniformCompute => "uniform, compute",
        Access::SampledCompute => "sampled, compute",
        Access::StorageReadCompute | Access::StorageWriteCompute => "storage, compute",
        Access::Indirect => "indirect arguments",
        Access::TransferRead | Access::TransferWrite => "transfer",
        Access::HostRead => "host",
        Access::Present => "present",
    }
}

fn layout(layout: ImageLayout) -> &'static str {
    match layout {
        ImageLayout::UNDEFINED => "undefined",
        ImageLayout::GENERAL => "general",
        ImageLayout::COLOR_ATTACHMENT_OPTIMAL => "color",
        ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL => "depth",
        ImageLayout::SHADER_READ_ONLY_OPTIMAL => "sampled",
        ImageLayout::TRANSFER_SRC_OPTIMAL => "transfer source",
        ImageLayout::TRANSFER_DST_OPTIMAL => "transfer destination",
        ImageLayout::PRESENT_SRC_KHR => "present",
        _ => "other",
    }
}

/// `stages(accesses)`: just `stages` where only execution counts.
fn scope(stages: PipelineStageFlags2, accesses: AccessFlags2) -> String {
    use {AccessFlags2 as A, PipelineStageFlags2 as S};
    let stage_words = [
        (S::DRAW_INDIRECT, "indirect"),
        (S::EARLY_FRAGMENT_TESTS, "depth test"),
        (S::COLOR_ATTACHMENT_OUTPUT, "color output"),
        (S::COMPUTE_SHADER, "compute"),
        (S::ALL_TRANSFER, "transfer"),
        (S::HOST, "host"),
        (S::ALL_COMMANDS, "everything"),
    ];
    let access_words = [
        (A::INDIRECT_COMMAND_READ, "read arguments"),
        (A::UNIFORM_READ, "read uniform"),
        (A::SHADER_SAMPLED_READ, "sample"),
        (A::SHADER_STORAGE_READ, "read"),
        (A::COLOR_ATTACHMENT_READ, "read"),
        (A::DEPTH_STENCIL_ATTACHMENT_READ, "read"),
        (A::TRANSFER_READ, "read"),
        (A::HOST_READ, "read"),
        (A::SHADER_STORAGE_WRITE, "write"),
        (A::COLOR_ATTACHMENT_WRITE, "write"),
        (A::DEPTH_STENCIL_ATTACHMENT_WRITE, "write"),
        (A::TRANSFER_WRITE, "write"),
        (A::MEMORY_WRITE, "write"),
    ];
    let stages: Vec<_> = stage_words.iter().filter(|(bit, _)| stages.contains(*bit)).map(|(_, word)| *word).collect();
    let mut accesses: Vec<_> =
        access_words.iter().filter(|(bit, _)| accesses.contains(*bit)).map(|(_, word)| *word).collect();
    let mut seen = std::collections::HashSet::new();
    accesses.retain(|word| seen.insert(*word));
    match accesses.as_slice() {
        [] => stages.join("|"),
        _ => format!("{}({})", stages.join("|"), accesses.join(", ")),
    }
}
