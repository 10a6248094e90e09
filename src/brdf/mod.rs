//! BRDFs. The CPU form, in double precision, is the truth; where shaders have it too, its GLSL twin is in glsl/brdf.
//!
//! A model is a file of `models`, a format of material files one of `files`. What a fit and shaders ask of any BRDF is here: how narrow its
//! lobe is (`lobe`), which symmetries it has, its table on the device, its record.
//!
//! Shading frame (conventions of the whole project): z is the normal, `w_i` points to the light, `w_o` to the eye, both
//! unit. `f` is in 1/sr, without the cosine, and 0 where either cosine is not positive. x is the tangent: an anisotropic BRDF depends on
//! the azimuths of `w_i` and `w_o` about z against x, counter-clockwise seen from outside; of an isotropic one any frame about z will do.
use std::f64::consts::{FRAC_PI_2, PI};
use std::mem;
use std::path::Path;

use glam::{DVec2, DVec3, Vec4, dvec3};

use crate::error::{Error, Result};
use crate::files::{FileKind, read, toml_problem};

mod base;
mod builtin;
mod cosines;
mod directions;
mod files;
mod lobe;
mod made_table;
mod microfacet;
#[macro_use]
mod models;
mod parameters;
mod record;
mod seen;
mod symmetry;
mod tabulate;

pub use base::BaseProfile;
pub(crate) use directions::{reflect, theta};
pub(crate) use files::has_model;
pub use files::{merl_bytes, merl_bytes_of_stored, merl_bytes_of_values};
pub use lobe::{Ellipse, LobeShape, MIN_COS_THETA_D, NARROWING_COSINES, half_vector_width, lobe_radius};
pub use made_table::{MADE_TABLE_SIZE, MadeTable};
pub use microfacet::{
    Axes, Distribution, NARROWEST_ALPHA, Roughness, Tap, fresnel_conductor, fresnel_dielectric, ggx_lobe,
};
pub use models::custom::CustomBrdf;
pub use models::layered::{
    Coat, base_file, base_file_in, base_files, base_files_from, base_files_of, change_base_files, resolve_base_files,
};
pub use models::*;
pub use parameters::{Domain, Parameter, Parameters, Scale, Spacing, as_number, channels, parameter, set_parameter};
pub use record::{MaterialRecord, ThreadTableRecord};
pub use seen::SeenBrdf;
pub use symmetry::Symmetry;
pub use tabulate::tabulate;

/// Steps of theta_h and phi_h that [`Brdf::albedo_from`] begins with: of all models and measured tables of the tests, half are within 2e-4 with these,
/// nine of ten within 1e-4 with twice as many.
const ALBEDO_STEPS: [usize; 2] = [96, 48];

/// How often it may halve them: seldom more than twice.
const ALBEDO_HALVINGS: u32 = 4;

/// The relative change at which it stops. The error of a midpoint rule is a third of the change.
const ALBEDO_CHANGE: f64 = 5e-4;

/// Directions nearer to the horizon are below it: squares of half vectors between two of them, and f over their cosines, are numbers.
const LEAST_COSINE: f64 = 1e-30;

/// The largest view angle: at 90 degrees f is 0. A renderer only meets it where an interpolated normal turns from the eye.
pub const MAX_THETA_O_DEG: f64 = 89.99;

include!(concat!(env!("OUT_DIR"), "/brdf_twins.rs"));

