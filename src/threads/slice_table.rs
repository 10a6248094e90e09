//! The CDFs of a BRDF's slices at all view angles: what importance sampling draws directions by (Matusik et al. 2003).
use rayon::prelude::*;

use super::slice::{Resolution, Slice};
use super::theta_o;
use crate::brdf::{Brdf, SeenBrdf};

/// View angles: theta_o = row 90 deg / ROWS. `SLICE_ROWS` in glsl/importance_sampling.glsl.
pub const ROWS: usize = 90;
/// Rings of the half vector: theta_h = 90 deg x^2, x in steps of 1 / RINGS. `SLICE_RINGS`.
pub const RINGS: usize = Resolution::FULL.theta / MERGED;
/// Azimuths of the half vector from -180 degrees. `SLICE_AZIMUTHS`.
pub const AZIMUTHS: usize = Resolution::FULL.phi / MERGED;
/// Numbers of a row. `SLICE_SIZE`.
pub const ROW_SIZE: usize = RINGS + 1 + RINGS * (AZIMUTHS + 1);

/// Four midpoints make the mass of a cell, so that one half below the horizon is not taken for empty.
const MERGED: usize = 2;

/// Random numbers are multiples of 1 / STEPS in [0, 1).
const STEPS: f64 = (1 << 24) as f64;

/// Row by row of the view angle: the CDF over rings, then ring by ring that over azimuths. All are multiples of 2^-24,
/// as random numbers are, so a cell is drawn with exactly the probability that the numbers tell. 2.3 MB.
#[derive(Clone, Debug)]
pub struct SliceTable {
    /// ROWS times ROW_SIZE numbers in [0, 1].
    pub cdfs: Vec<f32>,
}

impl SliceTable {
    /// Tabulates `brdf`; of an anisotropic one the mean over the azimuths of the view.
    pub fn new(brdf: &Brdf) -> Self {
        let seen = SeenBrdf::from_all_around(brdf);
        let row = |row: usize| {
            let (rings, azimuths) = Slice::new(&seen, theta_o(row, ROWS)).coarse_cdfs(MERGED);
            let all = rings.into_iter().chain(azimuths.into_iter().flatten());
            all.map(|mass| ((mass * STEPS).round() / STEPS) as f32).collect::<Vec<_>>()
        };
        Self { cdfs: (0..ROWS).into_par_iter().flat_map_iter(row).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::threads::test_materials;

    #[test]
    fn every_cdf_rises_from_0_to_1() {
        for (name, brdf) in test_materials::all() {
            let table = SliceTable::new(&brdf);
            assert_eq!(table.cdfs.len(), ROWS * ROW_SIZE);
            for row in table.cdfs.chunks_exact(ROW_SIZE) {
                let (rings, azimuths) = row.split_at(RINGS + 1);
                for cdf in [rings].into_iter().chain(azimuths.chunks_exact(AZIMUTHS + 1)) {
                    assert_eq!((cdf[0], cdf[cdf.len() - 1]), (0.0, 1.0), "{name}");
                    assert!(cdf.is_sorted(), "{name}");
                }
            }
        }
    }
}
