//! Roughness along two axes of the tangent plane: what brushing and weaving leave.
//!
//! The axes are those of the shading frame, x the tangent, turned by `rotation_deg`. Facets are like those of an isotropic surface that is
//! stretched along them: Heitz, "Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs" (2014), appendix A.
use glam::{DVec2, DVec3, Vec4};

use crate::brdf::{Parameters, Spacing, hash_numbers};
use crate::error::{Error, Result};

/// Two axes at a right angle to each other in the tangent plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axes {
    rotation_deg: f64,
    /// The first axis.
    x: DVec2,
}

impl Axes {
    /// The first is `rotation_deg` from the tangent, counter-clockwise seen from outside.
    pub fn new(rotation_deg: f64) -> Self {
        Self { rotation_deg, x: DVec2::from_angle(rotation_deg.to_radians()) }
    }

    /// Reads `rotation_deg`, which may be left out.
    pub(crate) fn from_parameters(parameters: &mut Parameters) -> Result<Self> {
        let help = "How far the axes are turned from the tangent, counter-clockwise seen from outside, in degrees; 0 where left out.";
        Ok(Self::new(parameters.number_or(ROTATION, -90.0..=90.0, 0.0, help)?))
    }

    /// Where the first axis points, as the key `rotation_deg` has it.
    pub fn rotation_deg(self) -> f64 {
        self.rotation_deg
    }

    /// The components of `w` along both.
    #[inline]
    pub fn along(self, w: DVec3) -> DVec2 {
        DVec2::new(self.x.dot(w.truncate()), self.x.perp_dot(w.truncate()))
    }

    /// The axes that are the tangent and what is across it, and the rotation in degrees; none if they are that.
    pub(crate) fn without_rotation(self) -> Option<(Self, f64)> {
        (self.rotation_deg != 0.0).then(|| (Self::new(0.0), self.rotation_deg))
    }
}

/// The key of [`Axes`].
pub(crate) const ROTATION: &str = "rotation_deg";

/// Whether `parameters` has one of `keys`, which are along axes, or the rotation of these.
///
/// # Errors
/// Beside one of them stands `single`, which is for all directions.
pub(crate) fn is_along_axes(parameters: &Parameters, single: &str, keys: [&str; 2]) -> Result<bool> {
    let is_along_axes = keys.iter().chain(&[ROTATION]).any(|key| parameters.has(key));
    if is_along_axes && parameters.has(single) {
        let [x, y] = keys;
        let remedy = format!("give `{single}` alone, for all directions, or `{x}` and `{y}`");
        return Err(Error::input(single, format!("stands beside `{x}`, `{y}` or `{ROTATION}`"), remedy));
    }
    Ok(is_along_axes)
}

/// The least roughness_alpha of a model. Narrower (than a lobe of 0.06 degrees) no quadrature of this project resolves it: that is a mirror.
pub const NARROWEST_ALPHA: f64 = 1e-3;

/// What models of one roughness say of it.
pub(crate) const ALPHA_HELP: &str =
    "Roughness of the microfacets, used as it is, not squared: 0.01 is nearly a mirror.";

/// roughness_alpha along both axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Roughness {
    alpha: DVec2,
    axes: Axes,
}

impl Roughness {
    /// Alike in all directions.
    pub fn isotropic(alpha: f64) -> Self {
        Self::new(alpha, alpha, 0.0)
    }

    /// `alpha_x` along an axis that is `rotation_deg` from the tangent, counter-clockwise seen from outside, and `alpha_y` across it.
    pub fn new(alpha_x: f64, alpha_y: f64, rotation_deg: f64) -> Self {
        // What is alike in all directions is the same however it is turned, but for digits.
        let axes = Axes::new(if alpha_x == alpha_y { 0.0 } else { rotation_deg });
        Self { alpha: DVec2::new(alpha_x, alpha_y), axes }
    }

    /// Reads `alpha`, or `alpha_x`, `alpha_y` and `rotation_deg`, of which the last may be left out.
    pub(crate) fn from_parameters(parameters: &mut Parameters, help: &'static str) -> Result<Self> {
        let range = NARROWEST_ALPHA..=1.0;
        if !is_along_axes(parameters, "alpha", ["alpha_x", "alpha_y"])? {
            return Ok(Self::isotropic(parameters.number("alpha", range, Spacing::Logarithmic, help)?));
        }
        let help = "Roughness along the first axis, which is the tangent where the rotation is 0.";
        let alpha_x = parameters.number("alpha_x", range.clone(), Spacing::Logarithmic, help)?;
        let alpha_y = parameters.number("alpha_y", range, Spacing::Logarithmic, "Roughness across the first axis.")?;
        Ok(Self::new(alpha_x, alpha_y, Axes::from_parameters(parameters)?.rotation_deg()))
    }

    /// Whether both are the same.
    #[inline]
    pub fn is_isotropic(self) -> bool {
        self.alpha.x == self.alpha.y
    }

