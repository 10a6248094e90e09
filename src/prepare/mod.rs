//! Loads everything that a scene names, and makes the threads of its materials: all that the GPU will need.
use crate::brdf::{Brdf, LobeShape};
use crate::environment::Environment;
use crate::geometry_texel::MAX_MATERIALS;
use crate::memo::{Key, Keyed, Round};
use crate::method::{Method, Sampling, Variant};
use crate::passes::{PlacedMesh, PlacedTangent, SmoothVariance, View};
use crate::scene::{BoundingSphere, Camera, MaterialSource, Mesh, MeshSource, Scene, TangentRule};
use crate::steps::{FindLobe, FitThreads, LoadBrushedMesh, LoadEnvironment, LoadMaterial, LoadMesh};
use crate::threads::{ShadedLobe, ThreadSettings, Threads};
use crate::{Error, Result};
use glam::DAffine3;

mod draft;
mod key;

pub use draft::{can_draft, may_be_drafted, prepare_draft};
pub use key::key_of;

/// A scene with all its files read and its threads made. Cheap to clone.
#[derive(Clone)]
pub struct Prepared {
    /// What it was prepared from.
    pub scene: Scene,
    /// How to estimate radiance.
    pub method: Method,
    /// How many threads or samples, and which random numbers.
    pub sampling: Sampling,
    /// Camera, resolution and display settings.
    pub view: View,
    /// Whether the environment is seen behind the objects.
    pub show_environment: bool,
    /// The light.
    pub environment: Keyed<Environment>,
    /// Each mesh once, however many objects have it.
    pub meshes: Vec<NamedMesh>,
    /// The objects.
    pub objects: Vec<PlacedMesh>,
    /// Name, BRDF and threads of each material that an object has.
    pub materials: Vec<PreparedMaterial>,
    /// Whether some of its threads only stand in for those that are being made, and others may follow at once.
    pub is_draft: bool,
}

/// A mesh that some object has.
#[derive(Clone)]
pub struct NamedMesh {
    /// Name in the scene.
    pub name: String,
    /// Its triangles.
    pub mesh: Keyed<Mesh>,
}

/// A material that some object has.
#[derive(Clone)]
pub struct PreparedMaterial {
    /// Name in the scene.
    pub name: String,
    /// Its BRDF as the scene has it, against the tangent of a surface.
    pub turned_brdf: Keyed<Brdf>,
    /// The same in its own axes, by which it is shaded: [`in_own_axes`].
    pub brdf: Keyed<Brdf>,
    /// By how many degrees these are turned: see [`PlacedTangent::turn_deg`].
    pub rotation_deg: f64,
    /// The lobe of [`Self::brdf`].
    pub lobe: Keyed<LobeShape>,
    /// Its threads, for methods that use them.
    pub threads: Option<Keyed<Threads>>,
}

/// `brdf` in its own axes, and its rotation in degrees: [`Brdf::without_rotation`].
pub fn in_own_axes(brdf: &Keyed<Brdf>) -> (Keyed<Brdf>, f64) {
    match brdf.without_rotation() {
        // Known by what it is, so it is the same for all rotations.
        Some((own, rotation_deg)) => (Keyed::new(Key::of_digest(own.fingerprint()), own), rotation_deg),
        None => (brdf.clone(), 0.0),
    }
}

impl PreparedMaterial {
    /// A material of this name and BRDF, as the scene has it; threads are yet to come.
    ///
    /// # Errors
    /// Cancelled.
    pub fn new(name: String, turned_brdf: Keyed<Brdf>, round: &Round) -> Result<Self> {
        let (brdf, rotation_deg) = in_own_axes(&turned_brdf);
        let lobe = round.ask(&FindLobe(&brdf))?;
        Ok(Self { name, turned_brdf, brdf, rotation_deg, lobe, threads: None })
    }

    /// [`Threads::shared_deviation`]; 0 without threads.
    pub(crate) fn shared_deviation(&self) -> f64 {
        self.threads.as_deref().map_or(0.0, |threads| threads.shared_deviation(&self.lobe))
    }

