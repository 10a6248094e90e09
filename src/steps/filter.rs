//! Filters environments: what the methods look up of them, in memory.
use crate::Result;
use crate::brdf::BaseProfile;
use crate::environment::{Environment, LightMoments, Pyramid, VmfPyramid, ggx_pyramid, moments_file, pyramid_file};
use crate::light::{BlurredLight, KernelNeeds, Light, PrefilteredLight, bases};
use crate::memo::{Key, Keyed, Memo, Round, Step, Stored};
use crate::method::Method;
use crate::passes::vmf_pyramid;
use crate::steps::pipelines;
use crate::threads::ShadedLobe;
use crate::vulkan::{Device, DeviceKind};
use std::path::Path;
use std::sync::Arc;

/// The box-filtered pyramid of an environment.
pub struct BoxFilter<'a> {
    /// Of what.
    pub environment: &'a Keyed<Environment>,
    /// Texels along the edge of a face of level 0, a power of two; none for as many as the environment's pixels need.
    pub face_size: Option<usize>,
}

impl Step for BoxFilter<'_> {
    type Output = Pyramid;
    const NAME: &'static str = "environment";

    fn key(&self, _: &Memo) -> Result<Key> {
        Ok(Key::builder("box").key(self.environment.key).number(self.face_size() as u64).build())
    }

    fn make(&self, round: &Round) -> Result<Pyramid> {
        Pyramid::box_filtered_to(self.environment, self.face_size(), round.observer())
    }
}

impl BoxFilter<'_> {
    fn face_size(&self) -> usize {
        self.face_size.unwrap_or_else(|| Pyramid::face_size_for(self.environment))
    }
}

/// What irradiance of an environment is a sum of, by any base of so many terms.
struct GatherLight<'a> {
    environment: &'a Keyed<Environment>,
    terms: usize,
}

impl Step for GatherLight<'_> {
    type Output = LightMoments;
    const NAME: &'static str = "light by cosines";

    fn key(&self, _: &Memo) -> Result<Key> {
        let of = Key::builder("moments").key(self.environment.key).number(self.terms as u64);
        Ok(of.number(moments_file::FORMAT_VERSION).build())
    }

    fn make(&self, round: &Round) -> Result<LightMoments> {
        LightMoments::of(self.environment, self.terms, round.observer())
    }

    fn stored(&self) -> Option<Stored<'_, LightMoments>> {
        Some(Stored { extension: "moments", read: Box::new(moments_file::read), write: Box::new(moments_file::write) })
    }
}

/// Irradiance over pi by a base of this profile.
struct Irradiance<'a>(&'a Keyed<LightMoments>, BaseProfile);

impl Step for Irradiance<'_> {
    type Output = Pyramid;
    const NAME: &'static str = "irradiance";

    fn key(&self, _: &Memo) -> Result<Key> {
        let Self(light, BaseProfile(terms)) = self;
        let key = Key::builder("irradiance").key(light.key);
        Ok(terms.iter().fold(key, |key, term| key.real((*term).into())).build())
    }

    fn make(&self, _: &Round) -> Result<Pyramid> {
        Ok(self.0.irradiance(&self.1))
    }
}

/// The environment filtered by GGX lobes.
struct GgxFilter<'a>(&'a Keyed<Environment>);

impl Step for GgxFilter<'_> {
    type Output = Pyramid;
    const NAME: &'static str = "environment";

    fn key(&self, _: &Memo) -> Result<Key> {
        Ok(Key::builder("ggx").key(self.0.key).number(pyramid_file::GGX.version()).build())
    }

    fn make(&self, round: &Round) -> Result<Pyramid> {
        let source = round.ask(&BoxFilter { environment: self.0, face_size: None })?;
        ggx_pyramid(&source, round.observer())
    }

    fn stored(&self) -> Option<Stored<'_, Pyramid>> {
        let read = |path: &Path| pyramid_file::GGX.read(path);
        let write = |path: &Path, pyramid: &Pyramid| pyramid_file::GGX.write(path, pyramid);
        Some(Stored { extension: "pyramid", read: Box::new(read), write: Box::new(write) })
    }
}

/// An environment without its small sources, or these alone.
struct Part<'a> {
    environment: &'a Keyed<Environment>,
    of_sources: bool,
}

impl Step for Part<'_> {
    type Output = Environment;
    const NAME: &'static str = "sources";

    fn key(&self, _: &Memo) -> Result<Key> {
        Ok(Key::builder("part").key(self.environment.key).number(u64::from(self.of_sources)).build())
    }

    fn content_key(&self, part: &Environment) -> Option<Key> {
        Some(Key::of_digest(part.fingerprint()))
    }

    fn make(&self, _: &Round) -> Result<Environment> {
        Ok(self.environment.part(self.of_sources))
    }
}

/// An environment blurred by the kernels of fitted threads.
pub struct Blur<'a> {
    /// Of what.
    pub environment: &'a Keyed<Environment>,
    /// What makes it, if that is a GPU; else the processor does.
    pub device: Option<&'a Arc<Device>>,
}

