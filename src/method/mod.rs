//! The shading methods: ways to estimate equation (1) that go through one shading interface.
//!
//! A method is one GLSL file in `glsl/methods/` that defines `estimate`, its CPU twin in `shading/`, and an entry in the table.
//! What makes that GLSL file a shader is `shade_shader` of `passes/shade.rs`: nothing here knows a device.
use crate::environment::Environment;
use crate::error::{Error, Result};
use crate::shader_constants::ris::CANDIDATES;
use crate::threads::ThreadKind;

mod lookups;
mod sampling;
mod table;
mod variant;

pub use lookups::Lookups;
pub use sampling::{Pattern, Sampling};
pub use table::Method;
pub use variant::Variant;

/// How many samples methods without threads draw where nobody asks for another number.
pub const DEFAULT_SAMPLES: u32 = 100;

impl Method {
    /// Those that a shader runs: all but the reference.
    pub fn on_gpu() -> impl Iterator<Item = Self> {
        Self::ALL.iter().copied().filter(|method| method.runs_on_gpu())
    }

    /// The method of that name.
    ///
    /// # Errors
    /// There is none.
    pub fn from_name(name: &str) -> Result<Self> {
        let known = || Self::ALL.iter().map(|method| method.name().to_owned()).collect();
        let method = Self::ALL.iter().copied().find(|method| method.name() == name);
        method.ok_or_else(|| Self::unknown(name, known()))
    }

    /// An error for the `name` of none of those that are `known`.
    fn unknown(name: &str, known: Vec<String>) -> Error {
        Error::input(format!("method \"{name}\""), "is not known", format!("use one of: {}", known.join(", ")))
    }

    /// What it does, in a sentence.
    pub fn summary(self) -> &'static str {
        self.properties().summary
    }

    /// What its shader looks up.
    pub fn lookups(self) -> Lookups {
        self.properties().lookups
    }

    /// The threads that it shades by; the others draw that many samples instead.
    pub fn threads(self) -> Option<ThreadKind> {
        self.properties().threads
    }

    /// How many threads or samples it has where none are asked for.
    pub fn default_count(self) -> u32 {
        let samples = if self.lookups().split_sum { 1 } else { DEFAULT_SAMPLES };
        self.threads().map_or(samples, |kind| kind.default_count() as u32)
    }

    /// Most threads, or samples in a picture of `subpixels` x `subpixels` to the pixel.
    pub fn max_count(self, subpixels: u32) -> u32 {
        // A pixel at an edge takes all samples in each sub-pixel. lavapipe silently leaves loops after 65535 iterations in all.
        const MOST_ITERATIONS: u32 = 65_000;
        // Samples of `ris` have a loop of their own, over pairs of candidates and once more to find its end.
        let iterations_a_sample = if self == Self::Ris { CANDIDATES / 2 + 2 } else { 1 };
        let most_samples = MOST_ITERATIONS / (subpixels * subpixels * iterations_a_sample);
        let samples = if self.lookups().split_sum { 1 } else { most_samples };
        self.threads().map_or(samples, |kind| kind.max_count() as u32)
    }

    /// Whether its shader evaluates BRDFs under `environment`: fitted threads and Gaussians hold all that is needed, but for small bright sources.
    pub fn evaluates_brdf(self, environment: &Environment) -> bool {
        match self.threads() {
            Some(kind) if kind.are_kernels() => environment.has_small_sources(),
            _ => !self.lookups().split_sum,
        }
    }

    /// Whether a pixel within one smooth surface is one sum at its mean normal, not a partition among its sub-pixels:
    /// its shader includes glsl/shared_sum.glsl.
    pub fn shares_surface(self) -> bool {
        self.properties().shares_surface
    }

    /// Whether it draws its samples at either of two patterns: its shader includes glsl/pattern.glsl.
    pub fn has_pattern(self) -> bool {
        self.properties().has_pattern
    }

    /// Whether a seed makes a difference: kernels, fitted or Gaussians, and the split sum have nothing random, nor has the reference.
    pub fn has_seed(self) -> bool {
        self.runs_on_gpu() && !self.lookups().split_sum && !self.threads().is_some_and(ThreadKind::are_kernels)
    }

    /// Whether its threads have drafts while a parameter of a material is dragged.
    pub fn has_drafts(self) -> bool {
        self == Self::Fitted
    }

    /// Whether a shader runs it.
    pub fn runs_on_gpu(self) -> bool {
        self != Self::Reference
    }
}

impl std::fmt::Display for Method {
    fn fmt(&self, formatter: &mut std::fmt::Formatter) -> std::fmt::Result {
        self.name().fmt(formatter)
    }
}

impl std::str::FromStr for Method {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        Self::from_name(name)
    }
}

impl TryFrom<String> for Method {
    type Error = Error;

    fn try_from(name: String) -> Result<Self> {
        Self::from_name(&name)
    }
}

impl From<Method> for &'static str {
    fn from(method: Method) -> Self {
        method.name()
    }
}
