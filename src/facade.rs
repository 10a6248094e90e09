//! What a program needs to render: a renderer, scenes, pictures.
use crate::Result;
use crate::environment::{self, CustomEnvironment};
use crate::evaluate::reference::{ReferenceSettings, reference};
use crate::memo::Memo;
use crate::method::Method;
use crate::passes::check_picture;
use crate::picture::ExrHeader;
use crate::pipeline::{DeviceScene, Wanted};
use crate::prepare::{prepare, threads_of};
use crate::progress::Observer;
use crate::rendering::Rendering;
use crate::scene::{
    Background, Camera, CustomMesh, EnvironmentSource, ImageSettings, MaterialSource, MeshSource, Scene, mesh,
};
use crate::threads::{ThreadSettings, Threads};
use crate::vulkan::{Device, Instance};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Renders scenes on one Vulkan device.
///
/// What a scene has in common with the one before is neither loaded, nor made, nor uploaded again; what it has not is let go.
///
/// ```
/// use threadlight::{Renderer, Scene};
///
/// let mut renderer = Renderer::new()?;
/// let mut scene = Scene::default().with_material("clay").with_environment("white").with_size(32, 24).with_threads(4);
/// let first = renderer.render(&scene)?;
/// scene.image.exposure = 0.5;
/// let darker = renderer.render(&scene)?; // Runs the frame, and nothing else.
/// assert_eq!(first.radiance(), darker.radiance());
/// assert!(first.display()[0] > darker.display()[0]);
/// # Ok::<(), threadlight::Error>(())
/// ```
pub struct Renderer {
    device: Arc<Device>,
    memo: Memo,
    /// Holds what the next scene may have in common with it.
    last: Option<DeviceScene>,
}

/// Names the device; what was made by it is no text.
impl std::fmt::Debug for Renderer {
    fn fmt(&self, formatter: &mut std::fmt::Formatter) -> std::fmt::Result {
        formatter.debug_struct("Renderer").field("device", &self.device_name()).finish_non_exhaustive()
    }
}

impl Renderer {
    /// A renderer on the device that is likely to be the fastest.
    ///
    /// # Errors
    /// No Vulkan, or no device that is good enough.
    pub fn new() -> Result<Self> {
        Self::open(None)
    }

    /// A renderer on the device of this index, or with this in its name, as `threadlight devices` lists them.
    ///
    /// # Errors
    /// No Vulkan, or no such device.
    pub fn on(device: &str) -> Result<Self> {
        Self::open(Some(device))
    }

    fn open(device: Option<&str>) -> Result<Self> {
        let instance = Instance::new(false)?;
        Ok(Self { device: Device::new(&instance, device)?, memo: Memo::default(), last: None })
    }

    /// The same, which keeps on disk what takes long to make: in `folder`, from one run of the program to the next.
    pub fn with_cache(self, folder: impl AsRef<Path>) -> Self {
        Self { memo: Memo::new(Some(folder.as_ref())), ..self }
    }

    /// Name of the device.
    pub fn device_name(&self) -> &str {
        &self.device.description().name
    }

    /// The picture of `scene`.
    ///
    /// # Errors
    /// The first file or setting that cannot be used; whatever Vulkan refuses.
    pub fn render(&mut self, scene: &Scene) -> Result<Picture> {
        self.render_watched(scene, &())
    }

    /// The same, watched by `observer`: it hears of what is made, and may end it.
    ///
    /// # Errors
    /// As for [`Self::render`]; [`Error::Cancelled`](crate::Error::Cancelled).
    pub fn render_watched(&mut self, scene: &Scene, observer: &dyn Observer) -> Result<Picture> {
        // Numbers that no scene may have are named as such, not as what this device cannot.
        scene.check()?;
        check_picture(&self.device, scene)?;
        for path in scene.files() {
            self.memo.look_again(&path);
        }
        let round = self.memo.round(observer);
        let prepared = prepare(scene, &round)?;
        let rendering = if prepared.method == Method::Reference {
            self.last = None;
            reference(&prepared, &self.device, &ReferenceSettings::default(), &round)?.rendering(&prepared)
        } else {
            let on_device = DeviceScene::new(&self.device, &prepared, &round)?;
            let wanted = Wanted { radiance: true, display: true, ..Wanted::default() };
            self.last.insert(on_device).render_watched(wanted, 1, observer)?
        };
        let header = rendering.exr_header(&prepared, self.device_name());
        Ok(Picture { image: scene.image.clone(), header, rendering })
    }

