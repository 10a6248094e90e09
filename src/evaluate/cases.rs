//! What evaluations go through: every material in every environment in every scene, by every method at every count.
use std::collections::BTreeMap;
use std::fmt;
use std::ops::Range;
use std::str::FromStr;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::metrics::Display;
use crate::error::{Error, Result};
use crate::memo::{Keyed, Memo, Round};
use crate::method::{Method, Sampling, Variant};
use crate::pipeline::DeviceScene;
use crate::prepare::{Prepared, PreparedMaterial, ask_threads, check_count, prepare};
use crate::progress::{Observer, OnlyCancels};
use crate::scene::{Background, EnvironmentSource, MaterialSettings, MaterialSource, Scene};
use crate::steps::{LoadEnvironment, LoadMaterial};
use crate::threads::Threads;
use crate::vulkan::Device;

/// A method with its number of threads, or of samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Estimator {
    /// How radiance is estimated.
    pub variant: Variant,
    /// 1 to [`Method::max_count`].
    pub count: u32,
}

/// A part of the combinations of materials and environments, for jobs that share a sweep: as text `2/8`, the second of eight.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "PartOfParts")]
pub struct Shard {
    /// Which part this is, from 1.
    number: usize,
    /// How many parts there are.
    pub count: usize,
}

impl Shard {
    /// All of them.
    pub const WHOLE: Self = Self { number: 1, count: 1 };

    /// The part of that `number`, from 1, of `count`; none if there is none of that number.
    pub fn new(number: usize, count: usize) -> Option<Self> {
        (1..=count).contains(&number).then_some(Self { number, count })
    }

    /// All of so many parts.
    pub fn all(count: usize) -> impl Iterator<Item = Self> + Clone {
        (1..=count).map(move |number| Self { number, count })
    }

    /// Which of `length` things are in this part. Neighbours stay together, as the threads of a material are made once for all environments.
    pub(super) fn of(self, length: usize) -> Range<usize> {
        let end = |number: usize| (number as u128 * length as u128 / self.count as u128) as usize;
        end(self.number - 1)..end(self.number)
    }
}

/// A [`Shard`] as a file has it, which there may be none of.
#[derive(Deserialize)]
struct PartOfParts {
    number: usize,
    count: usize,
}

impl TryFrom<PartOfParts> for Shard {
    type Error = String;

    fn try_from(PartOfParts { number, count }: PartOfParts) -> Result<Self, Self::Error> {
        Self::new(number, count).ok_or_else(|| format!("there is no part {number} of {count}"))
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.count)
    }
}

impl FromStr for Shard {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let numbers =
            text.split_once('/').and_then(|(number, count)| Some((number.parse().ok()?, count.parse().ok()?)));
        let shard = numbers.and_then(|(number, count)| Self::new(number, count));
        shard.ok_or("use part/parts, such as 2/8 for the second of eight")
    }
}

/// All combinations of these.
#[derive(Clone, Debug)]
pub struct Cases {
    /// Estimators.
    pub methods: Vec<Variant>,
    /// Numbers of threads, or of samples: each at least 1.
    pub counts: Vec<u32>,
    /// Materials, by names that differ. One at a time is that of all objects.
    pub materials: Vec<(String, MaterialSource)>,
    /// Environments, by names that differ. Turn and intensity are the scene's.
    pub environments: Vec<(String, EnvironmentSource)>,
    /// Scenes, by names that differ. What they say of materials, environment, method, threads and background is not used.
    pub scenes: Vec<(String, Scene)>,
    /// Seed of whatever is random.
    pub seed: u64,
    /// Which combinations of materials and environments.
    pub shard: Shard,
}

impl Cases {
    /// Every method at every count that it can have in all scenes, the count changing fastest.
    pub fn estimators(&self) -> Vec<Estimator> {
        let most_subpixels = self.scenes.iter().map(|(_, scene)| scene.image.subpixels).max().unwrap_or(1);
        let possible = |method: Method, count: u32| (1..=method.max_count(most_subpixels)).contains(&count);
        let of_method = |&variant: &Variant| {
            let counts = self.counts.iter().copied().filter(move |&count| possible(variant.method, count));
            counts.map(move |count| Estimator { variant, count })
        };
        self.methods.iter().flat_map(of_method).collect()
    }

