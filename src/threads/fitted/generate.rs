//! The fit of all rows: from the middle one outwards, each starts from its neighbour; of an anisotropic BRDF, so does each azimuth.

use glam::{DVec2, DVec3, dvec3};
use rayon::prelude::*;

use super::base::base_of;
use super::cells::in_sets;
use super::kernel::{Kernel, all_between, scale_rad, scaled, sharpest_level};
use super::lights::{BaseAnswers, LightSettings, Quadrature, TestLights};
use super::row::Row;
use super::sets::{pixels_have_own, share_of_sets};
use super::solve::{Effort, Fit};
use super::stray;
use super::table::FittedTable;
use crate::brdf::{BaseProfile, Brdf, LobeShape, SeenBrdf, luminance, reflect};
use crate::error::Result;
use crate::progress::{Observer, Parts};
use crate::threads::azimuths::{View, azimuth_count};
use crate::threads::rim::rim_power;
use crate::threads::slice::{Resolution, Slice};
use crate::threads::{ThreadKind, ThreadSettings};

/// Steps of the first row, which starts from cells, and of the others.
const FIRST: Effort = Effort { steps: 300, least_gain: 1e-5 };
const NEXT: Effort = Effort { steps: 40, least_gain: 1e-2 };

/// All rows have the same lights where these are not placed by the slice: threads follow the BRDF, not the lights.
const LIGHTS_SEED: usize = 0;

/// How strongly a row is tied to what is carried over from its neighbour: [`Fit::tied`]. With three times as much, ten measured materials err by
/// 3 and 7 % more with 16 and 64 threads. With a third of it they err by 3 % less with 64, but kernels of gold move by more than
/// [`MOST_MOVED`] in a row near the rim, and four brushed materials err by 1 to 2 % more, since they err more between azimuths.
const TIED: f64 = 3e-7;

/// By [`most_moved`] kernels must not move by more than this between rows a degree apart: what moves by more, since some changed places,
/// shows as a line, however well each of both rows is fitted. Where they would, they go part of the way, and further in the next rows. What
/// carrying misses of a steady motion grows with the square of the step.
pub(super) const MOST_MOVED: f64 = 0.06;

/// The same for an anisotropic BRDF, whose rows have two neighbours, where kernels err between rows by more than this part of what the
/// worse of both does (F33).
const MOST_BETWEEN: f64 = 1.1;

/// Test lights of a row: so many, and so many more for each thread. Of too few, many threads answer each alone and err between them: with
/// 64 threads 1536 lights leave a tenth less error than 1200. Up to 16 threads have the same lights.
const FEWEST_LIGHTS: usize = 1000;
const LIGHTS_A_THREAD: usize = 8;
const FEWEST_THREADS: usize = 16;

/// Gaussians are fitted to as many times more directions, since each stands for itself alone.
const DIRECTIONS_A_LIGHT: usize = 2;

/// What a BRDF differs from a diffuse one by at least, relative to the radiance: less is that of the lights' few points, and kernels would be
/// fitted to it.
const LEAST_ERROR: f64 = 3e-3;

/// Kernels narrower than this, in radians, stay where a facet mirrors the view to; wider ones stay where they are.
const FOLLOWS_BELOW_RAD: f64 = 0.15;

/// What has been fitted next to a row, or to an azimuth of rows, and its number; none for the first one.
pub(super) type Neighbour<'a, T = Row> = Option<(usize, &'a T)>;

/// What the threads of a row are fitted to.
struct TargetRow {
    lights: TestLights,
    albedo: DVec3,
}

impl TargetRow {
    /// The fit of one set of kernels, whose weights are in units of the lights.
    fn fit(&self) -> Fit<'_> {
        Fit::new(&self.lights, self.albedo / self.lights.unit)
    }
}

/// What threads of a BRDF are fitted to: lights, and what it makes of them, in each row.
struct Targets {
    /// How many azimuths there are rows of.
    azimuths: usize,
    rows: Vec<TargetRow>,
    /// Of the BRDF, seen along the normal.
    lobe: LobeShape,
    /// Of its albedos, of an anisotropic BRDF those seen along its tangent.
    rim_power: f32,
    /// The profile of what takes what kernels leave.
    base: BaseProfile,
}

