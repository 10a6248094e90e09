//! Makes the table by which shaders know a BRDF without a twin: as fine as its error asks for, within bounds.
use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DVec2, DVec3, dvec3};

use super::tabulated::{Grid, Tabulated};
use super::{Brdf, half_vector_width, lobe_radius};

/// Relative error of a table at which nodes are no longer added.
const TARGET_ERROR: f64 = 2e-3;

/// Nodes along tan(theta_h / 2) of the coarsest and of the finest table: 0.3 and 2.5 MB of 8 bytes a texel.
const TANGENT_NODES: [usize; 2] = [32, 249];

/// View angles at which the error is measured.
const VIEW_DEG: [f64; 4] = [5.0, 45.0, 70.0, 85.0];

/// The table of `brdf`, and its relative error: the integral of |difference| cos over that of f cos, of the worst channel at the worst
/// of four view angles, 5 to 85 degrees.
///
/// Starts coarse, then halves the steps along tan(theta_h / 2) until the error is at most 0.2 % or the table has 249 nodes
/// along it. Over the range of all models, errors end between 0.02 and 0.5 %, of which grazing views are the most. They are greater, 3 %
/// at most there, for lobes that are narrow but not about the mirror direction, and where shadows have an edge.
pub fn tabulate(brdf: &Brdf) -> (Tabulated, f64) {
    let width = half_vector_width(brdf).min(lobe_radius(brdf));
    // tan(theta_h / 2) is half of theta_h, and half of the width is where f is within a tenth or so of its peak.
    let knee = (0.25 * width).clamp(1e-4, 1.0);
    let f = |w_i: DVec3, w_o: DVec3| brdf.evaluate(w_i, w_o);
    let samples: Vec<_> = VIEW_DEG.into_iter().map(|theta_o_deg| Sample::of_view(&f, theta_o_deg, knee)).collect();
    let mut tangents = TANGENT_NODES[0];
    loop {
        let nodes = [Tabulated::NODES[0], Tabulated::NODES[1], tangents];
        let table = Tabulated::of(&f, Grid { nodes, knee, is_reciprocal: brdf.is_reciprocal() });
        let error = error(&table, &samples);
        if error <= TARGET_ERROR || 2 * tangents - 1 > TANGENT_NODES[1] {
            tracing::info!("{}: a table of {:?} nodes, error {:.2} %", brdf.model(), table.size(), 100.0 * error);
            return (table, error);
        }
        tangents = 2 * tangents - 1;
    }
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
    /// Those of one view angle: dense where half vectors are near the normal.
    fn of_view(f: &impl Fn(DVec3, DVec3) -> DVec3, theta_o_deg: f64, knee: f64) -> Vec<Self> {
        const THETA_STEPS: usize = 150;
        const PHI_STEPS: usize = 37;
        let w_o = dvec3(theta_o_deg.to_radians().sin(), 0.0, theta_o_deg.to_radians().cos());
        let range = knee.recip().ln_1p();
        let pairs = (0..THETA_STEPS).flat_map(|i| (0..PHI_STEPS).map(move |j| (i, j)));
        let sample = |(i, j): (usize, usize)| {
            // theta_h = 90 deg t with t = knee (e^(range x) - 1), so dtheta_h = pi / 2 (t + knee) range dx.
            let t = knee * (range * (i as f64 + 0.5) / THETA_STEPS as f64).exp_m1();
            let (sin_theta_h, cos_theta_h) = (FRAC_PI_2 * t).sin_cos();
            let across = DVec2::from_angle(2.0 * PI * (j as f64 + 0.3) / PHI_STEPS as f64) * sin_theta_h;
            let h = across.extend(cos_theta_h);
            let cos_theta_d = w_o.dot(h);
            let w_i = 2.0 * cos_theta_d * h - w_o;
            // dw_i = 4 (w_o . h) dw_h, but for a constant factor.
            let weight = w_i.z * cos_theta_d * sin_theta_h * (t + knee);
            (cos_theta_d > 0.0 && w_i.z > 0.0).then(|| Self { w_i, w_o, value: f(w_i, w_o), weight })
        };
        pairs.filter_map(sample).collect()
    }
}

/// The relative error of `table`.
fn error(table: &Tabulated, samples: &[Vec<Sample>]) -> f64 {
    let table = Brdf::Tabulated(table.clone());
    let of_view = |samples: &Vec<Sample>| {
        let [mut sum, mut difference] = [DVec3::ZERO; 2];
        for sample in samples {
            sum += sample.value * sample.weight;
            difference += (sample.value - table.evaluate(sample.w_i, sample.w_o)).abs() * sample.weight;
        }
        // A black channel has no error: its table is black.
        (difference / sum.max(DVec3::splat(f64::MIN_POSITIVE))).max_element()
    };
    samples.iter().map(of_view).fold(0.0, f64::max)
}
