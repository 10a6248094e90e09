//! Reads a model's parameters from TOML and checks them; every error names the key.
use std::ops::RangeInclusive;

use glam::DVec3;
use toml::{Table, Value};

use super::Brdf;
use crate::error::{Error, Result};
use crate::files::is_misspelt;

/// The parameters of one material that have not been read yet.
pub struct Parameters {
    table: Table,
    read: Vec<Parameter>,
    /// Whether what is missing counts as the middle of its range.
    fills: bool,
    /// Whether the model is only checked: files that are named are not read, and nothing is warned of, as both come when it is loaded.
    only_checks: bool,
    /// Keys that the model has, but not beside those that are given.
    idle: Vec<Idle>,
    /// The model that these are of, if a key among them said so.
    model: Option<String>,
}

/// A key that the model has, but not beside those that are given.
struct Idle {
    key: String,
    problem: String,
    remedy: String,
}

/// What a model reads, and what it takes: what a slider needs to know.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Its key in a scene or material file; `coat.alpha` is `alpha` in the table `coat`.
    pub key: String,
    /// What it is, in a sentence.
    pub help: &'static str,
    /// What it may be.
    pub domain: Domain,
    /// The number that it is where it is left out.
    pub default: Option<f64>,
}

/// What a parameter may be.
#[derive(Clone, Debug, PartialEq)]
pub enum Domain {
    /// A number of this range.
    Number(RangeInclusive<f64>, Scale),
    /// Linear Rec. 709, each channel of this range.
    Colour(RangeInclusive<f64>, Scale),
    /// One of these words.
    Choice(Vec<String>),
}

impl Domain {
    /// Something that it may be.
    fn middle(&self) -> Value {
        match self {
            Self::Number(range, _) | Self::Colour(range, _) => (0.5 * (range.start() + range.end())).into(),
            Self::Choice(words) => words.first().map_or("", String::as_str).into(),
        }
    }
}

/// How a slider, or a search, goes through what a number may be.
#[derive(Clone, Debug, PartialEq)]
pub struct Scale {
    /// From where to where; numbers beyond are unusual, but good.
    pub range: RangeInclusive<f64>,
    /// In what steps.
    pub spacing: Spacing,
}

impl Scale {
    /// All of `range`; by factors, which know no 0, from a hundred thousandth of the end where it starts there.
    pub fn new(range: RangeInclusive<f64>, spacing: Spacing) -> Self {
        let (start, end) = range.into_inner();
        let least = if spacing == Spacing::Logarithmic && start <= 0.0 { 1e-5 * end } else { start };
        Self { range: least..=end, spacing }
    }

    /// By the same difference.
    pub const fn linear(range: RangeInclusive<f64>) -> Self {
        Self { range, spacing: Spacing::Linear }
    }

    /// By the same factor; `range` is above 0.
    pub const fn logarithmic(range: RangeInclusive<f64>) -> Self {
        Self { range, spacing: Spacing::Logarithmic }
    }

    /// The number at this part of the way, 0 to 1.
    pub fn at(&self, part: f64) -> f64 {
        let (start, end) = (*self.range.start(), *self.range.end());
        let number = match self.spacing {
            Spacing::Linear => start + (end - start) * part,
            Spacing::Logarithmic => start * (end / start).powf(part),
        };
        number.clamp(start, end)
    }
}

/// How steps along a slider change a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Spacing {
    /// By the same difference.
    Linear,
    /// By the same factor, for what spans orders of magnitude.
    Logarithmic,
}

impl Parameters {
    /// All entries of `table` are parameters.
    pub fn new(table: Table) -> Self {
        Self { table, read: Vec::new(), fills: false, only_checks: false, idle: Vec::new(), model: None }
    }

    /// The same, but what is missing counts as the middle of its range, or as the first of its words.
    pub(super) fn filled(table: Table) -> Self {
        Self { fills: true, ..Self::new(table) }
    }

    /// The same, of a model that is only checked.
    pub(super) fn checked(table: Table) -> Self {
        Self { only_checks: true, ..Self::new(table) }
    }

    /// Whether the model is only checked: files are not to be read, nor anything warned of.
    pub(super) fn only_checks(&self) -> bool {
        self.only_checks
    }

    /// Those that have been read, in the order in which they were.
    pub fn read(self) -> Vec<Parameter> {
        self.read
    }

    /// Whether `key` is given and not yet read: what a parameter that may be left out is read by.
    pub fn has(&self, key: &str) -> bool {
        self.table.contains_key(key)
    }

    /// Notes that `keys` are in the place of `other`, which was read: it is an error if they are given too.
    pub(super) fn instead_of(&mut self, keys: &[&str], other: &str) {
        self.note(keys, format!("is not a parameter beside `{other}`"), format!("remove it, or `{other}`"));
    }