/// How many lights there are in a row for so many threads.
fn light_count(threads: usize) -> usize {
    FEWEST_LIGHTS + LIGHTS_A_THREAD * threads.max(FEWEST_THREADS)
}

impl Targets {
    /// Of as many rows as `settings` says, for each azimuth that `brdf` needs; lights count as where so many `threads` are fitted. 3 MB for 90 rows
    /// and 1128 lights.
    ///
    /// # Errors
    /// Cancelled by `observer` (noticed within a row).
    fn new(brdf: &Brdf, settings: &ThreadSettings, threads: usize, observer: &dyn Observer) -> Result<Self> {
        let (rows, count) = (settings.rows, light_count(settings.count));
        let light_settings = LightSettings { count, threads, seed: LIGHTS_SEED };
        let (azimuths, lobe) = (azimuth_count(brdf), LobeShape::of(brdf));
        let base = match settings.kind {
            ThreadKind::Fitted => base_of(brdf, &lobe, observer)?,
            _ => BaseProfile::EVEN,
        };
        let answers = BaseAnswers::of(&base);
        let (resolution, quadrature) = match azimuths {
            1 => (Resolution::FULL, Quadrature::FIT),
            _ => (Resolution::OF_AZIMUTHS, Quadrature::OF_AZIMUTHS),
        };
        let slices = |view: View| Slice::with_lobes_of_view(brdf, &lobe, view, resolution);
        let target = |index: usize| -> Result<TargetRow> {
            observer.check()?;
            let slices = slices(View::of_row(index, rows));
            let lights = match settings.kind {
                ThreadKind::Gaussian => TestLights::directions(&slices, DIRECTIONS_A_LIGHT * count),
                _ => TestLights::new(&slices, light_settings, quadrature, &answers),
            };
            Ok(TargetRow { lights, albedo: slices[0].albedo() })
        };
        let targets = (0..azimuths * rows).into_par_iter().map(target).collect::<Result<Vec<_>>>()?;
        let albedo = |theta_o: f64| slices(View { theta_o, phi_o: 0.0 })[0].albedo();
        let albedos: Vec<_> = targets[..rows].iter().map(|row| row.albedo).collect();
        let rim_power = rim_power(&albedos, albedo);
        Ok(Self { azimuths, rows: targets, lobe, rim_power, base })
    }

    /// Whether the base alone does in all rows.
    fn are_diffuse(&self) -> bool {
        self.rows.par_iter().all(|row| row.fit().relative_error(&[]) < LEAST_ERROR)
    }
}

/// Fits `settings.count` threads to `brdf`, to its answers to lights or, of kind [`ThreadKind::Gaussian`], to f cos itself; the same to the last bit on any number of cores.
/// If they are to be in sets, there may be as many others that are not: see sets.rs.
///
/// # Errors
/// No or too many threads, no rows, or cancelled by `observer` (noticed within a step of a row).
pub fn generate(brdf: &Brdf, settings: &ThreadSettings, observer: &dyn Observer) -> Result<FittedTable> {
    generate_as_of(settings.count, brdf, settings, observer)
}

/// The same by lights that count as where so many `threads` are fitted.
pub(super) fn generate_as_of(
    threads: usize,
    brdf: &Brdf,
    settings: &ThreadSettings,
    observer: &dyn Observer,
) -> Result<FittedTable> {
    settings.check()?;
    let targets = Targets::new(brdf, settings, threads, observer)?;
    let are_two = settings.sets > 1 && pixels_have_own(&targets.lobe);
    let total = if are_two { 2 * targets.rows.len() } else { targets.rows.len() };
    let done = Parts::new(total, observer);
    let share = share_of_sets(targets.azimuths, are_two);
    let fit = |sets| {
        RowFit { brdf, targets: &targets, settings: ThreadSettings { sets, ..*settings }, share, observer, done: &done }
            .of_all()
    };
    if !are_two {
        return fit(settings.sets);
    }
    let (of_pixels, of_subpixels) = rayon::join(|| fit(1), || fit(settings.sets));
    Ok(of_pixels?.with_subpixels(of_subpixels?))
}

