//! By which constants shaders are specialised for what a scene has: what it does not need is compiled out.
use crate::brdf::{Brdf, LobeShape};
use crate::light::{BlurredLight, KernelNeeds, sharp_from};
use crate::method::Pattern;
use crate::passes::ShaderOfMaterial;
use crate::prepare::{Prepared, PreparedMaterial};
use crate::threads::Threads;

/// Views from this angle on are grazing, in radians: a quarter of a sphere is seen at 60 degrees or more. Kernels that look up the environment as it is
/// there only are left to a shader for such views.
const GRAZING_RAD: f64 = 60.0 * std::f64::consts::PI / 180.0;

/// Specialisation constants by name.
pub(crate) type Constants = Vec<(&'static str, u32)>;

/// The shaders of a scene's method: materials that need the same share one, so that no pixel pays for what other materials are made of.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ShadersOfMaterials {
    /// What each is specialised by, besides the kind of pixels; no two are alike.
    pub constants: Vec<Constants>,
    /// Which of them shades each material.
    pub of_materials: Vec<ShaderOfMaterial>,
    /// Which of them shades pixels of several materials that have different ones, and what only grazing views need.
    pub of_mixed: u32,
}

impl ShadersOfMaterials {
    /// For `prepared`, under this light of fitted threads if its method looks that up; so many at most.
    pub fn new(prepared: &Prepared, light: Option<&BlurredLight>, most: usize) -> Self {
        let of_each = prepared.materials.iter().map(|material| {
            let constants = |needs| shade_constants(prepared, std::slice::from_ref(material), needs);
            // Drafts follow each other faster than shaders could be compiled for what each of them needs.
            let Some(light) = light.filter(|_| !prepared.is_draft) else {
                return (constants(light.map(|light| light.needs)), ShaderOfMaterial::NEVER);
            };
            let needs = KernelNeeds::of(&prepared.environment, &[material.shaded()], &light.rest);
            match material.threads.as_deref().and_then(|threads| sharp_from(threads, &light.rest)) {
                Some(theta_o) if theta_o >= GRAZING_RAD => {
                    (constants(Some(KernelNeeds { map: false, ..needs })), theta_o.cos() as f32)
                }
                _ => (constants(Some(needs)), ShaderOfMaterial::NEVER),
            }
        });
        let of_all = shade_constants(prepared, &prepared.materials, light.map(|light| light.needs));
        Self::of(&of_each.collect::<Vec<_>>(), of_all, most)
    }

    /// What the shader of each class of pixels is specialised by: of interior pixels and of those at edges, shader by shader.
    pub fn constants_of_classes(&self) -> impl Iterator<Item = Constants> {
        self.constants.iter().flat_map(|constants| {
            [1, 0].map(|is_interior| constants.iter().copied().chain([("IS_INTERIOR", is_interior)]).collect())
        })
    }

    /// Where each material needs these constants, but those of all where cos theta_o is less, and all together need `of_all`; that is also the shader of
    /// materials beyond the `most` that there may be.
    fn of(of_each: &[(Constants, f32)], of_all: Constants, most: usize) -> Self {
        let mut constants: Vec<Constants> = Vec::new();
        for (needed, _) in of_each {
            if constants.len() + 1 < most && !constants.contains(needed) {
                constants.push(needed.clone());
            }
        }
        if !constants.contains(&of_all) {
            constants.push(of_all.clone());
        }
        let shader = |needed: &Constants| constants.iter().position(|constants| constants == needed);
        let of_mixed = shader(&of_all).unwrap_or(0);
        let of_material = |(needed, cos_grazing): &(Constants, f32)| {
            let shader = shader(needed).unwrap_or(of_mixed) as u32;
            ShaderOfMaterial { shader, cos_grazing: *cos_grazing }
        };
        Self { of_materials: of_each.iter().map(of_material).collect(), of_mixed: of_mixed as u32, constants }
    }
}

/// What `classify` is specialised by, if shading has these shaders.
pub(crate) fn classify_constants(prepared: &Prepared, shaders: &ShadersOfMaterials) -> Constants {
    let has_grazing = shaders.of_materials.iter().any(ShaderOfMaterial::has_grazing);
    vec![
        ("SUBPIXELS", prepared.view.subpixels),
        ("HAS_TANGENTS", prepared.has_tangents().into()),
        ("CLASSES", 2 * shaders.constants.len() as u32),
        ("HAS_GRAZING", has_grazing.into()),
    ]
}

