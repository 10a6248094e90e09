//! What a driver's compiler makes of the shaders that a scene needs: `threadlight bench shaders`.
//!
//! Registers bound how many waves a GPU keeps to hide the time of lookups, spills go through memory, and the rest are estimates. None of
//! it is measured: the driver needs no GPU, and nothing runs.
use serde::Serialize;

use super::cases::by_method;
use super::tables::{Section, Table, in_order};
use crate::error::Result;
use crate::memo::{Memo, Round};
use crate::method::Method;
use crate::passes::{GEOMETRY_STATE, MAX_SHADERS, geometry_shaders, shade_shader};
use crate::prepare::{Prepared, prepare};
use crate::progress::Observer;
use crate::scene::{Background, Scene};
use crate::specialise::{ShadersOfMaterials, classify_constants};
use crate::steps::blurred_light;
use crate::vulkan::{CompiledShader, CompilingDevice, Shader, compiled};

/// A shader as a driver compiles it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ShaderCost {
    /// Its name.
    pub shader: &'static str,
    /// What it is compiled for: `scene`, or `any` for one that leaves out nothing that some scene needs.
    pub compiled_for: &'static str,
    /// Specialisation constants by name; the others have the values that stand in GLSL.
    pub constants: Vec<(&'static str, u32)>,
    /// Invocations of a wave, the vector that shares registers; 0 if the driver does not say.
    pub wave: u32,
    /// The driver's figures by the driver's names. Those of RADV: <https://docs.mesa3d.org/drivers/amd.html>.
    pub statistics: Vec<(String, f64)>,
}