/// The fit of rows to `targets`, all threads of which are in `settings.sets`, which count as `share` says: [`Fit::in_sets`].
struct RowFit<'a> {
    brdf: &'a Brdf,
    targets: &'a Targets,
    settings: ThreadSettings,
    share: f32,
    observer: &'a dyn Observer,
    /// Counts rows.
    done: &'a Parts<'a>,
}

impl RowFit<'_> {
    /// All rows.
    fn of_all(&self) -> Result<FittedTable> {
        let Self { targets, settings: ThreadSettings { rows, sets, .. }, .. } = *self;
        let column = |azimuth: usize, beside: Neighbour<Vec<Row>>| -> Result<Vec<Row>> {
            from_the_middle(rows, &|row, before| {
                let before = before.map(|(before, row)| (azimuth * rows + before, row));
                let beside = beside.map(|(beside, column)| (beside * rows + row, &column[row]));
                self.of_row(azimuth * rows + row, &before.into_iter().chain(beside).collect::<Vec<_>>())
            })
        };
        let mut fitted = from_the_middle(targets.azimuths, &column)?.concat();
        if targets.are_diffuse() {
            // Where kernels are is kept, for drafts to start from.
            fitted.iter_mut().for_each(|row| row.kernels = scaled(&row.kernels, 0.0));
        }
        Ok(FittedTable::pack(&fitted, targets.azimuths, sets, targets.rim_power, targets.base))
    }

    /// Row `index` of all azimuths, from what its `neighbours` are there: those of the view angle before and of the azimuth before.
    fn of_row(&self, index: usize, neighbours: &[(usize, &Row)]) -> Result<Row> {
        let Self { brdf, targets, settings, observer, .. } = *self;
        let target = &targets.rows[index];
        let TargetRow { lights, albedo } = target;
        let in_units = |kernels: &[Kernel]| scaled(kernels, 1.0 / lights.unit);
        let view = |index: usize| View::of_row(index, settings.rows);
        let to = view(index);
        let before: Vec<_> = neighbours.iter().map(|(_, row)| in_units(&row.kernels)).collect();
        let carry = |((from, _), before): (&(usize, &Row), &Vec<Kernel>)| carried(before, view(*from), to);
        let here: Vec<_> = neighbours.iter().zip(&before).map(carry).collect();
        let fit = target.fit().in_sets(settings.sets, self.share).no_sharper_than(sharpest_level(
            &targets.lobe,
            settings.count,
            to.theta_o,
        ));
        let start = match &here[..] {
            [] => {
                let [_, lobes] = Slice::with_lobes_of_view(brdf, &targets.lobe, to, Resolution::FULL);
                let starts = in_sets(&lobes, settings.count, settings.sets);
                best_of(&fit, starts.into_iter().map(|cells| in_units(&cells)).collect(), observer)?
            }
            [one] => one.clone(),
            [a, b, ..] => all_between(a, b, 0.5),
        };
        let mut free = start.clone();
        let (tied, effort) = match here[..] {
            [] => (fit, FIRST),
            _ => (fit.tied(&start, TIED), NEXT),
        };
        if !here.is_empty() {
            tied.solve(&mut free, effort, observer)?;
        }
        if settings.kind == ThreadKind::Fitted {
            stray::call_back(&tied, lights.unit, &f_cos_of(brdf, to), &mut free, effort, observer)?;
        }
        let is_steady = |kernels: &[Kernel]| match (&before[..], targets.azimuths) {
            ([before], 1) => {
                let moved = most_moved([before, &start], kernels, *albedo / lights.unit);
                moved < MOST_MOVED * (90.0 / settings.rows as f64).powi(2)
            }
            _ => here.iter().all(|neighbour| {
                let worse = fit.relative_error(kernels).max(fit.relative_error(neighbour));
                fit.relative_error(&all_between(neighbour, kernels, 0.5)) < MOST_BETWEEN * worse
            }),
        };
        let kernels = fit.part_of_the_way(&start, &free, is_steady);
        let relative_error = fit.relative_error(&kernels);
        self.done.advance()?;
        Ok(Row { kernels: scaled(&kernels, lights.unit), albedo: *albedo, relative_error })
    }
}

