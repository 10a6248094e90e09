//! Makes the table in which shaders look a BRDF up that they do not evaluate. It is as fine as its error asks for, within bounds. A MERL table is
//! made smaller.
use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DVec2, DVec3};

use super::made_table::{exponential, exponential_slope, knee_of_lobe};
use super::merl::DEVICE_TABLE_SIZE;
use super::tabulated::{Grid, Tabulated};
use super::tabulated_anisotropic::{AnisotropicGrid, TabulatedAnisotropic};
use super::{Brdf, LobeShape, MadeTable, reflect};

/// Relative error of a table at which nodes are no longer added.
const TARGET_ERROR: f64 = 2e-3;

/// Views that are darker than this part of the brightest one count as if they had it: beside an edge of f, as that of the shadows of `sgd`, a view
/// may be black whose table is only nearly so.
const NEARLY_BLACK: f64 = 1e-3;

/// Nodes along tan(theta_h / 2) of tables of isotropic BRDFs: 0.3 to 2.5 MB of 8 bytes a texel.
const TANGENTS: &[usize] = &[32, 63, 125, 249];

/// The same along h_x and h_y of the others: 2.5 and 8.8 MB.
const ANISOTROPIC_TANGENTS: &[usize] = &[27, 51];

/// View angles and azimuths at which the error is measured.
const VIEW_DEG: [f64; 4] = [5.0, 45.0, 70.0, 85.0];
const AZIMUTH_DEG: [f64; 3] = [0.0, 50.0, 100.0];

/// The table of `brdf`, of model `tabulated`, `tabulated_anisotropic` or `merl`, and its relative error: the integral of |difference| cos over
/// that of f cos, of the worst channel at the worst of four view angles, 5 to 85 degrees.
///
/// That of a MERL table has one size. Any other starts coarse, then halves the steps along the half vector until the error is at most
/// 0.2 % or the table has the most nodes. Over the range of all isotropic models, errors end between 0.02 and 0.5 %, of which grazing views
/// are the most. They are greater, 3 % at most there, for lobes that are narrow but not about the mirror direction, and where shadows have
/// an edge. Of anisotropic models they are 0.3 to 1.7 % up to 70 degrees, and 1 to 6 % at 85; the guide has two that err by more.
pub fn tabulate(brdf: &Brdf) -> (Brdf, f64) {
    let lobe = LobeShape::of(brdf);
    let knee = knee_of_lobe(brdf, lobe.width_rad);
    let f = |w_i: DVec3, w_o: DVec3| brdf.evaluate(w_i, w_o);
    let azimuths = if lobe.is_isotropic { &AZIMUTH_DEG[..1] } else { &AZIMUTH_DEG[..] };
    let views =
        VIEW_DEG.iter().flat_map(|theta_o_deg| azimuths.iter().map(move |azimuth_deg| [*theta_o_deg, *azimuth_deg]));
    let samples: Vec<_> = views.map(|view| Sample::of_view(&f, view, knee)).collect();
    let with_error = |table: Brdf| {
        let error = error(&table, &samples);
        (table, error)
    };
    let is_reciprocal = brdf.is_reciprocal();
    let made = |tangents: usize| match lobe.is_isotropic {
        true => Brdf::Tabulated(Tabulated::of(&f, Grid { tangents, knee, is_reciprocal })),
        false => {
            let LobeShape { narrowness, long_axis, .. } = lobe;
            let knees = [(knee / narrowness).min(1.0), knee];
            let grid = AnisotropicGrid { tangents, knees, long_axis, is_reciprocal };
            Brdf::TabulatedAnisotropic(TabulatedAnisotropic::of(&f, grid))
        }
    };
    let as_fine_as_needed = || {
        let (most, fewer) =
            if lobe.is_isotropic { TANGENTS } else { ANISOTROPIC_TANGENTS }.split_last().expect("there are some");
        let is_good = |(_, error): &(Brdf, f64)| *error <= TARGET_ERROR;
        fewer.iter().map(|&few| with_error(made(few))).find(is_good).unwrap_or_else(|| with_error(made(*most)))
    };
    let (table, error) = match brdf {
        Brdf::MerlTable(table) => with_error(Brdf::MerlTable(table.as_on_device())),
        _ => as_fine_as_needed(),
    };
    let size = table.made_table().map_or(DEVICE_TABLE_SIZE, MadeTable::size);
    tracing::info!("{}: a table of {size:?} texels, error {:.2} %", brdf.model(), 100.0 * error);
    (table, error)
}

/// A direction of light at which a table is compared with its BRDF.
struct Sample {
    w_i: DVec3,
    w_o: DVec3,
    /// f in 1/sr.
    value: DVec3,
    /// n . w_i, times the solid angle that the direction stands for, on any scale.
    weight: f64,
}

impl Sample {
    /// Those of one view angle and azimuth: dense where half vectors are near the normal.
    fn of_view(f: &impl Fn(DVec3, DVec3) -> DVec3, view_deg: [f64; 2], knee: f64) -> Vec<Self> {
        const THETA_STEPS: usize = 150;
        const PHI_STEPS: usize = 37;
        let [theta_o, phi_o] = view_deg.map(f64::to_radians);
        let w_o = (DVec2::from_angle(phi_o) * theta_o.sin()).extend(theta_o.cos());
        let pairs = (0..THETA_STEPS).flat_map(|i| (0..PHI_STEPS).map(move |j| (i, j)));
        let sample = |(i, j): (usize, usize)| {
            // In right angles.
            let theta_h = exponential((i as f64 + 0.5) / THETA_STEPS as f64, knee);
            let (sin_theta_h, cos_theta_h) = (FRAC_PI_2 * theta_h).sin_cos();
            let across = DVec2::from_angle(2.0 * PI * (j as f64 + 0.3) / PHI_STEPS as f64) * sin_theta_h;
            let h = across.extend(cos_theta_h);
            let cos_theta_d = w_o.dot(h);
            let w_i = reflect(w_o, h);
            // dw_i = 4 (w_o . h) dw_h, but for a constant factor.
            let weight = w_i.z * cos_theta_d * sin_theta_h * exponential_slope(theta_h, knee);
            (cos_theta_d > 0.0 && w_i.z > 0.0).then(|| Self { w_i, w_o, value: f(w_i, w_o), weight })
        };
        pairs.filter_map(sample).collect()
    }
}

/// The relative error of `table`.
fn error(table: &Brdf, samples: &[Vec<Sample>]) -> f64 {
    let of_view = |samples: &Vec<Sample>| {
        let [mut sum, mut difference] = [DVec3::ZERO; 2];
        for sample in samples {
            sum += sample.value * sample.weight;
            difference += (sample.value - table.evaluate(sample.w_i, sample.w_o)).abs() * sample.weight;
        }
        (sum, difference)
    };
    let views: Vec<_> = samples.iter().map(of_view).collect();
    let brightest = views.iter().fold(DVec3::ZERO, |brightest, (sum, _)| brightest.max(*sum));
    // A black channel has no error: its table is black.
    let least = (NEARLY_BLACK * brightest).max(DVec3::splat(f64::MIN_POSITIVE));
    views.iter().map(|(sum, difference)| (difference / sum.max(least)).max_element()).fold(0.0, f64::max)
}