    /// Its lobe and threads.
    pub fn shaded(&self) -> ShadedLobe<'_> {
        ShadedLobe { lobe: &self.lobe, threads: self.threads.as_deref() }
    }
}

/// The threads that `method` shades `material` by in a picture of `subpixels` x `subpixels` to the pixel; none for a method that draws
/// samples instead.
///
/// # Errors
/// A number of threads that is out of range; cancelled.
pub fn ask_threads(
    round: &Round,
    method: Method,
    material: &PreparedMaterial,
    sampling: Sampling,
    subpixels: u32,
) -> Result<Option<Keyed<Threads>>> {
    let Some(settings) = thread_settings(method, &material.lobe, sampling, subpixels) else { return Ok(None) };
    round.ask(&FitThreads { brdf: &material.brdf, settings }).map(Some)
}

/// Which threads `method` shades a BRDF of this lobe by, if it does.
fn thread_settings(method: Method, lobe: &LobeShape, sampling: Sampling, subpixels: u32) -> Option<ThreadSettings> {
    let Sampling { count, seed, .. } = sampling;
    let settings = ThreadSettings { kind: method.threads()?, count: count as usize, seed, ..ThreadSettings::default() };
    Some(settings.for_picture(lobe, subpixels))
}

/// The threads of the material from `source` by itself, as a picture of `subpixels` x `subpixels` to the pixel has them.
///
/// # Errors
/// A material that cannot be used, settings that ask for no threads or too many; cancelled.
pub fn threads_of(
    source: &MaterialSource,
    settings: ThreadSettings,
    subpixels: u32,
    round: &Round,
) -> Result<Keyed<Threads>> {
    let (brdf, _) = in_own_axes(&round.ask(&LoadMaterial(source))?);
    let settings = settings.for_picture(&*round.ask(&FindLobe(&brdf))?, subpixels);
    round.ask(&FitThreads { brdf: &brdf, settings })
}

/// Asks `round` for all that `scene` names, and for the threads of its materials.
///
/// # Errors
/// The first file or setting that cannot be used; cancelled.
pub fn prepare(scene: &Scene, round: &Round) -> Result<Prepared> {
    let subpixels = scene.image.subpixels;
    let ask = |method, material: &PreparedMaterial, sampling| ask_threads(round, method, material, sampling, subpixels);
    prepare_by(scene, round, &ask)
}

/// Gives the threads of a material that has none yet.
type AskThreads<'a> = dyn Fn(Method, &PreparedMaterial, Sampling) -> Result<Option<Keyed<Threads>>> + 'a;

fn prepare_by(scene: &Scene, round: &Round, ask_threads: &AskThreads) -> Result<Prepared> {
    scene.check()?;
    let method = scene.shading.method;
    let count = scene.shading.count();
    check_count(method, count, scene.image.subpixels)?;
    let Variant { pattern, .. } = Variant::new(method, scene.shading.pattern);
    let sampling = Sampling { count, seed: scene.shading.seed, pattern };
    let (meshes, objects) = place_meshes(scene, round)?;
    let environment = round.ask(&LoadEnvironment(&scene.environment.source))?;
    let spheres = world_spheres(&meshes, &objects);
    for (object, &sphere) in objects.iter().zip(&spheres) {
        check_object_size(&meshes[object.mesh].name, sphere)?;
    }
    let view = view_of(scene, BoundingSphere::around(&spheres))?;
    check_materials(scene)?;
    let mut materials = Vec::new();
    for name in scene.used_materials() {
        // `check` has found every material that an object names.
        let Some(settings) = scene.material(name) else { continue };
        let brdf = round.ask(&LoadMaterial(&settings.source)).map_err(|error| match settings.source {
            MaterialSource::Model { .. } => error.within(format!("material \"{name}\"")),
            _ => error,
        })?;
        let material = PreparedMaterial::new(name.to_owned(), brdf, round)?;
        let threads = ask_threads(method, &material, sampling)?;
        materials.push(PreparedMaterial { threads, ..material });
    }
    let mut prepared = Prepared {
        scene: scene.clone(),
        method,
        sampling,
        view,
        show_environment: !scene.image.has_alpha(),
        environment,
        meshes,
        objects,
        materials,
        is_draft: false,
    };
    prepared.place_tangents(round)?;
    Ok(prepared)
}