/// f (n . w) of `brdf` for a view.
pub(super) fn f_cos_of(brdf: &Brdf, View { theta_o, phi_o }: View) -> impl Fn(DVec3) -> DVec3 {
    let (seen, w_o) = (SeenBrdf::from_azimuth(brdf, phi_o), dvec3(theta_o.sin(), 0.0, theta_o.cos()));
    move |w_i| seen.evaluate(w_i, w_o) * w_i.z.max(0.0)
}

/// The solution of the least cost from any of these `starts`.
fn best_of(fit: &Fit, starts: Vec<Vec<Kernel>>, observer: &dyn Observer) -> Result<Vec<Kernel>> {
    let solved = |mut kernels: Vec<Kernel>| {
        fit.bound(&mut kernels);
        fit.solve(&mut kernels, FIRST, observer)?;
        Ok((fit.cost(&kernels), kernels))
    };
    let all = starts.into_par_iter().map(solved).collect::<Result<Vec<_>>>()?;
    let best = all.into_iter().min_by(|(a, _), (b, _)| a.total_cmp(b));
    Ok(best.map(|(_, kernels)| kernels).unwrap_or_default())
}

/// How far kernels have moved, at most, from where they were `before` or where they are carried to, whichever is nearer: in widths and in
/// levels, times their part of the `albedo`, and by how much that part has changed.
pub(super) fn most_moved([before, carried]: [&[Kernel]; 2], kernels: &[Kernel], albedo: DVec3) -> f64 {
    // A black row has no weights.
    let share = |kernel: &Kernel| luminance(kernel.weight) / luminance(albedo).max(f64::MIN_POSITIVE);
    let moved = |((a, carried), b): ((&Kernel, &Kernel), &Kernel)| {
        let away = a.direction.distance(b.direction).min(carried.direction.distance(b.direction));
        let away = away / scale_rad(a.level.min(b.level)) + (a.level - b.level).abs();
        let [before, after] = [share(a), share(b)];
        before.min(after) * away + (before - after).abs()
    };
    before.iter().zip(carried).zip(kernels).map(moved).fold(0.0, f64::max)
}

/// `fit` of each of `count` rows, or azimuths of rows: of the middle one, then of the others one after the other outwards, each with the number of
/// its neighbour and what came of that.
pub(super) fn from_the_middle<T: Send + Sync>(
    count: usize,
    fit: &(impl Fn(usize, Neighbour<T>) -> Result<T> + Sync),
) -> Result<Vec<T>> {
    let middle = count / 2;
    let first = fit(middle, None)?;
    let chain = |order: &mut dyn Iterator<Item = usize>| -> Result<Vec<T>> {
        let mut chain: Vec<T> = Vec::new();
        let mut before = middle;
        for row in order {
            let next = fit(row, Some((before, chain.last().unwrap_or(&first))))?;
            chain.push(next);
            before = row;
        }
        Ok(chain)
    };
    let (down, up) = rayon::join(|| chain(&mut (0..middle).rev()), || chain(&mut (middle + 1..count)));
    let mut all = down?;
    all.reverse();
    all.push(first);
    all.extend(up?);
    Ok(all)
}

/// Kernels of the row for the view `from` as a start for that of `to` (F32).
pub(super) fn carried(kernels: &[Kernel], from: View, to: View) -> Vec<Kernel> {
    let [w_from, w_to] = [from, to].map(|View { theta_o, .. }| dvec3(theta_o.sin(), 0.0, theta_o.cos()));
    // In the frame of the view the surface turns against it.
    let turn = DVec2::from_angle(from.phi_o - to.phi_o);
    let carry = |kernel: &Kernel| {
        let h = (kernel.direction + w_from).normalize();
        let h = turn.rotate(h.truncate()).extend(h.z);
        let mirrored = reflect(w_to, h).normalize();
        let width = scale_rad(kernel.level);
        // Lobes turn with the surface as a whole.
        let follows = (width < FOLLOWS_BELOW_RAD || from.phi_o != to.phi_o) && mirrored.z > -width;
        Kernel { direction: if follows { mirrored } else { kernel.direction }, ..*kernel }
    };
    kernels.iter().map(carry).collect()
}
