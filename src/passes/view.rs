//! What all passes know of the view: camera, resolution, rotation of the environment.
use crate::scene::Camera;
use bytemuck::{Pod, Zeroable};
use glam::{DMat3, DVec2, Vec2, Vec3};

/// The camera as shaders see it (`Camera` in glsl/camera.glsl): right and up scaled to the edges of the image.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct CameraRays {
    right: [f32; 4],
    up: [f32; 4],
    forward: [f32; 4],
}

impl CameraRays {
    /// The rays of `camera` for images of this width over height.
    pub fn new(camera: &Camera, aspect: f64) -> Self {
        let (right, up, forward) = camera.basis();
        let half_size = camera.half_size(aspect);
        let pack = |v: glam::DVec3| v.as_vec3().extend(0.0).to_array();
        Self { right: pack(right * half_size.x), up: pack(up * half_size.y), forward: pack(forward) }
    }

    /// The direction to the right, not normalised.
    pub fn right(&self) -> Vec3 {
        Vec3::new(self.right[0], self.right[1], self.right[2])
    }

    /// Direction from the eye through `position`, in [0, 1] from the top left corner; not normalised.
    /// Twin of `camera_ray` in glsl/camera.glsl.
    pub fn ray(&self, position: Vec2) -> Vec3 {
        let offset = Vec2::new(2.0, -2.0) * position + Vec2::new(-1.0, 1.0);
        let [right, up, forward] = [self.right, self.up, self.forward].map(|v| Vec3::new(v[0], v[1], v[2]));
        forward + offset.x * right + offset.y * up
    }
}

/// Camera, resolution and display settings of one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// Where the eye is.
    pub camera: Camera,
    /// Width of the image in pixels.
    pub width: u32,
    /// Height of the image in pixels.
    pub height: u32,
    /// Sub-pixels per axis, 1 to 4.
    pub subpixels: u32,
    /// The environment is turned by this angle about +Y, counter-clockwise seen from above.
    pub rotation_deg: f64,
    /// Factor on the environment's radiance.
    pub intensity: f64,
    /// Factor on radiance before display.
    pub exposure: f32,
    /// Display values are radiance to the power of 1/gamma.
    pub gamma: f32,
}

impl View {
    fn aspect(&self) -> f64 {
        f64::from(self.width) / f64::from(self.height)
    }

    /// Half the width and half the height of what is seen at distance 1.
    pub fn half_size(&self) -> DVec2 {
        self.camera.half_size(self.aspect())
    }

    /// Variance along each axis, in rad^2, of the views of a pixel's sub-pixels. Twin of `view_variance` in glsl/shared_sum.glsl.
    pub fn view_variance(&self) -> f32 {
        let pixel = 2.0 * self.half_size().as_vec2() / Vec2::new(self.width as f32, self.height as f32);
        pixel.length_squared() * (1.0 - 1.0 / (self.subpixels * self.subpixels) as f32) / 24.0
    }

    /// Rays through the image.
    pub fn camera_rays(&self) -> CameraRays {
        CameraRays::new(&self.camera, self.aspect())
    }

    /// Takes directions in the world to directions in the environment's own picture.
    pub fn to_environment(&self) -> DMat3 {
        DMat3::from_rotation_y(-self.rotation_deg.to_radians())
    }

    /// Cosine and sine of the environment's rotation, from which shaders make the same.
    pub fn rotation(&self) -> [f32; 2] {
        let (sin, cos) = self.rotation_deg.to_radians().sin_cos();
        [cos as f32, sin as f32]
    }

    /// The same, with so few pixels that no side of the geometry cache is longer than `longest`. The shape of the image stays, as far as whole
    /// pixels allow.
    #[must_use]
    pub fn fit(self, longest: u32) -> Self {
        let (side, most) = (self.width.max(self.height), longest / self.subpixels);
        if side <= most {
            return self;
        }
        let scaled = |size: u32| ((u64::from(size) * u64::from(most) / u64::from(side)) as u32).max(1);
        Self { width: scaled(self.width), height: scaled(self.height), ..self }
    }

    /// Size of the geometry cache.
    pub fn cache_size(&self) -> [u32; 2] {
        [self.width * self.subpixels, self.height * self.subpixels]
    }
}

#[cfg(test)]
mod tests {
    use crate::prepare::view_of;
    use crate::scene::{BoundingSphere, Scene};
    use glam::{DMat3, DVec3};

    #[test]
    fn turning_the_environment_takes_z_towards_x() {
        let mut scene = Scene::default();
        let mut to_environment = |rotation_deg: f64| {
            scene.environment.rotation_deg = rotation_deg;
            view_of(&scene, BoundingSphere { centre: DVec3::ZERO, radius: 1.0 }).unwrap().to_environment()
        };
        // What the picture has at +Z is now seen towards +X.
        assert!((to_environment(90.0) * DVec3::X - DVec3::Z).length() < 1e-15);
        assert_eq!(to_environment(0.0), DMat3::IDENTITY);
    }

    #[test]
    fn a_view_that_is_too_large_keeps_its_shape() {
        let mut scene = Scene::default();
        let unit = BoundingSphere { centre: DVec3::ZERO, radius: 1.0 };
        let mut fit = |width: u32, height: u32, subpixels: u32, longest: u32| {
            (scene.image.width, scene.image.height, scene.image.subpixels) = (width, height, subpixels);
            let view = view_of(&scene, unit).unwrap().fit(longest);
            [view.width, view.height]
        };
        assert_eq!(fit(4096, 240, 4, 16384), [4096, 240]);
        assert_eq!(fit(4200, 240, 4, 16384), [4096, 234]);
        assert_eq!(fit(300, 6000, 3, 9000), [150, 3000]);
        assert_eq!(fit(10000, 2, 1, 1000), [1000, 1]);
    }
}
