//! What shading looks up of an environment, in memory: its filtered forms, and which of them the kernels of threads need.
use crate::brdf::{BaseProfile, MIN_COS_THETA_D};
use crate::environment::sources::clearance;
use crate::environment::{Environment, Pyramid, VmfPyramid};
use crate::memo::Keyed;
use crate::threads::fitted::kernel::FINEST_WIDTH_RAD;
use crate::threads::{FittedTable, GivingWay, ShadedLobe, Threads};

/// What a method looks up of an environment, as far as it has to be filtered.
#[derive(Clone, Default)]
pub struct Light {
    /// The box-filtered pyramid.
    pub box_filtered: Option<Keyed<Pyramid>>,
    /// What fitted threads look up.
    pub blurred: Option<BlurredLight>,
    /// What the split sum looks up.
    pub prefiltered: Option<PrefilteredLight>,
}

impl Light {
    /// The same as half floats hold it.
    pub fn in_half_floats(&self) -> Self {
        Self {
            box_filtered: self.box_filtered.as_ref().map(|pyramid| in_half_floats(pyramid, pyramid.radiance_scale())),
            blurred: self.blurred.as_ref().map(BlurredLight::in_half_floats),
            prefiltered: self.prefiltered.as_ref().map(PrefilteredLight::in_half_floats),
        }
    }
}

fn in_half_floats(pyramid: &Keyed<Pyramid>, scale: f32) -> Keyed<Pyramid> {
    Keyed::new(pyramid.key, pyramid.in_half_floats(scale))
}

/// What the split sum looks up.
#[derive(Clone)]
pub struct PrefilteredLight {
    /// Filtered by GGX lobes: [`crate::environment::ggx_pyramid`].
    pub by_ggx: Keyed<Pyramid>,
    /// Irradiance over pi.
    pub irradiance: Keyed<Pyramid>,
}

impl PrefilteredLight {
    /// By what radiance is divided for half floats: one scale for all that is added up.
    pub fn radiance_scale(&self) -> f32 {
        self.by_ggx.radiance_scale()
    }

    fn in_half_floats(&self) -> Self {
        let half = |pyramid| in_half_floats(pyramid, self.radiance_scale());
        Self { by_ggx: half(&self.by_ggx), irradiance: half(&self.irradiance) }
    }
}

/// What fitted threads look up.
#[derive(Clone)]
pub struct BlurredLight {
    /// The environment without its small sources, blurred.
    pub rest: Keyed<VmfPyramid>,
    /// Its small sources alone, blurred, if some lobe mirrors them.
    pub sources: Option<Keyed<VmfPyramid>>,
    /// Irradiance over pi by each of [`bases`], without the small sources.
    pub irradiance: Vec<Keyed<Pyramid>>,
    /// What kernels look up besides.
    pub needs: KernelNeeds,
}

impl BlurredLight {
    /// By what radiance is divided for half floats: one scale for all that is added up.
    pub fn radiance_scale(&self) -> f32 {
        let of_sources = self.sources.as_ref().map_or(0.0, |sources| sources.levels.radiance_scale());
        of_sources.max(self.rest.levels.radiance_scale())
    }

    fn in_half_floats(&self) -> Self {
        let scale = self.radiance_scale();
        let half = |pyramid: &Keyed<VmfPyramid>| {
            Keyed::new(pyramid.key, VmfPyramid { levels: pyramid.levels.in_half_floats(scale) })
        };
        Self {
            rest: half(&self.rest),
            sources: self.sources.as_ref().map(half),
            irradiance: self.irradiance.iter().map(|map| in_half_floats(map, scale)).collect(),
            needs: self.needs,
        }
    }
}

/// The profiles of the bases of these threads, each once, Lambert's if there are none, and which of them each has; the first where it has none.
pub fn bases<'t>(threads: impl IntoIterator<Item = Option<&'t Threads>>) -> (Vec<BaseProfile>, Vec<usize>) {
    let mut bases = Vec::new();
    let place = |threads: Option<&Threads>| {
        let Some(table) = threads.and_then(Threads::fitted) else { return 0 };
        bases.iter().position(|base| *base == table.base).unwrap_or_else(|| {
            bases.push(table.base);
            bases.len() - 1
        })
    };
    let places = threads.into_iter().map(place).collect();
    if bases.is_empty() {
        bases.push(BaseProfile::EVEN);
    }
    (bases, places)
}

/// What kernels look up besides the pyramid of the environment without its small sources.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct KernelNeeds {
    /// The environment as it is, for kernels sharper than the pyramid.
    pub map: bool,
    /// That there are small sources at all: they are shaded by the BRDF.
    pub sources: bool,
    /// The small sources alone, blurred, for lobes in which they are mirrored.
    pub mirrored_sources: bool,
}

/// Level 0 of `pyramid` on the scale of kernels, whose level 0 has the finest width.
pub fn finest_level(pyramid: &VmfPyramid) -> f32 {
    (pyramid.finest_width_rad() / FINEST_WIDTH_RAD).log2() as f32
}

/// The view angle in radians up to which no kernel of these threads is sharper than `rest`; none if none ever is.
pub fn sharp_from(threads: &Threads, rest: &VmfPyramid) -> Option<f64> {
    let tables = threads.fitted().into_iter().flat_map(FittedTable::tables);
    tables.filter_map(|table| table.used().sharp_from(finest_level(rest))).reduce(f64::min)
}

impl KernelNeeds {
    /// The most that any kernels may look up: what one frame needs and the next does not is there for all frames.
    pub fn of_any(environment: &Environment) -> Self {
        let sources = environment.has_small_sources();
        Self { map: true, sources, mirrored_sources: sources }
    }

    /// What those of `materials` do, where the environment without its small sources is blurred as `rest`.
    pub fn of(environment: &Environment, materials: &[ShadedLobe], rest: &VmfPyramid) -> Self {
        let sources = environment.small_sources();
        let mirrors = |&ShadedLobe { lobe, threads }: &ShadedLobe| {
            let giving_way = threads.and_then(|threads| threads.giving_way(lobe));
            giving_way.is_some_and(|GivingWay { lobe_radius_rad, clear: [_, clear] }| {
                // At grazing views, where it is narrowest.
                let narrower = MIN_COS_THETA_D * lobe.narrowing.iter().sum::<f64>().exp2();
                let lobe_radius = (narrower * lobe_radius_rad) as f32;
                sources.leaves().any(|source| clearance(0.0, source.width_rad() as f32, lobe_radius) < clear)
            })
        };
        let is_sharp = |threads: &Threads| sharp_from(threads, rest).is_some();
        Self {
            map: materials.iter().any(|material| material.threads.is_some_and(is_sharp)),
            sources: environment.has_small_sources(),
            mirrored_sources: materials.iter().any(mirrors),
        }
    }

    /// The constants of glsl/methods/fitted.glsl that compile out what is not needed.
    pub fn constants(self) -> [(&'static str, u32); 3] {
        [
            ("HAS_SHARP_KERNELS", self.map.into()),
            ("HAS_SOURCES", self.sources.into()),
            ("HAS_MIRRORED_SOURCES", self.mirrored_sources.into()),
        ]
    }
}
