//! Help texts of what flags can name, and of their ranges: they follow from the tables of formats and methods, and from what is checked.
use threadlight::low_level::brdf::Brdf;
use threadlight::low_level::environment::Environment;
use threadlight::low_level::evaluate::reference::Processor;
use threadlight::low_level::method::{DEFAULT_SAMPLES, Method};
use threadlight::low_level::scene::{MAX_SAMPLES, MAX_SIZE_PX, MAX_SUBPIXELS, Mesh, Scene};
use threadlight::low_level::threads::{self, ThreadKind, fitted};

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

/// How exact pictures of the method `reference` are to be.
pub fn tolerance() -> String {
    let [cpu, gpu] = [Processor::Cpu, Processor::Gpu].map(Processor::default_tolerance);
    format!(
        "Method `reference` goes on until its estimated error of display values is below this: each pixel's on the CPU (default {cpu:e}), their RMS over the picture on the GPU (default {gpu:e})"
    )
}

/// `what` and how scenes are named: by scene files or by meshes.
pub fn scenes(what: &str) -> String {
    format!("{}; or {}, whose camera and objects are used", mesh(what), Scene::FILES.names())
}

/// `what` and how many sub-pixels there can be.
pub fn subpixels(what: &str) -> String {
    format!("{what}, 1 to {MAX_SUBPIXELS}")
}

/// Sizes of pictures with sides of at `least` so many pixels.
pub fn size(what: &str, least: usize) -> String {
    format!("{what} in pixels, each side {least} to {MAX_SIZE_PX}")
}

/// `what` and how many threads there can be, of methods that can have so many.
pub fn most_threads(what: &str) -> String {
    format!("{what}, 1 to {}; of a method that can have fewer, its most", threads::MAX_COUNT)
}

/// `what` and how many fitted threads there can be.
pub fn fitted_threads(what: &str) -> String {
    format!("{what}, 1 to {}", fitted::MAX_COUNT)
}

/// Of these kinds, how many threads there can be.
pub fn counts_of_threads(kinds: impl Iterator<Item = ThreadKind>) -> String {
    let count =
        |kind: ThreadKind| format!("{} 1 to {} (default {})", kind.name(), kind.max_count(), kind.default_count());
    kinds.map(count).collect::<Vec<_>>().join(", ")
}

/// Numbers of threads, and of samples.
pub fn counts() -> String {
    let of_threads = counts_of_threads(Method::ALL.iter().filter_map(|method| method.threads()));
    let of_samples = format!(
        "samples per pixel of methods that have none, 1 to {MAX_SAMPLES}, fewer of `ris` and with many sub-pixels (default {DEFAULT_SAMPLES}; `split_sum` has 1)"
    );
    format!("Sample threads per pixel: {of_threads}; or {of_samples}")
}
