//! What each rounding of a device costs: `threadlight bench rounding`.
//!
//! The CPU's form of a method shades the same surfaces without a rounding and with it; what differs is of that rounding alone. Beside them
//! stands the device's own picture, in which all of them are at once.
use std::sync::Arc;

use glam::{UVec2, Vec4};
use rayon::prelude::*;
use serde::Serialize;

use super::cases::{Cases, Place};
use super::metrics::{Differences, Display};
use super::tables::{Section, Table};
use crate::environment::FractionBits;
use crate::error::Result;
use crate::memo::{Key, Keyed, Memo};
use crate::pipeline::{Wanted, render_geometry};
use crate::prepare::Prepared;
use crate::progress::{Observer, Parts};
use crate::shading::random::pcg4d;
use crate::shading::{CpuShader, texels_of_pixel};
use crate::statistics::{largest, mean};
use crate::threads::Threads;
use crate::threads::fitted::{FittedTable, PackedKernel};
use crate::vulkan::Device;

/// One of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Rounding {
    /// Lookups in cube maps blend by fractions of so many bits. Vulkan promises 4 of each (`subTexelPrecisionBits`,
    /// `mipmapPrecisionBits`), and 8 are usual.
    Fractions(FractionBits),
    /// Cube maps hold half floats.
    HalfLight,
    /// Both numbers of the geometry cache's normals are a step of their 16 bits off. To round to the nearest step is to be off by
    /// 1/sqrt(12) of one, RMS.
    Normals,
    /// All numbers of all threads are a step of their 16 bits off.
    Threads,
    /// Threads are summed from the last to the first.
    Order,
    /// All that the device itself does.
    Device,
}

impl Rounding {
    const ALL: [Self; 9] = [
        Self::Fractions(FractionBits { texel: 8, level: 8 }),
        Self::Fractions(FractionBits { texel: 4, level: 4 }),
        Self::Fractions(FractionBits { texel: 4, level: 8 }),
        Self::Fractions(FractionBits { texel: 8, level: 4 }),
        Self::HalfLight,
        Self::Normals,
        Self::Threads,
        Self::Order,
        Self::Device,
    ];

    fn name(self) -> String {
        match self {
            Self::Fractions(FractionBits { texel, level }) => format!("fractions of {texel} and {level} bits"),
            Self::HalfLight => "light in half floats".to_owned(),
            Self::Normals => "normals a step off".to_owned(),
            Self::Threads => "threads a step off".to_owned(),
            Self::Order => "sums backwards".to_owned(),
            Self::Device => "the device".to_owned(),
        }
    }
}

/// What a rounding cost a material in an environment.
#[derive(Clone, Debug, Serialize)]
pub struct Rounded {
    /// Name of the material.
    pub material: String,
    /// Name of the environment.
    pub environment: String,
    /// Name of the scene.
    pub scene: String,
    /// Name of the method.
    pub method: String,
    /// Threads or samples.
    pub count: u32,
    /// What was rounded.
    pub rounding: String,
    /// Of display values, over the pixels that see a surface.
    pub rms: f64,
    /// The largest difference of a display value.
    pub most: f64,
}

/// Measures all cases; `found` has what was measured until an error or an interruption.
///
/// # Errors
/// Whatever cannot be loaded, and what Vulkan refuses; cancelled.
pub fn run(
    cases: &Cases,
    device: &Arc<Device>,
    memo: &Memo,
    observer: &dyn Observer,
    found: &mut Vec<Rounded>,
) -> Result<()> {
    let estimators = cases.estimators();
    let pictures = Parts::new(cases.place_count() * estimators.len(), observer);
    cases.for_each_place(memo, observer, &mut |place| {
        for &estimator in &estimators {
            place.choose(estimator)?;
            for (rounding, [rms, most]) in differences(place, device)? {
                found.push(Rounded {
                    material: place.material.to_owned(),
                    environment: place.environment.to_owned(),
                    scene: place.scene.to_owned(),
                    method: estimator.variant.name(),
                    count: estimator.count,
                    rounding: rounding.name(),
                    rms,
                    most,
                });
            }
            pictures.advance()?;
        }
        Ok(())
    })
}