    /// The threads that pictures of a material have by default: a built-in, a file, or a [`Custom`](crate::Custom) BRDF. They are
    /// along the material's own axes, whatever its rotation. An anisotropic one has 13 where 16 are asked for.
    ///
    /// ```
    /// # let renderer = threadlight::Renderer::new()?;
    /// let threads = renderer.threads("clay", 4)?;
    /// assert_eq!(threads.size()[1], 4);
    /// # Ok::<(), threadlight::Error>(())
    /// ```
    ///
    /// # Errors
    /// A material that there is not; a number of threads that is not from 1 to 128.
    pub fn threads(&self, material: impl Into<MaterialSource>, count: usize) -> Result<Threads> {
        let material = material.into();
        material.files().iter().for_each(|path| self.memo.look_again(path));
        let settings = ThreadSettings { count, ..Default::default() };
        let subpixels = ImageSettings::default().subpixels;
        Ok((*threads_of(&material, settings, subpixels, &self.memo.round(&()))?).clone())
    }
}

/// A rendered picture.
#[derive(Clone, Debug)]
pub struct Picture {
    image: ImageSettings,
    header: ExrHeader,
    rendering: Rendering,
}

impl Picture {
    /// Columns and rows.
    pub fn size(&self) -> [u32; 2] {
        [self.image.width, self.image.height]
    }

    /// Linear radiance times coverage, Rec. 709, and coverage: row by row from the top left.
    pub fn radiance(&self) -> &[[f32; 4]] {
        &self.rendering.radiance
    }

    /// As a display shows it: clamp(exposure L, 0, 1)^(1/gamma), 8 bits each of red, green, blue and alpha; colour is not multiplied by alpha.
    pub fn display(&self) -> &[u8] {
        &self.rendering.display
    }

    /// Writes it: display values to a `.png`, linear radiance to an `.exr`.
    ///
    /// # Errors
    /// Another extension, or a place that cannot be written to.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<()> {
        self.rendering.write(path.as_ref(), &self.image, &self.header)
    }
}

/// Scenes of one material, step by step.
impl Scene {
    /// The scene in a file.
    ///
    /// # Errors
    /// A file that cannot be read or is no scene.
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        Self::load(path.as_ref())
    }

    /// The same with this material on all objects: a built-in's name, the path of a file, or a [`Custom`](crate::Custom) BRDF.
    pub fn with_material(mut self, material: impl Into<MaterialSource>) -> Self {
        self.use_material("material", material.into());
        self
    }

    /// The same in this environment: a built-in's name, the path of a file, or a [`CustomEnvironment`].
    pub fn with_environment(mut self, environment: impl Into<EnvironmentSource>) -> Self {
        self.environment.source = environment.into();
        self
    }

    /// The same with this mesh in the place of all objects: a built-in's name, the path of a file, or a [`CustomMesh`].
    pub fn with_mesh(mut self, mesh: impl Into<MeshSource>) -> Self {
        self.use_mesh(mesh.into());
        self
    }

    /// The same with an image of this size, in pixels.
    pub fn with_size(mut self, width: u32, height: u32) -> Self {
        (self.image.width, self.image.height) = (width, height);
        self
    }

    /// The same seen by this camera; without one, by a camera that frames all objects.
    pub fn with_camera(self, camera: Camera) -> Self {
        Self { camera: Some(camera), ..self }
    }

    /// The same before this background.
    pub fn with_background(mut self, background: Background) -> Self {
        self.image.background = background;
        self
    }

    /// The same by this method, with as many threads or samples as suit it.
    pub fn with_method(mut self, method: Method) -> Self {
        (self.shading.method, self.shading.threads) = (method, None);
        self
    }

    /// The same with so many threads, or samples of methods that have none.
    pub fn with_threads(mut self, count: u32) -> Self {
        self.shading.threads = Some(count);
        self
    }
}

