//! What the measurements have in common on the command line: what to measure, on which device, and where to write it.
use crate::cli::render::processor;
use crate::cli::scene_flags::{DeviceFlags, parse_size, subpixels};
use crate::cli::{display_error, json, nameable, print, stem};
use clap::builder::NonEmptyStringValueParser;
use clap::parser::ValueSource;
use clap::{ArgMatches, Args, Command, FromArgMatches, value_parser};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use threadlight::low_level::brdf::Brdf;
use threadlight::low_level::environment;
use threadlight::low_level::evaluate::reference::{self, Processor, ReferenceSettings};
use threadlight::low_level::evaluate::sweep::Measured;
use threadlight::low_level::evaluate::{Cases, Row, Shard, Sweep, ssim, sweep, tables};
use threadlight::low_level::files;
use threadlight::low_level::memo::{Memo, Round};
use threadlight::low_level::method::{Method, Variant};
use threadlight::low_level::progress::Observer;
use threadlight::low_level::scene::{
    EnvironmentSource, MAX_SAMPLES, MaterialSettings, MaterialSource, ObjectSettings, Scene, Source, mesh,
};
use threadlight::low_level::vulkan::Device;
use threadlight::{Error, Result};

/// What to measure. Where a flag is left out, the command says what is taken: see [`Defaults`].
#[derive(clap::Args)]
pub struct CasesArguments {
    #[arg(long, help = nameable::materials(), value_name = "LIST", value_delimiter = ',', value_parser = NonEmptyStringValueParser::new())]
    materials: Vec<String>,
    #[arg(long, help = nameable::environment("Environments, each"), value_name = "LIST", value_delimiter = ',', value_parser = NonEmptyStringValueParser::new(), default_value = "studio")]
    environments: Vec<String>,
    /// Shading methods; `filtered_fixed` and `importance_fixed` are those at one set of points for all pixels.
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = NonEmptyStringValueParser::new())]
    methods: Vec<String>,
    #[arg(long, help = counts(), value_name = "LIST", value_delimiter = ',', value_parser = value_parser!(u32).range(1..=i64::from(MAX_SAMPLES)))]
    counts: Vec<u32>,
    #[arg(long, help = nameable::scenes("Scenes, each a mesh"), value_name = "LIST", value_delimiter = ',', value_parser = NonEmptyStringValueParser::new(), default_value = "sphere")]
    scene: Vec<String>,
    #[arg(long, help = nameable::size("Size of the pictures", ssim::WINDOW), value_name = "WxH", value_parser = parse_size, allow_hyphen_values = true)]
    size: Option<(u32, u32)>,
    #[arg(long, help = format!("{}; without it, the scene's", nameable::subpixels("Sub-pixels per axis")), value_name = "S", value_parser = subpixels())]
    subpixels: Option<u32>,
    /// Seed of everything random.
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    #[command(flatten)]
    pub device: DeviceFlags,
}

fn counts() -> String {
    format!(
        "Numbers of threads, or of samples of the other estimators, each 1 to {MAX_SAMPLES}; a method is measured with those that it can have"
    )
}

/// The flags that stand on the command line: others have their defaults. The first field of a command, as the later ones take values away.
pub struct Given(Vec<String>);

impl Given {
    /// Whether the flag of this name, in which `_` is in the place of `-`, is there.
    pub fn has(&self, name: &str) -> bool {
        self.flags().any(|given| given == name)
    }

    /// Their names, in which `_` is in the place of `-`.
    pub fn flags(&self) -> impl Iterator<Item = &str> {
        self.0.iter().map(String::as_str)
    }
}

impl FromArgMatches for Given {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        // Groups, which are named as their types are, are no flags.
        let names = matches.ids().map(|id| id.as_str()).filter(|name| !name.starts_with(char::is_uppercase));
        let given = names.filter(|name| matches.value_source(name) == Some(ValueSource::CommandLine));
        Ok(Self(given.map(str::to_owned).collect()))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

impl Args for Given {
    fn augment_args(command: Command) -> Command {
        command
    }

