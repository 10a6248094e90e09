//! The flags that say what is rendered, and on what: `render` and `view` have them in common.
use super::{memo, nameable, number};
use clap::builder::{PossibleValue, PossibleValuesParser, RangedI64ValueParser, TypedValueParser};
use clap::{Arg, value_parser};
use std::path::PathBuf;
use std::sync::Arc;
use threadlight::Error;
use threadlight::low_level::environment;
use threadlight::low_level::memo::Memo;
use threadlight::low_level::method::{Method, Pattern};
use threadlight::low_level::scene::{
    Background, EXPOSURE, GAMMA, MAX_SAMPLES, MAX_SIZE_PX, MAX_SUBPIXELS, MaterialSource, POSITIVE_SINGLE,
    SINGLE_FACTOR, Scene, Source, mesh,
};
use threadlight::low_level::vulkan::{Device, Instance, Messages};

/// What is rendered.
#[derive(clap::Args)]
pub struct SceneFlags {
    /// Scene file (TOML); without one, the built-in scene: a gold sphere in a studio.
    pub scene: Option<PathBuf>,
    #[arg(long, help = nameable::mesh("Mesh in place of the scene's objects"), value_name = "NAME|FILE")]
    pub mesh: Option<String>,
    #[arg(long, help = nameable::material("Material of every object"), value_name = "NAME|FILE")]
    pub material: Option<String>,
    #[arg(long, help = nameable::environment("Light from all directions"), value_name = "NAME|FILE")]
    pub environment: Option<String>,
    /// Shading method.
    #[arg(long, value_name = "NAME", value_parser = methods(|_| true))]
    pub method: Option<Method>,
    #[arg(long, help = nameable::counts(), value_name = "N", value_parser = value_parser!(u32).range(1..=i64::from(MAX_SAMPLES)))]
    pub threads: Option<u32>,
    /// Where methods filtered and importance draw samples: at random numbers of each pixel's own (noise), or at one fixed set (bias).
    #[arg(long, value_name = "per-pixel|fixed", value_parser = pattern(), hide_possible_values = true)]
    pub pattern: Option<Pattern>,
    #[arg(long, help = nameable::subpixels("Sub-pixels per axis"), value_name = "S", value_parser = subpixels())]
    pub subpixels: Option<u32>,
    #[arg(long, help = nameable::size("Size of the picture", 1), value_name = "WxH", value_parser = parse_size, allow_hyphen_values = true)]
    pub size: Option<(u32, u32)>,
    /// Factor on radiance before display.
    #[arg(long, value_name = "X", value_parser = number(EXPOSURE, SINGLE_FACTOR))]
    pub exposure: Option<f64>,
    /// Display values are radiance to the power of 1/X.
    #[arg(long, value_name = "X", value_parser = number(GAMMA, POSITIVE_SINGLE))]
    pub gamma: Option<f64>,
    /// What is seen behind the objects.
    #[arg(long, value_name = "environment|none", value_parser = background(), hide_possible_values = true)]
    pub background: Option<Background>,
    /// Turns the environment about the vertical axis, counter-clockwise seen from above, in degrees.
    #[arg(long, value_name = "DEG", value_parser = number(f64::MIN..=f64::MAX, "a finite number"))]
    pub rotation: Option<f64>,
    /// Seed of everything random; the same seed gives the same pixels on one device.
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
}

/// On what it is rendered, and what is kept on disk for the next time.
#[derive(clap::Args)]
pub struct DeviceFlags {
    /// Vulkan device: its index or part of its name, as `threadlight devices` lists them.
    #[arg(long, value_name = "NAME|INDEX")]
    pub device: Option<String>,
    /// Neither read nor write cached threads, blurred environments and pipelines.
    #[arg(long)]
    pub no_cache: bool,
}

impl DeviceFlags {
    /// The device, not validated: that would take time that is measured.
    pub fn open(&self) -> threadlight::Result<Arc<Device>> {
        Ok(Device::new(&Instance::new(false)?, self.device.as_deref())?)
    }

    /// What keeps, and finds again, what takes long to make.
    pub fn memo(&self) -> Memo {
        memo(self.no_cache)
    }
}

/// The same, with validation on request.
#[derive(clap::Args)]
pub struct MachineFlags {
    #[command(flatten)]
    pub device: DeviceFlags,
    /// Turn on Vulkan's validation layer, with synchronisation validation; any message is a failure.
    #[arg(long)]
    pub validate: bool,
}

