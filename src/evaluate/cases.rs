//! What evaluations go through: every material in every environment in every scene, by every method at every count.
use std::path::PathBuf;
use std::sync::Arc;

use super::metrics::Display;
use crate::error::{Error, Result};
use crate::method::Method;
use crate::prepare::{Prepared, PreparedMaterial, load_material, load_threads, prepare};
use crate::scene::{Background, EnvironmentSettings, MaterialSettings, MaterialSource, Scene, Source};
use crate::threads::{Observer, Threads};

/// A method with its number of threads, or of samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Estimator {
    /// How radiance is estimated.
    pub method: Method,
    /// 1 to 1024.
    pub count: u32,
}

/// All combinations of these.
#[derive(Clone, Debug)]
pub struct Cases {
    /// Estimators.
    pub methods: Vec<Method>,
    /// Numbers of threads, or of samples: each 1 to 1024.
    pub counts: Vec<u32>,
    /// Materials, by names that differ. One at a time is that of all objects.
    pub materials: Vec<(String, MaterialSource)>,
    /// Environments, by names that differ. Turn and intensity are the scene's.
    pub environments: Vec<(String, Source)>,
    /// Scenes, by names that differ. What they say of materials, environment, method, threads and background is not used.
    pub scenes: Vec<(String, Scene)>,
    /// Seed of whatever is random.
    pub seed: u64,
    /// Where threads, blurred environments and pipelines are cached.
    pub cache: Option<PathBuf>,
}

impl Cases {
    /// Every method at every count that it can have, the count changing fastest.
    pub fn estimators(&self) -> Vec<Estimator> {
        let possible = |method: Method, count: u32| {
            method.threads().is_none_or(|kind| (1..=kind.max_count()).contains(&(count as usize)))
        };
        let of_method = |&method: &Method| {
            let counts = self.counts.iter().copied().filter(move |&count| possible(method, count));
            counts.map(move |count| Estimator { method, count })
        };
        self.methods.iter().flat_map(of_method).collect()
    }

    /// How many combinations of material, environment and scene there are.
    pub fn place_count(&self) -> usize {
        self.materials.len() * self.environments.len() * self.scenes.len()
    }

    /// Whether all materials can be used: better found out before hours are spent on the first one.
    ///
    /// # Errors
    /// The first that cannot.
    pub fn check_materials(&self) -> Result<()> {
        self.materials.iter().try_for_each(|(_, source)| load_material(source).map(drop))
    }

    /// Calls `visit` for each combination of material, scene and environment, the last one changing fastest.
    ///
    /// # Errors
    /// The first material, environment or scene that cannot be used; the first of `visit`; cancelled.
    pub fn for_each_place(
        &self,
        observer: &dyn Observer,
        visit: &mut dyn FnMut(&mut Place<'_>) -> Result<()>,
    ) -> Result<()> {
        let mut environments = Vec::new();
        for (name, source) in &self.environments {
            let settings = EnvironmentSettings { source: source.clone(), ..EnvironmentSettings::default() };
            environments.push((name, Arc::new(settings.load()?)));
        }
        let mut scenes = Vec::new();
        for (name, scene) in &self.scenes {
            let display = Display { exposure: scene.image.exposure, gamma: scene.image.gamma };
            scenes.push((name, self.prepare_scene(scene)?, display));
        }
        self.check_materials()?;
        for (material_name, source) in &self.materials {
            let brdf = load_material(source)?;
            let source = source.clone();
            let mut material = vec![PreparedMaterial { name: material_name.clone(), brdf, source, threads: None }];
            let mut tables = Vec::new();
            for (scene, prepared, display) in &mut scenes {
                // The scene borrows the material and the environment while they are looked at together.
                std::mem::swap(&mut prepared.materials, &mut material);
                for (environment_name, environment) in &mut environments {
                    if observer.cancelled() {
                        return Err(Error::Cancelled);
                    }
                    std::mem::swap(&mut prepared.environment, environment);
                    visit(&mut Place {
                        material: material_name,
                        environment: environment_name,
                        scene,
                        display: *display,
                        prepared,
                        cases: self,
                        tables: &mut tables,
                        observer: &OnlyCancels(observer),
                    })?;
                    std::mem::swap(&mut prepared.environment, environment);
                }
                std::mem::swap(&mut prepared.materials, &mut material);
            }
        }
        Ok(())
    }

    /// The meshes, camera and settings of `scene`, with material and environment yet to come.
    fn prepare_scene(&self, scene: &Scene) -> Result<Prepared> {
        let mut scene = scene.clone();
        // Something that costs no time in their place.
        let placeholder = MaterialSource::Model {
            model: "lambert".to_owned(),
            parameters: toml::Table::from_iter([("reflectance".to_owned(), toml::Value::Float(0.5))]),
        };
        scene.materials = vec![MaterialSettings { name: "placeholder".to_owned(), source: placeholder }];
        scene.objects.iter_mut().for_each(|object| object.material = "placeholder".to_owned());
        scene.environment.source = Source::Builtin("white".to_owned());
        scene.image.background = Background::None;
        scene.shading.method = Method::Uniform.name().to_owned();
        prepare(&scene, self.cache.as_deref(), &())
    }
}

/// A material in an environment in a scene.
pub struct Place<'a> {
    /// Name of the material.
    pub material: &'a str,
    /// Name of the environment.
    pub environment: &'a str,
    /// Name of the scene.
    pub scene: &'a str,
    /// How the scene is displayed.
    pub display: Display,
    /// All that is to be rendered; method and threads are those that [`Place::choose`] was last called with. Whoever
    /// changes anything else changes it back.
    pub prepared: &'a mut Prepared,
    cases: &'a Cases,
    /// The threads made for the material so far.
    tables: &'a mut Vec<(Estimator, Arc<Threads>)>,
    observer: &'a dyn Observer,
}

impl Place<'_> {
    /// Prepares rendering by `estimator`: makes its threads, if it has any and they were not made before.
    ///
    /// # Errors
    /// A number of threads that is out of range, or cancelled.
    pub fn choose(&mut self, estimator: Estimator) -> Result<()> {
        let Estimator { method, count } = estimator;
        let material = &mut self.prepared.materials[0];
        material.threads = match self.tables.iter().find(|(made_for, _)| *made_for == estimator) {
            Some((_, table)) => Some(table.clone()),
            None => {
                let of = [count.into(), self.cases.seed];
                let table = load_threads(method, &material.brdf, of, self.cases.cache.as_deref(), self.observer)?;
                table.map(|(table, ..)| {
                    let table = Arc::new(table);
                    self.tables.push((estimator, table.clone()));
                    table
                })
            }
        };
        self.prepared.method = method;
        self.prepared.sampling.count = count;
        self.prepared.sampling.seed = self.cases.seed;
        Ok(())
    }
}

/// Passes on whether to stop, but no progress: that of a part is not that of the whole.
pub struct OnlyCancels<'a>(pub &'a dyn Observer);

impl Observer for OnlyCancels<'_> {
    fn progress(&self, _done: usize, _total: usize) {}
    fn cancelled(&self) -> bool {
        self.0.cancelled()
    }
}
