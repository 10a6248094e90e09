//! Loads what scenes name: meshes, environments and BRDFs, with their tables. A file is its contents, so an edited one is another.
use crate::Result;
use crate::brdf::{Brdf, LobeShape, base_file, base_file_in, base_files_from, tabulate};
use crate::environment::{CustomEnvironment, Environment};
use crate::error::Error;
use crate::files::FileKind;
use crate::memo::{Key, Keyed, Memo, Round, Step};
use crate::scene::{CustomMesh, EnvironmentSource, MaterialSource, Mesh, MeshSource, Source, TexturedMesh};
use crate::threads::SliceTable;
use std::path::{Path, PathBuf};

/// The key of what `source` names, in a file of one of the formats `files`, or with the digest that `digest` tells.
fn key_of<T, C>(
    memo: &Memo,
    files: &FileKind<T>,
    source: &Source<C>,
    digest: impl Fn(&C) -> blake3::Hash,
) -> Result<Key> {
    Ok(match source {
        Source::File(path) => file_key(memo, files, path)?,
        Source::Builtin(name) => Key::builder("builtin").text(name).build(),
        Source::Custom(custom) => Key::builder("custom").key(Key::of_digest(digest(custom))).build(),
    })
}

/// The key of a file: of its contents, and of its format, under which the same bytes are something else than under another.
fn file_key<T>(memo: &Memo, files: &FileKind<T>, path: &Path) -> Result<Key> {
    let format = files.format_of(path)?;
    Ok(Key::builder("file").text(format.extension).key(memo.file_key(path)?).build())
}

/// The base `first` and those below it, as their contents were when they were looked at.
fn bases(memo: &Memo, first: Option<PathBuf>) -> Result<Vec<PathBuf>> {
    base_files_from(first, |path| base_of(memo, path).map_err(|error| error.within("base")))
}

/// The base that the file at `path` names.
fn base_of(memo: &Memo, path: &Path) -> Result<Option<PathBuf>> {
    if !Brdf::is_model_file(path) {
        return Ok(None);
    }
    memo.file_named_in(path, |bytes| base_file_in(path, bytes))
}

/// The key of what `key` names over these files as its bases.
fn with_files(memo: &Memo, key: Key, files: &[PathBuf]) -> Result<Key> {
    if files.is_empty() {
        return Ok(key);
    }
    let file_key = |path: &PathBuf| file_key(memo, &Brdf::FILES, path).map_err(|error| error.within("base"));
    let files = files.iter().map(file_key).collect::<Result<Vec<_>>>()?;
    Ok(Key::builder("over").key(key).keys(files).build())
}

/// Loads or makes a mesh, in object space.
pub struct LoadMesh<'a>(pub &'a MeshSource);

impl Step for LoadMesh<'_> {
    type Output = Mesh;
    const NAME: &'static str = "mesh";

    fn key(&self, memo: &Memo) -> Result<Key> {
        key_of(memo, &Mesh::FILES, self.0, CustomMesh::digest)
    }

    fn make(&self, round: &Round) -> Result<Mesh> {
        match self.0 {
            Source::File(path) => Mesh::FILES.parse_watched(path, &round.memo().file_bytes(path)?, round.observer()),
            Source::Builtin(name) => Mesh::builtin(name),
            Source::Custom(custom) => Ok(custom.mesh(false)?.mesh),
        }
    }
}

/// The same with the tangents of its texture coordinates, if it has any.
pub struct LoadBrushedMesh<'a>(pub &'a MeshSource);

impl Step for LoadBrushedMesh<'_> {
    type Output = Mesh;
    const NAME: &'static str = "tangents";

    fn key(&self, memo: &Memo) -> Result<Key> {
        Ok(Key::builder("with tangents").key(key_of(memo, &TexturedMesh::FILES, self.0, CustomMesh::digest)?).build())
    }

    fn make(&self, round: &Round) -> Result<Mesh> {
        match self.0 {
            Source::File(path) => {
                let bytes = round.memo().file_bytes(path)?;
                Ok(TexturedMesh::FILES.parse_watched(path, &bytes, round.observer())?.with_tangents(path.display()))
            }
            // None has texture coordinates.
            Source::Builtin(name) => Mesh::builtin(name),
            Source::Custom(custom) => Ok(custom.mesh(true)?.with_tangents(self.0)),
        }
    }
}

