//! Reads a model's parameters from TOML and checks them; every error names the key.
use std::ops::RangeInclusive;

use glam::DVec3;
use toml::{Table, Value};

use crate::error::{Error, Result};

/// The parameters of one material that have not been read yet.
pub struct Parameters {
    table: Table,
    read: Vec<Parameter>,
}

/// What a model reads, and what it takes: what a slider needs to know.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Its key in a scene or material file.
    pub key: String,
    /// What it may be.
    pub domain: Domain,
}

/// What a parameter may be.
#[derive(Clone, Debug, PartialEq)]
pub enum Domain {
    /// A number of this range.
    Number(RangeInclusive<f64>),
    /// Linear Rec. 709, each channel of this range.
    Colour(RangeInclusive<f64>),
    /// One of these words.
    Choice(Vec<String>),
}

impl Parameters {
    /// All entries of `table` are parameters.
    pub fn new(table: Table) -> Self {
        Self { table, read: Vec::new() }
    }

    /// Those that have been read, in the order in which they were.
    pub fn read(self) -> Vec<Parameter> {
        self.read
    }

    /// The number `key`, within `range` (NaN and infinities never are).
    pub fn number(&mut self, key: &str, range: RangeInclusive<f64>) -> Result<f64> {
        let value = self.take(key, "a number", Domain::Number(range.clone()))?;
        in_range(key, as_number(&value), &range)
    }

    /// The RGB colour `key`, each channel within `range`; a single number stands for a grey.
    pub fn colour(&mut self, key: &str, range: RangeInclusive<f64>) -> Result<DVec3> {
        let value = self.take(key, "three numbers [r, g, b]", Domain::Colour(range.clone()))?;
        let channels = match &value {
            Value::Array(array) => array.iter().map(as_number).collect::<Vec<_>>(),
            single => vec![as_number(single); 3],
        };
        let [r, g, b] = channels[..] else {
            return Err(Error::input(key, format!("has {} values", channels.len()), "give three, [r, g, b]"));
        };
        Ok(DVec3::new(in_range(key, r, &range)?, in_range(key, g, &range)?, in_range(key, b, &range)?))
    }

    /// The value that the string `key` stands for among `choices`.
    pub fn choice<T: Copy>(&mut self, key: &str, choices: &[(&str, T)]) -> Result<T> {
        let names = choices.iter().map(|(name, _)| format!("\"{name}\"")).collect::<Vec<_>>().join(" or ");
        let words = choices.iter().map(|(name, _)| name.to_string()).collect();
        let value = self.take(key, &names, Domain::Choice(words))?;
        let chosen = choices.iter().find(|(name, _)| value.as_str() == Some(name));
        chosen
            .map(|(_, choice)| *choice)
            .ok_or_else(|| Error::input(key, format!("is {value}"), format!("use {names}")))
    }

    /// Reports a key that `model` does not have.
    pub fn finish(self, model: &str) -> Result<()> {
        match self.table.keys().next() {
            Some(key) => {
                Err(Error::input(key, format!("is not a parameter of `{model}`"), "remove or correct the key"))
            }
            None => Ok(()),
        }
    }

    fn take(&mut self, key: &str, what: &str, domain: Domain) -> Result<Value> {
        self.read.push(Parameter { key: key.into(), domain });
        self.table.remove(key).ok_or_else(|| Error::input(key, "is missing", format!("give {what}")))
    }
}

/// NaN, which no range holds, for anything but a number.
fn as_number(value: &Value) -> f64 {
    value.as_float().or(value.as_integer().map(|integer| integer as f64)).unwrap_or(f64::NAN)
}

fn in_range(key: &str, number: f64, range: &RangeInclusive<f64>) -> Result<f64> {
    if range.contains(&number) {
        return Ok(number);
    }
    let problem = if number.is_nan() { "is not a number".into() } else { format!("is {number}") };
    Err(Error::input(key, problem, format!("use a number from {} to {}", range.start(), range.end())))
}
