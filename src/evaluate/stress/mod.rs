//! Hard cases: whether what a device shades is finite, and what the CPU's form of the same method shades: `threadlight bench stress`.
//!
//! Materials, surfaces, light, views and pictures at the ends of what they may be: `cases.rs`. The device is compared with the CPU given the
//! same surfaces, so that what is found is of shading alone.
mod cases;

use std::sync::Arc;

use glam::Vec4;
use serde::Serialize;

use self::cases::Case;
pub use self::cases::{SIZE_PX, THREADS};
use super::cases::by_method;
use super::metrics::Display;
use super::rounding::shade;
use super::tables::{Section, Table};
use crate::environment::{Environment, RepairCounts};
use crate::error::{Error, Result};
use crate::memo::{Held, Key, Keyed, Memo};
use crate::method::Method;
use crate::passes::check_aliases;
use crate::pipeline::{DeviceScene, Wanted};
use crate::prepare::prepare;
use crate::progress::{Observer, Parts};
use crate::shading::CpuShader;
use crate::vulkan::{Device, DeviceKind};

/// What differences may be: RMS over the covered pixels, each relative to the largest of its radiance, the picture's mean, and a millionth
/// of the light's maximum, in which all rounds.
pub const MOST_RMS: f64 = 2e-3;
/// The same of the methods that draw samples. Of their pixels the worst twentieth is left out: a sample on the other side of an edge, of a
/// cell or of a choice makes another pixel.
pub const MOST_RMS_DRAWN: f64 = 3e-3;
/// The same of all methods on GPUs, which have the weights of a lookup in 8 bits: beside black, a step is 4e-3 of a texel.
pub const MOST_RMS_ON_GPUS: f64 = 5e-3;
/// Light is made as bright as this where pyramids are to be in single precision: half floats, scaled, go to 4e6.
const BRIGHT: f64 = 1e9;

/// Which cases.
#[derive(Clone, Debug, Default)]
pub struct Extent {
    /// All of them, by all methods, with pyramids in both formats; else those that take little time, by the methods that have threads.
    pub all: bool,
    /// Only those that have one of these in their names; none of these are all.
    pub only: Vec<String>,
}

/// What became of a case.
#[derive(Clone, Debug, Serialize)]
pub struct Stressed {
    /// What is hard.
    pub case: String,
    /// By which method.
    pub method: &'static str,
    /// Whether light is so bright that pyramids are in single precision, not in half floats.
    pub bright: bool,
    /// Pixels that see a surface.
    pub covered: usize,
    /// Pixels with a value that is NaN or infinite.
    pub not_finite: usize,
    /// Pixels within a surface whose display value is off by more than a step of 8 bits.
    pub wrongly_shown: usize,
    /// Of the finite ones, as [`MOST_RMS`] has it.
    pub rms: f64,
    /// What that may be: [`MOST_RMS`], [`MOST_RMS_DRAWN`] or [`MOST_RMS_ON_GPUS`].
    #[serde(skip)]
    pub allowed: f64,
    /// The largest such difference of a pixel.
    pub most: f64,
}

impl Stressed {
    /// Whether a bound is broken.
    pub fn is_broken(&self) -> bool {
        self.not_finite > 0 || self.wrongly_shown > 0 || self.rms.is_nan() || self.rms > self.allowed
    }
}

/// Whether the method of that name draws samples, which differ where a choice is close.
fn draws(method: &str) -> bool {
    Method::from_name(method).is_ok_and(|method| method.threads().is_none() && !method.lookups().split_sum)
}

