//! Threads of an edited material at once: a few steps from those that are on screen, in few rows.
use glam::DVec3;

use super::edit::Edit;
use super::generate::{Neighbour, carried, from_the_middle, most_moved};
use super::kernel::{Kernel, WIDEST_LEVEL, all_between, scaled, sharpest_level};
use super::lights::{BaseAnswers, LightSettings, Quadrature, TestLights};
use super::row::Row;
use super::sets::share_of_sets;
use super::solve::{Effort, Fit};
use super::table::FittedTable;
use crate::brdf::{Brdf, LobeShape, luminance};
use crate::error::Result;
use crate::progress::Observer;
use crate::threads::azimuths::View;
use crate::threads::slice::{Resolution, Slice};

/// Every so many rows one is fitted, and the last; the others are between them.
const ROW_STEP: usize = 5;

/// The same of azimuths of the view.
const AZIMUTH_STEP: usize = 6;

/// One more row is fitted, so many before the last: at the rim threads move most from row to row, and blends of rows further apart flicker.
/// Not of anisotropic BRDFs: brushed aluminium's drafts had 1.1 times the error with it, for a quarter more time.
const RIM_STEP: usize = 2;

/// Steps of the first row, from where its threads were, and of the others.
const FIRST: Effort = Effort { steps: 24, least_gain: 1e-3 };
const NEXT: Effort = Effort { steps: 12, least_gain: 3e-3 };

/// How strongly the first row is tied to where its threads were, and the others to their neighbours: [`Fit::tied`]. Tied to where they were
/// themselves, rows stay together too, but all of them near where a drag began: over gold of all roughnesses that errs by half as much
/// again. A third of this, and rows part; ten times, and a narrow lobe is not followed.
const FIRST_TIED: f64 = 1e-6;
const TIED: f64 = 1e-5;

/// By [`most_moved`] kernels do not move by more than this from where the edit brings them: what moves by more shows as a flicker. Where the
/// edit changes the lobe they may, since they change with it and would lag behind it otherwise.
const MOST_MOVED: f64 = 0.03;
const MOST_MOVED_AN_OCTAVE: f64 = 5.0;

/// Of what a row had besides a blend of fitted ones, this part is kept: else finished threads would jump to blends in the first draft.
const REST: f64 = 0.7;

/// Test lights of a row: of 16 threads, half of those of a fit.
const FEWEST_LIGHTS: usize = 256;
const LIGHTS_A_THREAD: usize = 16;

/// Threads of `brdf` that continue those of `before`, of a BRDF not far away and of the same azimuths of the view: with up to three times the error of
/// [`super::generate()`], in a tenth of the time. The same to the last bit on any number of cores.
///
/// # Errors
/// Cancelled by `observer`.
pub fn draft(brdf: &Brdf, before: &FittedTable, observer: &dyn Observer) -> Result<FittedTable> {
    let share = share_of_sets(before.azimuths, before.of_subpixels.is_some());
    // Kernels go on from those of before, which have that base under them; and another would have a map of its own uploaded for each draft.
    let base = BaseAnswers::of(&before.base);
    let of_pixels = Drafting { brdf, before, share, lobe: LobeShape::of(brdf), base: &base };
    let Some(of_subpixels) = &before.of_subpixels else { return continued(&of_pixels, observer) };
    let of_subpixels = Drafting { before: of_subpixels, ..of_pixels };
    let (of_pixels, of_subpixels) =
        rayon::join(|| continued(&of_pixels, observer), || continued(&of_subpixels, observer));
    Ok(of_pixels?.with_subpixels(of_subpixels?))
}

