//! The models: a file each, and what each of them offers. A measured BRDF is a model whose parameters are a file.
use glam::{DVec3, Vec4};

use super::Parameters;
use crate::error::{Error, Result};

/// What every model offers; [`Brdf`] dispatches to it.
pub trait Model: Sized {
    /// Whether material and scene files can have its parameters.
    const HAS_PARAMETERS: bool = true;

    /// f(w_i, w_o) in 1/sr, linear Rec. 709, for unit vectors with both z positive.
    fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3;

    /// [`Self::evaluate`] for several `w_i`: faster where their memory accesses can overlap.
    fn evaluate_all(&self, w_i: &[DVec3], w_o: DVec3) -> Vec<DVec3> {
        w_i.iter().map(|&w_i| self.evaluate(w_i, w_o)).collect()
    }

    /// Whether f stays what it is when light and view change places. Measurements are reciprocal only approximately.
    fn is_reciprocal(&self) -> bool {
        true
    }

    /// Reads the model's parameters from a table; unknown keys are reported by the caller.
    fn from_parameters(parameters: &mut Parameters) -> Result<Self>;

    /// The model's parameters as its GLSL twin expects them: `BrdfParameters { vec4 a, b, c }`, without those of [`Self::without_rotation`]. None
    /// of a model that has no twin.
    fn gpu_parameters(&self) -> [Vec4; 3] {
        [Vec4::ZERO; 3]
    }

    /// Whether shaders have to look it up in a table although its model has a GLSL twin: where the twin leaves out what its parameters ask for.
    fn needs_table(&self) -> bool {
        false
    }

    /// The same in its own axes, and by how many degrees these are turned from the tangent, counter-clockwise seen from outside: none of a
    /// model that has no such parameter, or where it is 0.
    fn without_rotation(&self) -> Option<(Self, f64)> {
        None
    }

    /// Adds everything that `evaluate` depends on to `hasher`.
    fn hash_content(&self, hasher: &mut blake3::Hasher);
}

/// The greatest value of a measured table that is kept, in 1/sr: sums of values are to be numbers in single precision.
pub(crate) const MOST_MEASURED: f32 = 1e30;

/// Makes the modules, the enum and its dispatch from the table in `table.rs`.
macro_rules! brdf_models {
    ($($name:ident => $Model:ident,)+) => {
        $(#[allow(missing_docs)] pub mod $name; pub use $name::$Model;)+

        /// A BRDF of any model.
        #[derive(Clone, Debug)]
        pub enum Brdf {
            $(#[doc = concat!("Model `", stringify!($name), "`.")] $Model($Model),)+
        }

        impl Brdf {
            /// Names of all models; a model's position is its id in shaders.
            pub const MODELS: &[&str] = &[$(stringify!($name)),+];

            /// Names of the models whose parameters material and scene files can have.
            pub fn models_with_parameters() -> Vec<&'static str> {
                let models = [$((stringify!($name), $Model::HAS_PARAMETERS)),+];
                models.into_iter().filter_map(|(name, has_parameters)| has_parameters.then_some(name)).collect()
            }

            /// Whether f stays what it is when light and view change places.
            pub fn is_reciprocal(&self) -> bool {
                match self { $(Brdf::$Model(model) => model.is_reciprocal(),)+ }
            }

            /// Name of this BRDF's model: one of [`Brdf::MODELS`].
            pub fn model(&self) -> &'static str {
                match self { $(Brdf::$Model(_) => stringify!($name),)+ }
            }

            /// The BRDF in its own axes, and by how many degrees these are turned from the tangent, counter-clockwise seen from outside: what
            /// it is on a surface whose tangent is turned by as much. None if it is in its own axes.
            ///
            /// So one set of threads serves all rotations, and mirror planes of the BRDF are those of its frame.
            pub fn without_rotation(&self) -> Option<(Brdf, f64)> {
                match self {
                    $(Brdf::$Model(model) => model.without_rotation().map(|(own, deg)| (Brdf::$Model(own), deg)),)+
                }
            }

            pub(super) fn read_model(model: &str, parameters: &mut Parameters) -> Result<Brdf> {
                match model {
                    $(stringify!($name) => Ok(Brdf::$Model($Model::from_parameters(parameters)?)),)+
                    _ => Err(Error::input(
                        format!("model `{model}`"), "is not known", format!("use one of {}", Brdf::models_with_parameters().join(", ")),
                    )),
                }
            }
        }

        /// Calls a method of the model inside a [`Brdf`].
        macro_rules! dispatch {
            ($brdf:expr, $model:ident => $call:expr) => {
                match $brdf { $(Brdf::$Model($model) => $call,)+ }
            };
        }
    };
}
include!("table.rs");