/// What the shader of the method of `prepared` is specialised by for these materials of it, whose kernels have these needs.
fn shade_constants(prepared: &Prepared, materials: &[PreparedMaterial], needs: Option<KernelNeeds>) -> Constants {
    let Prepared { method, environment, view, sampling, .. } = prepared;
    let lobes = materials.iter().map(|material| (&*material.brdf, &*material.lobe));
    let has_tangents = materials.iter().any(|material| !material.lobe.is_isotropic);
    let mut constants = vec![
        ("SUBPIXELS", view.subpixels),
        ("HAS_TANGENTS", has_tangents.into()),
        ("HAS_ONE_MATERIAL", (prepared.materials.len() == 1).into()),
        ("MODELS_USED", models_used(lobes, method.evaluates_brdf(environment))),
    ];
    if method.has_pattern() {
        constants.push(("FIXED_PATTERN", (sampling.pattern == Pattern::Fixed).into()));
    }
    if let Some(needs) = needs {
        let is_uneven = |material: &PreparedMaterial| material.threads.as_deref().is_some_and(Threads::has_uneven_rim);
        // Drafts have one shader.
        let has_uneven_rim = prepared.is_draft || materials.iter().any(is_uneven);
        constants.extend(needs.constants());
        constants.push(("HAS_UNEVEN_RIM", has_uneven_rim.into()));
    }
    constants
}

/// Bit i: a material has the BRDF of model i, and it is evaluated.
fn models_used<'a>(materials: impl Iterator<Item = (&'a Brdf, &'a LobeShape)>, evaluates_brdf: bool) -> u32 {
    let bits = materials.filter(|_| evaluates_brdf).map(|(brdf, lobe)| 1 << brdf.model_index(lobe));
    bits.fold(0, |all, bit| all | bit)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::passes::MAX_SHADERS;

    fn needing(models: u32) -> Constants {
        vec![("SUBPIXELS", 2), ("MODELS_USED", models)]
    }

    #[test]
    fn materials_that_need_the_same_share_a_shader_and_pixels_of_others_have_one_with_all() {
        let of = |models: &[u32]| {
            let all = models.iter().fold(0, |all, models| all | models);
            let of_each: Vec<_> = models.iter().map(|models| (needing(*models), ShaderOfMaterial::NEVER)).collect();
            let shaders = ShadersOfMaterials::of(&of_each, needing(all), MAX_SHADERS);
            let constants: Vec<_> = shaders.constants.iter().map(|constants| constants[1].1).collect();
            let of_materials: Vec<_> = shaders.of_materials.iter().map(|of_material| of_material.shader).collect();
            (constants, of_materials, shaders.of_mixed)
        };
        assert_eq!(of(&[]), (vec![0], vec![], 0));
        assert_eq!(of(&[1, 1]), (vec![1], vec![0, 0], 0));
        assert_eq!(of(&[1, 2, 1]), (vec![1, 2, 3], vec![0, 1, 0], 2));
        // One that needs all is the shader of mixed pixels, too.
        assert_eq!(of(&[1, 3]), (vec![1, 3], vec![0, 1], 1));
        let many: Vec<u32> = (0..20).map(|model| 1 << model).collect();
        let (constants, of_materials, of_mixed) = of(&many);
        assert_eq!((constants.len(), of_mixed), (MAX_SHADERS, MAX_SHADERS as u32 - 1));
        assert_eq!(constants[of_mixed as usize], (1 << 20) - 1);
        assert_eq!(of_materials, (0..20).map(|material| of_mixed.min(material)).collect::<Vec<_>>());
    }

    #[test]
    fn a_material_that_needs_more_at_grazing_views_has_the_shader_for_all_there() {
        let of_each = [(needing(1), 0.2), (needing(1), ShaderOfMaterial::NEVER)];
        for materials in [&of_each[..1], &of_each] {
            let shaders = ShadersOfMaterials::of(materials, needing(3), MAX_SHADERS);
            assert_eq!((shaders.constants, shaders.of_mixed), (vec![needing(1), needing(3)], 1));
            let cosines = shaders.of_materials.iter().map(|of_material| (of_material.shader, of_material.cos_grazing));
            assert!(cosines.eq(materials.iter().map(|(_, cosine)| (0, *cosine))));
        }
    }
}