impl Brdf {
    /// f(w_i, w_o) in 1/sr, per linear Rec. 709 channel; 0 where a cosine is not positive, or so small that no light is.
    #[inline]
    pub fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
        // Written so that a NaN counts as "not positive".
        if !(w_i.z > LEAST_COSINE && w_o.z > LEAST_COSINE) {
            return DVec3::ZERO;
        }
        dispatch!(self, model => model.evaluate(w_i, w_o))
    }

    /// f for each of `w_i`, unit vectors with z positive, and one `w_o`: what [`Self::evaluate`] finds, sooner.
    pub fn evaluate_all(&self, w_i: &[DVec3], w_o: DVec3) -> Vec<DVec3> {
        debug_assert!(w_i.iter().all(|w_i| w_i.z > 0.0) && w_o.z > 0.0);
        dispatch!(self, model => model.evaluate_all(w_i, w_o))
    }

    /// The formats of material files.
    pub const FILES: FileKind<Brdf> =
        FileKind { what: "material", formats: files::FORMATS, builtin_names: || Brdf::builtin_names().collect() };

    /// Reads a material file: see [`Self::FILES`].
    ///
    /// # Errors
    /// What cannot be read or is no material.
    pub fn load(path: &Path) -> Result<Brdf> {
        Self::FILES.load(path)
    }

    /// A BRDF from `model` and its parameters as they stand in a scene file. Errors name the key; use [`Error::within`] to
    /// put the file in front.
    pub fn from_parameters(model: &str, table: toml::Table) -> Result<Brdf> {
        let mut parameters = Parameters::new(table);
        let brdf = Brdf::read_model(model, &mut parameters)?;
        parameters.finish(model)?;
        Ok(brdf)
    }

    /// Checks `model` and its parameters as [`Self::from_parameters`] does, but reads no files: those of bases under coats are taken to be
    /// sound.
    ///
    /// # Errors
    /// The model is not known, or a parameter is missing, unknown or out of range.
    pub fn check_parameters(model: &str, table: toml::Table) -> Result<()> {
        let mut parameters = Parameters::checked(table);
        Brdf::read_model(model, &mut parameters)?;
        parameters.finish(model)
    }

    /// What `model` reads from a table of its parameters, and what each of them may be.
    ///
    /// # Errors
    /// The table is not sound: see [`Self::from_parameters`].
    pub fn parameters(model: &str, table: &toml::Table) -> Result<Vec<Parameter>> {
        let mut parameters = Parameters::new(table.clone());
        Brdf::read_model(model, &mut parameters)?;
        Ok(parameters.read())
    }

    /// What `model` reads where `table` is all that is given: what is missing counts as the middle of its range.
    ///
    /// # Errors
    /// What is given is not sound.
    pub fn possible_parameters(model: &str, table: &toml::Table) -> Result<Vec<Parameter>> {
        let mut parameters = Parameters::filled(table.clone());
        Brdf::read_model(model, &mut parameters)?;
        Ok(parameters.read())
    }

    /// Whether `path` is called as a file of a model and its parameters is, so that [`Self::load_model`] may read it.
    pub fn is_model_file(path: &Path) -> bool {
        files::is_model_file(path)
    }

    /// The model that a material file (`.toml`) names, and its parameters, not yet checked.
    pub fn load_model(path: &Path) -> Result<(String, toml::Table)> {
        files::parse_model(path, &read(path)?)
    }

    /// The model of the built-in material `name`, and its parameters.
    pub fn builtin_model(name: &str) -> Option<(String, toml::Table)> {
        Some(model_of(builtin::text(name)?).expect("built-in materials are read by a test"))
    }

    /// The built-in material `name`, if there is one.
    pub fn builtin(name: &str) -> Option<Brdf> {
        let (model, parameters) = Brdf::builtin_model(name)?;
        Some(Brdf::from_parameters(&model, parameters).expect("built-in materials are read by a test"))
    }

    /// Names of the built-in materials, in the order in which to list them.
    pub fn builtin_names() -> impl Iterator<Item = &'static str> {
        builtin::materials().map(|(name, _)| *name)
    }

    /// Families of built-in materials, and the names in each.
    pub fn builtin_families() -> impl Iterator<Item = (&'static str, Vec<&'static str>)> {
        builtin::FAMILIES.iter().map(|(family, materials)| (*family, materials.iter().map(|(name, _)| *name).collect()))
    }

    /// Id of the model by which shaders evaluate it, whose lobe this is: its position in models/table.rs, or that of a table if it has no twin.
    pub fn model_index(&self, lobe: &LobeShape) -> u32 {
        let twin = match self.has_twin() {
            true => self.model(),
            false if lobe.is_isotropic => "tabulated",
            false => "tabulated_anisotropic",
        };
        Brdf::MODELS.iter().position(|name| *name == twin).expect("MODELS holds every model") as u32
    }

    /// Whether shaders evaluate it by a model's form in GLSL.
    fn has_twin(&self) -> bool {
        TWINS.contains(&self.model()) && !dispatch!(self, model => model.needs_table())
    }

    /// Whether shaders look it up in a table that [`tabulate`] makes; otherwise they evaluate it by themselves.
    pub fn has_table(&self) -> bool {
        matches!(self, Brdf::MerlTable(_)) || !self.has_twin()
    }

    /// The texels of one that [`tabulate`] made; none of any other.
    pub fn made_table(&self) -> Option<&MadeTable> {
        match self {
            Brdf::Tabulated(tabulated) => Some(tabulated.table()),
            Brdf::TabulatedAnisotropic(tabulated) => Some(tabulated.table()),
            _ => None,
        }
    }

    /// The model's parameters for its GLSL twin, `BrdfParameters { vec4 a, b, c }`. Shaders have no rotation: see
    /// [`Self::without_rotation`].
    pub fn gpu_parameters(&self) -> [Vec4; 3] {
        debug_assert!(self.without_rotation().is_none(), "{} is rotated", self.model());
        dispatch!(self, model => model.gpu_parameters())
    }

    /// Digest of everything the BRDF's values depend on: equal digests, equal BRDFs.
    pub fn fingerprint(&self) -> blake3::Hash {
        let mut hasher = blake3::Hasher::new();
        hasher.update(self.model().as_bytes());
        dispatch!(self, model => model.hash_content(&mut hasher));
        hasher.finalize()
    }

    /// [`Self::albedo_from`] the azimuth 0: of an isotropic BRDF that of every azimuth.
    pub fn albedo(&self, theta_o: f64) -> DVec3 {
        self.albedo_from(theta_o, 0.0)
    }

    /// Directional albedo: the integral of f(w, w_o) (n . w) dw per channel, for the view angle `theta_o` and its azimuth against the tangent
    /// `phi_o`, both in radians.
    ///
    /// Midpoint rule over the half vector, theta_h = 90 deg x^2 with x uniform: lobes about the mirror direction are lobes
    /// about the normal there, at every view angle, and the square resolves narrow ones. Steps are halved until that changes little. Within about
    /// 1e-3 of the truth for roughness_alpha >= 0.001; lobes about another direction that are narrower than about 3 degrees may fall between its
    /// points.
    pub fn albedo_from(&self, theta_o: f64, phi_o: f64) -> DVec3 {
        self.albedo_until(theta_o, phi_o, ALBEDO_CHANGE)
    }

    /// The same, of steps that are halved until that changes it by no more than this part.
    pub(crate) fn albedo_until(&self, theta_o: f64, phi_o: f64, least_change: f64) -> DVec3 {
        let narrowness = lobe::narrowness(self);
        let in_steps = |halvings: u32| {
            let [theta_steps, phi_steps] = ALBEDO_STEPS.map(|steps| steps << halvings);
            self.albedo_in_steps(theta_o, phi_o, [theta_steps, lobe::azimuths_across(narrowness, phi_steps)])
        };
        let mut albedo = in_steps(0);
        for halvings in 1..=ALBEDO_HALVINGS {
            let coarser = mem::replace(&mut albedo, in_steps(halvings));
            if (albedo - coarser).abs().cmple(least_change * albedo).all() {
                break;
            }
        }
        albedo
    }

    /// [`Self::albedo_from`] by so many steps of theta_h and phi_h.
    fn albedo_in_steps(&self, theta_o: f64, phi_o: f64, [theta_steps, phi_steps]: [usize; 2]) -> DVec3 {
        let w_o = (DVec2::from_angle(phi_o) * theta_o.sin()).extend(theta_o.cos());
        let azimuths: Vec<_> =
            (0..phi_steps).map(|j| DVec2::from_angle(2.0 * PI * (j as f64 + 0.5) / phi_steps as f64)).collect();
        let mut sum = DVec3::ZERO;
        for i in 0..theta_steps {
            let x = (i as f64 + 0.5) / theta_steps as f64;
            let (sin_theta_h, cos_theta_h) = (FRAC_PI_2 * x * x).sin_cos();
            // dw_h = sin(theta_h) dtheta_h dphi_h with dtheta_h = pi x dx.
            let ring = sin_theta_h * PI * x / theta_steps as f64 * (2.0 * PI / phi_steps as f64);
            let mirrored = azimuths.iter().filter_map(|azimuth| {
                let h = (azimuth * sin_theta_h).extend(cos_theta_h);
                let cos_theta_d = w_o.dot(h);
                let w_i = reflect(w_o, h);
                (cos_theta_d > 0.0 && w_i.z > 0.0).then_some((w_i, cos_theta_d))
            });
            let (w_i, cosines): (Vec<_>, Vec<_>) = mirrored.unzip();
            for ((f, w_i), cos_theta_d) in self.evaluate_all(&w_i, w_o).into_iter().zip(&w_i).zip(cosines) {
                // dw_i = 4 (w_o . h) dw_h.
                sum += f * (w_i.z * 4.0 * cos_theta_d * ring);
            }
        }
        sum
    }
}

