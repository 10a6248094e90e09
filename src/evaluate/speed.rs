//! What a frame costs: by the number of threads beside the floor (the paper's table 1), and as other things double.
use std::f64::consts::TAU;
use std::sync::Arc;

use glam::DVec2;
use serde::Serialize;

use super::bare_lookups::time_bare_lookups;
use super::cases::{Cases, Estimator, Place};
use crate::environment::width_rad_of;
use crate::error::{Error, Result};
use crate::memo::{Key, Keyed, Memo};
use crate::passes::{BareLookup, BareLookups, PlacedMesh, SHADE_PASS};
use crate::pipeline::{DeviceScene, Wanted};
use crate::progress::{Observer, Parts};
use crate::rendering::Rendering;
use crate::statistics::median;
use crate::steps::{BoxFilter, CheckDevice, pipelines};
use crate::threads::fitted::kernel::FINEST_WIDTH_RAD;
use crate::threads::fitted::{FittedTable, PackedKernel};
use crate::threads::slice::{fibonacci_lattice, on_sphere};
use crate::vulkan::{Device, PassTime};

/// What to measure, and how.
#[derive(Clone, Debug)]
pub struct Speed {
    /// Each method at each count, for each material in each environment in each scene.
    pub cases: Cases,
    /// Threads or samples while other things double; they themselves double up to this number. 1 to 1024.
    pub threads: u32,
    /// Times are medians over so many frames, at least 1.
    pub repeat: u32,
}

/// What one frame cost, and what it did.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TimedFrame {
    /// Name of the method.
    pub method: String,
    /// Number of threads, or of samples of the other estimators.
    pub threads: u32,
    /// Name of the material.
    pub material: String,
    /// Name of the environment.
    pub environment: String,
    /// Name of the scene.
    pub scene: String,
    /// Columns of the picture.
    pub width: u32,
    /// Rows of the picture.
    pub height: u32,
    /// Sub-pixels per axis.
    pub subpixels: u32,
    /// Triangles of all objects.
    pub triangles: u64,
    /// Lookups in the environment that shading made.
    pub lookups: u64,
    /// Pixels that see a surface.
    pub covered_pixels: u64,
    /// Time on the GPU of each pass that makes the picture, in milliseconds.
    pub passes: Vec<PassTime>,
    /// The sum of these.
    pub gpu_ms: f64,
    /// From the start of recording until the GPU is done and has copied the picture back, in milliseconds.
    pub frame_ms: f64,
    /// Time on the GPU of as many bare trilinear lookups in the environment's pyramid, in milliseconds.
    pub floor_ms: f64,
    /// Time of the shade pass for each lookup, in nanoseconds.
    pub ns_per_lookup: f64,
}

/// A frame of a series in which one quantity grows.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Growth {
    /// What grows: `pixels`, `sub-pixels`, `threads` or `triangles`.
    pub what: String,
    /// How much of it there is: in a picture, in a pixel, in a table, in all objects.
    pub quantity: u64,
    /// `gpu_ms` over that of the frame before in the series; none for the first.
    pub ratio: Option<f64>,
    /// What it cost.
    #[serde(flatten)]
    pub frame: TimedFrame,
}

/// All measurements.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Timings {
    /// Each method at each count.
    pub frames: Vec<TimedFrame>,
    /// Series, each in rising order.
    pub growths: Vec<Growth>,
}

/// What grows in a series.
#[derive(Clone, Copy, PartialEq)]
enum Growing {
    Pixels,
    Subpixels,
    Threads,
    Triangles,
}

/// What grows, its name, and the steps of its series.
const SERIES: [(Growing, &str, &[u32]); 4] = [
    // Parts of the pixels and of the threads that are asked for.
    (Growing::Pixels, "pixels", &[4, 2, 1]),
    // Per axis.
    (Growing::Subpixels, "sub-pixels", &[1, 2, 4]),
    (Growing::Threads, "threads", &[4, 2, 1]),
    // How often each triangle is split into four.
    (Growing::Triangles, "triangles", &[0, 1, 2]),
];

