//! Compiles every shader in `glsl/` to SPIR-V with shaderc and writes one typed table of them.
//!
//! By default the compiler is shaderc's command line, `glslc` (Debian and Ubuntu have a package of that name; the
//! environment variable GLSLC names another). With the feature `shaderc-from-source` it is the shaderc crate.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::{env, fs};

/// Names of the BRDF models, in the order of their ids.
macro_rules! brdf_models {
    ($($name:ident => $model:ident),* $(,)?) => { const BRDF_MODELS: &[&str] = &[$(stringify!($name)),*]; };
}
include!("src/brdf/models/table.rs");

#[cfg(not(feature = "shaderc-from-source"))]
#[path = "src/vulkan/glslc.rs"]
mod glslc;

fn main() {
    println!("cargo:rerun-if-changed=glsl");
    println!("cargo:rerun-if-changed=src/brdf/models/table.rs");
    println!("cargo:rerun-if-env-changed=GLSLC");
    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    let glsl = Path::new("glsl");

    let generated = out.join("glsl");
    write(&generated.join("brdf_models.glsl"), &brdf_switch());

    write(
        &out.join("shader_constants.rs"),
        &shader_constants(&[glsl, &glsl.join("methods"), &glsl.join("brdf"), &glsl.join("threads")]),
    );

    let twins: Vec<_> = BRDF_MODELS.iter().filter(|name| has_twin(name)).collect();
    write(
        &out.join("brdf_twins.rs"),
        &format!("/// The models that have a form in GLSL.\nconst TWINS: &[&str] = &{twins:?};\n"),
    );

    let methods = files(&glsl.join("methods")).into_iter().map(|file| text(file.file_stem()));
    let methods = methods.map(|method| (method.clone(), format!("#include \"methods/{method}.glsl\"\n")));
    // Not a specialisation constant: lavapipe takes time for what is handed from stage to stage, though nothing reads it.
    let tangents =
        [("", 0), ("tangents", 1)].map(|(name, has)| (name.to_owned(), format!("#define HAS_TANGENTS {has}\n")));
    let forms = [("method.glsl", methods.collect()), ("has_tangents.glsl", Vec::from(tangents))];
    for (file, forms) in &forms {
        for (form, contents) in forms {
            write(&folder_of(&out, file, form).join(file), contents);
        }
    }

    let (mut table, mut recipes, mut names) = (String::new(), String::new(), Vec::new());
    for source in files(glsl) {
        let (stem, extension) = (text(source.file_stem()), text(source.extension()));
        let stage = match extension.as_str() {
            "vert" => "Vertex",
            "frag" => "Fragment",
            "comp" => "Compute",
            _ => continue,
        };
        let name = if stage == "Compute" { stem } else { format!("{stem}_{extension}") };
        let code = fs::read_to_string(&source).expect("a readable shader");
        let mut add = |name: &str, includes: &[&Path]| {
            compile(&mut table, &source, name, stage, includes, &out);
            recipe(&mut recipes, &source, name, includes);
            names.push(name.to_uppercase());
        };
        // One variant of the shader for each form of a file that it includes.
        match forms.iter().find(|(file, _)| code.contains(&format!("#include \"{file}\""))) {
            None => add(&name, &[glsl, &generated]),
            Some((file, forms)) => {
                for (form, _) in forms {
                    let variant = if form.is_empty() { name.clone() } else { format!("{name}_{form}") };
                    add(&variant, &[glsl, &generated, &folder_of(&out, file, form)]);
                }
            }
        }
    }
    let _ = writeln!(table, "/// All of them.\npub const ALL: &[Shader] = &[{}];", names.join(", "));
    write(&out.join("shaders.rs"), &table);
    write(&out.join("recipes.rs"), &format!("const RECIPES: &[Recipe] = &[\n{recipes}];\n"));
}

/// Where a form of a generated file is.
fn folder_of(out: &Path, file: &str, form: &str) -> PathBuf {
    out.join(file).join(form)
}

/// Adds a line to what feature `hot-reload` compiles shaders by.
fn recipe(recipes: &mut String, source: &Path, name: &str, includes: &[&Path]) {
    let absolute = |path: &Path| std::path::absolute(path).expect("a current folder").display().to_string();
    let (source, includes) = (absolute(source), includes.iter().map(|folder| absolute(folder)).collect::<Vec<_>>());
    let _ = writeln!(recipes, "    Recipe {{ name: {name:?}, source: {source:?}, includes: &{includes:?} }},");
}

/// The numbers that GLSL files of these folders declare, as Rust: a module for each file, `const float X = 1.0;` as `pub const X: f32 = 1.0;`.
fn shader_constants(folders: &[&Path]) -> String {
    let mut rust = String::new();
    for source in folders.iter().flat_map(|folder| files(folder)) {
        let code = fs::read_to_string(&source).expect("a readable shader");
        let constants: String = code.lines().filter_map(shader_constant).collect();
        if !constants.is_empty() {
            let name = text(source.file_name()).replace('.', "_");
            let module = name.strip_suffix("_glsl").unwrap_or(&name);
            let _ = writeln!(rust, "pub mod {module} {{\n{constants}}}");
        }
    }
    rust
}

/// `const uint NAME = 8u;` or `const float NAME = 0.5;`, a formula of numbers and names, as a line of Rust.
fn shader_constant(line: &str) -> Option<String> {
    let (kind, rest) = line.strip_prefix("const ")?.split_once(' ')?;
    let kind = match kind {
        "uint" => "u32",
        "float" => "f32",
        _ => return None,
    };
    let (name, value) = rest.split_once(';')?.0.split_once(" = ")?;
    // Functions of GLSL are none of Rust's; whole numbers end in `u`.
    let is_call = value.split('(').rev().skip(1).any(|before| before.ends_with(char::is_alphanumeric));
    let words: Vec<_> = value.split(' ').map(|word| word.strip_suffix('u').unwrap_or(word)).collect();
    (!is_call).then(|| format!("    pub const {name}: {kind} = {};\n", words.join(" ")))
}