/// The model that the text of a material's TOML file names, and the other keys.
fn model_of(text: &str) -> Result<(String, toml::Table)> {
    let mut table: toml::Table = text.parse().map_err(|error: toml::de::Error| {
        Error::input("TOML", toml_problem(text, &error), "correct the file's syntax")
    })?;
    Ok((parameters::take_model(&mut table)?, table))
}

/// What the channels of linear Rec. 709 add to luminance.
pub const LUMINANCE: DVec3 = dvec3(0.2126, 0.7152, 0.0722);

/// Luminance of a linear Rec. 709 colour.
#[inline]
pub fn luminance(rgb: DVec3) -> f64 {
    rgb.dot(LUMINANCE)
}

/// Warns where `most`, that `what` of a model with these `parameters` is, exceeds 1 in some channel: such a surface reflects more light than
/// it receives.
fn warn_of_excess(parameters: &Parameters, what: &str, most: DVec3) {
    let most = most.max_element();
    if most > 1.0 + 1e-9 && !parameters.only_checks() {
        tracing::warn!("{what} is {most:.3}: the surface reflects more light than it receives");
    }
}

/// Adds numbers to a fingerprint, independent of the machine's byte order.
fn hash_numbers(hasher: &mut blake3::Hasher, numbers: impl IntoIterator<Item = f64>) {
    for number in numbers {
        hasher.update(&number.to_le_bytes());
    }
}

#[cfg(test)]
pub(crate) mod tests;
