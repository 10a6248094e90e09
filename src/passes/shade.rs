//! Pass 2 of the paper (section 4.2): the radiance of every listed pixel, by its partition of the sample threads.
use super::{CameraRays, Counters, DeviceIrradiance, DeviceLight, DeviceMaterials, Tiles, View};
use crate::graph::{BufferDesc, BufferHandle, FrameGraph, ImageDesc, ImageHandle};
use crate::memo::Keyed;
use crate::method::{Method, Sampling};
use crate::shader_constants::ris::CANDIDATES;
use crate::vulkan::{ComputePipeline, DeviceKind, Shader, compiled};
use crate::{Error, Result};
use ash::vk;
use bytemuck::{Pod, Zeroable};

/// Name of the pass.
pub const SHADE_PASS: &str = "shade";

/// The variant of shade.comp that runs `method`.
///
/// # Errors
/// The reference runs on the CPU.
///
/// # Panics
/// A method in the table has no file in `glsl/methods/`.
pub fn shade_shader(method: Method) -> Result<&'static Shader> {
    if method == Method::Reference {
        return Err(Error::input("method \"reference\"", "does not run on the GPU", "use another here"));
    }
    let variant = |shader: &&Shader| shader.name().strip_prefix("shade_") == Some(method.name());
    Ok(compiled::ALL.iter().find(variant).expect("a test looks for the shader of every method"))
}

/// What the pass is made of.
#[derive(Clone)]
pub struct Shade {
    /// The method's shader, for each class of pixels: [`Counters::arguments_of`].
    pub pipelines: Vec<Keyed<ComputePipeline>>,
    /// What objects are made of.
    pub materials: Keyed<DeviceMaterials>,
    /// What lights them.
    pub light: Keyed<DeviceLight>,
    /// What of the light the bases of fitted threads look up.
    pub irradiance: Option<Keyed<DeviceIrradiance>>,
    /// How many threads or samples, and which random numbers.
    pub sampling: Sampling,
    /// The method of the shader.
    pub method: Method,
    /// How many samples of `mis` a submission on the device may have.
    pub most_samples: u64,
}

/// Samples of `mis` in a submission: half a second for a GPU of 1 Tflop/s, by what an H200 of 60 takes. Systems end what runs for longer than
/// 2 s (Windows) or 10 s (Linux), and the device is lost with it. GPUs that share the CPU's memory may be a quarter as fast.
pub(crate) fn most_samples(kind: DeviceKind) -> u64 {
    if kind == DeviceKind::Integrated { 1 << 23 } else { 1 << 25 }
}

/// Lamps by the BRDF are the work of so many samples in each of 2 x 2 sub-pixels: alumina-oxide takes 4 ms for them on that GPU, where 1.4 million
/// pixels see a dragon, as 20 samples of each of these pixels would. A quarter of it counts, as of all that sub-pixels have of their own.
const SAMPLES_OF_LAMPS: u64 = 5;