/// GLSL that includes every model and picks one by its id; models that no material of a scene uses are compiled out.
fn brdf_switch() -> String {
    let mut glsl = String::from("// Generated from src/brdf/models/table.rs.\n");
    for name in BRDF_MODELS.iter().filter(|name| has_twin(name)) {
        let _ = writeln!(glsl, "#include \"brdf/{name}.glsl\"");
    }
    glsl += "layout(constant_id = 1) const uint MODELS_USED = 0xffffffffu; // bit i: some material has model i\n";
    glsl += "// f in 1/sr. Twin: Brdf::evaluate in src/brdf/mod.rs.\n";
    glsl += "vec3 brdf(Material material, vec3 w_i, vec3 w_o) {\n";
    glsl += "    // Written so that a NaN counts as not positive.\n";
    glsl += "    if (!(w_i.z > 0.0 && w_o.z > 0.0)) return vec3(0.0);\n";
    for (id, name) in BRDF_MODELS.iter().enumerate().filter(|(_, name)| has_twin(name)) {
        let bit = 1_u32 << id;
        let _ = writeln!(
            glsl,
            "    if ((MODELS_USED & {bit}u) != 0u && material.model == {id}u) return {name}(material.parameters, w_i, w_o);"
        );
    }
    glsl + "    return vec3(0.0);\n}\n"
}

/// Whether a BRDF model has a form in GLSL.
fn has_twin(model: &str) -> bool {
    Path::new("glsl/brdf").join(format!("{model}.glsl")).is_file()
}

/// Compiles one shader and adds its line to the table.
fn compile(table: &mut String, source: &Path, name: &str, stage: &str, includes: &[&Path], out: &Path) {
    let spirv = out.join(format!("{name}.spv"));
    to_spirv(source, &spirv, includes);
    let constant = name.to_uppercase();
    let spirv = spirv.display();
    let _ = writeln!(
        table,
        "/// `{}`.\npub const {constant}: Shader = Shader {{ name: {name:?}, stage: ShaderStage::{stage}, spirv: include_bytes!({:?}) }};",
        source.display(),
        spirv.to_string(),
    );
}

#[cfg(not(feature = "shaderc-from-source"))]
fn to_spirv(source: &Path, spirv: &Path, includes: &[&Path]) {
    let output = glslc::command(source, spirv, includes.iter().copied()).output().unwrap_or_else(|cause| {
        panic!(
            "{:?} cannot be run ({cause}): install glslc (Debian 12, Ubuntu 24.04: apt-get install glslc; elsewhere the Vulkan SDK), or build with --features shaderc-from-source",
            glslc::compiler()
        )
    });
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// With the settings that `glslc` has in glslc.rs.
#[cfg(feature = "shaderc-from-source")]
fn to_spirv(source: &Path, spirv: &Path, includes: &[&Path]) {
    let kind = match text(source.extension()).as_str() {
        "vert" => shaderc::ShaderKind::Vertex,
        "frag" => shaderc::ShaderKind::Fragment,
        _ => shaderc::ShaderKind::Compute,
    };
    let mut options = shaderc::CompileOptions::new().expect("shaderc options");
    options.set_target_env(shaderc::TargetEnv::Vulkan, shaderc::EnvVersion::Vulkan1_2 as u32);
    options.set_warnings_as_errors();
    options.set_include_callback(|name, kind, includer, _| {
        // As glslc looks for "name": beside the file that includes it, then in the folders.
        let beside = Path::new(includer).parent().filter(|_| kind == shaderc::IncludeType::Relative);
        let mut places = beside.into_iter().chain(includes.iter().copied()).map(|folder| folder.join(name));
        let file = places
            .find(|file| file.is_file())
            .ok_or_else(|| format!("{name} is neither beside {includer} nor in any of {includes:?}"))?;
        let content = fs::read_to_string(&file).map_err(|cause| cause.to_string())?;
        Ok(shaderc::ResolvedInclude { resolved_name: file.display().to_string(), content })
    });
    let compiler = shaderc::Compiler::new().expect("a shaderc compiler");
    let code = fs::read_to_string(source).expect("a readable shader");
    match compiler.compile_into_spirv(&code, kind, &source.display().to_string(), "main", Some(&options)) {
        Ok(artifact) => fs::write(spirv, artifact.as_binary_u8()).expect("a writable OUT_DIR"),
        Err(cause) => panic!("{cause}"),
    }
}

/// The files of a folder in a fixed order.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap_or_else(|cause| panic!("{}: {cause}", folder.display()));
    let mut files: Vec<_> = entries.map(|entry| entry.expect("a readable folder").path()).collect();
    files.retain(|path| path.is_file());
    files.sort();
    files
}

/// Writes a generated file, only when it changes, so that what depends on it is not rebuilt for nothing.
fn write(path: &Path, contents: &str) {
    if fs::read_to_string(path).is_ok_and(|old| old == contents) {
        return;
    }
    fs::create_dir_all(path.parent().expect("generated files have a folder")).expect("a writable OUT_DIR");
    fs::write(path, contents).expect("a writable OUT_DIR");
}

fn text(part: Option<&std::ffi::OsStr>) -> String {
    part.unwrap_or_default().to_string_lossy().into_owned()
}