/// The threads that `drafting` continues, but not those of their sub-pixels.
fn continued(drafting: &Drafting, observer: &dyn Observer) -> Result<FittedTable> {
    let before = drafting.before;
    let FittedTable { rows, azimuths, sets, rim_power, base, .. } = *before;
    let (mut places, columns) = (every(ROW_STEP, rows), every(AZIMUTH_STEP, azimuths));
    let before_rim = rows.saturating_sub(RIM_STEP + 1);
    if let (Err(place), 1) = (places.binary_search(&before_rim), azimuths) {
        places.insert(place, before_rim);
    }
    let view = |index: usize| drafting.view(index);
    let edit = drafting.edit(places[places.len() / 2]);
    let mut fitted: Vec<Vec<Row>> = Vec::new();
    let index = |column: usize, at: usize| columns[column] * rows + places[at];
    for column in 0..columns.len() {
        let rows_of_column = from_the_middle(places.len(), &|at, neighbour| {
            let of_column = neighbour.map(|(before, row)| (index(column, before), row));
            let of_azimuth = column.checked_sub(1).map(|before| (index(before, at), &fitted[before][at]));
            drafting.fit(index(column, at), [of_column, of_azimuth], &edit, observer)
        })?;
        fitted.push(rows_of_column);
    }
    let blend = |rows_of_columns: &[Vec<Row>], to: usize| {
        let of_column = |column: usize| {
            let row = |at: usize| {
                let row = &rows_of_columns[column][at];
                Row { kernels: carried(&row.kernels, view(index(column, at)), view(to)), ..*row }
            };
            let (low, high, t) = around(&places, to % rows);
            if t == 1.0 { row(high) } else { between(&row(low), &row(high), t) }
        };
        let (low, high, t) = around(&columns, to / rows);
        if t == 1.0 { of_column(high) } else { between(&of_column(low), &of_column(high), t) }
    };
    let edited = |index: usize| Row {
        kernels: edit.applied(&before.unpacked_row(index), view(index).theta_o, None),
        albedo: albedo_of(before, index),
        relative_error: 0.0,
    };
    let edited: Vec<Row> = (0..azimuths * rows).map(edited).collect();
    let edited_where_fitted: Vec<Vec<Row>> = (0..columns.len())
        .map(|column| (0..places.len()).map(|at| edited[index(column, at)].clone()).collect())
        .collect();
    let row = |to: usize| {
        let sharpest = sharpest_level(&drafting.lobe, before.count, view(to).theta_o);
        with_rest(blend(&fitted, to), &blend(&edited_where_fitted, to), &edited[to], sharpest)
    };
    Ok(FittedTable::pack(&(0..azimuths * rows).map(row).collect::<Vec<_>>(), azimuths, sets, rim_power, base))
}

/// What rows are fitted by; what `share` is, [`Fit::in_sets`] says.
struct Drafting<'a> {
    brdf: &'a Brdf,
    before: &'a FittedTable,
    base: &'a BaseAnswers,
    share: f32,
    lobe: LobeShape,
}

/// What a row is fitted to, and the kernels that it had, in units of the lights.
struct Target {
    lights: TestLights,
    albedo: DVec3,
    kernels: Vec<Kernel>,
}

impl Drafting<'_> {
    fn view(&self, index: usize) -> View {
        View::of_row(index, self.before.rows)
    }

    fn target(&self, index: usize) -> Target {
        let slices = Slice::with_lobes_of_view(self.brdf, &self.lobe, self.view(index), Resolution::DRAFT);
        let threads = self.before.count;
        let count = FEWEST_LIGHTS + LIGHTS_A_THREAD * threads;
        let settings = LightSettings { count, threads, seed: 0 };
        let lights = TestLights::new(&slices, settings, Quadrature::DRAFT, self.base);
        let albedo = slices[0].albedo();
        let kernels = scaled(&in_proportion(self.before, index, albedo), 1.0 / lights.unit);
        Target { lights, albedo, kernels }
    }

    /// The fit of the row of this `index` to `target`.
    fn fit_to<'t>(&self, target: &'t Target, index: usize) -> Fit<'t> {
        let Target { lights, albedo, .. } = target;
        let sharpest = sharpest_level(&self.lobe, self.before.count, self.view(index).theta_o);
        Fit::new(lights, *albedo / lights.unit).in_sets(self.before.sets, self.share).no_sharper_than(sharpest)
    }

    /// How the BRDF was edited, as seen in the row of this `index`.
    fn edit(&self, index: usize) -> Edit {
        let target = self.target(index);
        Edit::found(&self.fit_to(&target, index), &target.kernels, self.view(index).theta_o)
    }

    /// The row of this `index`, beside `neighbours`.
    fn fit(&self, index: usize, neighbours: [Neighbour; 2], edit: &Edit, observer: &dyn Observer) -> Result<Row> {
        observer.check()?;
        let target = self.target(index);
        // Only directions and levels are tied, so weights may be in any unit.
        let carried = |(from, row): (usize, &Row)| carried(&row.kernels, self.view(from), self.view(index));
        let beside = match neighbours {
            [Some(a), Some(b)] => Some(all_between(&carried(a), &carried(b), 0.5)),
            [a, b] => a.or(b).map(carried),
        };
        let mut start = edit.applied(&target.kernels, self.view(index).theta_o, beside.as_deref());
        let fit = self.fit_to(&target, index);
        fit.bound(&mut start);
        fit.solve_weights(&mut start);
        let (tied_to, strength, effort) = match &beside {
            Some(beside) => (beside, TIED, NEXT),
            None => (&start, FIRST_TIED, FIRST),
        };
        let mut free = start.clone();
        fit.tied(tied_to, strength).solve(&mut free, effort, observer)?;
        let Target { lights, albedo, .. } = &target;
        let most = MOST_MOVED + MOST_MOVED_AN_OCTAVE * edit.octaves.abs();
        let is_steady = |kernels: &[Kernel]| most_moved([&start, &start], kernels, *albedo / lights.unit) < most;
        let kernels = fit.part_of_the_way(&start, &free, is_steady);
        let relative_error = fit.relative_error(&kernels);
        Ok(Row { kernels: scaled(&kernels, lights.unit), albedo: *albedo, relative_error })
    }
}

