//! Makes the threads of a BRDF, section 3.2: from the normal outwards, each view angle starts from the one before.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::rim::rim_power;
use super::slice::{Slice, fibonacci_lattice};
use super::{MIN_COS, Sample, ThreadSettings, ThreadTable, theta_o};
use super::{forces, peaks, smoothing};
use crate::brdf::{Brdf, SeenBrdf};
use crate::error::Result;
use crate::progress::{Observer, Parts};

/// Most steps along the forces in a row; with 50 or 200 pictures came out no nearer to their references, only later.
const ITERATIONS: usize = 25;

/// Makes `settings.count` threads for `brdf`, the same to the last bit on any number of cores.
///
/// Errors: no or too many threads, no rows, or cancelled by `observer` (noticed within one step of one row).
pub fn generate(brdf: &Brdf, settings: &ThreadSettings, observer: &dyn Observer) -> Result<ThreadTable> {
    let &ThreadSettings { count, rows, seed, .. } = settings;
    settings.check()?;

    // Each row is finished twice: its slice is tabulated (on all cores), then its samples settle.
    let parts = Parts::new(2 * rows, observer);
    let seen = SeenBrdf::from_all_around(brdf);
    let tabulate = |row| {
        let slice = Slice::new(&seen, theta_o(row, rows));
        let peak = peaks::sharp_peak(&slice);
        parts.advance()?;
        Ok((slice, peak))
    };
    let slices: Vec<(Slice, Option<DVec3>)> = (0..rows).into_par_iter().map(tabulate).collect::<Result<_>>()?;

    let mut samples: Vec<DVec3> = start(count, seed).into_iter().map(|uv| slices[0].0.direction(uv)).collect();
    let mut peak_thread = None;
    let mut settled: Vec<Vec<DVec3>> = Vec::with_capacity(rows);
    let mut is_peak: Vec<Option<usize>> = Vec::with_capacity(rows);
    for (row, (slice, peak)) in slices.iter().enumerate() {
        if row > 0 {
            // Carried by what the CDF says, not by direction: a narrow lobe moves by more than its width from row to row, and
            // would leave its samples behind.
            let before = &slices[row - 1].0;
            samples.par_iter_mut().for_each(|s| *s = slice.direction(before.coordinate(*s)));
        }
        samples.iter_mut().for_each(|s| *s = above_horizon(*s));
        peak_thread = peak.map(|peak| peaks::occupy(above_horizon(peak), &mut samples, peak_thread));
        forces::settle(slice, &mut samples, peak_thread, ITERATIONS, observer)?;
        samples.iter_mut().for_each(|s| *s = above_horizon(*s));
        settled.push(samples.clone());
        is_peak.push(peak_thread);
        parts.advance()?;
    }

    let threads = (0..count).into_par_iter().map(|thread| {
        let path: Vec<DVec3> = settled.iter().map(|row| row[thread]).collect();
        let smoothed = smoothing::smooth(&path);
        let row_sample = |row: usize| {
            // A sample on a peak stays on it.
            let candidates = if is_peak[row] == Some(thread) { [path[row]; 2] } else { [smoothed[row], path[row]] };
            evaluated(&slices[row].0, candidates)
        };
        (0..rows).map(row_sample).collect::<Vec<_>>()
    });
    let threads: Vec<Vec<Sample>> = threads.collect();
    let samples = (0..rows).flat_map(|row| threads.iter().map(move |thread| thread[row])).collect();
    let albedos: Vec<_> = slices.iter().map(|(slice, _)| slice.albedo()).collect();
    let rim_power = rim_power(&albedos, |theta_o| Slice::new(&seen, theta_o).albedo());
    let albedo = albedos.iter().map(|albedo| albedo.as_vec3().to_array()).collect();
    Ok(ThreadTable { rows, count, seed, material: brdf.model().to_string(), rim_power, albedo, samples })
}

/// Evenly spread points of the CDF's square, in the order of a Hilbert curve: every S-th of them is then evenly spread too,
/// for any S, which is how sub-pixels share the threads out.
fn start(count: usize, seed: u64) -> Vec<DVec2> {
    // The R2 sequence (Roberts 2018) as 64-bit fractions: seeds give well separated shifts of the lattice.
    let fraction = |multiplier: u64| seed.wrapping_mul(multiplier) as f64 / 2f64.powi(64);
    let shift = DVec2::new(fraction(0xC13F_A9A9_02A6_328F), fraction(0x91E1_0DA5_C79E_7B1D));
    let mut points: Vec<DVec2> = fibonacci_lattice(count).map(|uv| (uv + shift).fract()).collect();
    points.sort_by_key(|&uv| hilbert_index(uv));
    points
}