/// The measurements of `speed` on `device`, into `timings` place by place.
///
/// What is compared takes turns frame by frame, so that a machine that slows down for a while slows all of it down. The first
/// turn does not count: drivers compile then.
///
/// # Errors
/// The first material, environment or scene that cannot be used, or a scene without a surface; whatever Vulkan refuses;
/// cancelled.
pub fn run(
    speed: &Speed,
    device: &Arc<Device>,
    memo: &Memo,
    observer: &dyn Observer,
    timings: &mut Timings,
) -> Result<()> {
    let steps: usize = SERIES.iter().map(|(_, _, steps)| steps.len()).sum();
    let of_place = speed.cases.estimators().len() + speed.cases.methods.len() * steps;
    let total = speed.cases.place_count() * of_place * (speed.repeat.max(1) as usize + 1);
    let frames = Parts::new(total, observer);
    speed.cases.for_each_place(memo, observer, &mut |place| {
        let mut entrants = Vec::new();
        for estimator in speed.cases.estimators() {
            place.choose(estimator)?;
            entrants.push(Entrant::new(device, place)?);
            frames.advance()?;
        }
        timings.frames.extend(take_turns(entrants, device, speed.repeat, &frames)?);
        for &variant in &speed.cases.methods {
            for (growing, what, steps) in SERIES {
                let side = growing.most_subpixels(steps, place.prepared.view.subpixels);
                let threads = speed.threads.min(variant.method.max_count(side));
                let mut entrants = Vec::new();
                for &step in steps {
                    let entrant = |place: &mut Place| {
                        place.choose(Estimator { variant, count: growing.count(step, threads) })?;
                        Entrant::new(device, place)
                    };
                    entrants.push(growing.at(step, place, entrant)?);
                    frames.advance()?;
                }
                let mut before = None;
                for frame in take_turns(entrants, device, speed.repeat, &frames)? {
                    let ratio = before.replace(frame.gpu_ms).map(|before| frame.gpu_ms / before);
                    let quantity = growing.quantity(&frame);
                    timings.growths.push(Growth { what: what.to_owned(), quantity, ratio, frame });
                }
            }
        }
        Ok(())
    })
}

impl Growing {
    /// What `then` makes of `place` at a step of the series; `place` is left as it was.
    fn at<T>(self, step: u32, place: &mut Place, then: impl FnOnce(&mut Place) -> Result<T>) -> Result<T> {
        let view = place.prepared.view.clone();
        let meshes = (self == Self::Triangles).then(|| place.prepared.meshes.clone());
        match self {
            Self::Pixels => {
                let side = |side: u32| (f64::from(side) / f64::from(step).sqrt()).round().max(1.0) as u32;
                (place.prepared.view.width, place.prepared.view.height) = (side(view.width), side(view.height));
            }
            Self::Subpixels => place.prepared.view.subpixels = step,
            Self::Threads => {}
            Self::Triangles => {
                for named in &mut place.prepared.meshes {
                    named.mesh = (0..step).fold(named.mesh.clone(), |mesh, _| {
                        Keyed::new(Key::builder("subdivided").key(mesh.key).build(), mesh.subdivided())
                    });
                }
            }
        }
        let made = then(place);
        place.prepared.view = view;
        if let Some(meshes) = meshes {
            place.prepared.meshes = meshes;
        }
        made
    }

    /// The most sub-pixels per axis of the series, in a view that has so many: a method may have fewer samples the more there are.
    fn most_subpixels(self, steps: &[u32], of_view: u32) -> u32 {
        let of_series = steps.iter().copied().max().filter(|_| self == Self::Subpixels);
        of_series.unwrap_or(of_view)
    }

    /// How many of `threads` there are at a step of the series.
    fn count(self, step: u32, threads: u32) -> u32 {
        if self == Self::Threads { threads.div_ceil(step) } else { threads }
    }

    fn quantity(self, frame: &TimedFrame) -> u64 {
        match self {
            Self::Pixels => u64::from(frame.width) * u64::from(frame.height),
            Self::Subpixels => u64::from(frame.subpixels).pow(2),
            Self::Threads => u64::from(frame.threads),
            Self::Triangles => frame.triangles,
        }
    }
}

/// Something whose time is compared with that of others.
struct Entrant {
    frame: TimedFrame,
    renderer: DeviceScene,
    floor: BareLookups,
    renderings: Vec<Rendering>,
    floor_ms: Vec<f64>,
}

impl Entrant {
    /// What `place` has been prepared for. Renders once, so that drivers have compiled when time counts.
    fn new(device: &Arc<Device>, place: &mut Place) -> Result<Self> {
        let renderer = place.renderer(device)?;
        let (prepared, round) = (&place.prepared, place.round());
        let Rendering { lookups, counters, .. } = render(&renderer)?;
        if lookups == 0 {
            let remedy = "point the camera at its objects, or leave the camera out";
            return Err(Error::input(place.scene, "shows no surface to shade", remedy));
        }
        let threads = prepared.sampling.count;
        let pyramid = round.ask(&BoxFilter { environment: &prepared.environment, face_size: None })?;
        let way_around = round.ask(&CheckDevice(device))?.way_around(device)?;
        let fitted = prepared.materials.iter().find_map(|material| material.threads.as_deref()?.fitted());
        let (rows, of_row) = match fitted {
            Some(table) => (lookups_of(table, pyramid.face_size), table.for_subpixels().count as u32),
            None => (lookups_all_around(threads, pyramid.face_size), threads),
        };
        // As many pixels as the lookups suffice for.
        let pixels = lookups.div_ceil(u64::from(of_row)) as u32;
        let cache = pipelines(&round, device)?;
        let floor = BareLookups::new(device, &cache, &pyramid, [pixels, of_row], &rows, way_around)?;
        time_bare_lookups(device, &floor)?;
        let triangles = |object: &PlacedMesh| prepared.meshes[object.mesh].mesh.indices.len() as u64 / 3;
        let frame = TimedFrame {
            method: prepared.variant().name(),
            threads,
            material: place.material.to_owned(),
            environment: place.environment.to_owned(),
            scene: place.scene.to_owned(),
            width: prepared.view.width,
            height: prepared.view.height,
            subpixels: prepared.view.subpixels,
            triangles: prepared.objects.iter().map(triangles).sum(),
            lookups,
            covered_pixels: counters.covered_pixels(),
            passes: Vec::new(),
            gpu_ms: 0.0,
            frame_ms: 0.0,
            floor_ms: 0.0,
            ns_per_lookup: 0.0,
        };
        Ok(Self { frame, renderer, floor, renderings: Vec::new(), floor_ms: Vec::new() })
    }

