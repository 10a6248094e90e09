//! `threadlight bench shaders`: what a driver's compiler makes of the shaders that a scene needs.
use super::arguments::JsonArgument;
use crate::cli::memo;
use crate::cli::progress::TerminalProgress;
use crate::cli::scene_flags::{SceneFlags, takes_methods};
use threadlight::Error;
use threadlight::low_level::evaluate::shaders;
use threadlight::low_level::method::Method;
use threadlight::low_level::vulkan::{CompilingDevice, Instance};

const EXAMPLES: &str = "\
Without --method, shaders of all methods are compiled; and always those of the other passes, and bare lookups.

Examples:
  threadlight bench shaders
  threadlight bench shaders scene.toml --method fitted --json shaders.json
  RADV_FORCE_FAMILY=navi21 threadlight bench shaders --device radv      # a GPU that is not there: Mesa compiles for it all the same

Nothing runs: the figures are what the driver's compiler counts and estimates, and no time. `for` is what a shader is compiled for:
the scene, as when it is rendered, or any scene, with all models, sources and tangents. On Mesa's RADV, VGPRs and SGPRs are registers, spills \
those that go through memory, waves those that a SIMD has room for, latency and inv. thr. (inverse throughput) estimated cycles of a \
wave, in which each loop counts a fixed number of times. / bare is inverse throughput a lane over that of bare lookups. Of other drivers \
the table has all that they tell.

The JSON is a list of rows with these fields, in this order:
  shader, compiled_for        what was compiled
  constants                   specialisation constants: list of name and value
  wave                        lanes of a vector
  statistics                  list of name and value, as the driver has them";

/// Lists what a driver's compiler makes of the shaders that a scene needs: registers, spills, estimated cycles. Nothing is rendered.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES, allow_negative_numbers = true, mut_arg("method", takes_methods(Method::runs_on_gpu)))]
pub struct BenchShaders {
    #[command(flatten)]
    scene: SceneFlags,
    /// Vulkan device: its index or part of its name, as `threadlight devices` lists them. It need not be one that can render.
    #[arg(long, value_name = "NAME|INDEX")]
    device: Option<String>,
    /// Neither read nor write cached threads and blurred environments.
    #[arg(long)]
    no_cache: bool,
    #[command(flatten)]
    json: JsonArgument,
}

impl BenchShaders {
    pub fn run(self) -> anyhow::Result<()> {
        let scene = self.scene.scene()?;
        self.json.check(&self.scene.files(&scene))?;
        let methods = match &self.scene.method {
            Some(method) => vec![*method],
            None => Method::on_gpu().collect(),
        };
        let instance = Instance::new(false).map_err(Error::from)?;
        let device = CompilingDevice::new(&instance, self.device.as_deref()).map_err(Error::from)?;
        let memo = memo(self.no_cache);
        let progress = TerminalProgress::of("bench shaders", "shaders")?;
        let mut costs = Vec::new();
        let result = shaders::run(&scene, &methods, &device, &memo, &progress, &mut costs);
        progress.finish();
        let about = device.description();
        let name = format!("{}, {}", about.name, about.driver);
        self.json.report(result, &costs, |costs| vec![shaders::table(&name, costs)])
    }
}