    fn augment_args_for_update(command: Command) -> Command {
        command
    }
}

/// What a command measures where it is not told.
pub struct Defaults {
    pub materials: Vec<&'static str>,
    pub methods: Vec<Method>,
    pub counts: &'static [u32],
    /// None: the scene's.
    pub size: Option<(u32, u32)>,
}

impl Defaults {
    /// Of pictures that are shown beside each other.
    pub fn of_pictures(materials: Vec<&'static str>, counts: &'static [u32]) -> Self {
        let methods = vec![Method::Fitted, Method::Paper, Method::Importance, Method::Filtered];
        Self { materials, methods, counts, size: Some((160, 120)) }
    }

    /// Help after that of the flags: these, where pictures are compared the `tolerance` of the references, and what `follows`.
    pub fn help(&self, tolerance: Option<f64>, follows: &str) -> String {
        let names = |given: &[&str], all: Vec<&str>| if given == all { "all".to_owned() } else { given.join(",") };
        let materials = names(&self.materials, Brdf::builtin_names().collect());
        let methods: Vec<_> = self.methods.iter().map(|method| method.name()).collect();
        let methods = names(&methods, Method::on_gpu().map(Method::name).collect());
        let counts = self.counts.iter().map(u32::to_string).collect::<Vec<_>>().join(",");
        let size = self.size.map_or("that of the scene".to_owned(), |(width, height)| format!("{width}x{height}"));
        let tolerance = tolerance.map_or(String::new(), |tolerance| {
            let on_gpu = Processor::Gpu.default_tolerance().max(tolerance);
            let on_gpu = if on_gpu > tolerance { format!(", on the GPU {on_gpu:e}") } else { String::new() };
            format!("; --reference-tolerance {tolerance:e}{on_gpu}")
        });
        format!(
            "Defaults: --materials {materials}; --methods {methods}; --counts {counts}; --size {size}{tolerance}.\n\n{follows}"
        )
    }
}

impl CasesArguments {
    pub fn cases(&self, defaults: &Defaults) -> Result<Cases> {
        let methods = match self.methods.as_slice() {
            [] => defaults.methods.iter().copied().map(Variant::from).collect(),
            names => names.iter().map(|name| Variant::from_name(name)).collect::<Result<Vec<_>>>()?,
        };
        once("--methods", methods.iter().map(|method| method.name()).collect())?;
        if methods.contains(&Method::Reference.into()) {
            let remedy = "name others; where errors are measured, it is what they are measured against";
            return Err(Error::input("--methods reference", "is the truth, not a method to measure", remedy));
        }
        let counts = if self.counts.is_empty() { defaults.counts.to_vec() } else { self.counts.clone() };
        let by_default: Vec<_> = defaults.materials.iter().map(|name| (*name).to_owned()).collect();
        let materials = if self.materials.is_empty() { &by_default } else { &self.materials };
        let scenes = named("--scene", &self.scene)?;
        let size = self.size.or(defaults.size);
        let cases = Cases {
            methods,
            counts: once("--counts", counts)?,
            materials: named_materials("--materials", materials)?,
            environments: named_environments("--environments", &self.environments)?,
            scenes: scenes
                .into_iter()
                .map(|(name, text)| Ok((name, self.scene_of(text, size)?)))
                .collect::<Result<_>>()?,
            seed: self.seed,
            shard: Shard::WHOLE,
        };
        if cases.estimators().is_empty() {
            let most = |variant: &Variant| format!("{} has at most {}", variant.name(), variant.method.max_count(1));
            let remedy = cases.methods.iter().map(most).collect::<Vec<_>>().join(", ");
            return Err(Error::input("--counts", "has none that these methods can have", remedy));
        }
        Ok(cases)
    }