/// The meshes of `scene`, each once, with their names; and its objects.
fn place_meshes(scene: &Scene, round: &Round) -> Result<(Vec<NamedMesh>, Vec<PlacedMesh>)> {
    let mut meshes: Vec<NamedMesh> = Vec::new();
    let used_materials = scene.used_materials();
    let mut objects = Vec::new();
    for object in &scene.objects {
        let mesh = round.ask(&LoadMesh(&object.mesh))?;
        let index = index_of_mesh(&mut meshes, mesh, &object.mesh);
        let material = used_materials.iter().position(|known| *known == object.material);
        objects.push(PlacedMesh {
            mesh: index,
            material: material.expect("used materials are those of objects") as u32,
            to_world: DAffine3::from_mat4(object.transform().as_dmat4()),
            tangent: None,
        });
    }
    Ok((meshes, objects))
}

/// The place of `mesh`, which comes from `source`, among `meshes`: the last if it was not yet there.
fn index_of_mesh(meshes: &mut Vec<NamedMesh>, mesh: Keyed<Mesh>, source: &MeshSource) -> usize {
    meshes.iter().position(|known| known.mesh.key == mesh.key).unwrap_or_else(|| {
        meshes.push(NamedMesh { name: source.to_string(), mesh });
        meshes.len() - 1
    })
}

/// An error for more materials than a texel of the geometry cache can tell apart.
fn check_materials(scene: &Scene) -> Result<()> {
    let count = scene.used_materials().len();
    if count <= MAX_MATERIALS {
        return Ok(());
    }
    let problem = format!("of objects are {count}, more than {MAX_MATERIALS}");
    Err(Error::input("materials", problem, "use fewer"))
}

/// The view of `scene`, whose objects are within `sphere`.
///
/// # Errors
/// Objects that no camera can frame.
pub fn view_of(scene: &Scene, sphere: BoundingSphere) -> Result<View> {
    let image = &scene.image;
    let camera = match scene.camera {
        Some(camera) => camera,
        None => {
            let camera = Camera::framing(sphere.centre, sphere.radius, image.aspect());
            camera.validate().map_err(|problem| {
                let problem = format!("cannot be chosen: {problem}");
                Error::input("[camera]", problem, "give eye and target in the scene file")
            })?;
            camera
        }
    };
    Ok(View {
        camera,
        width: image.width,
        height: image.height,
        subpixels: image.subpixels,
        rotation_deg: scene.environment.rotation_deg,
        intensity: scene.environment.intensity,
        exposure: image.exposure as f32,
        gamma: image.gamma as f32,
    })
}

impl Prepared {
    /// The same without the environment behind the objects, as pictures are compared.
    pub fn objects_alone(&self) -> Self {
        Self { show_environment: false, ..self.clone() }
    }

    /// A sphere around each object, in world space.
    pub fn spheres(&self) -> Vec<BoundingSphere> {
        world_spheres(&self.meshes, &self.objects)
    }

    /// Gives objects the tangents that their materials need, and no others: to be called when materials were changed.
    ///
    /// # Errors
    /// A mesh that cannot be read again with its texture coordinates; cancelled.
    pub fn place_tangents(&mut self, round: &Round) -> Result<()> {
        for (object, settings) in self.objects.iter_mut().zip(&self.scene.objects) {
            let material = object.material as usize;
            let needs_tangent = !self.materials[material].lobe.is_isotropic;
            if settings.tangent == Some(TangentRule::Uv) {
                let brushed = needs_tangent.then(|| round.ask(&LoadBrushedMesh(&settings.mesh))).transpose()?;
                let mesh = match brushed.filter(|mesh| !mesh.tangents.is_empty()) {
                    Some(mesh) => mesh,
                    None => round.ask(&LoadMesh(&settings.mesh))?,
                };
                object.mesh = index_of_mesh(&mut self.meshes, mesh, &settings.mesh);
            }
            let name = &self.materials[material].name;
            let rule = match settings.tangent {
                Some(TangentRule::Uv) if self.meshes[object.mesh].mesh.tangents.is_empty() => None,
                rule => rule,
            };
            match settings.tangent {
                _ if !needs_tangent || rule.is_some() => {}
                None => tracing::info!(
                    "an object of \"{name}\", which is anisotropic, has no `tangent`: it is brushed around its y axis"
                ),
                Some(_) => tracing::warn!(
                    "{} has no texture coordinates that its `tangent` could go by: \"{name}\" is brushed around its y axis",
                    settings.mesh
                ),
            }
            object.tangent = needs_tangent.then(|| PlacedTangent {
                rule: rule.unwrap_or(TangentRule::DEFAULT),
                turn_deg: self.materials[material].rotation_deg,
            });
        }
        self.drop_unused_meshes();
        Ok(())
    }

