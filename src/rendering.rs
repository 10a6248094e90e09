//! What a rendering leaves, and how a picture of it is written.
use crate::Result;
use crate::passes::{Counters, SHADE_PASS, WayAround};
use crate::picture::{self, ExrHeader, Format};
use crate::prepare::Prepared;
use crate::scene::ImageSettings;
use crate::vulkan::PassTime;
use std::path::Path;

/// Results of a rendering, as far as they were wanted.
#[derive(Clone, Debug, Default)]
pub struct Rendering {
    /// RGBA, linear radiance times coverage, row by row from the top left.
    pub radiance: Vec<[f32; 4]>,
    /// RGBA, 8 bits each; colour not multiplied by alpha.
    pub display: Vec<u8>,
    /// Texels of the geometry cache, row by row at sub-pixel resolution.
    pub geometry: Vec<[u32; 2]>,
    /// What the classification counted.
    pub counters: Counters,
    /// Lookups in the environment that shading made.
    pub lookups: u64,
    /// Time on the GPU by pass, median over the repetitions; where the device cannot tell, from submission until it is done.
    pub passes: Vec<PassTime>,
    /// From the start of recording until the GPU is done, in milliseconds: median over the repetitions.
    pub frame_ms: f64,
    /// Device memory in use while rendering.
    pub device_memory_bytes: u64,
    /// The plan of the frame as text.
    pub plan: String,
    /// How a fault of the device was got around, if it has one.
    pub way_around: Option<WayAround>,
}

impl Rendering {
    /// What an EXR file of it, rendered from `prepared` on the device of this name, says of how it was made.
    pub fn exr_header(&self, prepared: &Prepared, device: &str) -> ExrHeader {
        let materials: Vec<_> = prepared.materials.iter().map(|material| material.name.as_str()).collect();
        ExrHeader {
            method: prepared.variant().name(),
            threads: prepared.sampling.count,
            material: materials.join(", "),
            environment: prepared.environment.name.clone(),
            device: self.way_around.map_or(device.to_owned(), |way| format!("{device}, by {}", way.name())),
            seconds: self.frame_ms * 1e-3,
            ..ExrHeader::default()
        }
    }

    /// Writes the picture that `image` says, in the format that its name at `path` asks for: display values to a `.png`, linear radiance to an
    /// `.exr` with this header.
    ///
    /// # Errors
    /// Another extension, or a place that cannot be written to.
    pub fn write(&self, path: &Path, image: &ImageSettings, header: &ExrHeader) -> Result<()> {
        let &ImageSettings { width, height, gamma, .. } = image;
        match Format::of(path)? {
            Format::Png => picture::write_png_of_gamma(path, width, height, &self.display, image.has_alpha(), gamma),
            Format::Exr => picture::write_exr(path, width, height, &self.radiance, image.has_alpha(), header),
        }
    }

    /// Time on the GPU of all passes but those that copy results back, in milliseconds.
    pub fn gpu_ms(&self) -> f64 {
        PassTime::ms_but_readbacks(&self.passes)
    }

    /// Time on the GPU of pass 2 alone, in milliseconds.
    pub fn shade_ms(&self) -> f64 {
        self.pass_ms(SHADE_PASS)
    }

    /// Time on the GPU of the pass of this name, in milliseconds; 0 if there is none.
    pub fn pass_ms(&self, name: &str) -> f64 {
        PassTime::ms_of(&self.passes, name)
    }
}