/// Every so many of `count`, and the last.
fn every(step: usize, count: usize) -> Vec<usize> {
    let last = !(count - 1).is_multiple_of(step);
    (0..count).step_by(step).chain(last.then_some(count - 1)).collect()
}

/// Between which of `places`, which ascend, `at` is, and how far from the first to the second: above 0, but for the first of all.
fn around(places: &[usize], at: usize) -> (usize, usize, f64) {
    let high = places.partition_point(|&place| place < at);
    let low = high.saturating_sub(1);
    let t = if low == high { 1.0 } else { (at - places[low]) as f64 / (places[high] - places[low]) as f64 };
    (low, high, t)
}

/// The row the part `t` of the way from `a` to `b`, which are both carried to its view.
fn between(a: &Row, b: &Row, t: f64) -> Row {
    Row {
        kernels: a.kernels.iter().zip(&b.kernels).map(|(a, b)| blended(a, b, t)).collect(),
        albedo: a.albedo.lerp(b.albedo, t),
        relative_error: a.relative_error + t * (b.relative_error - a.relative_error),
    }
}

/// The row `blended` with the part [`REST`] of what `before` has besides its own blend, `blended_before`, but no kernel sharper than the level `sharpest`.
fn with_rest(blended: Row, blended_before: &Row, before: &Row, sharpest: f64) -> Row {
    let [albedo_before, albedo_blended] = [before.albedo, blended_before.albedo];
    let albedo = blended.albedo * DVec3::ONE.lerp(ratio_or(albedo_before, albedo_blended, DVec3::ONE), REST);
    let with_rest = |(kernel, (before, blended)): (&Kernel, (&Kernel, &Kernel))| {
        let part_of = |weight: DVec3, albedo: DVec3| ratio_or(weight, albedo, DVec3::ZERO);
        let part = part_of(before.weight, albedo_before) - part_of(blended.weight, albedo_blended);
        Kernel {
            direction: (kernel.direction + REST * (before.direction - blended.direction))
                .normalize_or(kernel.direction),
            level: (kernel.level + REST * (before.level - blended.level)).clamp(sharpest, WIDEST_LEVEL),
            weight: (kernel.weight + REST * albedo * part).max(DVec3::ZERO),
        }
    };
    let others = before.kernels.iter().zip(&blended_before.kernels);
    Row { kernels: blended.kernels.iter().zip(others).map(with_rest).collect(), albedo, ..blended }
}

/// The kernels of `row` of `table` with weights for this albedo: another colour, or none, has them at once.
fn in_proportion(table: &FittedTable, row: usize, albedo: DVec3) -> Vec<Kernel> {
    let factor = ratio_or(albedo, albedo_of(table, row), DVec3::ZERO);
    let kernels = table.unpacked_row(row).into_iter();
    kernels.map(|kernel| Kernel { weight: factor * kernel.weight, ..kernel }).collect()
}

fn albedo_of(table: &FittedTable, row: usize) -> DVec3 {
    DVec3::from_array(table.albedo[row].map(f64::from))
}

/// `a / b` in each channel, and `or` where `b` is 0.
fn ratio_or(a: DVec3, b: DVec3, or: DVec3) -> DVec3 {
    DVec3::select(b.cmpgt(DVec3::ZERO), a / b, or)
}

/// The kernel the part `t` of the way from `a` to `b`, of rows further apart than a degree. It is where most of its weight comes from: one
/// that has none in a row may be anywhere there.
fn blended(a: &Kernel, b: &Kernel, t: f64) -> Kernel {
    let weight = a.weight.lerp(b.weight, t);
    let of_b = t * luminance(b.weight) / luminance(weight);
    Kernel { weight, ..a.between(b, if of_b.is_finite() { of_b } else { t }) }
}