impl MachineFlags {
    /// The device, and what the validation layer says.
    pub fn open(&self) -> threadlight::Result<(Arc<Device>, Messages)> {
        let instance = Instance::new(self.validate)?;
        Ok((Device::new(&instance, self.device.device.as_deref())?, instance.messages()))
    }
}

impl SceneFlags {
    /// The scene file, or the built-in scene, with the flags laid over it.
    pub fn scene(&self) -> threadlight::Result<Scene> {
        let mut scene = match &self.scene {
            Some(path) => Scene::load(path)?,
            None => Scene::default(),
        };
        if let Some(material) = &self.material {
            scene.use_material(material, MaterialSource::named(material));
        }
        if let Some(mesh) = &self.mesh {
            scene.use_mesh(Source::named(mesh, mesh::builtin_names()));
        }
        if let Some(name) = &self.environment {
            scene.environment.source = Source::named(name, environment::builtin_names());
        }
        if let Some((width, height)) = self.size {
            (scene.image.width, scene.image.height) = (width, height);
        }
        fn lay<T: Clone>(flag: &Option<T>, setting: &mut T) {
            if let Some(value) = flag {
                *setting = value.clone();
            }
        }
        lay(&self.method, &mut scene.shading.method);
        scene.shading.threads = self.threads.or(scene.shading.threads);
        lay(&self.pattern, &mut scene.shading.pattern);
        lay(&self.seed, &mut scene.shading.seed);
        lay(&self.subpixels, &mut scene.image.subpixels);
        lay(&self.exposure, &mut scene.image.exposure);
        lay(&self.gamma, &mut scene.image.gamma);
        lay(&self.background, &mut scene.image.background);
        lay(&self.rotation, &mut scene.environment.rotation_deg);
        Ok(scene)
    }

    /// `error` of the scene, with the name of its file in front unless a flag is at fault.
    pub fn in_file(&self, error: Error) -> Error {
        let Error::Input { subject, .. } = &error else { return error };
        let named = [&self.material, &self.mesh, &self.environment];
        let is_of_flag = named.into_iter().flatten().any(|name| subject.contains(name.as_str()))
            || (subject == "threads" && self.threads.is_some());
        match &self.scene {
            Some(path) if !is_of_flag => error.within(path.display()),
            _ => error,
        }
    }

    /// All files that are read for `scene`, which is what these flags name.
    pub fn files(&self, scene: &Scene) -> Vec<PathBuf> {
        self.scene.iter().cloned().chain(scene.files()).collect()
    }
}

/// How many sub-pixels a pixel may have along an axis.
pub fn subpixels() -> RangedI64ValueParser<u32> {
    value_parser!(u32).range(1..=i64::from(MAX_SUBPIXELS))
}

/// `640x480`.
pub fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let side = |text: &str| text.parse().ok().filter(|side| (1..=MAX_SIZE_PX).contains(side));
    let sides = text.split_once(['x', 'X']).and_then(|(width, height)| Some((side(width)?, side(height)?)));
    sides.ok_or_else(|| format!("use width x height in pixels, each 1 to {MAX_SIZE_PX}, such as 640x480"))
}

/// The flag --method of a command that takes some of the methods only: its help and its errors list no others.
pub fn takes_methods(is_taken: fn(Method) -> bool) -> impl FnOnce(Arg) -> Arg {
    move |method| method.value_parser(methods(is_taken))
}

/// The name of a method that the command takes.
fn methods(is_taken: fn(Method) -> bool) -> impl TypedValueParser<Value = Method> {
    let names = Method::ALL.iter().filter(|method| is_taken(**method));
    let names = names.map(|method| PossibleValue::new(method.name()).help(method.summary()));
    PossibleValuesParser::new(names).try_map(|name| Method::from_name(&name))
}

/// The value of one of these names.
pub fn one_of<T: Clone + Send + Sync + 'static, const N: usize>(
    values: [(&'static str, T); N],
) -> impl TypedValueParser<Value = T> {
    PossibleValuesParser::new(values.each_ref().map(|(name, _)| *name)).map(move |name| {
        let (_, value) = values.iter().find(|(known, _)| *known == name).expect("the parser takes no other name");
        value.clone()
    })
}

/// `per-pixel` or `fixed`.
fn pattern() -> impl TypedValueParser<Value = Pattern> {
    one_of(Pattern::ALL.map(|pattern| (pattern.name(), pattern)))
}

/// `environment` or `none`.
fn background() -> impl TypedValueParser<Value = Background> {
    one_of([("environment", Background::Environment), ("none", Background::None)])
}
