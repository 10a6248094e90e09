//! The samples of one azimuth of the view, settled: from the normal outwards, each view angle starts from the one before, and of an
//! anisotropic BRDF from the same of the azimuth before. All directions are in the surface's own axes, where lobes stay as the view turns.
use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::azimuths::View;
use super::slice::{Slice, reflect};
use super::{MIN_COS, forces, peaks};
use crate::brdf::SeenBrdf;
use crate::error::{Error, Result};
use crate::progress::Observer;

/// Most steps along the forces in a row; with 50 or 200 pictures came out no nearer to their references, only later.
const ITERATIONS: usize = 25;

/// What has settled at one azimuth, row by row.
pub struct Column<'a> {
    /// The pdf of each row.
    pub slices: Vec<Slice<'a>>,
    /// Where the samples of each row are.
    pub samples: Vec<Vec<DVec3>>,
    /// Which of them sits on a peak.
    pub peaks: Vec<Option<usize>>,
}

/// What columns are made of.
pub struct Columns<'a> {
    /// The BRDF in its own axes.
    pub seen: SeenBrdf<'a>,
    /// How many azimuths of the view there are.
    pub azimuths: usize,
    /// How many view angles of each.
    pub rows: usize,
    /// Where the samples of the first row start: points of its CDF's square.
    pub start: Vec<DVec2>,
    /// May cancel.
    pub observer: &'a dyn Observer,
    /// Is called twice a row.
    pub advance: &'a (dyn Fn() + Sync),
}

impl<'a> Columns<'a> {
    /// Settles the rows of `azimuth`, after those of the azimuth `before`.
    ///
    /// # Errors
    /// Cancelled by the observer (noticed within one step of one row).
    pub fn settle(&self, azimuth: usize, before: Option<&Column>) -> Result<Column<'a>> {
        let views: Vec<_> = (0..self.rows).map(|row| View::of_row(azimuth * self.rows + row, self.rows)).collect();
        let tabulate = |view: &View| {
            if self.observer.cancelled() {
                return Err(Error::Cancelled);
            }
            let slice = Slice::of_view(&self.seen, view.w_o());
            (self.advance)();
            Ok(slice)
        };
        let slices: Vec<Slice> = views.par_iter().map(tabulate).collect::<Result<_>>()?;
        let mut column =
            Column { slices, samples: Vec::with_capacity(self.rows), peaks: Vec::with_capacity(self.rows) };
        for row in 0..self.rows {
            let (samples, peak) = match before {
                // Seen along the normal all azimuths are one view.
                Some(before) if row == 0 => (before.samples[0].clone(), before.peaks[0]),
                _ => self.settled_row(row, &column, before)?,
            };
            column.samples.push(samples);
            column.peaks.push(peak);
            (self.advance)();
        }
        Ok(column)
    }

    /// The samples of `row`, after the rows before it in its column, and which of them sits on a peak.
    fn settled_row(&self, row: usize, column: &Column, before: Option<&Column>) -> Result<(Vec<DVec3>, Option<usize>)> {
        let slice = &column.slices[row];
        let last = row.checked_sub(1);
        let of_row = last.map(|last| self.carried(&column.slices[last], &column.samples[last], slice));
        let of_azimuth = before.map(|before| self.carried(&before.slices[row], &before.samples[row], slice));
        let mut samples = match (of_row, of_azimuth) {
            (None, None) => self.start.iter().map(|uv| slice.direction(*uv)).collect(),
            (Some(one), None) | (None, Some(one)) => one,
            (Some(a), Some(b)) => half_way(&a, &b, slice.w_o()),
        };
        samples.iter_mut().for_each(|s| *s = above_horizon(*s));
        let peak_before = before.and_then(|before| before.peaks[row]).or_else(|| column.peaks[last?]);
        let peak = peaks::sharp_peak(slice).map(above_horizon);
        let peak_thread = peak.map(|peak| peaks::occupy(peak, &mut samples, peak_before));
        forces::settle(slice, &mut samples, peak_thread, ITERATIONS, self.observer)?;
        samples.iter_mut().for_each(|s| *s = above_horizon(*s));
        Ok((samples, peak_thread))
    }

    /// `samples` carried from one slice to another, not by direction: a narrow lobe moves by more than its width from row to row, and would
    /// leave its samples behind. By what the CDF says; but of an anisotropic BRDF by the facets that mirror them. A long lobe has two ends with
    /// nothing between, and what the CDF says would take samples from one to the other as their masses change.
    fn carried(&self, from: &Slice, samples: &[DVec3], to: &Slice) -> Vec<DVec3> {
        if self.azimuths == 1 {
            return samples.par_iter().map(|s| to.direction(from.coordinate(*s))).collect();
        }
        let carry = |s: &DVec3| above_horizon(reflect(to.w_o(), (s + from.w_o()).normalize()));
        samples.iter().map(carry).collect()
    }
}

/// Half way between both, by the facets that mirror them.
fn half_way(a: &[DVec3], b: &[DVec3], w_o: DVec3) -> Vec<DVec3> {
    let between = |(a, b): (&DVec3, &DVec3)| {
        let [a, b] = [a, b].map(|s| (s + w_o).normalize());
        reflect(w_o, (a + b).normalize())
    };
    a.iter().zip(b).map(between).collect()
}

/// Lifts a direction to [`MIN_COS`] where it is below.
pub(super) fn above_horizon(s: DVec3) -> DVec3 {
    if s.z > MIN_COS {
        return s;
    }
    // Twice, so that the rounding of theta cannot take it back.
    (s.truncate().normalize_or(DVec2::X) * (1.0 - 4.0 * MIN_COS * MIN_COS).sqrt()).extend(2.0 * MIN_COS)
}
