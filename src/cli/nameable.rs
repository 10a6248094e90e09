//! Help texts of what flags can name: they follow from the tables of formats and methods.
use threadlight::low_level::brdf::Brdf;
use threadlight::low_level::environment::Environment;
use threadlight::low_level::method::{DEFAULT_SAMPLES, Method};
use threadlight::low_level::scene::{MAX_SAMPLES, Mesh, Scene};

/// `what` and how a material is named.
pub fn material(what: &str) -> String {
    format!("{what}: a built-in name, {}", Brdf::FILES.names())
}

/// How several materials are named: one by one, or all those of a scene file.
pub fn materials() -> String {
    format!("{}; or {}, for all of its materials", material("Materials, each"), Scene::FILES.names())
}

/// `what` and how an environment is named.
pub fn environment(what: &str) -> String {
    format!("{what}: a built-in name, {}, latitude-longitude", Environment::FILES.names())
}

/// `what` and how a mesh is named.
pub fn mesh(what: &str) -> String {
    format!("{what}: a built-in name, {}", Mesh::FILES.names())
}

/// `what` and how scenes are named: by scene files or by meshes.
pub fn scenes(what: &str) -> String {
    format!("{}; or {}, whose camera and objects are used", mesh(what), Scene::FILES.names())
}

/// Numbers of threads, and of samples.
pub fn counts() -> String {
    let of_threads = |method: &Method| {
        let kind = method.threads()?;
        Some(format!("{} 1 to {} (default {})", method.name(), kind.max_count(), kind.default_count()))
    };
    let of_threads = Method::ALL.iter().filter_map(of_threads).collect::<Vec<_>>().join(", ");
    let of_samples = format!(
        "samples per pixel of methods that have none, 1 to {MAX_SAMPLES}, fewer of `ris` and with many sub-pixels (default {DEFAULT_SAMPLES}; `split_sum` has 1)"
    );
    format!("Sample threads per pixel: {of_threads}; or {of_samples}")
}
