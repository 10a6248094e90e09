//! What it costs that devices blend texels and levels by fractions of few bits: `threadlight bench fractions`.
//!
//! Vulkan promises 4 bits of each (`subTexelPrecisionBits`, `mipmapPrecisionBits`), and 8 are usual. The CPU's form of a method shades the
//! same surfaces by all bits and by few; what differs is of the fractions alone.
use std::sync::Arc;

use glam::{UVec2, Vec4};
use rayon::prelude::*;
use serde::Serialize;

use super::cases::{Cases, Place};
use super::tables::{Section, Table};
use crate::environment::FractionBits;
use crate::error::Result;
use crate::memo::Memo;
use crate::pipeline::render_geometry;
use crate::progress::Observer;
use crate::shading::{CpuShader, texels_of_pixel};
use crate::vulkan::Device;

/// What is tried: as is usual, as is promised, and each of the two alone.
const TRIED: [FractionBits; 4] = [
    FractionBits { texel: 8, level: 8 },
    FractionBits { texel: 4, level: 4 },
    FractionBits { texel: 4, level: 8 },
    FractionBits { texel: 8, level: 4 },
];

/// What became of a material in an environment.
#[derive(Clone, Debug, Serialize)]
pub struct Blended {
    /// Name of the material.
    pub material: String,
    /// Name of the environment.
    pub environment: String,
    /// Name of the scene.
    pub scene: String,
    /// Name of the method.
    pub method: &'static str,
    /// Threads or samples.
    pub count: u32,
    /// Bits of the fractions.
    pub bits: FractionBits,
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
    found: &mut Vec<Blended>,
) -> Result<()> {
    let estimators = cases.estimators();
    let total = cases.place_count() * estimators.len();
    let mut done = 0;
    cases.for_each_place(memo, observer, &mut |place| {
        for &estimator in &estimators {
            place.choose(estimator)?;
            for (bits, [rms, most]) in TRIED.into_iter().zip(differences(place, device)?) {
                found.push(Blended {
                    material: place.material.to_owned(),
                    environment: place.environment.to_owned(),
                    scene: place.scene.to_owned(),
                    method: estimator.variant.method.name(),
                    count: estimator.count,
                    bits,
                    rms,
                    most,
                });
            }
            done += 1;
            observer.progress(done, total);
        }
        Ok(())
    })
}

/// RMS and largest difference of display values, by the bits of each of [`TRIED`].
fn differences(place: &Place, device: &Arc<Device>) -> Result<[[f64; 2]; TRIED.len()]> {
    let (prepared, round) = (&*place.prepared, place.round());
    let geometry = render_geometry(device, prepared, &round)?;
    let (width, height) = (prepared.view.width, prepared.view.height);
    let shade = |twin: &CpuShader| -> Vec<Vec4> {
        let pixel = |index: u32| {
            let pixel = UVec2::new(index % width, index / width);
            twin.shade(pixel, &texels_of_pixel(&prepared.view, &geometry, pixel))
        };
        (0..width * height).into_par_iter().map(pixel).collect()
    };
    let mut twin = CpuShader::new(prepared, &round)?;
    let exact = shade(&twin);
    let mut differences = [[0.0; 2]; TRIED.len()];
    for (bits, difference) in TRIED.into_iter().zip(&mut differences) {
        twin = twin.with_fractions(bits);
        let pairs = exact.iter().zip(shade(&twin)).filter(|(exact, _)| exact.w > 0.0);
        let (mut squares, mut most, mut count) = (0.0, 0.0_f64, 0);
        for (exact, found) in pairs {
            for channel in 0..3 {
                let [exact, found] = [exact[channel], found[channel]].map(|value| place.display.value(value.into()));
                squares += (found - exact).powi(2);
                most = most.max((found - exact).abs());
                count += 1;
            }
        }
        *difference = [(squares / f64::from(count.max(1))).sqrt(), most];
    }
    Ok(differences)
}

/// The tables that `bench fractions` prints: for each method and count a row for each environment and number of bits.
pub fn tables(found: &[Blended]) -> Section {
    let mut estimators: Vec<_> = found.iter().map(|row| (row.method, row.count)).collect();
    estimators.sort_unstable();
    estimators.dedup();
    let mut environments: Vec<&str> = found.iter().map(|row| row.environment.as_str()).collect();
    environments.sort_unstable();
    environments.dedup();
    let of_estimator = |(method, count): (&'static str, u32)| {
        let row = |environment: &str, bits: FractionBits| {
            let is_of = |row: &&Blended| {
                (row.method, row.count, row.environment.as_str(), row.bits) == (method, count, environment, bits)
            };
            let rows: Vec<_> = found.iter().filter(is_of).collect();
            let mean = rows.iter().map(|row| row.rms).sum::<f64>() / rows.len().max(1) as f64;
            let largest = |of: fn(&Blended) -> f64| rows.iter().map(|row| of(row)).fold(0.0, f64::max);
            let worst = largest(|row| row.rms);
            let of_worst = rows.iter().find(|row| row.rms == worst).map_or("", |row| &row.material);
            let cells = [mean, worst, largest(|row| row.most)].map(|value| format!("{value:.1e}"));
            let cells = cells.into_iter().chain([rows.iter().filter(|row| row.rms > 1e-3).count().to_string()]);
            let label = format!("{environment}, {} and {} bits", bits.texel, bits.level);
            (label, cells.chain([of_worst.to_owned()]).collect())
        };
        let rows = environments.iter().flat_map(|environment| TRIED.map(|bits| row(environment, bits)));
        let head = ["mean RMS", "worst", "of a pixel", "above 1e-3", "which"].map(str::to_owned).to_vec();
        Table { title: format!("{method}, {count}"), head, rows: rows.collect() }
    };
    Section {
        title: "What coarse fractions of texels and levels do to display values:".to_owned(),
        tables: estimators.into_iter().map(of_estimator).collect(),
    }
}
