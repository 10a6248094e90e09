//! What plots of a BRDF show: lobes in the plane of incidence, the image over half and difference angle, albedo by angle.
use std::f64::consts::FRAC_PI_2;

use glam::{DMat3, DVec3, dvec3};

use super::colours::CURVES;
use super::metrics::Display;
use crate::brdf::{Brdf, luminance};

/// Angles of the light whose lobes are drawn, in degrees, and their colours.
pub const LIGHTS: [(f64, [u8; 3]); 4] = [(0.0, CURVES[0]), (30.0, CURVES[1]), (60.0, CURVES[2]), (80.0, CURVES[3])];

/// Names of the channels, and the colours of their albedos.
pub const CHANNELS: [(&str, [u8; 3]); 3] = [("red", [200, 30, 30]), ("green", [20, 140, 40]), ("blue", [40, 70, 200])];

/// Columns and rows of the image, a degree each.
pub const CELLS: usize = 90;

/// The relative change at which albedos are good enough: the width of a line in plots.
const ALBEDO_CHANGE: f64 = 4e-3;

/// A BRDF seen from one azimuth, which plots have as the plane of incidence or that of the half vector.
#[derive(Clone, Copy, Debug)]
pub struct Side<'a> {
    /// What is plotted.
    pub brdf: &'a Brdf,
    /// Degrees from the tangent.
    pub azimuth_deg: f64,
}

impl<'a> Side<'a> {
    /// Those to draw: one of an isotropic BRDF, else those along the tangent and across it.
    pub fn of(brdf: &'a Brdf) -> Vec<Self> {
        let azimuths: &[f64] = if brdf.is_isotropic() { &[0.0] } else { &[0.0, 90.0] };
        azimuths.iter().map(|&azimuth_deg| Self { brdf, azimuth_deg }).collect()
    }

    /// f for directions whose azimuths count from that of the side.
    fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
        let turn = DMat3::from_rotation_z(self.azimuth_deg.to_radians());
        self.brdf.evaluate(turn * w_i, turn * w_o)
    }

    /// A lobe as a curve in the plane of incidence, x towards the light, z along the normal: how far it is from the origin is the cube root
    /// of luminance times cosine.
    pub fn lobe(&self, theta_i_deg: f64) -> Vec<[f64; 2]> {
        let point = |i: i32| {
            // Steps of an eighth of a degree, so that narrow lobes have a tip.
            let w_o = in_plane(f64::from(i) / 8.0);
            let radius = (luminance(self.evaluate(in_plane(theta_i_deg), w_o)) * w_o.z).max(0.0).cbrt();
            [radius * w_o.x, radius * w_o.z]
        };
        (-719..720).map(point).collect()
    }

    /// Display values, f^(1/2.2), at phi_d = 90 degrees, as BRDF Explorer has them: `CELLS` columns of theta_h and as many rows of theta_d, which
    /// begin at 0.
    pub fn image(&self) -> Vec<[u8; 3]> {
        let cell = |index: usize| {
            let [theta_h, theta_d] =
                [index % CELLS, index / CELLS].map(|cell| (cell as f64 + 0.5) / CELLS as f64 * FRAC_PI_2);
            let along = theta_d.cos() * theta_h.sin();
            let [w_i, w_o] = [1.0, -1.0].map(|sign| dvec3(along, sign * theta_d.sin(), theta_d.cos() * theta_h.cos()));
            self.evaluate(w_i, w_o).to_array().map(|f| (255.0 * Display::default().value(f)).round() as u8)
        };
        (0..CELLS * CELLS).map(cell).collect()
    }

    /// The albedo seen from `theta_o_deg`, as exactly as plots show it.
    pub fn albedo(&self, theta_o_deg: f64) -> DVec3 {
        self.brdf.albedo_until(theta_o_deg.to_radians(), self.azimuth_deg.to_radians(), ALBEDO_CHANGE)
    }
}

/// View angles at which the albedo is plotted: every third degree, and where it changes most.
pub fn albedo_angles_deg() -> impl Iterator<Item = f64> {
    (0..29).map(|i| 3.0 * f64::from(i)).chain([86.0, 87.5, 89.0])
}

/// The direction at `theta_deg` from the normal in the plane of incidence.
pub fn in_plane(theta_deg: f64) -> DVec3 {
    let (sin, cos) = theta_deg.to_radians().sin_cos();
    dvec3(sin, 0.0, cos)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::tests::samples::of_model;

    #[test]
    fn curves_of_a_diffuse_surface_are_what_lambert_says() {
        let lambert = of_model("lambert", "reflectance = [0.9, 0.5, 0.1]");
        let [side] = Side::of(&lambert)[..] else { panic!("one side") };
        let f = dvec3(0.9, 0.5, 0.1) / std::f64::consts::PI;
        for [x, z] in side.lobe(30.0) {
            let radius = x.hypot(z);
            assert!((radius.powi(3) - luminance(f) * z / radius).abs() < 1e-9, "{x} {z}");
        }
        let shown = f.to_array().map(|f| (255.0 * f.powf(1.0 / 2.2)).round() as u8);
        // Half vectors and differences of half a degree are of light above the horizon, those of nearly 90 below.
        assert_eq!((side.image()[0], side.image()[CELLS * CELLS - 1]), (shown, shown));
        assert!(
            albedo_angles_deg()
                .all(|theta_o_deg| (side.albedo(theta_o_deg) - std::f64::consts::PI * f).length() < 2e-3)
        );
    }
}
