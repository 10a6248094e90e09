//! Loads what scenes name: meshes, environments and BRDFs. A file is its contents, so an edited one is another.
use crate::Result;
use crate::brdf::Brdf;
use crate::environment::Environment;
use crate::error::Error;
use crate::memo::{Key, Memo, Round, Step};
use crate::scene::{MaterialSource, Mesh, Source};

/// The key of what `source` names.
fn key_of(memo: &Memo, source: &Source) -> Result<Key> {
    Ok(match source {
        Source::File(path) => Key::builder("file").key(memo.file_key(path)?).build(),
        Source::Builtin(name) => Key::builder("builtin").text(name).build(),
    })
}

/// Loads or makes a mesh, in object space.
pub struct LoadMesh<'a>(pub &'a Source);

impl Step for LoadMesh<'_> {
    type Output = Mesh;
    const NAME: &'static str = "mesh";

    fn key(&self, memo: &Memo) -> Result<Key> {
        key_of(memo, self.0)
    }

    fn make(&self, _: &Round) -> Result<Mesh> {
        match self.0 {
            Source::File(path) => Mesh::load(path),
            Source::Builtin(name) => Mesh::builtin(name),
        }
    }
}

/// Loads or makes an environment, without its turn and intensity.
pub struct LoadEnvironment<'a>(pub &'a Source);

impl Step for LoadEnvironment<'_> {
    type Output = Environment;
    const NAME: &'static str = "environment";

    fn key(&self, memo: &Memo) -> Result<Key> {
        // It knows its name.
        Ok(Key::builder(&self.0.to_string()).key(key_of(memo, self.0)?).build())
    }

    fn make(&self, _: &Round) -> Result<Environment> {
        match self.0 {
            Source::File(path) => Environment::load(path),
            Source::Builtin(name) => Environment::builtin(name),
        }
    }
}

/// Loads a material: a built-in's name, a file, or a model with its parameters.
pub struct LoadMaterial<'a>(pub &'a MaterialSource);

impl Step for LoadMaterial<'_> {
    type Output = Brdf;
    const NAME: &'static str = "material";

    fn key(&self, memo: &Memo) -> Result<Key> {
        Ok(match self.0 {
            MaterialSource::File(path) => Key::builder("file").key(memo.file_key(path)?).build(),
            // Models are made at once, so they are known by what they are.
            source => Key::builder("model").bytes(load_material(source)?.fingerprint().as_bytes()).build(),
        })
    }

    fn make(&self, _: &Round) -> Result<Brdf> {
        load_material(self.0)
    }
}

fn load_material(source: &MaterialSource) -> Result<Brdf> {
    match source {
        MaterialSource::File(path) => Brdf::load(path),
        MaterialSource::Builtin(name) => Brdf::builtin(name).ok_or_else(|| {
            let known: Vec<_> = Brdf::builtin_names().collect();
            Error::input(
                format!("material \"{name}\""),
                "is neither built in nor a file",
                format!("name a .binary or .toml file or one of: {}", known.join(", ")),
            )
        }),
        MaterialSource::Model { model, parameters } => Brdf::from_parameters(model, parameters.clone()),
    }
}
