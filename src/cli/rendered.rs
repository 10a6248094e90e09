//! What a rendering leaves, and how it is written: as a picture, and as `--stats`, times, counts and memory.
use std::path::Path;
use threadlight::Result;
use threadlight::low_level::evaluate::reference::ReferenceImage;
use threadlight::low_level::memo::{Asked, Origin};
use threadlight::low_level::passes::WayAround;
use threadlight::low_level::prepare::Prepared;
use threadlight::low_level::rendering::Rendering;
use threadlight::low_level::vulkan::PassTime;

/// All that a rendering leaves.
pub struct Rendered {
    pub prepared: Prepared,
    pub rendering: Rendering,
    /// Only for method `reference`.
    pub reference: Option<ReferenceStats>,
    /// Only with `--error`.
    pub expected_rms: Option<f64>,
    /// How each material's threads were come by.
    pub threads: Vec<Asked>,
    pub device: String,
}

impl Rendered {
    /// Writes the picture.
    pub fn write(&self, path: &Path) -> Result<()> {
        let Self { prepared, rendering, .. } = self;
        let mut header = rendering.exr_header(prepared, &self.device);
        if let Some(reference) = &self.reference {
            header.more.extend(reference.header());
        }
        header.more.extend(self.expected_rms.map(|rms| ("expected_rms".to_owned(), rms.to_string())));
        rendering.write(path, &prepared.scene.image, &header)
    }
}

/// What `--stats` writes.
#[derive(serde::Serialize)]
pub struct Stats<'a> {
    version: &'a str,
    device: &'a str,
    /// How a fault of the device was got around.
    #[serde(skip_serializing_if = "Option::is_none")]
    way_around: Option<&'static str>,
    method: &'a str,
    /// Or samples: as many as were asked for, of which anisotropic materials may have fewer. Not for method `reference`.
    #[serde(skip_serializing_if = "Option::is_none")]
    threads: Option<u32>,
    subpixels: u32,
    width: u32,
    height: u32,
    /// Sub-pixels that see a surface.
    covered_subpixels: u32,
    /// Pixels that share one sum over the threads among their sub-pixels.
    interior_pixels: u32,
    /// Pixels in which each covered sub-pixel is a sum of its own.
    edge_pixels: u32,
    /// Lookups in the environment that shading made.
    lookups: u64,
    passes: &'a [PassTime],
    frame_ms: f64,
    #[serde(flatten)]
    thread_stats: Option<ThreadStats>,
    device_memory_bytes: u64,
    validation_messages: usize,
    /// Only with `--error`.
    #[serde(skip_serializing_if = "Option::is_none")]
    expected_rms: Option<f64>,
    /// Only for method `reference`.
    #[serde(flatten)]
    reference: Option<&'a ReferenceStats>,
}

/// How threads were come by; not for method `reference`.
#[derive(serde::Serialize)]
struct ThreadStats {
    thread_generation_ms: f64,
    thread_cache: &'static str,
}

/// What is known of the error of a reference.
#[derive(serde::Serialize)]
pub struct ReferenceStats {
    tolerance: f64,
    /// RMS over covered pixels of the estimated error of display values.
    error_estimate: f64,
    /// The largest of a pixel.
    max_error_estimate: f64,
    reference_cache: &'static str,
}

impl<'a> Stats<'a> {
    pub fn new(rendered: &'a Rendered, validation_messages: usize) -> Self {
        let Rendered { prepared, rendering, reference, expected_rms, threads, device } = rendered;
        let counters = &rendering.counters;
        Self {
            version: env!("CARGO_PKG_VERSION"),
            device,
            way_around: rendering.way_around.map(WayAround::name),
            method: prepared.method.name(),
            threads: reference.is_none().then_some(prepared.sampling.count),
            subpixels: prepared.view.subpixels,
            width: prepared.view.width,
            height: prepared.view.height,
            covered_subpixels: counters.covered_subpixels,
            interior_pixels: counters.interior_pixels,
            edge_pixels: counters.edge_pixels,
            lookups: rendering.lookups,
            passes: &rendering.passes,
            frame_ms: rendering.frame_ms,
            thread_stats: reference.is_none().then(|| ThreadStats::new(threads)),
            device_memory_bytes: rendering.device_memory_bytes,
            validation_messages,
            expected_rms: *expected_rms,
            reference: reference.as_ref(),
        }
    }
}

impl ThreadStats {
    fn new(threads: &[Asked]) -> Self {
        Self {
            thread_generation_ms: 1e3 * threads.iter().map(|asked| asked.time.as_secs_f64()).sum::<f64>(),
            thread_cache: if threads.iter().all(|asked| asked.origin != Origin::Made) { "hit" } else { "miss" },
        }
    }
}

impl ReferenceStats {
    pub fn new(tolerance: f64, image: &ReferenceImage) -> Self {
        Self {
            tolerance,
            error_estimate: image.error_estimate,
            max_error_estimate: image.max_error_estimate,
            reference_cache: if image.cached { "hit" } else { "miss" },
        }
    }

    /// What the header of an EXR file says of it.
    pub fn header(&self) -> [(String, String); 2] {
        let number = |name: &str, value: f64| (name.to_owned(), value.to_string());
        [number("tolerance", self.tolerance), number("error_estimate", self.error_estimate)]
    }
}