/// Runs cases on `device`; `found` has what was seen until an error or an interruption.
///
/// # Errors
/// A part of names that no case has; whatever Vulkan refuses, a folder for files that cannot be made; cancelled.
pub fn run(
    extent: &Extent,
    device: &Arc<Device>,
    memo: &Memo,
    observer: &dyn Observer,
    found: &mut Vec<Stressed>,
) -> Result<()> {
    let folder = tempfile::tempdir().map_err(|cause| Error::unwritable(std::env::temp_dir(), cause))?;
    let is_possible = |case: &Case| extent.all || !case.is_slow;
    let mut cases: Vec<Case> = cases::cases(folder.path()).into_iter().filter(is_possible).collect();
    let is_in = |case: &Case, only: &String| case.name.contains(only.as_str());
    if let Some(only) = extent.only.iter().find(|only| !cases.iter().any(|case| is_in(case, only))) {
        let names = cases.iter().map(|case| format!("{:?}", case.name)).collect::<Vec<_>>().join(", ");
        let or = if extent.all { "" } else { ", or --all for more of them" };
        return Err(Error::input(
            format!("--only {only:?}"),
            "is in the name of no case",
            format!("give a part of one of {names}{or}"),
        ));
    }
    cases.retain(|case| extent.only.is_empty() || extent.only.iter().any(|only| is_in(case, only)));
    let methods: Vec<_> = Method::on_gpu().filter(|method| extent.all || method.threads().is_some()).collect();
    let formats: &[bool] = if extent.all { &[false, true] } else { &[false] };
    let pictures = Parts::new(cases.len() * methods.len() * formats.len(), observer);
    for case in &cases {
        let file = case.write_file()?;
        // Another case had another file there.
        file.iter().for_each(|path| memo.look_again(path));
        // What the methods have in common is made once.
        let mut held = Held::default();
        for &method in &methods {
            for &bright in formats {
                found.extend(stress(device, memo, case, method, bright, &mut held)?);
                pictures.advance()?;
            }
        }
        file.map_or(Ok(()), std::fs::remove_file).map_err(|cause| Error::unwritable(folder.path(), cause))?;
    }
    Ok(())
}

/// What becomes of a case by `method`; none where its light cannot be made bright, or has more pixels than the method can draw by on the device.
fn stress(
    device: &Arc<Device>,
    memo: &Memo,
    case: &Case,
    method: Method,
    bright: bool,
    held: &mut Held,
) -> Result<Option<Stressed>> {
    let round = memo.round(&());
    let mut prepared = prepare(&by_method(&case.scene, method), &round)?;
    let light = case.light.as_ref().map_or_else(|| (*prepared.environment).clone(), |light| light());
    let light = if bright { brightened(&light) } else { Some(light) };
    let Some(light) = light else { return Ok(None) };
    if check_aliases(device, method, &light).is_err() {
        return Ok(None);
    }
    prepared.environment = Keyed::new(Key::of_digest(light.fingerprint()), light);
    let wanted = Wanted { radiance: true, display: true, geometry: true };
    let rendering = DeviceScene::new(device, &prepared, &round)?.render(wanted, 1)?;
    let twin = CpuShader::new(&prepared, &round)?;
    *held = round.held();
    let expected = shade(&twin, &prepared, &rendering.geometry);
    let most = (prepared.view.intensity * prepared.environment.max_radiance()).min(f32::MAX.into());
    let least = 1e-6 * most;
    let display = Display::of(&prepared.view);
    let is_wrong = |(radiance, shown): &(&[f32; 4], &[u8])| {
        let off = |channel: usize| 255.0 * display.value(radiance[channel].into()) - f64::from(shown[channel]);
        radiance[3] == 1.0 && (0..3).any(|channel| off(channel).abs() > 1.0)
    };
    let wrongly_shown = rendering.radiance.iter().zip(rendering.display.chunks_exact(4)).filter(is_wrong).count();
    let stressed = compare(&case.name, method.name(), &rendering.radiance, &expected, least);
    let allowed = if device.description().kind == DeviceKind::Cpu { stressed.allowed } else { MOST_RMS_ON_GPUS };
    Ok(Some(Stressed { bright, wrongly_shown, allowed, ..stressed }))
}

/// The same light, of which the brightest is about [`BRIGHT`]; none where that is not brighter.
fn brightened(light: &Environment) -> Option<Environment> {
    let factor = (BRIGHT / light.max_radiance()).log2().ceil().exp2();
    if !factor.is_finite() || factor < 1.0 {
        return None;
    }
    let texels = light.texels.iter().map(|texel| texel.map(|value| (f64::from(value) * factor) as f32)).collect();
    let name = format!("{}, bright", light.name);
    Some(Environment::new(name, light.width, light.height, texels, RepairCounts::default()))
}

