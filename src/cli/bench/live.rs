//! `threadlight bench live`: what drafts of threads cost and are worth while a parameter is dragged.
use super::arguments::{JsonArgument, QUICK_TOLERANCE};
use crate::cli::progress::TerminalProgress;
use crate::cli::scene_flags::{MachineFlags, SceneFlags, takes_methods};
use crate::cli::{display_error, none_of};
use clap::value_parser;
use threadlight::low_level::evaluate::live::{self, Drag};
use threadlight::low_level::evaluate::reference::ReferenceSettings;
use threadlight::low_level::method::Method;
use threadlight::low_level::scene::Scene;
use threadlight::{Error, Result};

const EXAMPLES: &str = "\
Without a scene file and --size, pictures are 80x60.

Examples:
  threadlight bench live --drag gold.alpha --from 0.05 --to 0.6
  threadlight bench live --material red-plastic --drag red-plastic.ior --from 1.3 --to 2 --json ior.json
  threadlight bench live --material clay --drag clay.reflectance --from \"[0.8,0.1,0.1]\" --to \"[0.1,0.1,0.8]\"

Every draft is made from the one before; those of the way back begin where the way there has ended. Errors are RMS of display \
values against the reference. The change is the largest one of a display value from one picture to the next.

The JSON is a list of steps with these fields, in this order:
  value                            of the parameter
  draft_ms, fit_ms                 from the threads before to a draft, from nothing to finished threads
  draft_rms, finished_rms          errors
  draft_change, reference_change   from one picture to the next";

/// Drags a parameter of a material there and back, and measures the drafts of its threads.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES, allow_negative_numbers = true, mut_arg("method", takes_methods(Method::has_drafts)))]
pub struct BenchLive {
    #[command(flatten)]
    scene: SceneFlags,
    #[command(flatten)]
    machine: MachineFlags,
    /// Name of a material of the scene, a dot, and a parameter of it, such as varnish.coat.alpha.
    #[arg(long, value_name = "MATERIAL.KEY")]
    drag: String,
    /// Its first value, as in a scene file: a number, or a list of three.
    #[arg(long, value_name = "VALUE")]
    from: String,
    /// Its last value.
    #[arg(long, value_name = "VALUE")]
    to: String,
    /// How many values there are from the first to the last.
    #[arg(long, value_name = "N", default_value_t = 60, value_parser = value_parser!(u32).range(2..=10_000))]
    steps: u32,
    /// Estimated error of the reference, RMS of display values.
    #[arg(long, value_name = "X", default_value_t = QUICK_TOLERANCE, value_parser = display_error())]
    reference_tolerance: f64,
    #[command(flatten)]
    json: JsonArgument,
}

impl BenchLive {
    pub fn run(self) -> anyhow::Result<()> {
        let mut scene = self.scene.scene()?;
        self.json.check(&self.scene.files(&scene))?;
        if self.scene.scene.is_none() && self.scene.size.is_none() {
            (scene.image.width, scene.image.height) = (80, 60);
        }
        let (material, key) = material_and_key(&scene, &self.drag)?;
        let [from, to] = [("--from", &self.from), ("--to", &self.to)].map(|(flag, text)| numbers(flag, text));
        let values = between(&from?, &to?, self.steps)?;
        let drag = Drag { scene, material: material.to_owned(), key: key.to_owned(), values };
        let (device, messages) = self.machine.open()?;
        let memo = self.machine.device.memo();
        let settings = ReferenceSettings { tolerance: self.reference_tolerance, ..ReferenceSettings::default() };
        let progress = TerminalProgress::of("bench live", "pictures")?;
        let mut found = Vec::new();
        let result = live::run(&drag, &settings, &device, &memo, &progress, &mut found);
        drop(device);
        progress.finish();
        self.json.report(result, &found, |found| vec![live::table(&drag, found)])?;
        none_of(&messages.all())
    }
}

/// The material of `scene` and the parameter that `drag` names: both may have dots.
fn material_and_key<'d>(scene: &Scene, drag: &'d str) -> Result<(&'d str, &'d str)> {
    let splits = drag.match_indices('.').map(|(dot, _)| (&drag[..dot], &drag[dot + 1..]));
    let is_there = |name: &str| scene.materials.iter().any(|material| material.name == name);
    splits.clone().rfind(|(name, _)| is_there(name)).or(splits.clone().next_back()).ok_or_else(|| {
        let problem = format!("\"{drag}\" has no dot");
        Error::input("--drag", problem, "name material and parameter, as gold.alpha")
    })
}

/// A number or a list of numbers, as in a scene file.
fn numbers(flag: &str, text: &str) -> Result<toml::Value> {
    let refused =
        || Error::input(flag, format!("\"{text}\" is no number or list of numbers"), "use 0.5, or [0.5,0.4,0.3]");
    let value = format!("value = {text}").parse::<toml::Table>().ok().and_then(|mut table| table.remove("value"));
    let value = value.ok_or_else(refused)?;
    let is_number = |value: &toml::Value| value.as_float().is_some() || value.as_integer().is_some();
    let is_list = value.as_array().is_some_and(|list| list.iter().all(is_number));
    if is_number(&value) || is_list { Ok(value) } else { Err(refused()) }
}

/// So many values, evenly spaced.
fn between(from: &toml::Value, to: &toml::Value, count: u32) -> Result<Vec<toml::Value>> {
    let list = |value: &toml::Value| value.as_array().cloned().unwrap_or_else(|| vec![value.clone()]);
    let number = |value: &toml::Value| value.as_float().or(value.as_integer().map(|value| value as f64));
    let [from_list, to_list] = [from, to].map(|value| list(value).iter().filter_map(number).collect::<Vec<_>>());
    if from_list.len() != to_list.len() || from.is_array() != to.is_array() {
        return Err(Error::input("--to", "is of another kind than --from", "give two numbers, or two lists as long"));
    }
    let value = |step: u32| {
        let t = f64::from(step) / f64::from(count - 1);
        let numbers = from_list.iter().zip(&to_list).map(|(from, to)| toml::Value::Float(from + t * (to - from)));
        if from.is_array() { toml::Value::Array(numbers.collect()) } else { numbers.collect::<Vec<_>>().remove(0) }
    };
    Ok((0..count).map(value).collect())
}
