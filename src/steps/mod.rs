//! Steps of the memo: load, fit, filter, compile, upload. Each says what its output is a function of and how it is made.
mod check;
mod compile;
mod filter;
mod fit;
mod load;
mod looked_up;
mod upload;

pub use check::CheckDevice;
pub use compile::{CompileCompute, CompileGeometryCache, pipelines};
pub use filter::{Blur, BoxFilter, blurred_light, light};
pub use fit::{DraftThreads, FitSplitSum, FitThreads};
pub use load::{FindLobe, LoadBrushedMesh, LoadEnvironment, LoadMaterial, LoadMesh, Tabulate, TabulateSlices};
pub use looked_up::LookedUp;
pub use upload::{
    KeyedMaterial, UploadBackground, UploadIrradiance, UploadLight, UploadMaterials, UploadMesh, UploadShaders,
};