/// What was `found` beside what was `expected`: radiance times coverage, and coverage. `least` is a radiance that is as good as none.
fn compare(case: &str, method: &'static str, found: &[[f32; 4]], expected: &[Vec4], least: f64) -> Stressed {
    let pairs = found.iter().map(|found| Vec4::from(*found)).zip(expected.iter().copied());
    let pairs: Vec<_> = pairs.filter(|(found, expected)| found.w.max(expected.w) > 0.0 || !found.is_finite()).collect();
    let largest = |of: Vec4| f64::from(of.truncate().max_element());
    let mean = pairs.iter().map(|(_, expected)| largest(*expected)).sum::<f64>() / pairs.len().max(1) as f64;
    let mut differences = Vec::new();
    for (found, expected) in pairs.iter().filter(|(found, expected)| found.is_finite() && expected.is_finite()) {
        let scale = largest(*expected).max(mean).max(least);
        let difference = (found.as_dvec4() - expected.as_dvec4()).truncate().abs().max_element();
        // Where all is black, black is expected.
        differences.push(if difference == 0.0 { 0.0 } else { difference / scale });
    }
    let not_finite = pairs.len() - differences.len();
    differences.sort_by(f64::total_cmp);
    let most = differences.last().copied().unwrap_or_default();
    if draws(method) {
        differences.truncate(differences.len() - differences.len() / 20);
    }
    let squares: f64 = differences.iter().map(|difference| difference * difference).sum();
    let rms = (squares / differences.len().max(1) as f64).sqrt();
    let allowed = if draws(method) { MOST_RMS_DRAWN } else { MOST_RMS };
    let covered = pairs.len();
    Stressed { case: case.to_owned(), method, bright: false, covered, not_finite, wrongly_shown: 0, rms, allowed, most }
}

/// The table that `bench stress` prints.
pub fn tables(found: &[Stressed]) -> Section {
    let of_method = |method: &'static str, bright: bool| {
        let row = |case: &Stressed| {
            let verdict = if case.is_broken() { "broken" } else { "" };
            let counts = [case.covered, case.not_finite, case.wrongly_shown].map(|count| count.to_string());
            let differences = [case.rms, case.most].map(|difference| format!("{difference:.1e}"));
            (case.case.clone(), [&counts[..], &differences, &[verdict.to_owned()]].concat())
        };
        let head = ["pixels", "not finite", "wrongly shown", "RMS", "most", ""];
        let is_of = |case: &&Stressed| (case.method, case.bright) == (method, bright);
        let rows: Vec<_> = found.iter().filter(is_of).map(row).collect();
        let title = if bright { format!("{method}, bright") } else { method.to_owned() };
        (!rows.is_empty()).then(|| Table::new(title, head, rows))
    };
    let title = format!(
        "Device and CPU, relative to radiance; {MOST_RMS:.0e} RMS is allowed, {MOST_RMS_DRAWN:.0e} where samples are drawn, {MOST_RMS_ON_GPUS:.0e} on GPUs:"
    );
    let tables = Method::ALL.iter().flat_map(|method| [false, true].map(|bright| of_method(method.name(), bright)));
    Section { title, tables: tables.flatten().collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_finite_or_not_as_expected_breaks_a_bound() {
        let expected = vec![Vec4::new(1.0, 0.5, 0.2, 1.0); 100];
        let right: Vec<[f32; 4]> = expected.iter().map(|pixel| pixel.to_array()).collect();
        assert!(!compare("right", "fitted", &right, &expected, 0.0).is_broken());
        for (pixel, value) in [(3, f32::NAN), (4, f32::INFINITY), (5, 1.1)] {
            let mut found = right.clone();
            found[pixel][0] = value;
            let stressed = compare("planted", "fitted", &found, &expected, 0.0);
            assert!(stressed.is_broken(), "{stressed:?}");
            assert_eq!(stressed.not_finite, usize::from(!value.is_finite()));
        }
        // Black on black is right, light on black is not.
        let (black, dark) = (vec![Vec4::W; 4], [[0.0, 0.0, 0.0, 1.0]; 4]);
        assert!(!compare("black", "fitted", &dark, &black, 0.0).is_broken());
        assert!(compare("black", "fitted", &[[1e-9, 0.0, 0.0, 1.0]; 4], &black, 0.0).is_broken());
    }
}