/// Loads or makes an environment, without its turn and intensity, in pixels that are fine enough to filter.
pub struct LoadEnvironment<'a>(pub &'a EnvironmentSource);

impl Step for LoadEnvironment<'_> {
    type Output = Environment;
    const NAME: &'static str = "environment";

    fn key(&self, memo: &Memo) -> Result<Key> {
        let digest = |custom: &CustomEnvironment| custom.environment().fingerprint();
        // It knows its name.
        Ok(Key::builder(&self.0.to_string()).key(key_of(memo, &Environment::FILES, self.0, digest)?).build())
    }

    fn content_key(&self, environment: &Environment) -> Option<Key> {
        Some(Key::of_digest(environment.fingerprint()))
    }

    fn make(&self, round: &Round) -> Result<Environment> {
        match self.0 {
            Source::File(path) => Environment::FILES.parse(path, &round.memo().file_bytes(path)?),
            Source::Builtin(name) => Environment::builtin(name),
            // They share the pixels.
            Source::Custom(custom) => Ok(custom.environment().clone()),
        }
        .map(Environment::in_fine_pixels)
    }
}

/// Loads a material: a built-in's name, a file, or a model with its parameters.
pub struct LoadMaterial<'a>(pub &'a MaterialSource);

impl Step for LoadMaterial<'_> {
    type Output = Brdf;
    const NAME: &'static str = "material";

    fn key(&self, memo: &Memo) -> Result<Key> {
        Ok(match self.0 {
            MaterialSource::File(path) => {
                let file = file_key(memo, &Brdf::FILES, path)?;
                let over = |first| with_files(memo, file, &bases(memo, first)?);
                over(base_of(memo, path)?).map_err(|error| error.within(path.display()))?
            }
            MaterialSource::Model { model, parameters } if base_file(parameters).is_some() => {
                let key = Key::builder("layered").text(model).text(&parameters.to_string()).build();
                with_files(memo, key, &bases(memo, base_file(parameters))?)?
            }
            // Other models are made at once, so they are known by what they are.
            source => Key::builder("model").bytes(load(memo, source)?.fingerprint().as_bytes()).build(),
        })
    }

    fn content_key(&self, brdf: &Brdf) -> Option<Key> {
        Some(Key::of_digest(brdf.fingerprint()))
    }

    fn make(&self, round: &Round) -> Result<Brdf> {
        load(round.memo(), self.0)
    }
}

fn load(memo: &Memo, source: &MaterialSource) -> Result<Brdf> {
    // Bases are read by their names where a coat is made: they have to be what its key names.
    let check_bases = |first| bases(memo, first)?.iter().try_for_each(|base| memo.file_bytes(base).map(drop));
    match source {
        MaterialSource::File(path) => {
            check_bases(base_of(memo, path)?)?;
            Brdf::FILES.parse(path, &memo.file_bytes(path)?)
        }
        MaterialSource::Builtin(name) => Brdf::builtin(name).ok_or_else(|| {
            let remedy = Brdf::FILES.remedy_for(name);
            Error::input(format!("material \"{name}\""), "is neither built in nor a file", remedy)
        }),
        MaterialSource::Model { model, parameters } => {
            check_bases(base_file(parameters))?;
            Brdf::from_parameters(model, parameters.clone())
        }
        MaterialSource::Custom(custom) => Ok(Brdf::Custom(custom.clone())),
    }
}

/// Finds what shading goes by of a BRDF's lobe.
pub struct FindLobe<'a>(pub &'a Keyed<Brdf>);

impl Step for FindLobe<'_> {
    type Output = LobeShape;
    const NAME: &'static str = "lobe";

    fn key(&self, _: &Memo) -> Result<Key> {
        Ok(self.0.key)
    }

    fn make(&self, _: &Round) -> Result<LobeShape> {
        Ok(LobeShape::of(self.0))
    }
}