impl Step for Blur<'_> {
    type Output = VmfPyramid;
    const NAME: &'static str = "environment";

    fn key(&self, _: &Memo) -> Result<Key> {
        // They round differently, each in its way.
        let made_by = self.gpu().map_or(Vec::new(), |device| device.driver_id());
        let of = Key::builder("blur").key(self.environment.key).number(self.face_size() as u64);
        Ok(of.number(pyramid_file::VMF.version()).bytes(&made_by).build())
    }

    fn make(&self, round: &Round) -> Result<VmfPyramid> {
        let face_size = Some(self.face_size());
        let source = round.ask(&BoxFilter { environment: self.environment, face_size })?;
        match self.gpu() {
            Some(device) => vmf_pyramid(device, &*pipelines(round, device)?, &source, round.observer()),
            None => VmfPyramid::new(&source, round.observer()),
        }
    }

    fn stored(&self) -> Option<Stored<'_, VmfPyramid>> {
        let read = |path: &Path| Ok(VmfPyramid { levels: pyramid_file::VMF.read(path)? });
        let write = |path: &Path, pyramid: &VmfPyramid| pyramid_file::VMF.write(path, &pyramid.levels);
        Some(Stored { extension: "pyramid", read: Box::new(read), write: Box::new(write) })
    }
}

impl<'a> Blur<'a> {
    /// Texels along the edge of a face of the box-filtered pyramid that it begins with: that of its own would show on maps of few pixels, so
    /// their texels are a quarter as large.
    fn face_size(&self) -> usize {
        const FEWEST: usize = 512;
        let face_size = Pyramid::face_size_for(self.environment);
        face_size.max((4 * face_size).min(FEWEST))
    }

    fn gpu(&self) -> Option<&'a Arc<Device>> {
        self.device.filter(|device| device.description().kind != DeviceKind::Cpu)
    }
}

/// What `method` looks up of `environment` for these materials, or what kernels of any others with the same bases do, too; `device` blurs, if there is one.
///
/// # Errors
/// Whatever Vulkan refuses; cancelled.
pub fn light(
    round: &Round,
    device: Option<&Arc<Device>>,
    method: Method,
    environment: &Keyed<Environment>,
    materials: &[ShadedLobe],
    for_any: bool,
) -> Result<Light> {
    let lookups = method.lookups();
    Ok(Light {
        box_filtered: match lookups.box_filtered {
            true => Some(round.ask(&BoxFilter { environment, face_size: None })?),
            false => None,
        },
        blurred: match lookups.blurred {
            true => Some(blurred_light(round, device, environment, materials, for_any)?),
            false => None,
        },
        prefiltered: match lookups.split_sum {
            true => Some(PrefilteredLight {
                by_ggx: round.ask(&GgxFilter(environment))?,
                irradiance: irradiance(round, environment, &[BaseProfile::EVEN])?.remove(0),
            }),
            false => None,
        },
    })
}

/// Irradiance over pi by each of these bases.
fn irradiance(round: &Round, environment: &Keyed<Environment>, bases: &[BaseProfile]) -> Result<Vec<Keyed<Pyramid>>> {
    let for_any = GatherLight { environment, terms: BaseProfile::TERMS };
    let for_even = GatherLight { environment, terms: BaseProfile::EVEN.terms() };
    let by_cosines = match bases.iter().all(|base| base.terms() <= for_even.terms) {
        // What was made for other bases has these terms, too.
        true => round.known(&for_any)?.map_or_else(|| round.ask(&for_even), Ok)?,
        false => round.ask(&for_any)?,
    };
    bases.iter().map(|base| round.ask(&Irradiance(&by_cosines, *base))).collect()
}

/// What fitted threads look up of `environment` for these materials, or those of any others with the same bases, too.
///
/// # Errors
/// Whatever Vulkan refuses; cancelled.
pub fn blurred_light(
    round: &Round,
    device: Option<&Arc<Device>>,
    environment: &Keyed<Environment>,
    materials: &[ShadedLobe],
    for_any: bool,
) -> Result<BlurredLight> {
    let has_sources = environment.has_small_sources();
    let part = |of_sources| match has_sources {
        true => round.ask(&Part { environment, of_sources }),
        false => Ok(environment.clone()),
    };
    let rest = part(false)?;
    let (bases, _) = bases(materials.iter().map(|material| material.threads));
    let irradiance = irradiance(round, &rest, &bases)?;
    let rest = round.ask(&Blur { environment: &rest, device })?;
    let needs = match for_any {
        true => KernelNeeds::of_any(environment),
        false => KernelNeeds::of(environment, materials, &rest),
    };
    let sources = match needs.mirrored_sources {
        true => Some(round.ask(&Blur { environment: &part(true)?, device })?),
        false => None,
    };
    Ok(BlurredLight { rest, sources, irradiance, needs })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment::tests::environment;

    #[test]
    fn pyramids_of_one_environment_and_two_sizes_are_two() {
        let sky = environment(8, 4, |x, y| [x as f32, y as f32, 1.0]);
        let environment = Keyed::new(Key::of_digest(sky.fingerprint()), sky);
        let memo = Memo::default();
        let round = memo.round(&());
        let [small, large] = [4, 16].map(|size| {
            let pyramid = round.ask(&BoxFilter { environment: &environment, face_size: Some(size) }).unwrap();
            (pyramid.key, pyramid.face_size)
        });
        assert_eq!((small.1, large.1), (4, 16));
        assert_ne!(small.0, large.0);
    }
}