/// RMS and largest difference of display values by each rounding that the method has.
fn differences(place: &mut Place, device: &Arc<Device>) -> Result<Vec<(Rounding, [f64; 2])>> {
    let rendering = place.renderer(device)?.render(Wanted::RADIANCE, 1)?;
    let of_device: Vec<_> = rendering.radiance.into_iter().map(Vec4::from).collect();
    let (prepared, round) = (&*place.prepared, place.round());
    let geometry = render_geometry(device, prepared, &round)?;
    let twin = || CpuShader::new(prepared, &round);
    let exact = shade(&twin()?, prepared, &geometry);
    let by = |rounding| -> Result<Option<Vec<Vec4>>> {
        Ok(Some(match rounding {
            Rounding::Fractions(bits) => shade(&twin()?.with_fractions(bits), prepared, &geometry),
            Rounding::HalfLight => shade(&twin()?.with_half_light(), prepared, &geometry),
            Rounding::Normals => shade(&twin()?, prepared, &moved_normals(&geometry)),
            Rounding::Threads | Rounding::Order => {
                let Some(changed) = with_threads(prepared, rounding) else { return Ok(None) };
                shade(&CpuShader::new(&changed, &round)?, prepared, &geometry)
            }
            Rounding::Device => of_device.clone(),
        }))
    };
    let mut found = Vec::new();
    for rounding in Rounding::ALL {
        if let Some(picture) = by(rounding)? {
            found.push((rounding, difference(place.display(), &exact, &picture)));
        }
    }
    Ok(found)
}

/// All pixels by the CPU's form of the method, of these texels of the geometry cache.
pub(super) fn shade(twin: &CpuShader, prepared: &Prepared, geometry: &[[u32; 2]]) -> Vec<Vec4> {
    let (width, height) = (prepared.view.width, prepared.view.height);
    let pixel = |index: u32| {
        let pixel = UVec2::new(index % width, index / width);
        twin.shade(pixel, &texels_of_pixel(&prepared.view, geometry, pixel))
    };
    (0..width * height).into_par_iter().map(pixel).collect()
}

fn difference(display: Display, exact: &[Vec4], found: &[Vec4]) -> [f64; 2] {
    let seen: Vec<_> = exact.iter().zip(found).filter(|(exact, _)| exact.w > 0.0).collect();
    let channels = |(exact, found): &(&Vec4, &Vec4)| {
        [0, 1, 2].map(|c| [exact[c], found[c]].map(|value| display.value(value.into())))
    };
    let differences = Differences::of(seen.iter().flat_map(channels));
    [differences.rms(seen.len().max(1) as u64), differences.max]
}

/// Texels whose normals are a step off, either way at random. Background stays.
fn moved_normals(geometry: &[[u32; 2]]) -> Vec<[u32; 2]> {
    let texel = |(i, &[normal, rest]): (usize, &[u32; 2])| {
        [if rest == 0 { normal } else { in_halves(normal, i as u32, next_integer) }, rest]
    };
    geometry.iter().enumerate().map(texel).collect()
}

/// `prepared`, whose one material has threads that are rounded, or in another order; none if they are no kernels.
fn with_threads(prepared: &Prepared, rounding: Rounding) -> Option<Prepared> {
    let mut prepared = prepared.clone();
    let threads = prepared.materials[0].threads.as_mut()?;
    let change = if rounding == Rounding::Threads { move_threads } else { reverse_threads };
    let of_table = |table: &FittedTable| -> Vec<_> {
        table.kernels.chunks(table.count).flat_map(|row| change(row, table.sets)).collect()
    };
    let mut changed = (**threads).clone();
    let (Threads::Fitted(table) | Threads::Gaussian(table)) = &mut changed else { return None };
    table.kernels = of_table(table);
    if let Some(table) = &mut table.of_subpixels {
        table.kernels = of_table(table);
    }
    let key = Key::builder("changed threads").text(&rounding.name()).key(threads.key).build();
    *threads = Keyed::new(key, changed);
    Some(prepared)
}

fn move_threads(row: &[PackedKernel], _: usize) -> Vec<PackedKernel> {
    let kernel = |&PackedKernel([place, level_red, green_blue]): &_| {
        let halves = [level_red, green_blue].map(|word| in_halves(word, word, next_half_float));
        PackedKernel([in_halves(place, place, next_integer), halves[0], halves[1]])
    };
    row.iter().map(kernel).collect()
}

/// Each set in reverse; some may have one more than others.
fn reverse_threads<T: Copy>(row: &[T], sets: usize) -> Vec<T> {
    let of_set = |set: usize| (row.len() - set).div_ceil(sets);
    (0..row.len()).map(|k| row[k % sets + sets * (of_set(k % sets) - 1 - k / sets)]).collect()
}

/// `change` of both 16-bit halves of a word, each with a random bit.
fn in_halves(word: u32, seed: u32, change: fn(u16, bool) -> u16) -> u32 {
    let [random, ..] = pcg4d([seed, 0, 0, 0]);
    let low = change(word as u16, random & 1 == 0);
    let high = change((word >> 16) as u16, random & 2 == 0);
    u32::from(low) | u32::from(high) << 16
}

