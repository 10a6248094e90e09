//! Metallic-roughness as glTF 2.0 defines it, under a sheen and a clear coat. Twin: glsl/brdf/principled.glsl, for all but sheen.
//!
//! Khronos, "glTF 2.0 Specification", appendix B, for the base; names of layers as in OpenPBR. alpha = roughness^2, GGX facets with
//! Smith's separable shadowing, Schlick's Fresnel:
//!
//! ```text
//! base = (1 - metallic) ((1 - F(w_o . h)) base_colour / pi + F(w_o . h) D G / (4 cos cos)) + metallic F_m(w_o . h) D G / (4 cos cos)
//! where F has f0 = ((ior - 1) / (ior + 1))^2 and F_m has f0 = base_colour.
//! ```
//!
//! With the keys `anisotropy` = a, 0 to 1, and `anisotropy_convention` the facets of the base have a roughness_alpha along the tangent,
//! turned by `rotation_deg`, and another one across it:
//!
//! | `anisotropy_convention` | along the tangent | across it |
//! |---|---|---|
//! | `gltf` | mix(roughness^2, 1, a^2) | roughness^2 |
//! | `openpbr` | roughness^2 sqrt(2 / (1 + (1 - a)^2)) | (1 - a) times that, and no less than 0.001 |
//!
//! The first is KHR_materials_anisotropy of glTF (anisotropyStrength; anisotropyRotation is `rotation_deg` in radians), which only adds
//! roughness. The second is specular_roughness_anisotropy of OpenPBR, where the tangent is an input of its own; it keeps the mean of both
//! squares. In both, highlights are long along the tangent. KHR_materials_anisotropy has the height-correlated form of Smith's shadowing,
//! here it is separable. Sheen and coat are isotropic.
//!
//! Sheen (keys `sheen` and `sheen_roughness`) is Estevez and Kulla's distribution D_s = (2 + 1/r) sin(theta_h)^(1/r) / (2 pi), "Production
//! Friendly Microfacet Sheen BRDF" (2017), r = sheen_roughness^2, as in glTF's KHR_materials_sheen, with Neubelt's and Pettineo's 1 / (4
//! (cos_i + cos_o - cos_i cos_o)) for its visibility. What is below gets what it leaves: times 1 - max(sheen) E_s, of the direction of
//! which E_s, its albedo, is greater.
//!
//! The coat (keys `coat`, `coat_roughness`, `coat_ior`) is a dielectric GGX lobe times `coat`. What is below is seen through it twice:
//! times (1 - coat F(cos theta_i)) (1 - coat F(cos theta_o)).
//!
//! glTF's and OpenPBR's own coats look only at the viewer; this one is reciprocal, so it differs from them by some per cent, most at grazing
//! angles. The base without layers is glTF's.
//!
//! Energy is not bounded by 1, as it is not in glTF. (1 - F) of the base is that of the facet, not of the surface: at grazing views of a smooth
//! dielectric the lobe has all of the light, and the diffuse part stays. White of roughness 0.05 has an albedo of 1.2 at 75 degrees and of
//! 1.84 at 89.5, of roughness 0.3 one of 1.33, of 0.7 one of 1.03. E_s exceeds 1 at grazing views where sheen_roughness is 0.4 or
//! less: over black, 3.3 at 89.5 degrees with 0.1. What a dielectric needs to lose nothing is `plastic`, or `layered`.
use std::f64::consts::{FRAC_1_PI, PI};
use std::sync::{Arc, OnceLock};

use glam::{DVec2, DVec3, Vec3, Vec4, dvec3};

use crate::brdf::microfacet::roughness::{Axes, ROTATION};
use crate::brdf::microfacet::{Distribution, fresnel_schlick};
use crate::brdf::{Model, NARROWEST_ALPHA, Parameters, Roughness, Spacing, hash_numbers};
use crate::error::Result;

/// Metallic-roughness with sheen and coat.
#[derive(Clone, Debug)]
pub struct Principled {
    /// Colour of the diffuse part of dielectrics, of reflection of metals; 0 to 1.
    pub base_colour: DVec3,
    /// 0 for dielectrics, 1 for metals.
    pub metallic: f64,
    /// 0.05 to 1; alpha is its square.
    pub roughness: f64,
    /// roughness_alpha of the base along both axes, if it differs by direction.
    pub anisotropic: Option<Roughness>,
    /// Index of refraction of dielectrics, 1 to 3.
    pub ior: f64,
    /// The layer of fibres, if there is one.
    pub sheen: Option<Sheen>,
    /// The clear coat, if there is one.
    pub coat: Option<Coat>,
}

/// Whose formula makes roughness along two axes of a roughness and an anisotropy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Convention {
    /// glTF's, KHR_materials_anisotropy.
    Gltf,
    /// OpenPBR's, specular_roughness_anisotropy.
    OpenPbr,
}