/// Makes the table by which shaders know a BRDF that they do not evaluate. Its error is logged.
pub struct Tabulate<'a>(pub &'a Keyed<Brdf>);

impl Step for Tabulate<'_> {
    type Output = Brdf;
    const NAME: &'static str = "table of a BRDF";

    fn key(&self, _: &Memo) -> Result<Key> {
        Ok(self.0.key)
    }

    fn make(&self, _: &Round) -> Result<Brdf> {
        Ok(tabulate(self.0).0)
    }
}

/// Makes the table of CDFs by which samples are drawn in proportion to a BRDF.
pub struct TabulateSlices<'a>(pub &'a Keyed<Brdf>);

impl Step for TabulateSlices<'_> {
    type Output = SliceTable;
    const NAME: &'static str = "CDFs of a BRDF";

    fn key(&self, _: &Memo) -> Result<Key> {
        Ok(self.0.key)
    }

    fn make(&self, _: &Round) -> Result<SliceTable> {
        Ok(SliceTable::new(self.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_material_over_a_file_is_another_when_the_file_is() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let base = |reflectance: f64| {
            std::fs::write(path("base.toml"), format!("model = 'lambert'\nreflectance = {reflectance}")).unwrap();
        };
        let text = "base = 'base.toml'\ncoat = { alpha = 0.1, ior = 1.5 }";
        std::fs::write(path("coat.toml"), format!("model = 'layered'\n{text}")).unwrap();
        let mut parameters = text.parse().unwrap();
        crate::brdf::resolve_base_files(&mut parameters, folder.path()).unwrap();
        let inline = MaterialSource::Model { model: "layered".into(), parameters };
        for source in [MaterialSource::File(path("coat.toml")), inline] {
            let memo = Memo::default();
            let ask = || memo.round(&()).ask(&LoadMaterial(&source)).map(|brdf| brdf.fingerprint());
            base(0.2);
            let first = ask().unwrap();
            assert_eq!(ask().unwrap(), first);
            base(0.4);
            memo.look_again(&path("base.toml"));
            assert_ne!(ask().unwrap(), first);
            std::fs::remove_file(path("base.toml")).unwrap();
            memo.look_again(&path("base.toml"));
            assert!(ask().unwrap_err().to_string().contains("base: "));
        }
    }

    #[test]
    fn a_base_that_was_changed_on_disk_is_not_taken_for_what_it_was() {
        let folder = tempfile::tempdir().unwrap();
        let base = folder.path().join("base.toml");
        std::fs::write(&base, "model = 'lambert'\nreflectance = 0.2").unwrap();
        let memo = Memo::default();
        let ask = |alpha: f64| {
            let text = format!("base = {base:?}\ncoat = {{ alpha = {alpha}, ior = 1.5 }}");
            let source = MaterialSource::Model { model: "layered".into(), parameters: text.parse().unwrap() };
            memo.round(&()).ask(&LoadMaterial(&source)).map(|brdf| brdf.fingerprint())
        };
        ask(0.1).unwrap();
        ask(0.2).unwrap();
        std::fs::write(&base, "model = 'lambert'\nreflectance = 0.4").unwrap();
        let error = ask(0.3).unwrap_err().to_string();
        assert!(error.contains("base.toml") && error.contains("was changed"), "{error}");
        memo.look_again(&base);
        ask(0.3).unwrap();

        // Another base in the file of a coat, which nobody has named again.
        let coat = folder.path().join("coat.toml");
        let write = |base: &str| {
            std::fs::write(&coat, format!("model = 'layered'\nbase = '{base}'\ncoat = {{ alpha = 0.1, ior = 1.5 }}"))
        };
        write("base.toml").unwrap();
        let source = MaterialSource::File(coat.clone());
        let round = memo.round(&());
        let first = round.ask(&LoadMaterial(&source)).unwrap().fingerprint();
        for other in ["clay", "absent.toml"] {
            write(other).unwrap();
            assert_eq!(round.ask(&LoadMaterial(&source)).unwrap().fingerprint(), first, "{other}");
        }
        memo.look_again(&coat);
        assert!(round.ask(&LoadMaterial(&source)).unwrap_err().to_string().contains("absent.toml"));
    }
}