    /// Meshes that no object has take no memory on the device.
    fn drop_unused_meshes(&mut self) {
        let is_used = |index: &usize| self.objects.iter().any(|object| object.mesh == *index);
        let kept: Vec<_> = (0..self.meshes.len()).filter(is_used).collect();
        if kept.len() == self.meshes.len() {
            return;
        }
        for object in &mut self.objects {
            object.mesh = kept.iter().position(|index| *index == object.mesh).expect("a mesh of an object is kept");
        }
        self.meshes = kept.into_iter().map(|index| self.meshes[index].clone()).collect();
    }

    /// The method, and where it draws its samples.
    pub fn variant(&self) -> Variant {
        Variant::new(self.method, self.sampling.pattern)
    }

    /// Whether a material of it is anisotropic, so that objects have tangents.
    pub fn has_tangents(&self) -> bool {
        self.objects.iter().any(|object| object.tangent.is_some())
    }

    /// From which variances on sub-pixels are no smooth surface.
    pub fn smooth_variance(&self) -> SmoothVariance {
        let deviations = self.materials.iter().map(PreparedMaterial::shared_deviation);
        SmoothVariance::of(self.method, &self.environment, deviations.fold(0.0, f64::max))
    }

    /// Lobe and threads of each material.
    pub fn shaded(&self) -> Vec<ShadedLobe<'_>> {
        self.materials.iter().map(PreparedMaterial::shaded).collect()
    }
}

/// An error for more threads than a table holds, or more samples than shaders may loop over.
pub(crate) fn check_count(method: Method, count: u32, subpixels: u32) -> Result<()> {
    let most = method.max_count(subpixels);
    if count <= most {
        return Ok(());
    }
    let problem = format!("are {count}, more than the {most} of method \"{}\"", method.name());
    let remedy = match method.max_count(1) == most {
        true => format!("use at most {most}"),
        false => format!("use at most {most}, or fewer sub-pixels than {subpixels} x {subpixels}"),
    };
    Err(Error::input("threads", problem, remedy))
}

/// A sphere in world space for each object, that holds it.
fn world_spheres(meshes: &[NamedMesh], objects: &[PlacedMesh]) -> Vec<BoundingSphere> {
    let of_meshes: Vec<_> = meshes.iter().map(|named| named.mesh.bounding_sphere()).collect();
    objects.iter().map(|object| object.placed_sphere(of_meshes[object.mesh])).collect()
}

/// An error for an object so large, small or far off that single precision, in which the GPU computes, would not hold areas
/// of its triangles.
fn check_object_size(mesh: &str, BoundingSphere { centre, radius }: BoundingSphere) -> Result<()> {
    const SMALLEST: f64 = 1e-9;
    const LARGEST: f64 = 1e9;
    let remedy = format!("scale and place it such that both are from {SMALLEST:e} to {LARGEST:e}");
    let (reach, size) = (centre.length() + radius, 2.0 * radius);
    // Written so that a NaN fails too.
    if size >= SMALLEST && reach <= LARGEST {
        return Ok(());
    }
    Err(Error::input(mesh, format!("is {size:.2e} in size and reaches {reach:.2e} from the origin"), remedy))
}