impl Convention {
    /// The roughness of the base along both axes, if there are keys of it.
    fn from_parameters(parameters: &mut Parameters, roughness: f64) -> Result<Option<Roughness>> {
        if !["anisotropy", "anisotropy_convention", ROTATION].iter().any(|key| parameters.has(key)) {
            return Ok(None);
        }
        let help = "How much the roughness along the tangent differs from that across it: 0 not at all.";
        let anisotropy = parameters.number("anisotropy", 0.0..=1.0, Spacing::Linear, help)?;
        let conventions = [("gltf", Convention::Gltf), ("openpbr", Convention::OpenPbr)];
        let help = "Whose anisotropy it is: glTF's adds roughness along the tangent, OpenPBR's keeps the mean of both.";
        let convention = parameters.choice("anisotropy_convention", &conventions, help)?;
        let alpha = convention.alpha(roughness, anisotropy);
        let rotation_deg = Axes::from_parameters(parameters)?.rotation_deg();
        Ok(Some(Roughness::new(alpha.x, alpha.y, rotation_deg)))
    }

    /// roughness_alpha along the tangent and across it.
    pub fn alpha(self, roughness: f64, anisotropy: f64) -> DVec2 {
        let alpha = roughness * roughness;
        match self {
            Convention::Gltf => DVec2::new(alpha + (1.0 - alpha) * anisotropy * anisotropy, alpha),
            Convention::OpenPbr => {
                let aspect = 1.0 - anisotropy;
                let along = alpha * (2.0 / (1.0 + aspect * aspect)).sqrt();
                DVec2::new(along, (aspect * along).max(NARROWEST_ALPHA))
            }
        }
    }
}

/// A layer of upright fibres.
#[derive(Clone, Debug)]
pub struct Sheen {
    /// Its colour, 0 to 1.
    pub colour: DVec3,
    /// 0.1 to 1; alpha is its square.
    pub roughness: f64,
    /// Albedo of the layer with colour 1, at equally spaced cosines; made when first asked for.
    albedo: Arc<OnceLock<Vec<f64>>>,
}

/// A clear coat.
#[derive(Clone, Copy, Debug)]
pub struct Coat {
    /// How much of it there is, 0 to 1.
    pub weight: f64,
    /// 0.05 to 1; alpha is its square.
    pub roughness: f64,
    /// Its index of refraction, 1 to 3.
    pub ior: f64,
}

/// Reflectance of a dielectric at normal incidence.
fn f0(ior: f64) -> f64 {
    ((ior - 1.0) / (ior + 1.0)).powi(2)
}

/// The index of refraction `key`, which may be left out.
fn index_of_refraction(parameters: &mut Parameters, key: &str) -> Result<f64> {
    let help = "Index of refraction, against air; 1.5 where left out.";
    parameters.number_or(key, 1.0..=3.0, 1.5, help)
}

impl Coat {
    fn from_parameters(parameters: &mut Parameters) -> Result<Option<Self>> {
        if !parameters.has("coat") {
            parameters.only_beside(&["coat_roughness", "coat_ior"], "coat");
            return Ok(None);
        }
        let weight = parameters.number("coat", 0.0..=1.0, Spacing::Linear, "How much clear coat there is.")?;
        let help = "Roughness of the clear coat, of which alpha is the square.";
        let roughness = parameters.number("coat_roughness", 0.05..=1.0, Spacing::Linear, help)?;
        Ok(Some(Self { weight, roughness, ior: index_of_refraction(parameters, "coat_ior")? }))
    }
}

impl Sheen {
    fn from_parameters(parameters: &mut Parameters) -> Result<Option<Self>> {
        if !parameters.has("sheen") {
            parameters.only_beside(&["sheen_roughness"], "sheen");
            return Ok(None);
        }
        let colour = parameters.colour("sheen", 0.0..=1.0, "Colour of a layer of fibres, linear Rec. 709.")?;
        let help = "Roughness of the layer of fibres, of which alpha is the square.";
        Ok(Some(Self::new(colour, parameters.number("sheen_roughness", 0.1..=1.0, Spacing::Linear, help)?)))
    }

    /// A layer of that colour and roughness.
    pub fn new(colour: DVec3, roughness: f64) -> Self {
        Self { colour, roughness, albedo: Arc::default() }
    }

    /// The layer's own reflection, with colour 1.
    fn lobe(&self, w_i: DVec3, w_o: DVec3) -> f64 {
        let h = (w_i + w_o).normalize();
        let power = (self.roughness * self.roughness).recip();
        let sin2 = h.x * h.x + h.y * h.y;
        let d = (2.0 + power) * sin2.powf(0.5 * power) / (2.0 * PI);
        // Both cosines may graze: then D is 1 at most, and 0 where the directions are opposite.
        d / (4.0 * (w_i.z + w_o.z - w_i.z * w_o.z))
    }

    /// Its albedo at a cosine.
    fn albedo(&self, cos_theta: f64) -> f64 {
        const COUNT: usize = 64;
        let table = self.albedo.get_or_init(|| {
            (0..COUNT).map(|i| self.integral(((i as f64) / (COUNT - 1) as f64).max(1e-3)).min(1.0)).collect()
        });
        let position = cos_theta.clamp(0.0, 1.0) * (COUNT - 1) as f64;
        let first = (position as usize).min(COUNT - 2);
        table[first] + (table[first + 1] - table[first]) * (position - first as f64)
    }