    /// Takes from `row`, which the file at `path` holds, what was not `given`: measurements beside it are to be of the same.
    pub fn take_from(&mut self, row: &Row, path: &Path, given: &Given) -> Result<()> {
        let materials: Vec<_> = Brdf::builtin_names().collect();
        for (flag, what, texts, name, builtin) in [
            ("materials", "material", &mut self.materials, &row.material, materials.as_slice()),
            ("environments", "environment", &mut self.environments, &row.environment, environment::builtin_names()),
            ("scene", "scene", &mut self.scene, &row.scene, mesh::builtin_names()),
        ] {
            if given.has(flag) {
                continue;
            }
            // Rows have names, and not the files of these.
            if !builtin.contains(&name.as_str()) {
                let problem = format!("is of the {what} \"{name}\", which is not built in");
                return Err(Error::in_file(path, problem, format!("name its file by --{flag}")));
            }
            *texts = vec![name.clone()];
        }
        let settings = &row.settings;
        self.size = self.size.or(Some((settings.width, settings.height)));
        self.subpixels = self.subpixels.or(Some(settings.subpixels));
        if !given.has("seed") {
            self.seed = settings.seed;
        }
        Ok(())
    }

    /// All files that are read for `cases`, which are what these arguments name.
    pub fn files(&self, cases: &Cases) -> Vec<PathBuf> {
        let of_scenes = cases.scenes.iter().flat_map(|(_, scene)| scene.files());
        let named = self.environments.iter().chain(&self.scene).map(PathBuf::from);
        of_scenes.chain(named).chain(files_of_materials(&self.materials, &cases.materials)).collect()
    }

    /// The scene that `text` names: a scene file, or a mesh in the built-in scene.
    fn scene_of(&self, text: &str, size: Option<(u32, u32)>) -> Result<Scene> {
        let path = Path::new(text);
        let mut scene = if Scene::FILES.format_of(path).is_ok() {
            Scene::load(path)?
        } else {
            let mut scene = Scene::default();
            let material = scene.objects.first().map(|object| object.material.clone()).unwrap_or_default();
            scene.objects = vec![ObjectSettings::new(Source::named(text, mesh::builtin_names()), &material)];
            scene
        };
        if let Some((width, height)) = size {
            (scene.image.width, scene.image.height) = (width, height);
        }
        scene.image.subpixels = self.subpixels.unwrap_or(scene.image.subpixels);
        Ok(scene)
    }
}

/// Each of `texts` with the name that it has in tables: without folder and extension.
pub fn named<'a>(flag: &str, texts: &'a [String]) -> Result<Vec<(String, &'a str)>> {
    let names = once(flag, texts.iter().map(|text| stem(Path::new(text))).collect())?;
    Ok(names.into_iter().zip(texts.iter().map(String::as_str)).collect())
}

/// The materials that `texts` name, with their names: a scene file stands for all of its materials.
pub fn named_materials(flag: &str, texts: &[String]) -> Result<Vec<(String, MaterialSource)>> {
    let mut materials = Vec::new();
    for text in texts {
        match MaterialSource::named(text) {
            // What cannot be read is told of by who needs it.
            MaterialSource::File(path) if Scene::FILES.knows(&path).unwrap_or(false) => {
                let of_scene = Scene::load(&path)?.materials;
                materials.extend(of_scene.into_iter().map(|MaterialSettings { name, source }| (name, source)));
            }
            source => materials.push((stem(Path::new(text)), source)),
        }
    }
    // Their pictures and plots are named after them, too.
    once(flag, materials.iter().map(|(name, _)| files::file_name(name)).collect())?;
    Ok(materials)
}

/// All files that are read for `materials`, which are what `texts` name.
pub fn files_of_materials(texts: &[String], materials: &[(String, MaterialSource)]) -> Vec<PathBuf> {
    texts.iter().map(PathBuf::from).chain(materials.iter().flat_map(|(_, source)| source.files())).collect()
}

/// The environments that `texts` name, with their names.
pub fn named_environments(flag: &str, texts: &[String]) -> Result<Vec<(String, EnvironmentSource)>> {
    let source = |text| Source::named(text, environment::builtin_names());
    Ok(named(flag, texts)?.into_iter().map(|(name, text)| (name, source(text))).collect())
}

