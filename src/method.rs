//! The shading methods: ways to estimate equation (1) that go through one shading interface.
//!
//! A method is one GLSL file in `glsl/methods/` that defines `estimate`, its CPU twin in `shading/`, and an entry in the table
//! `shading/methods.rs`.
use crate::environment::Environment;
pub use crate::scene::Method;
use crate::scene::{Pattern, ShadingSettings};
use crate::threads::ThreadKind;
use crate::vulkan::{Shader, compiled};
use crate::{Error, Result};

/// How many samples methods without threads draw where nobody asks for another number.
pub const DEFAULT_SAMPLES: u32 = 100;

/// What the program needs to know of a method besides its shader and its twin.
#[derive(Clone, Copy, Debug)]
struct Properties {
    /// What it does, for help texts: one sentence.
    summary: &'static str,
    /// The threads that it shades by; the others draw that many samples instead.
    threads: Option<ThreadKind>,
    /// What its shader looks up.
    lookups: Lookups,
    /// Whether its shader includes shared_sum.glsl.
    shares_surface: bool,
    /// Whether its shader includes pattern.glsl.
    has_pattern: bool,
}

/// What a method's shader looks up besides BRDFs and threads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Lookups {
    /// The box-filtered pyramid of the environment.
    pub box_filtered: bool,
    /// The environment blurred by the kernels of fitted threads, with what belongs to that.
    pub blurred: bool,
    /// The environment as it is, with the density of its light.
    pub map: bool,
    /// The alias table of that density.
    pub aliases: bool,
    /// CDFs of BRDFs.
    pub slices: bool,
    /// What the split sum has: the environment filtered by GGX and by the cosine, albedos of BRDFs, and how rough the nearest GGX is.
    pub split_sum: bool,
}

impl Properties {
    const fn new(summary: &'static str, lookups: Lookups) -> Self {
        Self { summary, threads: None, lookups, shares_surface: false, has_pattern: false }
    }
}

const NOTHING: Lookups =
    Lookups { box_filtered: false, blurred: false, map: false, aliases: false, slices: false, split_sum: false };
const SPLIT_SUM: Lookups = Lookups { split_sum: true, ..NOTHING };
const BLURRED: Lookups = Lookups { blurred: true, ..NOTHING };
const BOX_FILTERED: Lookups = Lookups { box_filtered: true, ..NOTHING };
const MAP: Lookups = Lookups { map: true, ..NOTHING };
const MAP_BY_LIGHT: Lookups = Lookups { aliases: true, ..MAP };

impl Lookups {
    /// These, and CDFs of BRDFs.
    const fn and_slices(self) -> Self {
        Self { slices: true, ..self }
    }
}

/// Makes the properties from the table in shading/methods.rs.
macro_rules! methods {
    ($($name:ident $(| $older:ident)? => $Method:ident: $properties:expr,)+) => {
        impl Method {
            fn properties(self) -> Properties {
                match self {
                    $(Self::$Method => $properties,)+
                    Self::Reference => Properties::new("The integral itself, by quadrature on the CPU.", NOTHING),
                }
            }
        }
    };
}
include!("shading/methods.rs");

impl ShadingSettings {
    /// How many threads or samples: as many as are asked for, or as suit the method.
    pub fn count(&self) -> u32 {
        self.threads.unwrap_or(self.method.default_count())
    }
}

impl Method {
    /// What it does, in a sentence.
    pub fn summary(self) -> &'static str {
        self.properties().summary
    }

    /// The variant of shade.comp that runs it.
    ///
    /// # Errors
    /// The reference runs on the CPU.
    ///
    /// # Panics
    /// A method in the table has no file in `glsl/methods/`.
    pub fn shader(self) -> Result<&'static Shader> {
        if self == Self::Reference {
            return Err(Error::input("method \"reference\"", "does not run on the GPU", "use another here"));
        }
        let variant = |shader: &&Shader| shader.name().strip_prefix("shade_") == Some(self.name());
        Ok(compiled::ALL.iter().find(variant).expect("a test looks for the shader of every method"))
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
        // Samples of `ris` have a loop of their own, over four pairs of candidates and once more to find its end.
        let iterations_a_sample = if self == Self::Ris { 6 } else { 1 };
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

    /// Whether a shader runs it: all but the reference.
    pub fn runs_on_gpu(self) -> bool {
        self != Self::Reference
    }
}

/// A method, and where it draws its samples: what tables have a row for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Variant {
    /// How radiance is estimated.
    pub method: Method,
    /// Where samples are drawn; [`Pattern::PerPixel`] of methods that have no choice.
    pub pattern: Pattern,
}

/// What the names of variants with a fixed pattern end in.
const FIXED: &str = "_fixed";

impl Variant {
    /// `method`, with `pattern` if it has a choice.
    pub fn new(method: Method, pattern: Pattern) -> Self {
        Self { method, pattern: if method.has_pattern() { pattern } else { Pattern::PerPixel } }
    }

    /// The name of the method, followed by `_fixed` if the pattern is.
    pub fn name(self) -> String {
        let suffix = if self.pattern == Pattern::Fixed { FIXED } else { "" };
        format!("{}{suffix}", self.method.name())
    }

    /// The variant of that name.
    ///
    /// # Errors
    /// There is none.
    pub fn from_name(name: &str) -> Result<Self> {
        let fixed = name.strip_suffix(FIXED).map(Method::from_name).and_then(Result::ok);
        match fixed.filter(|method| method.has_pattern()) {
            Some(method) => Ok(Self { method, pattern: Pattern::Fixed }),
            None => Method::from_name(name).map(Self::from).map_err(|_| {
                let fixed = Method::ALL.iter().filter(|method| method.has_pattern());
                let fixed = fixed.map(|method| Self::new(*method, Pattern::Fixed));
                let all = Method::ALL.iter().filter(|method| method.runs_on_gpu()).map(|method| Self::from(*method));
                Method::unknown(name, all.chain(fixed).map(Self::name).collect())
            }),
        }
    }
}

impl From<Method> for Variant {
    fn from(method: Method) -> Self {
        Self::new(method, Pattern::PerPixel)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_method_has_a_shader_and_every_shader_a_method() {
        let variants = compiled::ALL.iter().filter_map(|shader| shader.name().strip_prefix("shade_"));
        for name in variants {
            assert!(Method::from_name(name).is_ok_and(|method| method.name() == name), "{name} is not in the table");
        }
        for method in Method::ALL.iter().filter(|method| method.runs_on_gpu()) {
            assert_eq!(method.shader().unwrap().name(), format!("shade_{}", method.name()));
        }
        assert!(Method::Reference.shader().is_err());
    }

    #[test]
    fn variants_of_methods_that_have_a_pattern_are_named_by_it() {
        for &method in Method::ALL {
            for pattern in Pattern::ALL {
                let variant = Variant::new(method, pattern);
                assert_eq!(Variant::from_name(&variant.name()).unwrap(), variant);
                let is_fixed = variant.name() == format!("{}_fixed", method.name());
                assert_eq!(is_fixed, pattern == Pattern::Fixed && method.has_pattern());
            }
            let declares = |shader: &Shader| shader.declares("FIXED_PATTERN").unwrap();
            assert_eq!(method.shader().is_ok_and(declares), method.has_pattern(), "{}", method.name());
        }
        assert!(Variant::from_name("paper_fixed").unwrap_err().to_string().contains("paper_fixed"));
    }

    #[test]
    fn what_methods_look_up_is_what_their_shaders_declare() {
        for method in Method::ALL.iter().filter(|method| method.runs_on_gpu()) {
            let declares = |name| method.shader().unwrap().declares(name).unwrap();
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
