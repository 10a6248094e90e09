//! Shaders compiled anew while the program runs, for work on them (feature `hot-reload`): by `glslc`, as build.rs does.
use super::glslc;
use crate::{Error, Result};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{PoisonError, RwLock};

/// How a shader is compiled.
struct Recipe {
    /// As [`super::Shader::name`].
    name: &'static str,
    source: &'static str,
    includes: &'static [&'static str],
}

include!(concat!(env!("OUT_DIR"), "/recipes.rs"));

/// Code by name of the shader, in the place of what was compiled in.
type Code = BTreeMap<&'static str, Vec<u32>>;

static FRESH: RwLock<Code> = RwLock::new(BTreeMap::new());

/// The folder to watch.
pub fn sources() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/glsl"))
}

/// The code of the shader `name`, if it was compiled anew.
pub(super) fn words_of(name: &str) -> Option<Vec<u32>> {
    FRESH.read().unwrap_or_else(PoisonError::into_inner).get(name).cloned()
}

/// Compiles all shaders, and builds with them. If either fails, the shaders from before are back.
///
/// # Errors
/// The first shader that does not compile, in the compiler's words; those of `build`.
pub fn reload<T>(build: impl FnOnce() -> Result<T>) -> Result<T> {
    let fresh = RECIPES.par_iter().map(compile).collect::<Result<Code>>()?;
    let swap = |code: Code| std::mem::replace(&mut *FRESH.write().unwrap_or_else(PoisonError::into_inner), code);
    let before = swap(fresh);
    build().inspect_err(|_| drop(swap(before)))
}

fn compile(recipe: &Recipe) -> Result<(&'static str, Vec<u32>)> {
    let Recipe { name, source, includes } = *recipe;
    let refuse = |problem: String, remedy: &str| Error::in_file(Path::new(source), problem, remedy);
    let output = glslc::command(Path::new(source), Path::new("-"), includes.iter().map(Path::new))
        .output()
        .map_err(|cause| refuse(format!("{} cannot be run ({cause})", glslc::compiler().display()), "install glslc"))?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr).lines().collect::<Vec<_>>().join("; ");
        return Err(refuse(format!("does not compile: {said}"), "the old shaders stay until it does"));
    }
    let words = output.stdout.as_chunks().0.iter().map(|&word| u32::from_le_bytes(word)).collect();
    Ok((name, words))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vulkan::compiled;

    #[test]
    fn what_is_compiled_anew_is_what_was_compiled_in_and_failures_bring_it_back() {
        let compiled_in: Vec<_> = compiled::ALL.iter().map(|shader| shader.words()).collect();
        reload(|| {
            for (shader, words) in compiled::ALL.iter().zip(&compiled_in) {
                assert_eq!(words_of(shader.name).as_ref(), Some(words), "{}", shader.name);
            }
            Ok(())
        })
        .unwrap();
        let failed = reload::<()>(|| {
            FRESH.write().unwrap().insert("nothing", vec![]);
            Err(Error::Cancelled)
        });
        assert!(failed.is_err() && words_of("nothing").is_none() && words_of("tone_map").is_some());
    }

    #[test]
    fn a_shader_that_does_not_compile_is_an_error_in_the_compilers_words() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("broken.comp");
        std::fs::write(&path, "#version 450\nvoid main() { nonsense; }\n").unwrap();
        let source = path.display().to_string().leak();
        let error = compile(&Recipe { name: "broken", source, includes: &[] }).unwrap_err().to_string();
        assert!(error.contains("broken.comp") && error.contains("nonsense") && !error.contains('\n'), "{error}");
    }
}