    /// The integral of the lobe times cos over all light.
    fn integral(&self, cos_theta: f64) -> f64 {
        const STEPS: usize = 64;
        let w_o = dvec3((1.0 - cos_theta * cos_theta).sqrt(), 0.0, cos_theta);
        let pairs = (0..STEPS).flat_map(|i| (0..STEPS).map(move |j| (i, j)));
        let term = |(i, j): (usize, usize)| {
            let cos = (i as f64 + 0.5) / STEPS as f64;
            let across = DVec2::from_angle(PI * (j as f64 + 0.5) / STEPS as f64) * (1.0 - cos * cos).sqrt();
            self.lobe(across.extend(cos), w_o) * cos
        };
        2.0 * PI * pairs.map(term).sum::<f64>() / (STEPS * STEPS) as f64
    }
}

impl Principled {
    /// roughness_alpha of the base along both axes.
    fn facets(&self) -> Roughness {
        self.anisotropic.unwrap_or_else(|| Roughness::isotropic(self.roughness * self.roughness))
    }

    fn base(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
        let h = (w_i + w_o).normalize();
        let cos_theta_d = w_o.dot(h);
        let lobe = Distribution::Ggx.torrance_sparrow(w_i, w_o, h, self.facets());
        let dielectric = fresnel_schlick(cos_theta_d, DVec3::splat(f0(self.ior)));
        let metal = fresnel_schlick(cos_theta_d, self.base_colour);
        ((1.0 - dielectric) * self.base_colour * FRAC_1_PI + dielectric * lobe) * (1.0 - self.metallic)
            + metal * (lobe * self.metallic)
    }
}

impl Model for Principled {
    fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
        let mut f = self.base(w_i, w_o);
        if let Some(sheen) = &self.sheen {
            let most = sheen.colour.max_element() * sheen.albedo(w_i.z).max(sheen.albedo(w_o.z));
            f = f * (1.0 - most) + sheen.colour * sheen.lobe(w_i, w_o);
        }
        if let Some(Coat { weight, roughness, ior }) = self.coat {
            let h = (w_i + w_o).normalize();
            let fresnel = |cos: f64| weight * fresnel_schlick(cos, DVec3::splat(f0(ior))).x;
            let lobe = Distribution::Ggx.torrance_sparrow(w_i, w_o, h, Roughness::isotropic(roughness * roughness));
            f = f * ((1.0 - fresnel(w_i.z)) * (1.0 - fresnel(w_o.z))) + fresnel(w_o.dot(h)) * lobe;
        }
        f
    }

    fn from_parameters(parameters: &mut Parameters) -> Result<Self> {
        let help = "Colour of the diffuse part of dielectrics, of the reflection of metals, linear Rec. 709.";
        let base_colour = parameters.colour("base_colour", 0.0..=1.0, help)?;
        let metallic = parameters.number("metallic", 0.0..=1.0, Spacing::Linear, "0 for dielectrics, 1 for metals.")?;
        let help = "Roughness, of which alpha is the square.";
        let roughness = parameters.number("roughness", 0.05..=1.0, Spacing::Linear, help)?;
        let anisotropic = Convention::from_parameters(parameters, roughness)?;
        let ior = index_of_refraction(parameters, "ior")?;
        let (sheen, coat) = (Sheen::from_parameters(parameters)?, Coat::from_parameters(parameters)?);
        Ok(Self { base_colour, metallic, roughness, anisotropic, ior, sheen, coat })
    }

    fn needs_table(&self) -> bool {
        // The albedo of fibres is a table of its own, and there is no room for more parameters.
        self.sheen.is_some()
    }

    fn gpu_parameters(&self) -> [Vec4; 3] {
        let coat = self.coat.map_or(Vec3::ZERO, |Coat { weight, roughness, ior }| {
            DVec3::new(weight, roughness * roughness, f0(ior)).as_vec3()
        });
        [
            self.base_colour.as_vec3().extend(self.metallic as f32),
            Vec4::new(f0(self.ior) as f32, coat.x, coat.y, coat.z),
            self.facets().gpu_parameters(),
        ]
    }

    fn without_rotation(&self) -> Option<(Self, f64)> {
        let (facets, deg) = self.anisotropic?.without_rotation()?;
        Some((Self { anisotropic: Some(facets), ..self.clone() }, deg))
    }

    fn hash_content(&self, hasher: &mut blake3::Hasher) {
        hash_numbers(hasher, self.base_colour.to_array());
        hash_numbers(hasher, [self.metallic, self.roughness, self.ior]);
        // A layer that is not there is not one of weight 0 at the place of the other.
        hasher.update(&[u8::from(self.sheen.is_some()), u8::from(self.coat.is_some())]);
        if let Some(Sheen { colour, roughness, .. }) = &self.sheen {
            hash_numbers(hasher, colour.to_array().into_iter().chain([*roughness]));
        }
        if let Some(Coat { weight, roughness, ior }) = self.coat {
            hash_numbers(hasher, [weight, roughness, ior]);
        }
        if let Some(facets) = self.anisotropic {
            facets.hash_content(hasher);
        }
    }
}