/// Position along the Hilbert curve of order 16 through the unit square.
fn hilbert_index(uv: DVec2) -> u32 {
    let (mut x, mut y) = ((uv.x * 65536.0) as u32, (uv.y * 65536.0) as u32);
    let mut index = 0;
    for bit in (0..16).rev() {
        let (right, top) = (x >> bit & 1, y >> bit & 1);
        index = index << 2 | (3 * right) ^ top;
        // Turn the quadrant so that its part of the curve starts where the one before ended.
        if top == 0 {
            if right == 1 {
                (x, y) = (!x, !y);
            }
            (x, y) = (y, x);
        }
    }
    index
}

/// Lifts a direction to [`MIN_COS`] where it is below.
fn above_horizon(s: DVec3) -> DVec3 {
    if s.z > MIN_COS {
        return s;
    }
    // Twice, so that the rounding of theta cannot take it back.
    (s.truncate().normalize_or(DVec2::X) * (1.0 - 4.0 * MIN_COS * MIN_COS).sqrt()).extend(2.0 * MIN_COS)
}

/// The first candidate where the BRDF reflects anything, with its pdf as the stored, rounded direction sees it.
fn evaluated(slice: &Slice, candidates: [DVec3; 2]) -> Sample {
    for direction in candidates {
        let rounded = Sample::new(direction, 0.0);
        let p = slice.pdf(rounded.direction());
        // Far below any pdf that carries light, and its reciprocal is far from the largest number of single precision.
        if p > 1e-30 {
            return Sample { p: p.min(f64::from(f32::MAX)) as f32, ..rounded };
        }
    }
    // In a hole of a measured table f is 0 and any p gives the right 0; that of the hemisphere is harmless between rows.
    Sample::new(candidates[1], 0.5 * std::f64::consts::FRAC_1_PI)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;
    use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

    use super::*;
    use crate::brdf::tests::samples::of_model;
    use crate::error::Error;
    use crate::farthest::Farthest;
    use crate::threads::{MAX_COUNT, MAX_ROWS, ThreadKind, test_materials};

    fn small(count: usize, rows: usize) -> ThreadSettings {
        ThreadSettings { kind: ThreadKind::Paper, count, rows, seed: 7, sets: 1 }
    }

    #[test]
    fn hilbert_curve_visits_neighbours() {
        let mut cells: Vec<(u32, i32, i32)> = (0..16 * 16)
            .map(|i| (i % 16, i / 16))
            .map(|(x, y)| (hilbert_index(DVec2::new(f64::from(x), f64::from(y)) / 16.0) >> 24, x, y))
            .collect();
        cells.sort();
        for (place, pair) in cells.windows(2).enumerate() {
            assert_eq!(pair[0].0, place as u32);
            assert_eq!((pair[0].1 - pair[1].1).abs() + (pair[0].2 - pair[1].2).abs(), 1);
        }
    }

    #[test]
    fn equal_seeds_give_equal_bits_on_any_number_of_cores_and_other_seeds_others() {
        let brdf = test_materials::narrow();
        let settings = small(20, 12);
        let on = |cores: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(cores).build().unwrap();
            pool.install(|| generate(brdf, &settings, &()).unwrap())
        };
        let table = on(1);
        assert_eq!(table, on(5));
        assert_ne!(table.samples, generate(brdf, &ThreadSettings { seed: 8, ..settings }, &()).unwrap().samples);
    }

    #[test]
    fn samples_lie_above_the_horizon_with_a_positive_pdf() {
        for (name, brdf) in test_materials::all() {
            // 360 rows reach 89.75 degrees.
            for (count, rows) in [(1, 5), (9, 30), (4, 360)] {
                let table = generate(&brdf, &small(count, rows), &()).unwrap();
                assert_eq!(table.samples.len(), count * rows);
                for sample in &table.samples {
                    assert!(sample.direction().z > 0.5 * MIN_COS, "{name} {sample:?}");
                    assert!(
                        sample.p > 0.0 && sample.p.is_finite() && sample.phi.abs() <= std::f32::consts::PI,
                        "{name} {sample:?}"
                    );
                }
            }
        }
    }

    #[test]
    fn the_largest_tables_work() {
        let table = generate(test_materials::narrow(), &small(MAX_COUNT, 2), &()).unwrap();
        assert_eq!(table.row(1).len(), MAX_COUNT);
    }

    #[test]
    fn samples_of_a_diffuse_surface_are_cosine_distributed() {
        let table = generate(&Brdf::builtin("clay").unwrap(), &small(100, 30), &()).unwrap();
        for row in [0, 15, 29] {
            let directions: Vec<DVec3> = table.row(row).iter().map(Sample::direction).collect();
            let mean = directions.iter().sum::<DVec3>() / 100.0;
            let square = directions.iter().map(|s| s.z * s.z).sum::<f64>() / 100.0;
            // Moments of the cosine distribution: (0, 0, 2/3) and 1/2; random points would miss by about 0.05.
            assert!(
                (mean - DVec3::new(0.0, 0.0, 2.0 / 3.0)).length() < 0.03 && (square - 0.5).abs() < 0.03,
                "{row} {mean}"
            );
        }
    }

    #[test]
    fn a_sample_sits_on_the_sharp_peak_in_every_row() {
        let brdf = test_materials::narrow();
        let table = generate(brdf, &small(3, 30), &()).unwrap();
        let holder = |row: usize| {
            let slice = Slice::new(&SeenBrdf::from_all_around(brdf), theta_o(row, table.rows));
            let peak = peaks::sharp_peak(&slice).expect("a lobe of 0.3 degrees is sharp");
            (0..3).find(|&thread| table.row(row)[thread].direction().distance(peak) < 1e-6)
        };
        let first = holder(0);
        assert!(first.is_some());
        assert!((1..28).all(|row| holder(row) == first));
    }

    #[test]
    fn threads_are_continuous() {
        for (name, brdf) in test_materials::all() {
            let table = generate(&brdf, &small(32, 90), &()).unwrap();
            for row in 1..85 {
                for (a, b) in table.row(row - 1).iter().zip(table.row(row)) {
                    let turn_deg = a.direction().angle_between(b.direction()).to_degrees();
                    // The mirror direction turns by 1 degree a row. 32 cones over a hemisphere are 14 degrees wide, 28 degrees
                    // across; from one to the next would be a jump.
                    assert!(turn_deg < 20.0, "{name} row {row}: {turn_deg}");
                }
            }
        }
    }

    #[test]
    fn equation_2_alone_is_near_the_albedo_in_a_white_furnace() {
        // Shading divides by what is left here; what is left tells how well samples follow the pdf.
        for (name, brdf) in test_materials::all() {
            let table = generate(
                &brdf,
                &ThreadSettings { kind: ThreadKind::Paper, count: 100, ..ThreadSettings::default() },
                &(),
            )
            .unwrap();
            for theta_o_deg in [0.0, 0.5, 10.5, 30.0, 45.5, 60.5, 75.5, 82.5, 87.5, 88.0f64] {
                let theta_o = theta_o_deg.to_radians();
                let albedo = brdf.albedo(theta_o);
                let error = ((furnace(&brdf, &table, theta_o) - albedo) / albedo).farthest();
                assert!(error < 0.1, "{name} at {theta_o_deg}: {error}");
            }
        }
    }

    #[test]
    fn the_table_knows_the_albedo_of_every_row() {
        for (name, brdf) in test_materials::all() {
            let table = generate(&brdf, &small(1, 9), &()).unwrap();
            for (row, albedo) in table.albedo.iter().enumerate() {
                let expected = brdf.albedo(theta_o(row, table.rows)).as_vec3();
                let error = ((glam::Vec3::from(*albedo) - expected) / expected).farthest();
                assert!(error < 1e-3, "{name}, row {row}: {error}");
            }
        }
    }

    /// Equation (2) under light of radiance 1.
    fn furnace(brdf: &Brdf, table: &ThreadTable, theta_o: f64) -> DVec3 {
        let w_o = DVec3::new(theta_o.sin(), 0.0, theta_o.cos());
        let term = |thread| {
            let (s, p) = table.interpolate(theta_o, thread);
            brdf.evaluate(s, w_o) * (s.z / p)
        };
        (0..table.count).map(term).sum::<DVec3>() / table.count as f64
    }

    #[test]
    fn impossible_settings_are_refused() {
        let brdf = test_materials::narrow();
        for settings in
            [small(0, 90), small(MAX_COUNT + 1, 90), small(10, 0), small(10, MAX_ROWS + 1), small(10, usize::MAX)]
        {
            assert!(matches!(generate(brdf, &settings, &()), Err(Error::Input { .. })));
        }
    }

    #[test]
    fn a_table_is_given_up_soon_after_cancelling_and_progress_is_reported() {
        struct CancelAt(usize, AtomicBool, AtomicUsize);
        impl Observer for CancelAt {
            fn progress(&self, done: usize, total: usize) {
                assert_eq!(total, 180);
                self.2.fetch_max(done, Ordering::Relaxed);
                self.1.fetch_or(done >= self.0, Ordering::Relaxed);
            }
            fn cancelled(&self) -> bool {
                self.1.load(Ordering::Relaxed)
            }
        }
        for at in [0, 10, 60] {
            let observer = CancelAt(at, AtomicBool::new(at == 0), AtomicUsize::new(0));
            assert!(matches!(generate(test_materials::narrow(), &small(4, 90), &observer), Err(Error::Cancelled)));
            // A few slices can be under way on other cores.
            assert!((at..at + 20).contains(&observer.2.load(Ordering::Relaxed)));
        }
    }

    #[test]
    fn a_material_that_reflects_nothing_gets_a_cosine_pdf() {
        let black = of_model("lambert", "reflectance = 0.0");
        let table = generate(&black, &small(5, 4), &()).unwrap();
        assert!(table.samples.iter().all(|s| (f64::from(s.p) - s.direction().z / PI).abs() < 1e-6));
    }
}
