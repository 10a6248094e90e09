//! Loads everything that a scene names, and makes the threads of its materials: all that the GPU will need.
use crate::brdf::Brdf;
use crate::environment::Environment;
use crate::method::Method;
use crate::passes::{PlacedMesh, Sampling, View};
use crate::scene::{Camera, MaterialSource, Mesh, Scene};
use crate::threads::{self, CacheState, Observer, Threads};
use crate::{Error, Result};
use glam::{DAffine3, DVec3};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

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
    pub environment: Arc<Environment>,
    /// Each mesh once, however many objects have it.
    pub meshes: Vec<(String, Arc<Mesh>)>,
    /// The objects.
    pub objects: Vec<PlacedMesh>,
    /// Name, BRDF and threads of each material that an object has.
    pub materials: Vec<PreparedMaterial>,
    /// Time it took to make or load the threads.
    pub thread_time: Duration,
    /// Whether all threads came from the cache.
    pub thread_cache: CacheState,
}

/// A material that some object has.
#[derive(Clone)]
pub struct PreparedMaterial {
    /// Name in the scene.
    pub name: String,
    /// Its BRDF.
    pub brdf: Brdf,
    /// Where that comes from.
    pub source: MaterialSource,
    /// Its threads, for methods that use them.
    pub threads: Option<Arc<Threads>>,
}

/// Reads a material: a built-in's name, or a file.
///
/// # Errors
/// Neither, or a file that cannot be used.
pub fn load_material(source: &MaterialSource) -> Result<Brdf> {
    match source {
        MaterialSource::File(path) => Brdf::load(path),
        MaterialSource::Builtin(name) => Brdf::builtin(name).ok_or_else(|| {
            let remedy = format!("give {}", Brdf::FILES.files_or_builtins());
            Error::input(format!("material \"{name}\""), "is neither built in nor a file", remedy)
        }),
        MaterialSource::Model { model, parameters } => Brdf::from_parameters(model, parameters.clone()),
        MaterialSource::Custom(custom) => Ok(Brdf::Custom(custom.clone())),
    }
}

/// The threads that `method` shades `brdf` by, so many and from this seed, as [`threads::load_or_generate`] has them; none for a
/// method that draws samples instead.
///
/// # Errors
/// A number of threads that is out of range, or a cancelled generation.
pub fn load_threads(
    method: Method,
    brdf: &Brdf,
    [count, seed]: [u64; 2],
    cache: Option<&Path>,
    observer: &dyn Observer,
) -> Result<Option<(Threads, CacheState, Duration)>> {
    let Some(kind) = method.threads() else { return Ok(None) };
    let settings = threads::ThreadSettings { kind, count: count as usize, seed, ..Default::default() };
    threads::load_or_generate(brdf, &settings, cache, observer).map(Some)
}

/// Loads and makes everything; thread generation reports to `observer` and is cached in `cache` if that is a folder.
///
/// # Errors
/// The first file or setting that cannot be used, or a cancelled generation.
pub fn prepare(scene: &Scene, cache: Option<&Path>, observer: &dyn Observer) -> Result<Prepared> {
    prepare_again(scene, None, cache, observer)
}

/// The same, taking from `before` what has not changed since: meshes, environment (with what was made of it) and materials of the
/// same source, and threads of the same settings.
///
/// # Errors
/// As for [`prepare`].
pub fn prepare_again(
    scene: &Scene,
    before: Option<&Prepared>,
    cache: Option<&Path>,
    observer: &dyn Observer,
) -> Result<Prepared> {
    let method = Method::from_name(&scene.shading.method)?;
    let count = scene.shading.threads.unwrap_or(method.default_count());
    check_count(method, count, scene.image.subpixels)?;
    let sampling = Sampling { count, seed: scene.shading.seed };
    let mut meshes: Vec<(String, Arc<Mesh>)> = Vec::new();
    let mut objects = Vec::new();
    let mut used_materials: Vec<&str> = Vec::new();
    for object in &scene.objects {
        let name = object.mesh.to_string();
        let mesh = match meshes.iter().position(|(known, _)| *known == name) {
            Some(known) => known,
            None => {
                let known = before.and_then(|before| before.meshes.iter().find(|(known, _)| *known == name));
                let mesh = match known {
                    Some((_, mesh)) => mesh.clone(),
                    None => Arc::new(object.load_mesh()?),
                };
                cancelled(observer)?;
                meshes.push((name, mesh));
                meshes.len() - 1
            }
        };
        let material = used_materials.iter().position(|known| *known == object.material).unwrap_or_else(|| {
            used_materials.push(&object.material);
            used_materials.len() - 1
        });
        objects.push(PlacedMesh {
            mesh,
            material: material as u32,
            to_world: DAffine3::from_mat4(object.transform().as_dmat4()),
        });
    }
    let environment = match before.filter(|before| before.scene.environment.source == scene.environment.source) {
        Some(before) => before.environment.clone(),
        None => Arc::new(scene.environment.load()?),
    };
    cancelled(observer)?;
    let image = &scene.image;
    for object in &objects {
        check_size(&meshes[object.mesh].0, world_sphere(&meshes, object))?;
    }
    let view = view_of(scene, bounding_sphere(&meshes, &objects))?;

    let mut materials = Vec::new();
    let mut thread_time = Duration::ZERO;
    let mut thread_cache = CacheState::Hit;
    for name in used_materials {
        // The scene has checked that every material an object names is there.
        let Some(settings) = scene.materials.iter().find(|material| material.name == name) else { continue };
        let known = before.and_then(|before| before.material(&settings.source));
        let brdf = match known {
            Some(known) => known.brdf.clone(),
            None => load_material(&settings.source).map_err(|error| match settings.source {
                MaterialSource::Model { .. } => error.within(format!("material \"{name}\"")),
                _ => error,
            })?,
        };
        cancelled(observer)?;
        let source = settings.source.clone();
        let mut material = PreparedMaterial { name: name.to_owned(), brdf, source, threads: None };
        let same_threads =
            |before: &&Prepared| (before.method.threads(), before.sampling) == (method.threads(), sampling);
        if let Some(known) = before.filter(same_threads).and(known) {
            material.threads.clone_from(&known.threads);
        } else if let Some((threads, state, time)) =
            load_threads(method, &material.brdf, [count.into(), sampling.seed], cache, observer)?
        {
            thread_time += time;
            if state == CacheState::Miss {
                thread_cache = CacheState::Miss;
            }
            material.threads = Some(Arc::new(threads.of_material(name)));
        }
        materials.push(material);
    }
    Ok(Prepared {
        scene: scene.clone(),
        method,
        sampling,
        view,
        show_environment: image.background == crate::scene::Background::Environment,
        environment,
        meshes,
        objects,
        materials,
        thread_time,
        thread_cache,
    })
}

