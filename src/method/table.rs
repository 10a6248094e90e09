//! The table of shading methods: an entry each, `name => Variant: properties`.
//!
//! A method `name` is glsl/methods/name.glsl, its twin src/shading/name.rs and its entry here.
use serde::{Deserialize, Serialize};

use super::Lookups;
use crate::threads::ThreadKind;

/// What the program needs to know of a method besides its shader and its twin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Properties {
    /// What it does, for help texts: one sentence.
    pub summary: &'static str,
    /// The threads that it shades by; the others draw that many samples instead.
    pub threads: Option<ThreadKind>,
    /// What its shader looks up.
    pub lookups: Lookups,
    /// Whether its shader includes shared_sum.glsl.
    pub shares_surface: bool,
    /// Whether its shader includes pattern.glsl.
    pub has_pattern: bool,
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

/// Makes the enum, names and properties from the table.
macro_rules! methods {
    ($($name:ident => $Method:ident: $properties:expr,)+) => {
        /// A way to estimate the radiance that leaves a surface; [`Method::summary`] says which.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        #[serde(try_from = "String", into = "&'static str")]
        pub enum Method {
            $(#[doc = concat!("Method `", stringify!($name), "`.")] $Method,)+
            /// Quadrature on the CPU: the truth.
            Reference,
        }

        impl Method {
            /// All of them.
            pub const ALL: &[Self] = &[$(Self::$Method,)+ Self::Reference];

            /// What the command line and scene files call it.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$Method => stringify!($name),)+
                    Self::Reference => "reference",
                }
            }

            pub(super) fn properties(self) -> Properties {
                match self {
                    $(Self::$Method => $properties,)+
                    Self::Reference => Properties::new("The integral itself, by quadrature on the CPU.", NOTHING),
                }
            }
        }
    };
}

methods! {
    fitted => Fitted: Properties {
        threads: Some(ThreadKind::Fitted),
        shares_surface: true,
        ..Properties::new("Threads fitted to the BRDF: directions, kernel widths and colours whose sum answers any light as the BRDF does.", BLURRED)
    },
    paper => Paper: Properties {
        threads: Some(ThreadKind::Paper),
        ..Properties::new("Sample threads as published by Kim, Kyung and Lee (2010), box-filtered lookups.", BOX_FILTERED)
    },
    gaussian => Gaussian: Properties {
        threads: Some(ThreadKind::Gaussian),
        shares_surface: true,
        ..Properties::new("Spherical Gaussians fitted to the BRDF itself (Green, Kautz and Durand 2007), looked up as fitted threads.", BLURRED)
    },
    split_sum => SplitSum: Properties {
        shares_surface: true,
        ..Properties::new("The split sum of engines (Karis 2013): the light filtered by the GGX that suits the BRDF best, times the BRDF's albedo.", SPLIT_SUM)
    },
    uniform => Uniform: Properties::new("Monte Carlo, uniform over the hemisphere.", MAP),
    cosine => Cosine: Properties::new("Monte Carlo, by the cosine to the normal.", MAP),
    importance => Importance: Properties {
        has_pattern: true,
        ..Properties::new("Monte Carlo by a 2D CDF of BRDF times cosine (Matusik et al. 2003).", MAP.and_slices())
    },
    filtered => Filtered: Properties {
        has_pattern: true,
        ..Properties::new("As importance, with filtered lookups (Colbert and Krivanek 2007); biased.", BOX_FILTERED.and_slices())
    },
    environment => Environment: Properties::new("Monte Carlo by the environment's light (Agarwal et al. 2003).", MAP_BY_LIGHT),
    ris => Ris: Properties::new("Resampled importance sampling of the whole product (Talbot et al. 2005).", MAP_BY_LIGHT.and_slices()),
    mis => Mis: Properties::new("Multiple importance sampling of lobe and light (Veach and Guibas 1995) at Sobol's points: the reference's form on the GPU.", MAP_BY_LIGHT.and_slices()),
}
