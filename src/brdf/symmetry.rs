//! Which symmetries a BRDF has about its normal: found by evaluating it, whatever its model says.
use glam::{DMat3, DVec2, DVec3};

use super::Brdf;

/// Values that differ by less than this part are the same: of a display value, its 2.2nd root, that is an eighth of a step of 8 bits. It is
/// far above what rounding makes of values, in single precision too.
const SAME: f64 = 1e-3;

/// And so are those that differ by less than this, in 1/sr: all over the hemisphere it is 3e-6 of the light.
const FAINT: f64 = 1e-6;

/// Angles of half vectors to the normal, each 2.5 times the one before: the first is a tenth of the narrowest lobe that a model may have, and
/// some are on the slope of any lobe.
const THETA_H: [f64; 11] = [1e-4, 2.5e-4, 6e-4, 1.6e-3, 4e-3, 1e-2, 2.5e-2, 0.06, 0.16, 0.4, 1.0];

/// Angles of both directions to the half vector, and azimuths of the plane of both about it. None is a multiple of another, or a node of a
/// table in degrees. Not 0, where measured tables over half and difference angles may take any of the values around it.
const THETA_D_DEG: [f64; 4] = [3.3, 31.7, 64.6, 83.1];
const PHI_D_DEG: [f64; 3] = [19.4, 101.3, 247.7];

/// Azimuths of half vectors. No symmetry of finite order takes them to each other.
const PHI_H_DEG: [f64; 6] = [8.2, 31.4, 74.9, 133.7, 211.3, 290.6];

/// What leaves a BRDF unchanged, done to both directions at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Symmetry {
    /// Any turn about the normal.
    pub isotropic: bool,
    /// Half a turn about the normal: x to -x and y to -y.
    pub half_turn: bool,
    /// The mirror that takes x to -x.
    pub mirror_x: bool,
    /// The mirror that takes y to -y.
    pub mirror_y: bool,
}

impl Brdf {
    /// Whether f(w_i, w_o) depends on the azimuth of `w_i` against `w_o` only, and not on the tangent; as [`Self::symmetry`] finds out.
    pub fn is_isotropic(&self) -> bool {
        let turns = PHI_H_DEG.map(turn);
        // Each pair of directions at three of the azimuths, the next at others: in turn each azimuth is compared with each.
        pairs().enumerate().all(|(i, pair)| {
            let [f, g, h] = [0, 1, 3].map(|step| self.at(pair, turns[(i + step) % turns.len()]));
            same(f, g) && same(f, h)
        })
    }

    /// The symmetries of the BRDF, found at 124 pairs of directions, each at three or six azimuths of the half vector. Half vectors are from 1e-4 rad
    /// from the normal on, so that those of narrow lobes are found.
    pub fn symmetry(&self) -> Symmetry {
        let isotropic = self.is_isotropic();
        // One azimuth stands for all if they are alike.
        let turns = &PHI_H_DEG.map(turn)[..if isotropic { 1 } else { PHI_H_DEG.len() }];
        let keeps = |x: f64, y: f64| {
            let flip = DMat3::from_diagonal(DVec3::new(x, y, 1.0));
            pairs().all(|pair| turns.iter().all(|&turn| same(self.at(pair, turn), self.at(pair, flip * turn))))
        };
        Symmetry {
            isotropic,
            half_turn: isotropic || keeps(-1.0, -1.0),
            mirror_x: keeps(-1.0, 1.0),
            mirror_y: keeps(1.0, -1.0),
        }
    }

    /// f for a pair of directions after `change`.
    fn at(&self, pair: [DVec3; 2], change: DMat3) -> DVec3 {
        let [w_i, w_o] = pair.map(|w| change * w);
        self.evaluate(w_i, w_o)
    }
}

/// A turn about the normal.
fn turn(phi_deg: f64) -> DMat3 {
    DMat3::from_rotation_z(phi_deg.to_radians())
}

fn same(f: DVec3, g: DVec3) -> bool {
    (f - g).abs().cmple(SAME * f.max(g) + FAINT).all()
}

