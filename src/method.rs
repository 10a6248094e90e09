//! The shading methods: ways to estimate equation (1) that go through one shading interface.
//!
//! A method is one GLSL file in `glsl/methods/` that defines `estimate`, one CPU twin in `shading/`, and
//! one line here in each list.
use crate::environment::Environment;
use crate::threads;
use crate::vulkan::{Shader, compiled};
use crate::{Error, Result};

/// A way to estimate the radiance that leaves a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Threads fitted to the BRDF, lookups in a pyramid of known kernels.
    Fitted,
    /// The paper's threads: equations (2) to (10), box-filtered lookups.
    Paper,
    /// Monte Carlo, uniform over the hemisphere.
    Uniform,
    /// Monte Carlo, in proportion to the cosine.
    Cosine,
    /// Monte Carlo, in proportion to BRDF times cosine (Matusik et al. 2003).
    Importance,
    /// The same with filtered lookups (Colbert and Krivanek 2007): biased.
    Filtered,
    /// Monte Carlo, in proportion to the environment's light (Agarwal et al. 2003).
    Environment,
    /// Resampled importance sampling of the whole product (Talbot et al. 2005).
    Ris,
    /// Multiple importance sampling of lobe and light (Veach and Guibas 1995) at Sobol's points: the reference's form on the GPU.
    Mis,
    /// Quadrature on the CPU: the truth.
    Reference,
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
}

impl Method {
    /// All of them.
    pub const ALL: &[Self] = &[
        Self::Fitted,
        Self::Paper,
        Self::Uniform,
        Self::Cosine,
        Self::Importance,
        Self::Filtered,
        Self::Environment,
        Self::Ris,
        Self::Mis,
        Self::Reference,
    ];

    /// What the command line and scene files call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Fitted => "fitted",
            Self::Paper => "paper",
            Self::Uniform => "uniform",
            Self::Cosine => "cosine",
            Self::Importance => "importance",
            Self::Filtered => "filtered",
            Self::Environment => "environment",
            Self::Ris => "ris",
            Self::Mis => "mis",
            Self::Reference => "reference",
        }
    }

    /// The method of that name.
    ///
    /// # Errors
    /// There is none.
    pub fn from_name(name: &str) -> Result<Self> {
        // Names of older scene files and scripts.
        let name = match name {
            "resampled" => "ris",
            "combined" => "mis",
            name => name,
        };
        Self::ALL.iter().copied().find(|method| method.name() == name).ok_or_else(|| {
            let known: Vec<_> = Self::ALL.iter().map(|method| method.name()).collect();
            Error::input(format!("method \"{name}\""), "is not known", format!("use one of: {}", known.join(", ")))
        })
    }

    /// The variant of shade.comp that runs it.
    ///
    /// # Errors
    /// The reference runs on the CPU.
    pub fn shader(self) -> Result<&'static Shader> {
        match self {
            Self::Fitted => Ok(&compiled::SHADE_FITTED),
            Self::Paper => Ok(&compiled::SHADE_PAPER),
            Self::Uniform => Ok(&compiled::SHADE_UNIFORM),
            Self::Cosine => Ok(&compiled::SHADE_COSINE),
            Self::Importance => Ok(&compiled::SHADE_IMPORTANCE),
            Self::Filtered => Ok(&compiled::SHADE_FILTERED),
            Self::Environment => Ok(&compiled::SHADE_ENVIRONMENT),
            Self::Ris => Ok(&compiled::SHADE_RIS),
            Self::Mis => Ok(&compiled::SHADE_MIS),
            Self::Reference => Err(Error::input("method \"reference\"", "does not run on the GPU", "use another here")),
        }
    }

    /// What its shader looks up.
    pub fn lookups(self) -> Lookups {
        let none = Lookups::default();
        match self {
            Self::Fitted => Lookups { blurred: true, ..none },
            Self::Paper => Lookups { box_filtered: true, ..none },
            Self::Uniform | Self::Cosine => Lookups { map: true, ..none },
            Self::Importance => Lookups { map: true, slices: true, ..none },
            Self::Filtered => Lookups { box_filtered: true, slices: true, ..none },
            Self::Environment => Lookups { map: true, aliases: true, ..none },
            Self::Ris | Self::Mis => Lookups { map: true, aliases: true, slices: true, ..none },
            Self::Reference => none,
        }
    }

    /// The threads that it shades by; the others draw that many samples instead.
    pub fn threads(self) -> Option<threads::ThreadKind> {
        match self {
            Self::Fitted => Some(threads::ThreadKind::Fitted),
            Self::Paper => Some(threads::ThreadKind::Paper),
            _ => None,
        }
    }

    /// How many threads or samples it has where none are asked for.
    pub fn default_count(self) -> u32 {
        self.threads().map_or(100, |kind| kind.default_count() as u32)
    }

    /// Whether its shader evaluates BRDFs under `environment`: fitted threads hold all that is needed, but for small bright sources.
    pub fn evaluates_brdf(self, environment: &Environment) -> bool {
        self != Self::Fitted || !environment.small_sources().list.is_empty()
    }

    /// Whether a pixel within one smooth surface is one sum at its mean normal, not a partition among its sub-pixels:
    /// SHARES_SURFACE in the shader.
    pub fn shares_surface(self) -> bool {
        matches!(self, Self::Fitted)
    }

    /// Whether a shader runs it: all but the reference.
    pub fn runs_on_gpu(self) -> bool {
        self != Self::Reference
    }

    /// Whether the mean over seeds is equation (1), whatever the number of samples.
    pub fn is_unbiased(self) -> bool {
        !matches!(self, Self::Fitted | Self::Paper | Self::Filtered | Self::Reference)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_methods_look_up_is_what_their_shaders_declare() {
        for method in Method::ALL.iter().filter(|method| method.runs_on_gpu()) {
            let declares = |name| method.shader().unwrap().declares(name).unwrap();
            let blurred = declares("irradiance_map");
            let declared = Lookups {
                box_filtered: declares("environment_pyramid") && !blurred,
                blurred,
                map: declares("environment_map") && !blurred,
                aliases: declares("LightAliases"),
                slices: declares("Slices"),
            };
            assert_eq!(method.lookups(), declared, "{}", method.name());
        }
    }
}
