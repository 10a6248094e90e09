//! What the tests of graphs without a device have in common.
use ash::vk;
use threadlight::low_level::graph::*;

/// Memory as a plain device would ask for it: images in multiples of 64 KiB, buffers of 256 bytes.
pub fn memory(info: &ResourceInfo) -> MemoryRequirement {
    let (bytes, alignment) = match info.kind {
        ResourceKind::Buffer(desc) => (desc.size_bytes, 256),
        ResourceKind::Image(desc) => {
            let texel_bytes = match desc.format {
                vk::Format::R32G32B32A32_SFLOAT => 16,
                vk::Format::R32G32_UINT => 8,
                _ => 4,
            };
            (u64::from(desc.width) * u64::from(desc.height) * texel_bytes, 65536)
        }
    };
    MemoryRequirement { size_bytes: bytes.next_multiple_of(alignment), alignment, memory_type_bits: 0b11 }
}

pub fn compile(graph: Graph<()>) -> Result<Plan<()>, GraphError> {
    graph.compile(&mut memory)
}

pub const SMALL: BufferDesc = BufferDesc { size_bytes: 256 };
pub const COLOR: ImageDesc = ImageDesc { format: vk::Format::R8G8B8A8_UNORM, width: 64, height: 64 };
pub const DEPTH: ImageDesc = ImageDesc { format: vk::Format::D32_SFLOAT, ..COLOR };

/// A pass that writes `handle` and nothing else.
pub fn write<H: Versioned>(graph: &mut Graph<()>, name: &str, handle: H, access: Access) -> H {
    let mut pass = graph.pass(name);
    let written = pass.write(handle, access);
    pass.record(());
    written
}

/// A pass that reads `handles` and writes an output of its own.
pub fn read(graph: &mut Graph<()>, name: &str, handles: &[(Handle, Access)]) {
    let result = graph.import_buffer(&format!("{name}_result"), SMALL, Some(Access::HostRead), None);
    let mut pass = graph.pass(name);
    for (handle, access) in handles {
        pass.read(*handle, *access);
    }
    let result = pass.write(result, Access::StorageWriteCompute);
    pass.record(());
    graph.output(result);
}