/// Pairs of directions above the horizon whose half vectors have the azimuth 0.
fn pairs() -> impl Iterator<Item = [DVec3; 2]> {
    let angles =
        THETA_H.into_iter().flat_map(|h| THETA_D_DEG.into_iter().flat_map(move |d| PHI_D_DEG.map(|p| (h, d, p))));
    let pair = |(theta_h, theta_d_deg, phi_d_deg): (f64, f64, f64)| {
        let (sin_theta_d, cos_theta_d) = f64::to_radians(theta_d_deg).sin_cos();
        let across = DVec2::from_angle(phi_d_deg.to_radians()) * sin_theta_d;
        let tilt = DMat3::from_rotation_y(theta_h);
        [across, -across].map(|across| tilt * across.extend(cos_theta_d))
    };
    // As far from the horizon as single precision can tell.
    angles.map(pair).filter(|pair| pair.iter().all(|w| w.z > 1e-6))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::CustomBrdf;
    use crate::brdf::tests::{noisy_table, samples};

    const ALL: Symmetry = Symmetry { isotropic: true, half_turn: true, mirror_x: true, mirror_y: true };

    fn conductor(roughness: &str) -> Brdf {
        samples::of_model("conductor", &format!("distribution = 'ggx'; metal = 'Al'; {roughness}"))
    }

    #[test]
    fn isotropic_models_and_tables_are_found_to_be_so() {
        for (name, brdf) in samples::isotropic() {
            assert_eq!(brdf.symmetry(), ALL, "{name}");
        }
        // Measured tables need not be the same in a mirror.
        let handed = Symmetry { mirror_x: false, mirror_y: false, ..ALL };
        assert_eq!(Brdf::MerlTable(noisy_table()).symmetry(), handed);
    }

    #[test]
    fn anisotropic_lobes_are_found_however_narrow_and_with_their_mirrors() {
        let mirrored = Symmetry { isotropic: false, ..ALL };
        let turned = Symmetry { mirror_x: false, mirror_y: false, ..mirrored };
        for (roughness, symmetry) in [
            ("alpha_x = 0.001; alpha_y = 0.003", mirrored),
            ("alpha_x = 1; alpha_y = 0.001; rotation_deg = 90", mirrored),
            ("alpha_x = 0.3; alpha_y = 0.302", mirrored),
            ("alpha_x = 0.001; alpha_y = 0.003; rotation_deg = 30", turned),
            ("alpha_x = 0.5; alpha_y = 0.2; rotation_deg = -45", turned),
            ("alpha_x = 0.2; alpha_y = 0.2; rotation_deg = 30", ALL),
        ] {
            assert_eq!(conductor(roughness).symmetry(), symmetry, "{roughness}");
        }
        // Whatever the rotation: none hides the axes between the azimuths that are compared.
        for rotation_deg in -90..90 {
            let roughness = format!("alpha_x = 0.2; alpha_y = 0.202; rotation_deg = {rotation_deg}");
            assert!(!conductor(&roughness).is_isotropic(), "{roughness}");
        }
    }

    /// Lambert's, brighter for light and views from one side, or from three.
    struct Sided(f64);

    impl CustomBrdf for Sided {
        fn name(&self) -> &str {
            "sided"
        }

        fn key(&self) -> Vec<u8> {
            self.0.to_le_bytes().to_vec()
        }

        fn evaluate(&self, w_i: DVec3, w_o: DVec3) -> DVec3 {
            let h = w_i + w_o;
            DVec3::splat(0.2 + 0.1 * (self.0 * h.y.atan2(h.x)).cos())
        }
    }

    #[test]
    fn a_surface_with_a_nap_has_one_mirror_and_a_twill_of_quarter_turns_is_no_isotropic_one() {
        let nap = Symmetry { isotropic: false, half_turn: false, mirror_x: false, mirror_y: true };
        assert_eq!(Brdf::custom(Sided(1.0)).symmetry(), nap);
        assert_eq!(Brdf::custom(Sided(3.0)).symmetry(), nap);
        assert_eq!(Brdf::custom(Sided(4.0)).symmetry(), Symmetry { isotropic: false, ..ALL });
    }
}
