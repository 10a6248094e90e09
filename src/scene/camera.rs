//! The pinhole camera: its axes, its rays, and the view that frames a scene by default.
use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

use super::three_numbers;

/// Where the default view stands, seen from a unit sphere at the origin.
const DEFAULT_EYE: DVec3 = DVec3::new(1.5, 1.0, 3.5);
/// Vertical field of view of the default view.
const DEFAULT_FOV_Y_DEG: f64 = 36.0;
/// Below it single precision, in which rays are, has fewer than 30 directions from edge to edge of a picture.
const NARROWEST_DEG: f64 = 1e-4;
/// Objects reach 1e9 from the origin at most; they can be looked at from a million times as far.
const FARTHEST: f64 = 1e15;

/// A camera that looks from `eye` to `target`. World right-handed; pixel (0, 0) is at the top left.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "CameraKeys", into = "CameraKeys")]
pub struct Camera {
    /// Position.
    pub eye: DVec3,
    /// The point in the middle of the image.
    pub target: DVec3,
    /// Whatever is up in the image; not parallel to the line of sight.
    pub up: DVec3,
    /// Vertical field of view in degrees, from 1e-4 to below 180.
    pub fov_y_deg: f64,
}

/// `[camera]` in the scene file.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraKeys {
    #[serde(deserialize_with = "three_numbers")]
    eye: DVec3,
    #[serde(default, deserialize_with = "three_numbers")]
    target: DVec3,
    #[serde(default = "default_up", deserialize_with = "three_numbers")]
    up: DVec3,
    #[serde(default = "default_fov_y_deg")]
    fov_y_deg: f64,
}

fn default_up() -> DVec3 {
    DVec3::Y
}

fn default_fov_y_deg() -> f64 {
    DEFAULT_FOV_Y_DEG
}

impl TryFrom<CameraKeys> for Camera {
    type Error = String;

    fn try_from(CameraKeys { eye, target, up, fov_y_deg }: CameraKeys) -> Result<Self, String> {
        let camera = Self { eye, target, up, fov_y_deg };
        camera.validate()?;
        Ok(camera)
    }
}

impl From<Camera> for CameraKeys {
    fn from(Camera { eye, target, up, fov_y_deg }: Camera) -> Self {
        Self { eye, target, up, fov_y_deg }
    }
}

impl Camera {
    /// The view that frames a sphere: the unit sphere at the origin is seen from (1.5, 1, 3.5) at 36 degrees, others from
    /// the same side and as large. In an image taller than wide (`aspect` = width / height below 1) the camera steps back.
    pub fn framing(centre: DVec3, radius: f64, aspect: f64) -> Self {
        let eye = centre + DEFAULT_EYE * framing_scale(radius, DEFAULT_FOV_Y_DEG, aspect);
        Self { eye, target: centre, up: DVec3::Y, fov_y_deg: DEFAULT_FOV_Y_DEG }
    }

    /// The distance from the centre of a sphere at which it is framed as [`Self::framing`] does, with another field of view.
    pub fn framing_distance(radius: f64, fov_y_deg: f64, aspect: f64) -> f64 {
        DEFAULT_EYE.length() * framing_scale(radius, fov_y_deg, aspect)
    }

    /// Whether the camera can see: an error in words names the key at fault.
    pub fn validate(&self) -> Result<(), String> {
        for (key, value, most) in
            [("eye", self.eye, FARTHEST), ("target", self.target, FARTHEST), ("up", self.up, f64::MAX)]
        {
            if !value.is_finite() {
                return Err(format!("`{key}` must be three finite numbers"));
            }
            if value.abs().max_element() > most {
                return Err(format!("`{key}` must be within {most:e} of the origin"));
            }
        }
        let sight = self.target - self.eye;
        if sight.length() == 0.0 {
            return Err("`eye` and `target` must not be the same point".into());
        }
        // Below a thousandth of a degree, roundings would decide which way is right.
        let sine = sight.normalize().cross(self.unit_up()).length();
        if sine < 1e-5 {
            return Err("`up` must not be zero or parallel to the line from `eye` to `target`".into());
        }
        // Not written as two comparisons of the other sense, as NaN must fail too.
        if !(self.fov_y_deg >= NARROWEST_DEG && self.fov_y_deg < 180.0) {
            return Err(format!("`fov_y_deg` must be at least {NARROWEST_DEG:e} and below 180"));
        }
        Ok(())
    }

    /// `up` of length 1, however long it is; 0 if it is 0.
    pub fn unit_up(&self) -> DVec3 {
        (self.up / self.up.abs().max_element()).normalize_or_zero()
    }

    /// The unit vectors right, up and forward of the image.
    pub fn basis(&self) -> (DVec3, DVec3, DVec3) {
        let forward = (self.target - self.eye).normalize();
        let right = forward.cross(self.unit_up()).normalize();
        (right, right.cross(forward), forward)
    }

    /// Half the width and half the height of what is seen at distance 1, in images of this width over height.
    pub fn half_size(&self, aspect: f64) -> DVec2 {
        let half_height = (0.5 * self.fov_y_deg).to_radians().tan();
        DVec2::new(half_height * aspect, half_height)
    }