    fn take_turn(&mut self, device: &Arc<Device>) -> Result<()> {
        self.renderings.push(render(&self.renderer)?);
        self.floor_ms.push(time_bare_lookups(device, &self.floor)?.0);
        Ok(())
    }

    /// The medians of all turns.
    fn finish(self) -> TimedFrame {
        let Self { mut frame, renderings, floor_ms, .. } = self;
        let median_of = |value: &dyn Fn(&Rendering) -> f64| median(renderings.iter().map(value));
        let passes = renderings.first().map(|rendering| rendering.passes.as_slice()).unwrap_or_default();
        let pass = |(index, pass): (usize, &PassTime)| PassTime {
            name: pass.name.clone(),
            gpu_ms: median_of(&|rendering| rendering.passes[index].gpu_ms),
        };
        frame.passes = passes.iter().enumerate().filter(|(_, pass)| !pass.is_readback()).map(pass).collect();
        frame.gpu_ms = frame.passes.iter().map(|pass| pass.gpu_ms).sum();
        frame.frame_ms = median_of(&|rendering| rendering.frame_ms);
        frame.floor_ms = median(floor_ms);
        frame.ns_per_lookup = 1e6 * frame.pass_ms(SHADE_PASS) / frame.lookups as f64;
        frame
    }
}

/// The lookups of these threads in a pyramid with such faces, row by row of the view angle; of an anisotropic BRDF those of one azimuth.
fn lookups_of(table: &FittedTable, face_size: usize) -> Vec<BareLookup> {
    let table = table.for_subpixels();
    let finest = (width_rad_of(face_size) / FINEST_WIDTH_RAD).log2() as f32;
    let lookup = |kernel: &PackedKernel| {
        let kernel = kernel.unpack();
        BareLookup { direction: kernel.direction().to_array(), level: (kernel.level - finest).max(0.0) }
    };
    (0..table.rows).flat_map(|row| table.row(row)).map(lookup).collect()
}

/// As many lookups in each of 64 rows, evenly all around. Their texels are about as large as a lookup's share of the hemisphere; levels go over
/// four, as those of samples of a glossy material do, in no order.
fn lookups_all_around(count: u32, face_size: usize) -> Vec<BareLookup> {
    const ROWS: u32 = 64;
    const LEVELS: f64 = 4.0;
    let texel_sr = 2.0 * TAU / (6 * face_size * face_size) as f64;
    let middle = 0.5 * (TAU / f64::from(count) / texel_sr).log2();
    let lookup = |point: DVec2| BareLookup {
        direction: on_sphere(point).as_vec3().to_array(),
        // The lattice's other coordinate has an order.
        level: (middle + LEVELS * (point.y - 0.5)).max(0.0) as f32,
    };
    fibonacci_lattice((ROWS * count) as usize).map(lookup).collect()
}

impl TimedFrame {
    /// Time of the pass of that name, in milliseconds; 0 if there is none.
    pub fn pass_ms(&self, name: &str) -> f64 {
        PassTime::ms_of(&self.passes, name)
    }
}

/// A frame with what a window shows of it.
pub(super) fn render(renderer: &DeviceScene) -> Result<Rendering> {
    renderer.render(Wanted::DISPLAY, 1)
}

/// The frames of `entrants`, each of which has `repeat` turns.
fn take_turns(
    mut entrants: Vec<Entrant>,
    device: &Arc<Device>,
    repeat: u32,
    frames: &Parts,
) -> Result<Vec<TimedFrame>> {
    for _ in 0..repeat.max(1) {
        for entrant in &mut entrants {
            entrant.take_turn(device)?;
            frames.advance()?;
        }
    }
    Ok(entrants.into_iter().map(Entrant::finish).collect())
}