    /// roughness_alpha of the isotropic surface whose shadows along `w` are the same: alpha^2 sin^2 = alpha_x^2 x^2 + alpha_y^2 y^2. Heitz eq 80.
    #[inline]
    pub fn seen_along(self, w: DVec3) -> f64 {
        if self.is_isotropic() {
            return self.alpha.x;
        }
        let tangential = self.axes.along(w);
        let sin2 = tangential.length_squared();
        // The normal has no azimuth, and nothing shadows it.
        if sin2 > 0.0 { ((self.alpha * tangential).length_squared() / sin2).sqrt() } else { self.alpha.x }
    }

    /// roughness_alpha of the isotropic surface whose slopes towards `h` fall off alike: sin^2 / alpha^2 = (x / alpha_x)^2 + (y / alpha_y)^2.
    #[inline]
    pub fn of_slope_towards(self, h: DVec3) -> f64 {
        if self.is_isotropic() {
            return self.alpha.x;
        }
        let tangential = self.axes.along(h);
        let scaled2 = (tangential / self.alpha).length_squared();
        // The normal has no azimuth, and no slope.
        if scaled2 > 0.0 { (tangential.length_squared() / scaled2).sqrt() } else { self.alpha.x }
    }

    /// alpha_x alpha_y.
    #[inline]
    pub fn area(self) -> f64 {
        self.alpha.x * self.alpha.y
    }

    /// The same along the tangent and across it, and the rotation in degrees; none if it is that.
    pub(crate) fn without_rotation(self) -> Option<(Self, f64)> {
        self.axes.without_rotation().map(|(axes, deg)| (Self { axes, ..self }, deg))
    }

    /// As shaders have it: roughness_alpha along both axes, which are those of the shading frame there, and nothing more.
    pub(crate) fn gpu_parameters(self) -> Vec4 {
        self.alpha.as_vec2().extend(0.0).extend(0.0)
    }

    /// Adds it to a fingerprint. What is alike in all directions has none.
    pub(crate) fn hash_content(self, hasher: &mut blake3::Hasher) {
        match self.is_isotropic() {
            true => hash_numbers(hasher, [self.alpha.x]),
            false => hash_numbers(hasher, [self.alpha.x, self.alpha.y, self.axes.rotation_deg]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{Brdf, Domain, Scale};
    use glam::dvec3;

    fn read(text: &str) -> Result<Roughness> {
        Roughness::from_parameters(&mut Parameters::new(text.parse().unwrap()), "")
    }

    #[test]
    fn roughness_is_read_along_all_directions_or_along_two_axes() {
        assert_eq!(read("alpha = 0.2").unwrap(), Roughness::isotropic(0.2));
        assert_eq!(read("alpha_x = 0.2\nalpha_y = 0.2\nrotation_deg = 9").unwrap(), Roughness::isotropic(0.2));
        assert_eq!(read("alpha_x = 0.2\nalpha_y = 0.1").unwrap(), Roughness::new(0.2, 0.1, 0.0));
        assert_eq!(read("alpha_x = 0.2\nalpha_y = 0.1\nrotation_deg = 30").unwrap(), Roughness::new(0.2, 0.1, 30.0));
        for (text, key) in [
            ("", "alpha"),
            ("alpha = 0.1\nalpha_x = 0.1\nalpha_y = 0.1", "alpha"),
            ("alpha = 0.1\nrotation_deg = 3", "alpha"),
            ("alpha_x = 0.1", "alpha_y"),
            ("alpha_y = 0.1", "alpha_x"),
            ("alpha_x = 0.1\nalpha_y = 2", "alpha_y"),
            ("alpha_x = 0.1\nalpha_y = 0.2\nrotation_deg = 91", "rotation_deg"),
        ] {
            let error = read(text).unwrap_err().to_string();
            assert!(error.starts_with(&format!("{key}: ")), "{text:?}: {error}");
        }
    }

    #[test]
    fn a_rotation_that_is_left_out_is_known_to_be_0_and_to_have_a_range() {
        let table = "distribution = 'ggx'\nmetal = 'Al'\nalpha_x = 0.2\nalpha_y = 0.1".parse().unwrap();
        let parameters = Brdf::parameters("conductor", &table).unwrap();
        let rotation = parameters.iter().find(|parameter| parameter.key == ROTATION).expect("a rotation");
        assert_eq!(rotation.default, Some(0.0));
        assert_eq!(rotation.domain, Domain::Number(-90.0..=90.0, Scale::linear(-90.0..=90.0)));
    }

    #[test]
    fn a_quarter_turn_exchanges_the_axes() {
        let (turned, exchanged) = (Roughness::new(0.3, 0.05, 90.0), Roughness::new(0.05, 0.3, 0.0));
        for w in [dvec3(0.6, 0.0, 0.8), dvec3(0.36, 0.48, 0.8), dvec3(1e-9, -1e-9, 1.0)] {
            assert!((turned.seen_along(w) / exchanged.seen_along(w) - 1.0).abs() < 1e-12);
            assert!((turned.of_slope_towards(w) / exchanged.of_slope_towards(w) - 1.0).abs() < 1e-12);
        }
        assert_eq!(exchanged.seen_along(dvec3(0.6, 0.0, 0.8)), 0.05);
        assert_eq!(exchanged.of_slope_towards(dvec3(0.0, 0.6, 0.8)), 0.3);
    }
}
