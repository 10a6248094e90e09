//! Writes any BRDF as a file of the MERL database's form, which `merl.rs` reads.
use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DMat3, DVec2, DVec3};
use rayon::prelude::*;

use super::Brdf;
use super::merl::{Horizon, PHI_D_BINS, SCALE, THETA_D_BINS, THETA_H_BINS};

/// The bytes of a `.binary` file with the values of `brdf` in the middle of each cell; -1, as in the database, where light or view is below
/// the horizon. The form is reciprocal: of a BRDF that is not, the mean of both ways is written.
pub fn merl_bytes(brdf: &Brdf) -> Vec<u8> {
    let line = |line: usize| {
        let (theta_h, theta_d) = (line / THETA_D_BINS, line % THETA_D_BINS);
        let horizon = Horizon::of_bins(theta_h, theta_d);
        (0..PHI_D_BINS).map(move |phi_d| {
            let (w_i, w_o) = middle_of_cell(theta_h, theta_d, phi_d);
            horizon.is_above(phi_d).then(|| match brdf.is_reciprocal() {
                true => brdf.evaluate(w_i, w_o),
                false => 0.5 * (brdf.evaluate(w_i, w_o) + brdf.evaluate(w_o, w_i)),
            })
        })
    };
    let cells: Vec<_> = (0..THETA_H_BINS * THETA_D_BINS).into_par_iter().flat_map_iter(line).collect();
    let sizes = [THETA_H_BINS, THETA_D_BINS, PHI_D_BINS].into_iter().flat_map(|size| (size as i32).to_le_bytes());
    let plane = |channel: usize| {
        let value = move |cell: &Option<DVec3>| cell.map_or(-1.0, |f| f[channel] / SCALE[channel]);
        cells.iter().flat_map(move |cell| value(cell).to_le_bytes())
    };
    sizes.chain((0..3).flat_map(plane)).collect()
}

/// The directions w_i and w_o in the middle of a cell, with the half vector in the plane of x and z.
fn middle_of_cell(theta_h: usize, theta_d: usize, phi_d: usize) -> (DVec3, DVec3) {
    let x = (theta_h as f64 + 0.5) / THETA_H_BINS as f64;
    let to_shading_frame = DMat3::from_rotation_y(FRAC_PI_2 * x * x);
    let (sin_theta_d, cos_theta_d) = (FRAC_PI_2 * (theta_d as f64 + 0.5) / THETA_D_BINS as f64).sin_cos();
    let across = sin_theta_d * DVec2::from_angle(PI * (phi_d as f64 + 0.5) / PHI_D_BINS as f64);
    (to_shading_frame * across.extend(cos_theta_d), to_shading_frame * (-across).extend(cos_theta_d))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::MerlTable;

    #[test]
    fn an_exported_brdf_comes_back() {
        let text = "distribution = 'ggx'\nalpha = 0.2\nior = 1.5\ndiffuse = [0.3, 0.1, 0.05]";
        let brdf = Brdf::from_parameters("plastic", text.parse().unwrap()).unwrap();
        let table = Brdf::MerlTable(MerlTable::from_bytes(&merl_bytes(&brdf)).unwrap());
        for theta_o_deg in [0.0f64, 30.0, 60.0, 80.0] {
            let [found, expected] = [&table, &brdf].map(|brdf| brdf.albedo(theta_o_deg.to_radians()));
            assert!(((found - expected) / expected).abs().max_element() < 5e-3, "{theta_o_deg}: {found}, {expected}");
        }
        // In the middle of a cell it is the value itself, up to single precision.
        let (w_i, w_o) = middle_of_cell(30, 20, 50);
        let [found, expected] = [&table, &brdf].map(|brdf| brdf.evaluate(w_i, w_o));
        assert!(((found - expected) / expected).abs().max_element() < 1e-6, "{found}, {expected}");
    }
}
