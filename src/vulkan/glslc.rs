//! The call of `glslc`, shared by build.rs and feature `hot-reload`: the same shader gives the same code in both.
use std::ffi::OsString;
use std::path::Path;
use std::process::Command;

/// What is run: the environment variable GLSLC, or else `glslc`.
pub fn compiler() -> OsString {
    std::env::var_os("GLSLC").unwrap_or_else(|| "glslc".into())
}

/// Compiles `source` to `output`, `-` for standard output.
pub fn command<'a>(source: &Path, output: &Path, includes: impl IntoIterator<Item = &'a Path>) -> Command {
    let mut command = Command::new(compiler());
    command.args(["--target-env=vulkan1.2", "-Werror", "-o"]).arg(output).arg(source);
    for folder in includes {
        command.arg("-I").arg(folder);
    }
    command
}