impl Shade {
    /// In how many portions a picture is shaded, so that no submission takes too long. Fitted threads are a sixteenth of the work of a sample or
    /// less, those of the paper a seventh (512 take 3.7 ms on that GPU, 512 samples 26 ms), and each two candidates of `ris` are a sample. At edges
    /// each sub-pixel has all samples and all lamps: where all pixels are edges, 2 x 2 of them take as long as may be, and more count as more.
    pub(crate) fn portion_count(&self, view: &View) -> u32 {
        let pixels = u64::from(view.width) * u64::from(view.height);
        let samples = u64::from(self.sampling.count);
        let times_edges = (u64::from(view.subpixels).pow(2) / 4).max(1);
        let of_lamps = if self.light.has_lamps() { SAMPLES_OF_LAMPS } else { 0 };
        let work = match self.method {
            Method::Ris => u64::from(CANDIDATES / 2) * samples * times_edges * pixels,
            Method::Paper => samples * times_edges * pixels / 7,
            method if method.threads().is_some() => (samples + 16 * of_lamps) * times_edges * pixels / 16,
            _ => samples * times_edges * pixels,
        };
        work.div_ceil(self.most_samples).max(1) as u32
    }
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Push {
    camera: CameraRays,
    size_px: [u32; 2],
    portion: [u32; 2],
    pixel_class: u32,
    face_size: f32,
    rotation: [f32; 2],
    radiance_scale: f32,
    sample_count: u32,
    seed: [u32; 2],
    finest_level: f32,
    intensity: f32,
}

impl Push {
    fn new(view: &View, sampling: &Sampling, light: &DeviceLight, pixel_class: u32, portion: [u32; 2]) -> Self {
        Self {
            camera: view.camera_rays(),
            size_px: [view.width, view.height],
            portion,
            pixel_class,
            face_size: light.face_size(),
            rotation: view.rotation(),
            radiance_scale: light.radiance_scale(),
            sample_count: sampling.count,
            seed: [sampling.seed as u32, (sampling.seed >> 32) as u32],
            finest_level: light.finest_level,
            intensity: view.intensity as f32,
        }
    }
}

/// What shading leaves.
#[derive(Clone, Copy)]
pub struct Shaded {
    /// Linear radiance times coverage, and coverage.
    pub radiance: ImageHandle,
    /// Number of lookups in the environment that were made: a u64.
    pub lookups: BufferHandle,
}

/// Shades the pixels that `tiles` lists, by the shader of each: interior ones with one sum shared by all sub-pixels, then those at edges. Others may
/// hold anything: see [`background`](super::background()).
pub fn shade<'a>(
    graph: &mut FrameGraph<'a>,
    shade: &'a Shade,
    geometry: ImageHandle,
    tiles: &Tiles,
    view: &View,
) -> Shaded {
    let Tiles { counters, parts, pixels, .. } = *tiles;
    let Shade { pipelines, materials, light, irradiance, sampling, .. } = shade;
    let format = vk::Format::R32G32B32A32_SFLOAT;
    let mut radiance = graph.kept_image("radiance", ImageDesc { format, width: view.width, height: view.height });
    let mut lookups = graph.buffer("lookups", BufferDesc { size_bytes: size_of::<u64>() as u64 });
    graph.clear_buffer("clear_lookups", &mut lookups);
    let portion_count = shade.portion_count(view);
    for portion in 0..portion_count {
        let dispatch = |pixel_class: usize| {
            let push = Push::new(view, sampling, light, pixel_class as u32, [portion, portion_count]);
            (&*pipelines[pixel_class], Counters::arguments_of(pixel_class), push)
        };
        let pass = match portion {
            0 => graph.compute(SHADE_PASS, &pipelines[0]),
            _ => {
                let name = format!("{SHADE_PASS}, portion {}", portion + 1);
                graph.compute(&name, &pipelines[0]).portion_of(SHADE_PASS)
            }
        };
        let pass = pass
            .read("geometry", geometry)
            .read("counters", counters)
            .read("part_list", parts)
            .read("pixel_list", pixels);
        let pass = match portion {
            0 => pass.write("radiance", &mut radiance),
            _ => pass.modify("radiance", &mut radiance),
        };
        pass.modify("all_lookups", &mut lookups)
            .bind_all(materials.bindings())
            .bind_all(light.bindings())
            .bind_all(irradiance.iter().map(|irradiance| irradiance.binding()))
            .indirect(counters, (0..pipelines.len()).map(dispatch));
    }
    Shaded { radiance, lookups }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::method::Lookups;

    #[test]
    fn every_method_has_a_shader_and_every_shader_a_method() {
        let variants = compiled::ALL.iter().filter_map(|shader| shader.name().strip_prefix("shade_"));
        for name in variants {
            assert!(Method::from_name(name).is_ok_and(|method| method.name() == name), "{name} is not in the table");
        }
        for method in Method::on_gpu() {
            assert_eq!(shade_shader(method).unwrap().name(), format!("shade_{}", method.name()));
        }
        assert!(shade_shader(Method::Reference).is_err());
    }

    #[test]
    fn methods_have_a_pattern_where_their_shaders_declare_one() {
        let declares = |shader: &Shader| shader.declares("FIXED_PATTERN").unwrap();
        for &method in Method::ALL {
            assert_eq!(shade_shader(method).is_ok_and(declares), method.has_pattern(), "{}", method.name());
        }
    }

    #[test]
    fn what_methods_look_up_is_what_their_shaders_declare() {
        for method in Method::on_gpu() {
            let declares = |name| shade_shader(method).unwrap().declares(name).unwrap();
            let split_sum = declares("SplitSums");
            let blurred = declares("irradiance_maps");
            let declared = Lookups {
                box_filtered: declares("environment_pyramid") && !blurred && !split_sum,
                blurred,
                map: declares("environment_map") && !blurred,
                aliases: declares("LightAliases"),
                slices: declares("Slices"),
                split_sum,
            };
            assert_eq!(method.lookups(), declared, "{}", method.name());
        }
    }
}