    /// How many combinations of material, environment and scene there are.
    pub fn place_count(&self) -> usize {
        self.pairs().len() * self.scenes.len()
    }

    /// The combinations of materials and environments of the shard, by number: the environment changes fastest.
    fn pairs(&self) -> Range<usize> {
        self.shard.of(self.combination_count())
    }

    /// How many combinations of materials and environments all parts have together.
    pub fn combination_count(&self) -> usize {
        self.materials.len() * self.environments.len()
    }

    /// Whether the shard has material and environment of these numbers together.
    fn has(&self, material: usize, environment: usize) -> bool {
        self.pairs().contains(&(material * self.environments.len() + environment))
    }

    /// The materials of the shard, with their numbers.
    fn own_materials(&self) -> impl Iterator<Item = (usize, &(String, MaterialSource))> {
        let is_used = |material: usize| (0..self.environments.len()).any(|environment| self.has(material, environment));
        self.materials.iter().enumerate().filter(move |(material, _)| is_used(*material))
    }

    /// Whether all materials can be used: better found out before hours are spent on the first one.
    ///
    /// # Errors
    /// The first that cannot.
    pub fn check_materials(&self, memo: &Memo) -> Result<()> {
        self.own_materials().try_for_each(|(_, (_, source))| memo.round(&()).ask(&LoadMaterial(source)).map(drop))
    }

    /// Whether each part of the sweep has some combination: otherwise nobody could tell a part that is empty from one that was lost.
    ///
    /// # Errors
    /// More parts than combinations.
    pub fn check_shard(&self) -> Result<()> {
        let most = self.combination_count();
        if self.shard.count <= most {
            return Ok(());
        }
        let problem = format!("has more parts than there are combinations of materials and environments, {most}");
        Err(Error::input("--shard", problem, format!("use at most {most} parts")))
    }

    /// Calls `visit` for each combination of material, scene and environment, the last one changing fastest.
    ///
    /// # Errors
    /// The first material, environment or scene that cannot be used; the first of `visit`; cancelled.
    pub fn for_each_place(
        &self,
        memo: &Memo,
        observer: &dyn Observer,
        visit: &mut dyn FnMut(&mut Place<'_>) -> Result<()>,
    ) -> Result<()> {
        let observer = &OnlyCancels(observer);
        let round = memo.round(observer);
        let mut environments = Vec::new();
        for (index, (name, source)) in self.environments.iter().enumerate() {
            if (0..self.materials.len()).any(|material| self.has(material, index)) {
                environments.push((index, name, round.ask(&LoadEnvironment(source))?, BTreeMap::new()));
            }
        }
        let mut scenes = Vec::new();
        for (name, scene) in &self.scenes {
            scenes.push((name, self.prepare_scene(scene, &round)?));
        }
        self.check_materials(memo)?;
        for (number, (material_name, source)) in self.own_materials() {
            let of_material = memo.round(observer);
            let brdf = of_material.ask(&LoadMaterial(source))?;
            let mut material = vec![PreparedMaterial::new(material_name.clone(), brdf, &of_material)?];
            let mut tables = Vec::new();
            for (scene, prepared) in &mut scenes {
                // The scene borrows the material and the environment while they are looked at together.
                std::mem::swap(&mut prepared.materials, &mut material);
                prepared.place_tangents(&round)?;
                let own = environments.iter_mut().filter(|(environment, ..)| self.has(number, *environment));
                for (_, environment_name, environment, renderers) in own {
                    observer.check()?;
                    std::mem::swap(&mut prepared.environment, environment);
                    visit(&mut Place {
                        material: material_name,
                        environment: environment_name,
                        scene,
                        prepared,
                        memo,
                        cases: self,
                        tables: &mut tables,
                        renderers,
                        observer,
                    })?;
                    std::mem::swap(&mut prepared.environment, environment);
                }
                std::mem::swap(&mut prepared.materials, &mut material);
            }
        }
        Ok(())
    }

    /// The meshes, camera and settings of `scene`, with material and environment yet to come.
    fn prepare_scene(&self, scene: &Scene, round: &Round) -> Result<Prepared> {
        let mut scene = scene.clone();
        // Something that costs no time in their place.
        let placeholder = MaterialSource::Model {
            model: "lambert".to_owned(),
            parameters: toml::Table::from_iter([("reflectance".to_owned(), toml::Value::Float(0.5))]),
        };
        scene.materials = vec![MaterialSettings { name: "placeholder".to_owned(), source: placeholder }];
        scene.objects.iter_mut().for_each(|object| object.material = "placeholder".to_owned());
        scene.environment.source = EnvironmentSource::Builtin("white".to_owned());
        scene.image.background = Background::None;
        (scene.shading.method, scene.shading.threads) = (Method::Uniform, None);
        prepare(&scene, round)
    }
}

/// `scene` by `method`, with no more threads than that can have.
pub(super) fn by_method(scene: &Scene, method: Method) -> Scene {
    let mut scene = scene.clone();
    scene.shading.method = method;
    let most = method.max_count(scene.image.subpixels);
    scene.shading.threads = scene.shading.threads.map(|count| count.min(most));
    scene
}

/// A material in an environment in a scene.
pub struct Place<'a> {
    /// Name of the material.
    pub material: &'a str,
    /// Name of the environment.
    pub environment: &'a str,
    /// Name of the scene.
    pub scene: &'a str,
    /// All that is to be rendered; method and threads are those that [`Place::choose`] was last called with. Whoever
    /// changes anything else changes it back.
    pub prepared: &'a mut Prepared,
    /// Where to ask for what it needs.
    pub memo: &'a Memo,
    cases: &'a Cases,
    /// The threads made for the material so far.
    tables: &'a mut Vec<Keyed<Threads>>,
    /// The last renderer in the environment by each method: what the next ones have in common with these is filtered, uploaded and
    /// compiled once.
    renderers: &'a mut BTreeMap<Method, DeviceScene>,
    observer: &'a dyn Observer,
}

