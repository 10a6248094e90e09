//! What tells scenes apart that need other things made.
use crate::Result;
use crate::memo::{Key, Memo, Step};
use crate::method::Variant;
use crate::scene::Scene;
use crate::steps::{LoadEnvironment, LoadMaterial, LoadMesh};

/// The key of all that `scene` on a device is made of: of all but what frames are given anew ([`Scene::with_frame_settings_of`]).
///
/// # Errors
/// A file that cannot be read, a model that there is not.
pub fn key_of(scene: &Scene, memo: &Memo) -> Result<Key> {
    let method = scene.shading.method;
    let count = scene.shading.count();
    let image = &scene.image;
    let shows_environment = !image.has_alpha();
    let variant = Variant::new(method, scene.shading.pattern);
    let mut key = Key::builder(&variant.name()).number(count).number(scene.shading.seed);
    key = key.number(image.subpixels).number(u64::from(shows_environment));
    key = key.key(LoadEnvironment(&scene.environment.source).key(memo)?);
    let used_materials = scene.used_materials();
    for object in &scene.objects {
        let material = used_materials.iter().position(|known| *known == object.material).unwrap_or_default();
        key = key.key(LoadMesh(&object.mesh).key(memo)?).number(material as u64);
        key = key.bytes(bytemuck::bytes_of(&object.transform())).text(&format!("{:?}", object.tangent));
    }
    for name in used_materials {
        let Some(material) = scene.material(name) else { continue };
        key = key.key(LoadMaterial(&material.source).key(memo)?);
    }
    Ok(key.build())
}
