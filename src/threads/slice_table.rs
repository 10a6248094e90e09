//! The CDFs of a BRDF's slices at all view angles: what importance sampling draws directions by (Matusik et al. 2003).
use glam::dvec3;
use rayon::prelude::*;

use super::azimuths::{View, azimuth_count};
use super::slice::{Resolution, Slice};
use crate::brdf::{Brdf, SeenBrdf};
use crate::shader_constants::importance_sampling::{self, SLICE_AZIMUTHS, SLICE_RINGS, SLICE_ROWS, SLICE_SIZE};

/// View angles of an isotropic BRDF: theta_o = row 90 deg / (ROWS - 1), the last 89.99 degrees.
pub const ROWS: usize = SLICE_ROWS as usize;
/// Rings of the half vector: theta_h = 90 deg x^2, x in steps of 1 / RINGS.
pub const RINGS: usize = SLICE_RINGS as usize;
/// Azimuths of the half vector from -180 degrees.
pub const AZIMUTHS: usize = SLICE_AZIMUTHS as usize;
/// Numbers of a row.
pub const ROW_SIZE: usize = SLICE_SIZE as usize;
const _: () = assert!(RINGS == Resolution::FULL.theta / MERGED && AZIMUTHS == Resolution::FULL.phi / MERGED);

/// Four midpoints make the mass of a cell, so that one half below the horizon is not taken for empty.
const MERGED: usize = 2;

/// Random numbers are multiples of 1 / STEPS in [0, 1).
const STEPS: f64 = (1 << 24) as f64;

/// View angles of an anisotropic BRDF at each azimuth: fewer, since it needs 19 or more of these.
pub const AZIMUTH_ROWS: usize = importance_sampling::AZIMUTH_ROWS as usize;

/// Row by row of the view angle: the CDF over rings, then ring by ring that over azimuths. All are multiples of 2^-24,
/// as random numbers are, so a cell is drawn with exactly the probability that the numbers tell. 2.3 MB.
///
/// Of an anisotropic BRDF azimuth by azimuth of the view, with the half vector's azimuth from the tangent: its lobe stays where it is as the
/// view turns, so a blend of two azimuths is a lobe as narrow as each. 22 MB for 19 azimuths.
#[derive(Clone, Debug)]
pub struct SliceTable {
    /// Azimuths of the view, as [`azimuth_count`] has them: 1 of an isotropic BRDF.
    pub azimuths: usize,
    /// View angles of each: [`ROWS`] or [`AZIMUTH_ROWS`].
    pub rows: usize,
    /// For each row [`ROW_SIZE`] numbers in [0, 1].
    pub cdfs: Vec<f32>,
}

impl SliceTable {
    /// Tabulates `brdf`.
    pub fn new(brdf: &Brdf) -> Self {
        let azimuths = azimuth_count(brdf);
        let rows = if azimuths == 1 { ROWS } else { AZIMUTH_ROWS };
        let seen = SeenBrdf::from_azimuth(brdf, 0.0);
        let slice = |row: usize| {
            let View { theta_o, phi_o } = View::of_row(row, rows);
            Slice::of_view(&seen, dvec3(theta_o.sin() * phi_o.cos(), theta_o.sin() * phi_o.sin(), theta_o.cos()))
        };
        Self { azimuths, rows, cdfs: tabulated(azimuths * rows, slice) }
    }
}

#[cfg(test)]
impl SliceTable {
    /// As if `brdf` were isotropic, of the mean over the azimuths of the view: what the rows of each azimuth are compared with.
    pub fn of_mean(brdf: &Brdf) -> Self {
        let seen = SeenBrdf::from_all_around(brdf);
        let slice = |row: usize| Slice::new(&seen, super::theta_o(row, ROWS));
        Self { azimuths: 1, rows: ROWS, cdfs: tabulated(ROWS, slice) }
    }
}

/// The CDFs of so many slices.
fn tabulated<'a>(count: usize, slice: impl Fn(usize) -> Slice<'a> + Sync) -> Vec<f32> {
    let row = |row: usize| {
        let (rings, azimuths) = slice(row).coarse_cdfs(MERGED);
        let all = rings.into_iter().chain(azimuths.into_iter().flatten());
        all.map(|mass| ((mass * STEPS).round() / STEPS) as f32).collect::<Vec<_>>()
    };
    (0..count).into_par_iter().flat_map_iter(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::threads::test_materials::{self, InSlices};

    #[test]
    fn every_cdf_rises_from_0_to_1() {
        for InSlices { name, table, .. } in test_materials::in_slices() {
            let expected = match *name {
                "brushed" => [19, AZIMUTH_ROWS],
                "brushed aslant" => [37, AZIMUTH_ROWS],
                "leaning" => [73, AZIMUTH_ROWS],
                _ => [1, ROWS],
            };
            assert_eq!([table.azimuths, table.rows], expected, "{name}");
            assert_eq!(table.cdfs.len(), table.azimuths * table.rows * ROW_SIZE);
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