impl Place<'_> {
    /// Prepares rendering by `estimator`: makes its threads, if it has any and they were not made before.
    ///
    /// # Errors
    /// A number of threads or samples that is out of range, or cancelled.
    pub fn choose(&mut self, estimator: Estimator) -> Result<()> {
        let Estimator { variant: Variant { method, pattern }, count } = estimator;
        check_count(method, count, self.prepared.view.subpixels)?;
        let sampling = Sampling { count, seed: self.cases.seed, pattern };
        let threads =
            ask_threads(&self.round(), method, &self.prepared.materials[0], sampling, self.prepared.view.subpixels)?;
        self.tables.extend(threads.clone());
        self.prepared.materials[0].threads = threads;
        self.prepared.method = method;
        self.prepared.sampling = sampling;
        Ok(())
    }

    /// How the scene is displayed.
    pub fn display(&self) -> Display {
        Display::of_image(&self.prepared.scene.image)
    }

    /// Asks for something of this place.
    pub fn round(&self) -> Round<'_> {
        self.memo.round(self.observer)
    }

    /// What renders it.
    ///
    /// # Errors
    /// As for [`DeviceScene::new`].
    pub fn renderer(&mut self, device: &Arc<Device>) -> Result<DeviceScene> {
        let renderer = DeviceScene::new(device, self.prepared, &self.round())?;
        self.renderers.insert(self.prepared.method, renderer.clone());
        Ok(renderer)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_have_each_combination_once() {
        for (count, length) in [(1, 4), (2, 4), (3, 7), (7, 3), (5, 0), (100, 2000)] {
            let parts = Shard::all(count).map(|shard| shard.of(length));
            assert!(parts.clone().flatten().eq(0..length), "{count} of {length}");
            let sizes: Vec<_> = parts.map(|part| part.len()).collect();
            assert!(sizes.iter().max().unwrap() - sizes.iter().min().unwrap() <= 1, "{sizes:?}");
        }
        assert!(Shard::new(0, 2).is_none() && Shard::new(3, 2).is_none() && Shard::new(1, 0).is_none());
        assert_eq!(Shard::new(1, 1), Some(Shard::WHOLE));
    }
}
