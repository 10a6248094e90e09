//! What many materials in one picture cost, beside the same picture of each alone: `threadlight bench together`.
use std::sync::Arc;

use glam::Vec3;
use serde::Serialize;

use super::speed::render;
use super::tables::{Section, Table};
use crate::error::Result;
use crate::memo::{Memo, Round};
use crate::passes::{CLASSIFY_PASS, SHADE_PASS};
use crate::pipeline::DeviceScene;
use crate::prepare::prepare;
use crate::progress::{Observer, OnlyCancels, Parts};
use crate::rendering::Rendering;
use crate::scene::{EnvironmentSource, MaterialSettings, MaterialSource, ObjectSettings, Scene, Source};
use crate::statistics::{mean, median};
use crate::vulkan::Device;

/// What to measure, and how often.
#[derive(Clone, Debug)]
pub struct Together {
    /// Materials, by names that differ: a sphere of each.
    pub materials: Vec<(String, MaterialSource)>,
    /// Environments, by names that differ.
    pub environments: Vec<(String, EnvironmentSource)>,
    /// Fitted threads of each material, 1 to [`crate::threads::fitted::MAX_COUNT`].
    pub threads: u32,
    /// Columns and rows of the picture.
    pub size: (u32, u32),
    /// Times are medians of so many, at least 1.
    pub repeat: u32,
}

/// Spheres of all materials, and the same spheres of one alone.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TimedTogether {
    /// Name of the environment.
    pub environment: String,
    /// How many fitted threads each material has.
    pub threads: u32,
    /// Columns of the picture.
    pub width: u32,
    /// Rows of the picture.
    pub height: u32,
    /// Pixels that see a surface.
    pub covered_pixels: u64,
    /// Lookups in the environment that shading made.
    pub lookups: u64,
    /// All that the program has allocated on the device while it renders all materials, in bytes.
    pub device_memory_bytes: u64,
    /// Sorting pixels by the shader that they need, in milliseconds on the GPU.
    pub classify_ms: f64,
    /// Shading, in milliseconds on the GPU.
    pub shade_ms: f64,
    /// `shade_ms` over its mean for each material alone.
    pub ratio: f64,
    /// Each material alone.
    pub alone: Vec<TimedAlone>,
}

/// All spheres of one material.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TimedAlone {
    /// Name of the material.
    pub material: String,
    /// Lookups in the environment that shading made.
    pub lookups: u64,
    /// Sorting pixels, in milliseconds on the GPU.
    pub classify_ms: f64,
    /// Shading, in milliseconds on the GPU.
    pub shade_ms: f64,
}

/// Measures on `device`, into `found` environment by environment. All pictures take turns, so that a machine that slows down for a while
/// slows all of them down.
///
/// # Errors
/// Materials or environments that cannot be used, a number of threads that is out of range; whatever Vulkan refuses; cancelled.
pub fn run(
    together: &Together,
    device: &Arc<Device>,
    memo: &Memo,
    observer: &dyn Observer,
    found: &mut Vec<TimedTogether>,
) -> Result<()> {
    let total = together.environments.len() * (together.materials.len() + 1) * (together.repeat.max(1) as usize + 1);
    let frames = Parts::new(total, observer);
    let cancels = &OnlyCancels(observer);
    for (environment, source) in &together.environments {
        let round = memo.round(cancels);
        let mut all = Entrant::new(&together.scene(source, &together.materials), device, &round)?;
        frames.advance()?;
        let mut alone = Vec::new();
        for material in &together.materials {
            alone.push(Entrant::new(&together.scene(source, std::slice::from_ref(material)), device, &round)?);
            frames.advance()?;
        }
        for _ in 0..together.repeat.max(1) {
            for entrant in std::iter::once(&mut all).chain(&mut alone) {
                entrant.renderings.push(render(&entrant.renderer)?);
                frames.advance()?;
            }
        }
        let alone = together.materials.iter().zip(&alone).map(|((material, _), entrant)| TimedAlone {
            material: material.clone(),
            lookups: entrant.first.lookups,
            classify_ms: entrant.median_ms(CLASSIFY_PASS),
            shade_ms: entrant.median_ms(SHADE_PASS),
        });
        let alone: Vec<_> = alone.collect();
        let shade_ms = all.median_ms(SHADE_PASS);
        found.push(TimedTogether {
            environment: environment.clone(),
            threads: together.threads,
            width: together.size.0,
            height: together.size.1,
            covered_pixels: all.first.counters.covered_pixels(),
            lookups: all.first.lookups,
            device_memory_bytes: all.first.device_memory_bytes,
            classify_ms: all.median_ms(CLASSIFY_PASS),
            shade_ms,
            ratio: shade_ms / mean(alone.iter().map(|alone| alone.shade_ms)),
            alone,
        });
    }
    Ok(())
}