    /// Notes that `keys` are parameters only beside `other`, which is left out: it is an error if they are given.
    pub(super) fn only_beside(&mut self, keys: &[&str], other: &str) {
        self.note(keys, format!("is a parameter only beside `{other}`"), format!("give `{other}`, or remove it"));
    }

    fn note(&mut self, keys: &[&str], problem: String, remedy: String) {
        let idle = |key: &&str| Idle { key: (*key).into(), problem: problem.clone(), remedy: remedy.clone() };
        self.idle.extend(keys.iter().map(idle));
    }

    /// The number `key`, within `range` (NaN and infinities never are).
    pub fn number(
        &mut self,
        key: &str,
        range: RangeInclusive<f64>,
        spacing: Spacing,
        help: &'static str,
    ) -> Result<f64> {
        let scale = Scale::new(range.clone(), spacing);
        self.number_on(key, range, scale, help)
    }

    /// The same, usually on this `scale`.
    pub fn number_on(
        &mut self,
        key: &str,
        range: RangeInclusive<f64>,
        scale: Scale,
        help: &'static str,
    ) -> Result<f64> {
        let value = self.take(key, "a number", Domain::Number(range.clone(), scale), help)?;
        in_range(key, as_number(&value), &range)
    }

    /// The number `key` as [`Self::number`] has it, by equal steps, or `default` where it is left out.
    pub fn number_or(
        &mut self,
        key: &str,
        range: RangeInclusive<f64>,
        default: f64,
        help: &'static str,
    ) -> Result<f64> {
        let domain = Domain::Number(range.clone(), Scale::linear(range.clone()));
        self.read.push(Parameter { key: key.into(), help, domain, default: Some(default) });
        let value = self.table.remove(key).map_or(default, |value| as_number(&value));
        in_range(key, value, &range)
    }

    /// The albedo of a diffuse part.
    pub(super) fn diffuse(&mut self) -> Result<DVec3> {
        self.colour("diffuse", 0.0..=1.0, "Albedo of the diffuse part, linear Rec. 709.")
    }

    /// The RGB colour `key`, each channel within `range`; a single number stands for a grey.
    pub fn colour(&mut self, key: &str, range: RangeInclusive<f64>, help: &'static str) -> Result<DVec3> {
        // Colours that may exceed 1 span orders of magnitude, as indices of refraction do.
        let spacing = if *range.end() > 1.0 { Spacing::Logarithmic } else { Spacing::Linear };
        let scale = Scale::new(range.clone(), spacing);
        self.colour_on(key, range, scale, help)
    }

    /// The same, usually on this `scale`.
    pub fn colour_on(
        &mut self,
        key: &str,
        range: RangeInclusive<f64>,
        scale: Scale,
        help: &'static str,
    ) -> Result<DVec3> {
        let value = self.take(key, "three numbers [r, g, b]", Domain::Colour(range.clone(), scale), help)?;
        let [r, g, b] = channels(&value)
            .map_err(|count| Error::input(key, format!("has {count} values"), "give three, [r, g, b]"))?;
        Ok(DVec3::new(in_range(key, r, &range)?, in_range(key, g, &range)?, in_range(key, b, &range)?))
    }

    /// The value that the string `key` stands for among `choices`.
    pub fn choice<T: Copy>(&mut self, key: &str, choices: &[(&str, T)], help: &'static str) -> Result<T> {
        let names = choices.iter().map(|(name, _)| format!("\"{name}\"")).collect::<Vec<_>>().join(" or ");
        let words = choices.iter().map(|(name, _)| name.to_string()).collect();
        let value = self.take(key, &names, Domain::Choice(words), help)?;
        let chosen = choices.iter().find(|(name, _)| value.as_str() == Some(name));
        chosen
            .map(|(_, choice)| *choice)
            .ok_or_else(|| Error::input(key, format!("is {value}"), format!("use {names}")))
    }

    /// The name of the model that stands beside its parameters.
    pub(super) fn model(&mut self) -> Result<String> {
        let model = take_model(&mut self.table)?;
        self.model = Some(model.clone());
        Ok(model)
    }

    /// Whether `key` is a table.
    pub(super) fn is_table(&self, key: &str) -> bool {
        self.table.get(key).is_some_and(Value::is_table)
    }