/// `values`, if none is there twice: rows could not be told apart.
pub fn once<T: PartialEq + std::fmt::Debug>(flag: &str, values: Vec<T>) -> Result<Vec<T>> {
    match values.iter().enumerate().find(|(i, value)| values[..*i].contains(value)) {
        Some((_, twice)) => {
            Err(Error::input(flag, format!("names {twice:?} twice"), "name each once, and files by names that differ"))
        }
        None => Ok(values),
    }
}

/// Reference pictures that a reader does not wait long for: far nearer to the truth than what is compared with them.
pub const QUICK_TOLERANCE: f64 = 1e-3;

/// Against what errors are measured.
#[derive(clap::Args)]
pub struct TruthArguments {
    /// Error of the reference pictures, in display values, that is good enough.
    #[arg(long, value_name = "X", value_parser = display_error())]
    reference_tolerance: Option<f64>,
    /// Where the reference pictures are made, as `threadlight render --help` explains.
    #[arg(long, value_name = "cpu|gpu", default_value = "cpu", value_parser = processor(), hide_possible_values = true)]
    reference_on: Processor,
}

impl TruthArguments {
    /// Runs `sweep` against reference pictures, which are within `tolerance` unless the flag says otherwise.
    pub fn sweep(
        &self,
        tolerance: f64,
        sweep: &Sweep,
        device: &Arc<Device>,
        memo: &Memo,
        observer: &dyn Observer,
        measured: &mut Measured,
    ) -> Result<()> {
        let settings = ReferenceSettings {
            tolerance: self.reference_tolerance.unwrap_or(tolerance.max(self.reference_on.default_tolerance())),
            processor: self.reference_on,
        };
        let truth = |prepared: &_, round: &Round| reference::reference(prepared, device, &settings, round);
        sweep::run(sweep, device, memo, &truth, observer, measured)
    }
}

/// Where measurements are written, besides the terminal.
#[derive(clap::Args)]
pub struct JsonArgument {
    /// Write all measurements as JSON.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

impl JsonArgument {
    /// Says before the work begins if the file cannot be written, or is one that the command has `read`.
    pub fn check(&self, read: &[PathBuf]) -> Result<()> {
        self.json.as_deref().map_or(Ok(()), files::check_writable)?;
        files::check_not_read(&self.json, read)
    }

    /// Prints the tables of what was `found`, if anything was, and writes it if that is all: a file that is there is whole.
    pub fn report<T: serde::Serialize>(
        &self,
        result: Result<()>,
        found: &[T],
        tables: impl FnOnce(&[T]) -> Vec<tables::Section>,
    ) -> anyhow::Result<()> {
        let printed = if found.is_empty() { Ok(()) } else { print(tables::text(&tables(found))) };
        result?;
        self.write(&found)?;
        Ok(printed?)
    }