    /// The unit direction through the centre of pixel (column `pixel_x`, row `pixel_y`); fractions name points between the
    /// centres, so that the pixel covers -0.5 to 0.5 around them.
    pub fn ray(&self, pixel_x: f64, pixel_y: f64, width: u32, height: u32) -> DVec3 {
        let (right, up, forward) = self.basis();
        let (width, height) = (f64::from(width), f64::from(height));
        let half_size = self.half_size(width / height);
        let x = (2.0 * (pixel_x + 0.5) / width - 1.0) * half_size.x;
        let y = (1.0 - 2.0 * (pixel_y + 0.5) / height) * half_size.y;
        (forward + x * right + y * up).normalize()
    }
}

/// How many times farther than the default view of the unit sphere the eye has to be.
fn framing_scale(radius: f64, fov_y_deg: f64, aspect: f64) -> f64 {
    // To three digits: a tessellated unit sphere, whose vertices lie 5e-5 outside, is framed as what it stands for.
    let rounded = |radius: f64| {
        let magnitude = 10f64.powi(2 - radius.log10().floor() as i32);
        (radius * magnitude).round() / magnitude
    };
    // What is a point is framed as the unit sphere is.
    let radius = if radius > 0.0 { rounded(radius) } else { 1.0 };
    // The sine of the angle between the axis and the nearest edge of the image: the silhouette stays as far inside it.
    let [default_half_height, half_height] = [DEFAULT_FOV_Y_DEG, fov_y_deg].map(|fov| (0.5 * fov).to_radians());
    let half_width = (half_height.tan() * aspect).atan();
    radius * (default_half_height.sin() / half_height.sin().min(half_width.sin()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reference() -> Camera {
        Camera { eye: DEFAULT_EYE, target: DVec3::ZERO, up: DVec3::Y, fov_y_deg: 36.0 }
    }

    #[test]
    fn rays_match_the_independent_renderer() {
        for (x, y, expected) in
            [(0.0, 0.0, [-0.713445, 0.052437, -0.698747]), (450.0, 300.0, [-0.206535, -0.327077, -0.922152])]
        {
            let error = reference().ray(x, y, 640, 480) - DVec3::from_array(expected);
            assert!(error.abs().max_element() < 1e-6, "{x} {y}: {error}");
        }
    }

    #[test]
    fn it_does_not_matter_how_long_up_is() {
        let camera = |length: f64| Camera { up: length * DVec3::new(0.1, 2.0, 0.3), ..reference() };
        for length in [1e-300, 1e-5, 1e5, 1e300] {
            assert_eq!(camera(length).validate(), Ok(()));
            let off = camera(length).ray(3.0, 5.0, 64, 48) - camera(1.0).ray(3.0, 5.0, 64, 48);
            assert!(off.length() < 1e-12, "{length}: {off}");
        }
        assert!(camera(0.0).validate().is_err());
    }

    #[test]
    fn the_default_view_is_that_of_the_reference_images() {
        assert_eq!(Camera::framing(DVec3::ZERO, 1.0, 4.0 / 3.0), reference());
        assert_eq!(Camera::framing(DVec3::ZERO, 1.00005, 1.0), reference());
        assert_eq!(Camera::framing(DVec3::ZERO, 0.0, 1.0), reference());
        let far = Camera::framing(DVec3::ONE, 20.0, 2.0);
        assert_eq!((far.eye, far.target), (DVec3::ONE + 20.0 * DEFAULT_EYE, DVec3::ONE));
    }

    #[test]
    fn the_framed_sphere_is_inside_the_image_whatever_its_shape() {
        for (width, height) in [(640, 480), (480, 640), (100, 1000), (1000, 100)] {
            let camera = Camera::framing(DVec3::ONE, 3.0, f64::from(width) / f64::from(height));
            for i in 0..100 {
                let across = f64::from(i) / 99.0;
                let (x, y) = (across * f64::from(width) - 0.5, across * f64::from(height) - 0.5);
                let (right, bottom) = (f64::from(width) - 0.5, f64::from(height) - 0.5);
                for (x, y) in [(x, -0.5), (x, bottom), (-0.5, y), (right, y)] {
                    let ray = camera.ray(x, y, width, height);
                    assert!(
                        ray.cross(DVec3::ONE - camera.eye).length() > 3.0,
                        "{width}x{height}: ({x}, {y}) is covered"
                    );
                }
            }
        }
    }

    #[test]
    fn blind_cameras_are_errors_that_name_the_key() {
        let good = reference();
        for (camera, key) in [
            (Camera { target: good.eye, ..good }, "target"),
            (Camera { up: DVec3::ZERO, ..good }, "up"),
            (Camera { up: -2.0 * good.eye, ..good }, "up"),
            (Camera { eye: DVec3::NAN, ..good }, "eye"),
            (Camera { fov_y_deg: 0.0, ..good }, "fov_y_deg"),
            (Camera { fov_y_deg: 180.0, ..good }, "fov_y_deg"),
            (Camera { fov_y_deg: f64::NAN, ..good }, "fov_y_deg"),
        ] {
            let error = camera.validate().unwrap_err();
            assert!(error.contains(&format!("`{key}`")), "{error}");
        }
        assert!(good.validate().is_ok());
    }
}