impl ShaderCost {
    fn new(
        shader: &'static Shader,
        compiled_for: &'static str,
        constants: Vec<(&'static str, u32)>,
        made: CompiledShader,
    ) -> Self {
        let (wave, statistics) = (made.subgroup_size, made.statistics);
        Self { shader: shader.name(), compiled_for, constants, wave, statistics }
    }

    /// The driver's figure of that name, if there is one.
    pub fn statistic(&self, name: &str) -> Option<f64> {
        self.statistics.iter().find(|(known, _)| known == name).map(|(_, value)| *value)
    }
}

/// The shaders of a frame of `scene` by each of `methods`, and of bare lookups, into `costs`.
///
/// # Errors
/// What the scene names and cannot be used, a driver that cannot compile a shader; cancelled.
pub fn run(
    scene: &Scene,
    methods: &[Method],
    device: &CompilingDevice,
    memo: &Memo,
    observer: &dyn Observer,
    costs: &mut Vec<ShaderCost>,
) -> Result<()> {
    let mut add = |made: Vec<ShaderCost>| {
        costs.extend(made);
        observer.check()
    };
    let geometry = |compiled_for, has_tangents| -> Result<Vec<_>> {
        let [vertex, fragment] = geometry_shaders(has_tangents);
        let made = [vertex, fragment].into_iter().zip(device.compile_graphics(vertex, fragment, &GEOMETRY_STATE)?);
        Ok(made.map(|(shader, made)| ShaderCost::new(shader, compiled_for, Vec::new(), made)).collect())
    };
    let compute = |shader, compiled_for, constants: Vec<_>| -> Result<Vec<_>> {
        let made = device.compile(shader, &constants)?;
        Ok(vec![ShaderCost::new(shader, compiled_for, constants, made)])
    };
    add(compute(&compiled::BARE_LOOKUPS, "any", Vec::new())?)?;
    for (index, &method) in methods.iter().enumerate() {
        let round = memo.round(observer);
        let prepared = prepare(&by_method(scene, method), &round)?;
        let shader = shade_shader(method)?;
        let shaders = shaders_of(&prepared, &round)?;
        // Those that say how much is in a scene; the rest stay as in GLSL, where nothing is left out.
        let of_any =
            shaders.constants[0].iter().copied().filter(|(name, _)| ["SUBPIXELS", "FIXED_PATTERN"].contains(name));
        let of_any = of_any.chain([("HAS_TANGENTS", 1)]).collect();
        if index == 0 {
            add(geometry("scene", prepared.has_tangents())?)?;
            add(geometry("any", true)?)?;
            add(compute(&compiled::CLASSIFY, "scene", classify_constants(&prepared, &shaders))?)?;
        }
        for constants in shaders.constants_of_classes() {
            add(compute(shader, "scene", constants)?)?;
        }
        add(compute(shader, "any", of_any)?)?;
    }
    let behind = match scene.image.background {
        Background::Environment => &compiled::BACKGROUND,
        Background::None => &compiled::CLEAR_UNCOVERED,
    };
    add(compute(behind, "any", Vec::new())?)?;
    add(compute(&compiled::TONE_MAP, "any", Vec::new())?)
}

/// The shaders that a rendering of `prepared` compiles.
fn shaders_of(prepared: &Prepared, round: &Round) -> Result<ShadersOfMaterials> {
    let Prepared { method, environment, .. } = prepared;
    let light = match method.lookups().blurred {
        true => Some(blurred_light(round, None, environment, &prepared.shaded(), false)?),
        false => None,
    };
    Ok(ShadersOfMaterials::new(prepared, light.as_ref(), MAX_SHADERS))
}

/// The columns of the table, by RADV's names: Mesa 22.3's, and what Mesa 25 calls the same.
const COLUMNS: [(&str, &[&str]); 9] = [
    ("VGPRs", &["VGPRs"]),
    ("SGPRs", &["SGPRs"]),
    ("spills", &["Spilled VGPRs", "Spilled SGPRs"]),
    ("LDS bytes", &["LDS Size", "LDS size"]),
    ("waves", &["Subgroups per SIMD"]),
    ("instructions", &["Instructions"]),
    ("latency", &["Latency"]),
    ("inv. thr.", &["Inverse Throughput"]),
    ("bytes", &["Code Size", "Code size"]),
];

/// The table that `bench shaders` prints of the driver on `device`: RADV's figures in columns that suit, or any other driver's by name.
pub fn table(device: &str, costs: &[ShaderCost]) -> Section {
    let known = |cost: &ShaderCost| COLUMNS.iter().any(|(_, names)| names.iter().any(|n| cost.statistic(n).is_some()));
    let is_known = costs.iter().any(known);
    let columns: Vec<(String, Vec<String>)> = if is_known {
        let owned = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
        COLUMNS.iter().map(|(head, names)| ((*head).to_owned(), owned(names))).collect()
    } else {
        let names = in_order(costs.iter().flat_map(|cost| &cost.statistics).map(|(name, _)| name));
        names.into_iter().map(|name| (name.clone(), vec![name.clone()])).collect()
    };
    let bare = costs.iter().find(|cost| cost.shader == compiled::BARE_LOOKUPS.name());
    let a_thread = |cost: &ShaderCost| Some(cost.statistic("Inverse Throughput")? / f64::from(cost.wave.max(1)));
    let floor = bare.and_then(a_thread);
    let row = |cost: &ShaderCost| {
        let cell = |names: &Vec<String>| {
            let values: Vec<_> = names.iter().filter_map(|name| cost.statistic(name)).collect();
            if values.is_empty() { "-".to_owned() } else { values.iter().sum::<f64>().to_string() }
        };
        let mut cells = vec![cost.compiled_for.to_owned(), cost.wave.to_string()];
        cells.extend(columns.iter().map(|(_, names)| cell(names)));
        if let Some(floor) = floor {
            cells.push(a_thread(cost).map_or("-".to_owned(), |of| format!("{:.2}", of / floor)));
        }
        (cost.shader.to_owned(), cells)
    };
    let of_columns = columns.iter().map(|(head, _)| head.as_str());
    let head = ["for", "wave"].into_iter().chain(of_columns).chain(floor.map(|_| "/ bare"));
    Section {
        title: format!("What the compiler of {device} says of shaders (nothing ran):"),
        tables: vec![Table::new("shader", head, costs.iter().map(row))],
    }
}