/// The view of `scene`, whose objects are within a sphere of this centre and radius.
///
/// # Errors
/// Objects that no camera can frame.
pub fn view_of(scene: &Scene, (centre, radius): (DVec3, f64)) -> Result<View> {
    let image = &scene.image;
    let camera = match scene.camera {
        Some(camera) => camera,
        None => {
            let camera = Camera::framing(centre, radius, image.aspect());
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
    /// Centre and radius of a sphere that holds all objects.
    pub fn bounding_sphere(&self) -> (DVec3, f64) {
        bounding_sphere(&self.meshes, &self.objects)
    }

    /// The material that comes from `source`, if there is one.
    fn material(&self, source: &MaterialSource) -> Option<&PreparedMaterial> {
        self.materials.iter().find(|material| material.source == *source)
    }
}

/// [`Error::Cancelled`] if `observer` has had enough.
fn cancelled(observer: &dyn Observer) -> Result<()> {
    if observer.cancelled() { Err(Error::Cancelled) } else { Ok(()) }
}

/// An error for more threads than a table holds, or more samples than shaders may loop over.
pub(crate) fn check_count(method: Method, count: u32, subpixels: u32) -> Result<()> {
    // A pixel at an edge takes all samples in each sub-pixel. lavapipe silently leaves loops after 65535 iterations in all.
    const MOST_ITERATIONS: u32 = 65_000;
    let most = match method.threads() {
        Some(kind) => kind.max_count() as u32,
        None => MOST_ITERATIONS / (subpixels * subpixels),
    };
    if count <= most {
        return Ok(());
    }
    let problem = format!("are {count}, more than the {most} of method \"{}\"", method.name());
    let remedy = match method.threads() {
        Some(_) => format!("use at most {most}"),
        None => format!("use at most {most}, or fewer sub-pixels than {subpixels} x {subpixels}"),
    };
    Err(Error::input("threads", problem, remedy))
}

/// Centre and radius of a sphere in world space that holds `object`.
fn world_sphere(meshes: &[(String, Arc<Mesh>)], object: &PlacedMesh) -> (DVec3, f64) {
    let (center, radius) = meshes[object.mesh].1.bounding_sphere();
    let m = object.to_world.matrix3;
    let scale = m.x_axis.length().max(m.y_axis.length()).max(m.z_axis.length());
    (object.to_world.transform_point3(center.as_dvec3()), f64::from(radius) * scale)
}

/// An error for objects so large, small or far off that single precision, in which the GPU computes, would not hold areas
/// of their triangles.
fn check_size(mesh: &str, (center, radius): (DVec3, f64)) -> Result<()> {
    const SMALLEST: f64 = 1e-9;
    const LARGEST: f64 = 1e9;
    let remedy = format!("scale and place it such that both are from {SMALLEST:e} to {LARGEST:e}");
    let (reach, size) = (center.length() + radius, 2.0 * radius);
    // Written so that a NaN fails too.
    if size >= SMALLEST && reach <= LARGEST {
        return Ok(());
    }
    Err(Error::input(mesh, format!("is {size:.2e} in size and reaches {reach:.2e} from the origin"), remedy))
}

/// A sphere around the bounding spheres of all objects: centre of their box, and the radius that reaches the farthest.
fn bounding_sphere(meshes: &[(String, Arc<Mesh>)], objects: &[PlacedMesh]) -> (DVec3, f64) {
    let spheres: Vec<_> = objects.iter().map(|object| world_sphere(meshes, object)).collect();
    let low = spheres.iter().fold(DVec3::INFINITY, |low, (center, radius)| low.min(*center - *radius));
    let high = spheres.iter().fold(DVec3::NEG_INFINITY, |high, (center, radius)| high.max(*center + *radius));
    let middle = (low + high) / 2.0;
    let reach = spheres.iter().map(|(center, radius)| center.distance(middle) + radius).fold(0.0, f64::max);
    (middle, reach)
}