    /// What `read` makes of the parameters in the table `key`, which holds `what`. Their names are `key.name`.
    pub(super) fn table<T>(
        &mut self,
        key: &str,
        what: &str,
        read: impl FnOnce(&mut Parameters) -> Result<T>,
    ) -> Result<T> {
        let inner = match self.table.remove(key) {
            Some(Value::Table(inner)) => inner,
            Some(other) => return Err(Error::input(key, format!("is {other}"), format!("give {what}"))),
            None if self.fills => Table::new(),
            None => return Err(Error::input(key, "is missing", format!("give {what}"))),
        };
        let mut inner = Parameters { fills: self.fills, only_checks: self.only_checks, ..Parameters::new(inner) };
        let value = read(&mut inner).map_err(|error| inside(error, key))?;
        let of_inner = |parameter: Parameter| Parameter { key: format!("{key}.{}", parameter.key), ..parameter };
        self.read.extend(inner.read.drain(..).map(of_inner));
        let of = inner.model.take();
        inner.finish(of.as_deref().unwrap_or(key)).map_err(|error| inside(error, key))?;
        Ok(value)
    }

    /// Reports a key that `model` does not have, or not beside those that are given. What is unknown goes first: another key may lack
    /// what is misspelt there.
    pub fn finish(self, model: &str) -> Result<()> {
        let idle = |key: &String| self.idle.iter().find(|idle| idle.key == *key);
        if let Some(key) = self.table.keys().find(|key| idle(key).is_none()) {
            return Err(Error::input(key, format!("is not a parameter of `{model}`"), "remove or correct the key"));
        }
        match self.table.keys().find_map(idle) {
            Some(Idle { key, problem, remedy }) => Err(Error::input(key, problem, remedy)),
            None => Ok(()),
        }
    }

    pub(super) fn take(&mut self, key: &str, what: &str, domain: Domain, help: &'static str) -> Result<Value> {
        let middle = self.fills.then(|| domain.middle());
        self.read.push(Parameter { key: key.into(), help, domain, default: None });
        self.table.remove(key).or(middle).ok_or_else(|| {
            let remedy = match self.table.keys().find(|given| is_misspelt(given, key)) {
                Some(given) => format!("rename `{given}`, or give {what}"),
                None => format!("give {what}"),
            };
            Error::input(key, "is missing", remedy)
        })
    }
}

/// The error about a key in the table `key`.
fn inside(error: Error, key: &str) -> Error {
    match error {
        Error::Input { subject, problem, remedy } => {
            Error::Input { subject: format!("{key}.{subject}"), problem, remedy }
        }
        other => other,
    }
}

/// Takes the name of the model from the keys of a material.
pub(super) fn take_model(table: &mut Table) -> Result<String> {
    let remedy = || format!("name one of {}", Brdf::models_with_parameters().join(", "));
    match table.remove("model") {
        Some(Value::String(model)) => Ok(model),
        Some(_) => Err(Error::input("model", "is not a string", remedy())),
        None if table.contains_key("material") => {
            let remedy = "give a file that has `model` and the parameters of one material, without [[material]]";
            Err(Error::input("material", "makes this a scene, where one material is asked for", remedy))
        }
        None => Err(Error::input("model", "is missing, and without one it is no material", remedy())),
    }
}

/// The value of a parameter by its [`Parameter::key`].
pub fn parameter<'t>(table: &'t Table, key: &str) -> Option<&'t Value> {
    match key.split_once('.') {
        Some((outer, inner)) => parameter(table.get(outer)?.as_table()?, inner),
        None => table.get(key),
    }
}

/// Gives a parameter a value by its [`Parameter::key`]. A table that is not there is made; within what is no table there are no
/// parameters, so such a key stands for itself, and no model knows it.
pub fn set_parameter(table: &mut Table, key: &str, value: Value) {
    let split = key.split_once('.').filter(|(outer, _)| table.get(*outer).is_none_or(Value::is_table));
    let Some((outer, inner)) = split else {
        table.insert(key.into(), value);
        return;
    };
    if let Value::Table(below) = table.entry(outer).or_insert_with(|| Table::new().into()) {
        set_parameter(below, inner, value);
    }
}

/// The channels of a colour; a single number stands for a grey. The error is how many values there are instead of three.
pub fn channels(value: &Value) -> Result<[f64; 3], usize> {
    match value {
        Value::Array(array) => {
            let channels: Vec<_> = array.iter().map(as_number).collect();
            channels.try_into().map_err(|channels: Vec<_>| channels.len())
        }
        single => Ok([as_number(single); 3]),
    }
}

/// NaN, which no range holds, for anything but a number.
pub fn as_number(value: &Value) -> f64 {
    value.as_float().or(value.as_integer().map(|integer| integer as f64)).unwrap_or(f64::NAN)
}

fn in_range(key: &str, number: f64, range: &RangeInclusive<f64>) -> Result<f64> {
    if range.contains(&number) {
        return Ok(number);
    }
    let problem = if number.is_nan() { "is not a number".into() } else { format!("is {number}") };
    Err(Error::input(key, problem, format!("use a number from {} to {}", range.start(), range.end())))
}