/// The signed integer above or below; the smallest is -0x7fff.
fn next_integer(bits: u16, up: bool) -> u16 {
    let step = if up { 1 } else { -1 };
    (bits as i16).saturating_add(step).max(-i16::MAX) as u16
}

/// The half float that is larger or smaller by a step, of the same sign; 0 and what has no such neighbour stay.
fn next_half_float(bits: u16, up: bool) -> u16 {
    match bits & 0x7fff {
        0 | 0x7bff.. => bits,
        _ if up => bits + 1,
        _ => bits - 1,
    }
}

/// The tables that `bench rounding` prints: for each method and count a row for each environment and rounding.
pub fn tables(found: &[Rounded]) -> Section {
    let mut estimators: Vec<_> = found.iter().map(|row| (row.method.as_str(), row.count)).collect();
    estimators.sort_unstable();
    estimators.dedup();
    let mut environments: Vec<&str> = found.iter().map(|row| row.environment.as_str()).collect();
    environments.sort_unstable();
    environments.dedup();
    let of_estimator = |(method, count): (&str, u32)| {
        let row = |environment: &str, rounding: &Rounding| {
            let name = rounding.name();
            let is_of = |row: &&Rounded| {
                (row.method.as_str(), row.count, row.environment.as_str(), &row.rounding)
                    == (method, count, environment, &name)
            };
            let rows: Vec<_> = found.iter().filter(is_of).collect();
            let rms = || rows.iter().map(|row| row.rms);
            let worst = largest(rms());
            let of_worst = &rows.iter().find(|row| row.rms == worst || row.rms.is_nan())?.material;
            let most = largest(rows.iter().map(|row| row.most));
            let cells = [mean(rms()), worst, most].map(|value| format!("{value:.1e}"));
            let cells = cells.into_iter().chain([rms().filter(|rms| rms.is_nan() || *rms > 1e-3).count().to_string()]);
            Some((format!("{environment}, {name}"), cells.chain([of_worst.clone()]).collect()))
        };
        let rows =
            environments.iter().flat_map(|environment| Rounding::ALL.iter().filter_map(|it| row(environment, it)));
        let head = ["mean RMS", "worst", "of a pixel", "above 1e-3", "which"];
        Table::new(format!("{method}, {count}"), head, rows)
    };
    Section {
        title: "What each rounding does to display values:".to_owned(),
        tables: estimators.into_iter().map(of_estimator).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use half::f16;

    #[test]
    fn a_step_is_one_of_integers_and_the_next_half_float_and_stays_in_their_ranges() {
        for x in [0_i16, 1, -1, 500, -500, 32766, -32766] {
            assert_eq!([true, false].map(|up| next_integer(x as u16, up) as i16), [x + 1, x - 1]);
        }
        assert_eq!([next_integer(32767, true) as i16, next_integer(-32767_i16 as u16, false) as i16], [32767, -32767]);
        let next = |x: f32, up| f16::from_bits(next_half_float(f16::from_f32(x).to_bits(), up)).to_f32();
        let step = (-10.0_f32).exp2();
        assert_eq!([next(1.0, true), next(-1.0, true), next(1.0, false)], [1.0 + step, -1.0 - step, 1.0 - 0.5 * step]);
        assert_eq!([next(0.0, true), next(65504.0, true), next(f32::INFINITY, false)], [0.0, 65504.0, f32::INFINITY]);
    }

    #[test]
    fn a_picture_that_is_not_a_number_is_the_worst() {
        let row = |material: &str, rms: f64| Rounded {
            material: material.to_owned(),
            environment: "sky".to_owned(),
            scene: "sphere".to_owned(),
            method: "fitted".to_owned(),
            count: 16,
            rounding: Rounding::Device.name(),
            rms,
            most: rms,
        };
        let shown = |rows: &[Rounded]| tables(rows).tables[0].rows[0].1.clone();
        assert_eq!(shown(&[row("gold", 4e-4), row("clay", 2e-3)]), ["1.2e-3", "2.0e-3", "2.0e-3", "1", "clay"]);
        assert_eq!(shown(&[row("gold", f64::NAN), row("clay", 2e-3)])[1..], ["NaN", "NaN", "2", "gold"]);
    }

    #[test]
    fn sets_stay_sets_in_reverse() {
        let row = [0, 1, 2, 3, 4, 5];
        assert_eq!(reverse_threads(&row, 1), [5, 4, 3, 2, 1, 0]);
        assert_eq!(reverse_threads(&row, 2), [4, 5, 2, 3, 0, 1]);
        assert_eq!(reverse_threads(&row, 4), [4, 5, 2, 3, 0, 1]);
    }
}