/// A path is a file's, whatever is built in. Names that a program has made are as those in its text.
macro_rules! from_paths {
    ($($source:ident),*) => {$(
        /// A built-in's name, or the path of a file.
        impl From<String> for $source {
            fn from(name: String) -> Self {
                name.as_str().into()
            }
        }

        /// A built-in's name, or the path of a file.
        impl From<&String> for $source {
            fn from(name: &String) -> Self {
                name.as_str().into()
            }
        }

        impl From<&PathBuf> for $source {
            fn from(path: &PathBuf) -> Self {
                path.as_path().into()
            }
        }

        impl From<&Path> for $source {
            fn from(path: &Path) -> Self {
                Self::File(path.to_owned())
            }
        }

        impl From<PathBuf> for $source {
            fn from(path: PathBuf) -> Self {
                Self::File(path)
            }
        }
    )*};
}

from_paths!(MaterialSource, EnvironmentSource, MeshSource);

/// A built-in's name, or the path of a file.
impl From<&str> for MaterialSource {
    fn from(name: &str) -> Self {
        Self::named(name)
    }
}

impl From<crate::Custom> for MaterialSource {
    fn from(custom: crate::Custom) -> Self {
        Self::Custom(custom)
    }
}

/// A built-in's name, or the path of a file.
impl From<&str> for EnvironmentSource {
    fn from(name: &str) -> Self {
        Self::named(name, environment::builtin_names())
    }
}

impl From<CustomEnvironment> for EnvironmentSource {
    fn from(custom: CustomEnvironment) -> Self {
        Self::Custom(custom)
    }
}

/// A built-in's name, or the path of a file.
impl From<&str> for MeshSource {
    fn from(name: &str) -> Self {
        Self::named(name, mesh::builtin_names())
    }
}

impl From<CustomMesh> for MeshSource {
    fn from(custom: CustomMesh) -> Self {
        Self::Custom(custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vulkan::test_device;

    #[test]
    fn names_and_paths_are_taken_in_all_their_forms() {
        let (name, path) = ("sphere".to_owned(), PathBuf::from("sphere"));
        let builtin = Scene::default().with_mesh("sphere");
        assert_eq!(Scene::default().with_mesh(&name), builtin);
        assert_eq!(Scene::default().with_mesh(name), builtin);
        let file = Scene::default().with_mesh(path.as_path());
        assert_eq!(Scene::default().with_mesh(&path), file);
        assert_eq!(Scene::default().with_mesh(path), file);
        assert_ne!(file, builtin);
        for name in ["clay", "clay.toml"].map(str::to_owned) {
            assert_eq!(Scene::default().with_material(&name), Scene::default().with_material(name.as_str()));
            assert_eq!(Scene::default().with_material(name.clone()), Scene::default().with_material(&name));
        }
        for name in ["sky", "sky.hdr"].map(str::to_owned) {
            assert_eq!(Scene::default().with_environment(&name), Scene::default().with_environment(name.as_str()));
            assert_eq!(Scene::default().with_environment(name.clone()), Scene::default().with_environment(&name));
        }
    }

    #[test]
    fn errors_name_settings_and_not_flags() {
        let absent = Renderer::on("nope").unwrap_err().to_string();
        assert!(absent.starts_with("device \"nope\": no such Vulkan device; name one of: "), "{absent}");
        let mut renderer = Renderer::open(test_device::name().as_deref()).unwrap();
        assert!(format!("{renderer:?}").contains(renderer.device_name()));
        let mut refused = |scene: &Scene| renderer.render(scene).unwrap_err().to_string();
        // What no scene may have, before what this device cannot.
        let largest = refused(&Scene::default().with_size(u32::MAX, u32::MAX));
        assert_eq!(largest, "width: 4294967295 is out of range; use a value from 1 to 16384");
        let mut finest = Scene::default();
        finest.image.subpixels = u32::MAX;
        assert_eq!(refused(&finest), "subpixels: 4294967295 is out of range; use a value from 1 to 4");
        // No device lists so many pixels, and none has images so wide.
        let mut large = Scene::default().with_size(16384, 16384);
        large.image.subpixels = 4;
        let large = refused(&large);
        assert!(large.starts_with("image size: ") && !large.contains("--"), "{large}");
    }
}