impl Together {
    /// As many spheres as there are materials, in rows, with `materials` in turn.
    fn scene(&self, environment: &EnvironmentSource, materials: &[(String, MaterialSource)]) -> Scene {
        let count = self.materials.len();
        // Pictures are four by three as a rule.
        let columns = (count as f32 * 4.0 / 3.0).sqrt().ceil() as usize;
        let rows = count.div_ceil(columns);
        let sphere = |index: usize| {
            let middle = |count: usize| 0.5 * (count - 1) as f32;
            ObjectSettings {
                translate: Vec3::new(
                    (index % columns) as f32 - middle(columns),
                    middle(rows) - (index / columns) as f32,
                    0.0,
                ),
                scale: 0.45,
                ..ObjectSettings::new(Source::Builtin("sphere".to_owned()), &materials[index % materials.len()].0)
            }
        };
        let mut scene = Scene { objects: (0..count).map(sphere).collect(), ..Scene::default() };
        let material =
            |(name, source): &(String, MaterialSource)| MaterialSettings { name: name.clone(), source: source.clone() };
        scene.materials = materials.iter().map(material).collect();
        scene.environment.source = environment.clone();
        scene.shading.threads = Some(self.threads);
        (scene.image.width, scene.image.height) = self.size;
        scene
    }
}

/// A picture whose time is compared with that of others.
struct Entrant {
    renderer: DeviceScene,
    /// Does not count: drivers compile then.
    first: Rendering,
    renderings: Vec<Rendering>,
}

impl Entrant {
    fn new(scene: &Scene, device: &Arc<Device>, round: &Round) -> Result<Self> {
        let renderer = DeviceScene::new(device, &prepare(scene, round)?, round)?;
        let first = render(&renderer)?;
        Ok(Self { renderer, first, renderings: Vec::new() })
    }

    fn median_ms(&self, pass: &str) -> f64 {
        median(self.renderings.iter().map(|rendering| rendering.pass_ms(pass)))
    }
}

/// For each environment all materials together, then the mean over each alone, and each.
pub fn tables(found: &[TimedTogether]) -> Vec<Section> {
    let section = |timed: &TimedTogether| {
        let cells = |lookups: f64, classify_ms: f64, shade_ms: f64| {
            let a_pixel = lookups / timed.covered_pixels as f64;
            vec![format!("{a_pixel:.1}"), format!("{classify_ms:.2}"), format!("{shade_ms:.2}")]
        };
        let mean = |value: fn(&TimedAlone) -> f64| mean(timed.alone.iter().map(value));
        let together = ("together".to_owned(), cells(timed.lookups as f64, timed.classify_ms, timed.shade_ms));
        let alone =
            cells(mean(|alone| alone.lookups as f64), mean(|alone| alone.classify_ms), mean(|alone| alone.shade_ms));
        let each = timed
            .alone
            .iter()
            .map(|alone| (alone.material.clone(), cells(alone.lookups as f64, alone.classify_ms, alone.shade_ms)));
        let rows = [together, ("mean of each alone".to_owned(), alone)].into_iter().chain(each);
        let TimedTogether { environment, threads, width, height, ratio, device_memory_bytes, .. } = timed;
        let title = format!(
            "{} materials, {environment}, {width} x {height} pixels, {threads} threads: together {ratio:.2} times as long as alone, {:.0} MB on \
             the device; times in ms",
            timed.alone.len(),
            *device_memory_bytes as f64 * 1e-6
        );
        let table = Table::new("materials", ["lookups a pixel", CLASSIFY_PASS, SHADE_PASS], rows);
        Section { title, tables: vec![table] }
    };
    found.iter().map(section).collect()
}