    pub fn write(&self, measurements: &impl serde::Serialize) -> anyhow::Result<()> {
        let Some(path) = &self.json else { return Ok(()) };
        Ok(files::write_whole(path, json("--json", measurements)?.as_bytes())?)
    }
}

/// The same, with pictures.
#[derive(clap::Args)]
pub struct OutputArguments {
    #[command(flatten)]
    pub json: JsonArgument,
    /// Folder for plots or pictures; made if it is not there.
    #[arg(long, value_name = "DIR")]
    pub plot: Option<PathBuf>,
}

impl OutputArguments {
    /// Says before the work begins what cannot be written.
    pub fn check(&self, read: &[PathBuf]) -> Result<()> {
        self.json.check(read)?;
        let Some(folder) = &self.plot else { return Ok(()) };
        check_folder(folder)?;
        // A file of the name of a folder that is still to be made would keep that from being made.
        let to_make = (!folder.exists()).then(|| folder.components().collect());
        files::check_all_writable(self.json.json.iter().chain(&to_make))
    }
}

/// An error if `folder` is none, or cannot be made or written to.
pub fn check_folder(folder: &Path) -> Result<()> {
    let is_like = |extension: &str| folder.extension().is_some_and(|of| of.eq_ignore_ascii_case(extension));
    if folder.is_dir() {
        return files::check_writable(&folder.join("plot.svg"));
    }
    if folder.exists() {
        return Err(Error::in_file(folder, "is a file, and what is written is a folder of them", "name a folder"));
    }
    if ["svg", "png", "exr", "html"].into_iter().any(is_like) {
        let problem = "is named like a file, and what is written is a folder of them";
        return Err(Error::in_file(folder, problem, "name a folder, or make one of this name"));
    }
    // It has to be made; its name may end in a separator.
    files::check_writable(&folder.components().collect::<PathBuf>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Measures {
        #[command(flatten)]
        given: Given,
        #[command(flatten)]
        cases: CasesArguments,
    }

    /// What is measured with these flags beside a row of `clay` in `sky`; names of materials and environments, size, sub-pixels, seed.
    fn beside_a_row(flags: &[&str], material: &str) -> Result<(String, String, [u32; 3], u64)> {
        let row = format!(
            r#"{{"method": "paper", "threads": 4, "material": "{material}", "environment": "sky", "scene": "sphere", "rms": 0.1,
            "rms_linear": 0.1, "ssim": 0.9, "flip": 0.1, "max": 0.3, "nan": 0, "gpu_ms": 1, "frame_ms": 1, "lookups": 1,
            "covered_pixels": 1, "shade_ms": 1,
            "settings": {{"width": 80, "height": 60, "subpixels": 3, "seed": 7, "repeat": 3, "whole_picture": false}}}}"#
        );
        let row = serde_json::from_str(&row).unwrap();
        let Measures { given, mut cases } = Measures::try_parse_from([&["measure"], flags].concat()).unwrap();
        cases.take_from(&row, Path::new("rows.json"), &given)?;
        let defaults = Defaults {
            materials: vec!["gold", "red-plastic"],
            methods: vec![Method::Fitted],
            counts: &[4],
            size: Some((160, 120)),
        };
        let cases = cases.cases(&defaults)?;
        let [materials, environments] = [
            cases.materials.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(","),
            cases.environments.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>().join(","),
        ];
        let image = &cases.scenes[0].1.image;
        Ok((materials, environments, [image.width, image.height, image.subpixels], cases.seed))
    }

    #[test]
    fn what_is_measured_beside_earlier_rows_is_of_the_same_but_for_what_flags_say() {
        let of_row = ("clay".to_owned(), "sky".to_owned(), [80, 60, 3], 7);
        assert_eq!(beside_a_row(&[], "clay").unwrap(), of_row);
        // Also where a flag says what it would be without.
        let flags = "--materials gold,silver --environments studio --scene sphere --size 24x18 --subpixels 1 --seed 0";
        let flags: Vec<_> = flags.split(' ').collect();
        let of_flags = ("gold,silver".to_owned(), "studio".to_owned(), [24, 18, 1], 0);
        assert_eq!(beside_a_row(&flags, "nickel-of-a-file").unwrap(), of_flags);
        let refused = beside_a_row(&[], "nickel-of-a-file").unwrap_err().to_string();
        let reason =
            "rows.json: is of the material \"nickel-of-a-file\", which is not built in; name its file by --materials";
        assert_eq!(refused, reason);
    }

    #[test]
    fn a_folder_may_be_named_that_is_not_there_but_not_where_none_can_be() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::write(path("file"), "").unwrap();
        std::fs::create_dir(path("there.svg")).unwrap();
        for name in ["new", "new/", "there.svg", "there.svg/new/"] {
            check_folder(&path(name)).unwrap();
        }
        for name in ["file", "file/new", "absent/new", "plot.svg"] {
            let error = check_folder(&path(name)).unwrap_err().to_string();
            assert!(error.contains(name.split('/').next().unwrap()), "{error}");
        }
        assert!(!path("new").exists());
        let to = |json: &str, plot: &str| OutputArguments {
            json: JsonArgument { json: Some(path(json)) },
            plot: Some(path(plot)),
        };
        to("a.json", "new/").check(&[]).unwrap();
        let error = to("new", "new/").check(&[]).unwrap_err().to_string();
        assert!(error.contains("is to be written twice"), "{error}");
    }
}
